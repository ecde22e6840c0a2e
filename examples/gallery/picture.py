"""What the pictures of the gallery share: the system, their width, and their command line."""

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

from matplotlib.figure import Figure
from PIL import Image

import vibroimpact as vi

# The system of section 4 of Han, Jin & Hu (2004), that of Fig. 4; Fig. 8(a) has friction 0.5.
SYSTEM = vi.System(
    mass_ratio=0.6,
    frequency_ratio=2.0,
    restitution=0.8,
    gap=0.5,
    drive_frequency=1.0,
    moment_amplitude=1.0,
)
START = (0.0, 0.5, 0.0, 0.0)
# Fig. 9(3): a 4-5 and a 6-7 motion coexist there (docs/coexistence.md).
COEXISTING = SYSTEM.replace(drive_frequency=1.5752, friction=0.5)

WIDTH = 6.0
DOTS_PER_INCH = 300
# A PNG with more bytes than these gets a palette of 256 colours, which halves it.
LARGE = 250_000


def new_figure(height: float) -> Figure:
    """Return an empty figure of the common width and a height in inches."""
    return Figure(figsize=(WIDTH, height), layout="constrained")


def save(figure: Figure, path: Path) -> None:
    """Write a figure into a file that is not large."""
    figure.savefig(path, dpi=DOTS_PER_INCH)
    if path.suffix == ".png" and path.stat().st_size > LARGE:
        image = Image.open(path).convert("RGB")
        image.quantize(256, dither=Image.Dither.NONE).save(path, optimize=True)


def main(
    draw: Callable[[bool], Figure], script: str, arguments: Sequence[str] | None = None
) -> None:
    """Draw a picture as its command line asks for."""
    default = Path(f"{Path(script).stem}.png")
    parser = argparse.ArgumentParser(prog=Path(script).name)
    parser.add_argument("--quick", action="store_true", help="a coarse one, in seconds")
    parser.add_argument(
        "--out", type=Path, default=default, help="file to write, .png, .pdf or .svg (%(default)s)"
    )
    given = parser.parse_args(arguments)
    with vi.plot.publication_style():
        save(draw(given.quick), given.out)
    print(given.out)
