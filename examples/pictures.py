"""The pictures of the documentation that belong to no other script, each by its name.

Run ``python examples/pictures.py NAME [--quick] [--out NAME.png]``; ``make pictures`` draws all of
them into docs/images:

- ``fig7c-contact``, ``fig8-regimes``: two pages of ``vibroimpact reproduce``;
- ``explorer``: the page of ``vibroimpact explore``, in headless Chromium as the tests start it
  (``tests/python/chromium.py``). Needs Bokeh, pytest, Selenium and Debian's packages chromium and
  chromium-driver;
- ``explorer-structure``: its page of two masses with two stops.
"""

import argparse
import io
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from PIL import Image

# Seconds for the last frames of the explorer's page.
SETTLING = 2.0
TESTS = Path(__file__).resolve().parents[1] / "tests" / "python"


def page(figure: int, name: str, quick: bool) -> Image.Image:
    """Draw a page of the reproduction."""
    from han_jin_hu_2004 import reproduce

    with tempfile.TemporaryDirectory() as folder:
        reproduce(folder, figures=[figure], frequencies=40 if quick else 4000, progress=not quick)
        with Image.open(Path(folder) / name) as image:
            return image.convert("RGB")


def explorer(quick: bool) -> Image.Image:
    """Show what the explorer begins with, with the branch of its motion."""
    from vibroimpact.explorer.presets import FIRST

    return _page(FIRST, quick, {"branch": True})


def explorer_structure(quick: bool) -> Image.Image:
    """Show two masses that meet, the second of which meets a wall."""
    import vibroimpact as vi
    from vibroimpact.explorer.server import first_state

    structure = vi.Structure(
        mass=[[1, 0], [0, 2]],
        stiffness=[[2, -1], [-1, 1]],
        stops=[
            vi.Stop(normal=[1, -1], gap=0.2, restitution=0.7),
            vi.Stop(normal=[0, 1], gap=0.5, restitution=0.8),
        ],
        damping_ratios=[0.02, 0.02],
        drive_amplitude=[1, 1j],
        drive_frequency=1.2,
    )
    return _page(first_state(structure, None), quick, {})


def _page(state: Any, quick: bool, pressed: dict[str, bool]) -> Image.Image:
    """Show a page of the explorer, with some buttons pressed and its fine diagram unless quick."""
    from vibroimpact.explorer.compute import COARSE

    sys.path.append(str(TESTS))
    from chromium import Window, serving, started

    with started() as chrome, serving(state) as server:
        window = Window(chrome, server.url)
        window.open()
        window.settled()
        if not quick:
            model = "Bokeh.documents[0].get_model_by_name"
            for name, active in pressed.items():
                window.set(name, "active", active)
            if "branch" in pressed:
                window.wait(f"{model}('stable').data.xs.length > 0")
            # The fine diagram follows the coarse one.
            window.wait(f"new Set({model}('diagram').data.at).size > {COARSE['diagram'].columns}")
            time.sleep(SETTLING)
        return Image.open(io.BytesIO(chrome.get_screenshot_as_png())).convert("RGB")


PICTURES: dict[str, Callable[[bool], Image.Image]] = {
    "fig7c-contact": lambda quick: page(7, "fig7c-enlarged.png", quick),
    "fig8-regimes": lambda quick: page(8, "fig8-regimes.png", quick),
    "explorer": explorer,
    "explorer-structure": explorer_structure,
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw one picture as the command line asks for."""
    parser = argparse.ArgumentParser(prog="pictures.py")
    parser.add_argument("name", choices=PICTURES)
    parser.add_argument("--quick", action="store_true", help="a coarse one, in seconds")
    parser.add_argument("--out", type=Path, help="file to write (NAME.png)")
    given = parser.parse_args(arguments)
    out = given.out or Path(f"{given.name}.png")
    image = PICTURES[given.name](given.quick)
    # A palette halves the file; these pictures have few colours.
    image.quantize(256, dither=Image.Dither.NONE).save(out, optimize=True)
    print(out)


if __name__ == "__main__":
    main()
