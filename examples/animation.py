"""A motion that moves: the machine beside its phase portrait and its time history.

Run ``python examples/animation.py [--out animation.gif]``; ``make animation`` writes it into
docs/images. It is a periodic motion of the paper's Fig. 9(3), with friction: four drive periods and
five impacts, in which the tip slips, or turns back while it is in contact.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import vibroimpact as vi

SYSTEM = vi.System(
    mass_ratio=0.6,
    frequency_ratio=2.0,
    restitution=0.8,
    gap=0.5,
    drive_frequency=1.5752,
    moment_amplitude=1.0,
    friction=0.5,
)
INITIAL = (0.0, 0.0, 0.0, 0.0)


def motion() -> vi.Run:
    """Return a run on the motion, whose time begins when it has settled."""
    settled = vi.simulate(SYSTEM, initial=INITIAL, periods=3000, keep=1)
    return vi.simulate(SYSTEM, initial=settled.stroboscopic[-1], periods=20)


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the animation as the command line asks for."""
    parser = argparse.ArgumentParser(prog="animation.py")
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("animation.gif"),
        help="file to write, .gif, .mp4 or .html (%(default)s)",
    )
    parser.add_argument("--frames", type=int, help="number of frames (48 in a drive period)")
    given = parser.parse_args(arguments)
    with vi.plot.publication_style():
        motion().animate(given.out, frames=given.frames)
    print(given.out)


if __name__ == "__main__":
    main()
