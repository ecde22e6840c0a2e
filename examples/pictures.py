"""The pictures of the documentation that belong to no other script, each by its name.

Run ``python examples/pictures.py NAME [--quick] [--out NAME.png]``; ``make pictures`` draws all of
them into docs/images:

- ``basins``: basins of attraction, with a cell for every dot;
- ``fig7c-contact``, ``fig8-regimes``: two pages of ``vibroimpact reproduce``;
- ``explorer``: the page of ``vibroimpact explore`` in headless Chromium. Needs Bokeh, Selenium and
  Debian's packages chromium and chromium-driver.
"""

import argparse
import io
import shutil
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from PIL import Image

import vibroimpact as vi

DOTS_PER_INCH = 300
START = (0.0, 0.5, 0.0, 0.0)
# Two motions coexist there (docs/coexistence.md).
SYSTEM = vi.System(
    mass_ratio=0.6,
    frequency_ratio=2.0,
    restitution=0.8,
    gap=0.5,
    drive_frequency=1.5752,
    moment_amplitude=1.0,
    friction=0.5,
)
# The page of the explorer has room for all its views.
WINDOW = (1440, 1000)
# Seconds in which the explorer's page has everything.
PATIENCE = 120
# Seconds for its last frames.
SETTLING = 2.0


def basins(quick: bool) -> Image.Image:
    """Draw which start leads to which motion, the oscillator at rest at first."""
    columns, rows = (60, 50) if quick else (1600, 1280)
    found = vi.basins(
        SYSTEM,
        x1=np.linspace(-1.2, 0.6, columns),
        v1=np.linspace(-2.5, 2.5, rows),
        scouts=60 if quick else 1000,
        progress=not quick,
    )
    with vi.plot.publication_style():
        figure = Figure(figsize=(6.0, 5.1), layout="constrained")
        ax = vi.plot.basins(found, ax=figure.subplots())
        ax.plot(*START[:2], "X", color="black", markeredgecolor="white", markersize=7)
        ax.annotate(
            "the paper's start",
            START[:2],
            xytext=(8, -15),
            textcoords="offset points",
            path_effects=[withStroke(linewidth=2.5, foreground="white")],
        )
        return _image(figure)


def page(figure: int, name: str, quick: bool) -> Image.Image:
    """Draw a page of the reproduction."""
    from han_jin_hu_2004 import reproduce

    with tempfile.TemporaryDirectory() as folder:
        reproduce(folder, figures=[figure], frequencies=40 if quick else 4000, progress=not quick)
        with Image.open(Path(folder) / name) as image:
            return image.convert("RGB")


def explorer(quick: bool) -> Image.Image:
    """Show what the explorer begins with, with the branch of its motion."""
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service
    from selenium.webdriver.support.wait import WebDriverWait

    from vibroimpact.explorer.compute import COARSE
    from vibroimpact.explorer.presets import FIRST
    from vibroimpact.explorer.server import LocalServer

    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or "chromium"
    for flag in ("headless=new", "no-sandbox", "disable-gpu", "disable-dev-shm-usage"):
        options.add_argument(f"--{flag}")
    options.add_argument(f"--window-size={WINDOW[0]},{WINDOW[1]}")
    ready, made = threading.Event(), []

    def serve() -> None:
        made.append(LocalServer(FIRST))
        ready.set()
        made[0].run()

    thread = threading.Thread(target=serve)
    thread.start()
    ready.wait()
    chrome = webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))
    try:
        chrome.get(made[0].url)
        model = "Bokeh.documents[0].get_model_by_name"
        wait = WebDriverWait(chrome, PATIENCE, ignored_exceptions=[Exception])

        def until(condition: str) -> None:
            wait.until(lambda _: chrome.execute_script(f"return {condition}"))

        until(f"{model}('verdict').text.includes('largest exponent')")
        if not quick:
            chrome.execute_script(f"{model}('branch').active = true")
            until(f"{model}('stable').data.xs.length > 0")
            # The fine diagram follows the coarse one.
            until(f"new Set({model}('diagram').data.at).size > {COARSE['diagram'].columns}")
            time.sleep(SETTLING)
        return Image.open(io.BytesIO(chrome.get_screenshot_as_png())).convert("RGB")
    finally:
        chrome.quit()
        made[0].stop()
        thread.join()


PICTURES: dict[str, Callable[[bool], Image.Image]] = {
    "basins": basins,
    "fig7c-contact": lambda quick: page(7, "fig7c-enlarged.png", quick),
    "fig8-regimes": lambda quick: page(8, "fig8-regimes.png", quick),
    "explorer": explorer,
}


def _image(figure: Figure) -> Image.Image:
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=DOTS_PER_INCH)
    return Image.open(buffer).convert("RGB")


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
