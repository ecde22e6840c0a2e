"""Between two motions: the unstable manifold of the saddle that parts the 4-5 from the 2-2 motion.

Run ``python examples/gallery/unstable_manifold.py [--quick] [--out unstable_manifold.png]``.
"""

from matplotlib.figure import Figure

import vibroimpact as vi
from picture import COEXISTING, main, new_figure


def saddle() -> vi.PeriodicMotion:
    """Follow the stable 4-5 motion round its saddle-node at 1.57747, and back to 1.5774."""
    start = (0.1, 0.3, 0.0, 0.0)
    motion = vi.simulate(COEXISTING, initial=start, periods=3000, keep=100).refine()
    branch = vi.follow_motion(motion, drive_frequency=(1.575, 1.578), max_step=0.01)
    unstable = [
        piece.motion(k)
        for piece in branch.pieces
        for k in range(1, len(piece.values) - 1)
        if piece.label == "4-5" and piece.multipliers[k][0].real > 1.02
    ]
    return min(unstable, key=lambda motion: abs(motion.system.drive_frequency - 1.5774))


def draw(quick: bool) -> Figure:
    """Draw both sides of the manifold on the stroboscopic section."""
    manifold = vi.unstable_manifold(saddle(), length=0.5 if quick else 3.0)
    figure = new_figure(4.2)
    vi.plot.manifold(manifold, ax=figure.subplots())
    return figure


if __name__ == "__main__":
    main(draw, __file__)
