"""Draws the figures of docs/errata.md, each by its name.

Run ``python examples/errata NAME [--quick] [--out FILE]``; the names are those of the modules
beside this file. ``make errata`` draws all of them into docs/images/errata.
"""

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

from matplotlib.figure import Figure

import counting
import energy
import growth
import multipliers
import separating
import slip
import vibroimpact as vi

FIGURES: dict[str, Callable[[bool], Figure]] = {
    module.__name__: module.draw
    for module in (energy, slip, separating, multipliers, growth, counting)
}
DOTS_PER_INCH = 150


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw one figure as the command line asks for."""
    parser = argparse.ArgumentParser(prog="examples/errata")
    parser.add_argument("name", choices=FIGURES)
    parser.add_argument("--quick", action="store_true", help="a coarse one, in seconds")
    parser.add_argument("--out", type=Path, help="file to write, .png, .pdf or .svg (NAME.png)")
    given = parser.parse_args(arguments)
    out = given.out or Path(f"{given.name}.png")
    with vi.plot.publication_style():
        FIGURES[given.name](given.quick).savefig(out, dpi=DOTS_PER_INCH)
    print(out)


if __name__ == "__main__":
    main()
