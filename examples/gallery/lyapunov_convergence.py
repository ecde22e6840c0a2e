"""How sure an exponent is: the spectrum of the chaotic motion of Fig. 9(2) as it converges.

Run ``python examples/gallery/lyapunov_convergence.py [--quick] [--out lyapunov_convergence.png]``.
"""

from matplotlib.figure import Figure

import vibroimpact as vi
from picture import START, SYSTEM, main, new_figure


def draw(quick: bool) -> Figure:
    """Draw the four exponents over the time of their measurement."""
    spectrum = vi.lyapunov_spectrum(
        SYSTEM.replace(drive_frequency=1.545, friction=0.5),
        initial=START,
        periods=600 if quick else 8000,
    )
    figure = new_figure(3.6)
    vi.plot.lyapunov(spectrum, ax=figure.subplots())
    return figure


if __name__ == "__main__":
    main(draw, __file__)
