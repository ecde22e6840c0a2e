"""Latency of the explorer, measured in the browser: from a slider's move to the redrawn views.

Run ``python benches/explorer_latency.py [--moves 40] [--only structures]``. It serves a page, opens
it in headless Chromium (Debian's packages chromium and chromium-driver, and Selenium), moves the
slider of the moment amplitude, of a structure that of the drive's factor, and takes the time in the
browser until the new data have come and two frames have been drawn since. The slider moves again
when both have come; each move changes motion, sections and diagram.

Then it drags the slider: it moves at every frame, whatever has come, and counts the motions that
come, and the time from the last move until the last motion has been drawn.
"""

import argparse
import contextlib
import shutil
import statistics
import threading
from collections.abc import Iterator

import numpy as np
from selenium import webdriver
from selenium.webdriver.chrome.service import Service

import vibroimpact as vi
from vibroimpact.explorer.presets import PRESETS
from vibroimpact.explorer.server import LocalServer
from vibroimpact.explorer.state import State


def row(count: int, struck: int) -> State:
    """Return a row of masses on springs, of which the first is driven and so many meet a stop."""
    neighbours = np.eye(count, k=1) + np.eye(count, k=-1)
    structure = vi.Structure(
        np.eye(count),
        2.0 * np.eye(count) - neighbours,
        [vi.Stop(unit, 0.3, 0.8) for unit in np.eye(count)[:struck]],
        damping_ratios=np.full(count, 0.05),
        drive_amplitude=np.eye(count)[0],
        drive_frequency=1.2,
    )
    return State.of(structure, own=True)


# States that a page begins with, by what is simulated.
SCENES = {
    "systems": {
        "Fig. 9(2), friction": PRESETS["Paper, Fig. 9(2): chaos"],
        "Fig. 5(b), no friction": PRESETS["Paper, Fig. 5(b): 1-1"],
        "impact oscillator": PRESETS["Impact oscillator (a wall)"],
    },
    "structures": {
        "2 masses, 2 stops": row(2, 2),
        "20 masses, 20 stops": row(20, 20),
        "128 masses, 4 stops": row(128, 4),
    },
}
# The slider that moves.
SLIDERS = {"systems": "moment_amplitude", "structures": "drive_factor"}
# Seconds for one move, at most.
PATIENCE = 30
MEASURE = """
const [name, value, done] = arguments
const found = (name) => Bokeh.documents[0].get_model_by_name(name)
const times = {}
const drawn = (name, begun) => requestAnimationFrame(() => requestAnimationFrame(() => {
  times[name] = performance.now() - begun
  if (Object.keys(times).length == 2) done(times)
}))
const sources = {motion: found("stroboscopic"), diagram: found("diagram")}
const slider = found(`${name}-slider`)
const begun = performance.now()
for (const [name, source] of Object.entries(sources)) {
  const changed = () => {
    source.properties.data.change.disconnect(changed)
    drawn(name, begun)
  }
  source.properties.data.change.connect(changed)
}
slider.value = value
"""
# A drag has ended when no motion has come for so many milliseconds.
QUIET = 3000
DRAG = """
const [name, moves, quiet, done] = arguments
const found = (name) => Bokeh.documents[0].get_model_by_name(name)
const slider = found(`${name}-slider`), data = found("film").properties.data
let count = 0, begun = 0, last = performance.now(), end = 0
const came = () => {
  count++
  last = performance.now()
  requestAnimationFrame(() => requestAnimationFrame(() => end = performance.now()))
}
data.change.connect(came)
let move = 0
const step = () => {
  slider.value = 0.9 + 0.005 * (++move)
  if (move < moves) return requestAnimationFrame(step)
  begun = last = performance.now()
  const watch = setInterval(() => {
    if (performance.now() - last < quiet) return
    clearInterval(watch)
    data.change.disconnect(came)
    done([end - begun, count])
  }, 100)
}
requestAnimationFrame(step)
"""
READY = """
const found = (name) => Bokeh.documents[0].get_model_by_name(name)
return document.readyState == "complete" && Bokeh.documents.length > 0
    && found("diagram").data.at.length > 0 && found("verdict").text.includes("exponent")
"""


def browser() -> webdriver.Chrome:
    """Return headless Chromium."""
    program, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if program is None or driver is None:
        raise SystemExit("needs Debian's packages chromium and chromium-driver")
    options = webdriver.ChromeOptions()
    options.binary_location = program
    for flag in (
        "headless=new",
        "no-sandbox",
        "disable-gpu",
        "disable-dev-shm-usage",
        "window-size=1440,1000",
    ):
        options.add_argument(f"--{flag}")
    chrome = webdriver.Chrome(options=options, service=Service(driver))
    chrome.set_script_timeout(PATIENCE)
    return chrome


def wait(chrome: webdriver.Chrome) -> None:
    """Wait until a page has its motion, its label and its map."""
    from selenium.webdriver.support.wait import WebDriverWait

    script = f"try {{ {READY} }} catch (error) {{ return false }}"
    WebDriverWait(chrome, 4 * PATIENCE).until(lambda _: chrome.execute_script(script))


def measure(chrome: webdriver.Chrome, url: str, slider: str, moves: int) -> dict[str, list[float]]:
    """Return the milliseconds of each move, for the motion with its sections and the diagram."""
    chrome.get(url)
    wait(chrome)
    found: dict[str, list[float]] = {"motion": [], "diagram": []}
    for move in range(moves):
        times = chrome.execute_async_script(MEASURE, slider, 0.9 + 0.005 * (move + 1))
        for name, milliseconds in times.items():
            found[name].append(milliseconds)
    return found


def drag(chrome: webdriver.Chrome, url: str, slider: str, moves: int) -> tuple[float, int]:
    """Return the milliseconds from the last move to the last picture, and how many motions came."""
    chrome.get(url)
    wait(chrome)
    lag, count = chrome.execute_async_script(DRAG, slider, moves, QUIET)
    return lag, count


@contextlib.contextmanager
def served(state: State) -> Iterator[str]:
    """Serve a page that begins with a state, and return its address."""
    ready, servers = threading.Event(), []

    def serve() -> None:
        servers.append(LocalServer(state))
        ready.set()
        servers[0].run()

    thread = threading.Thread(target=serve)
    thread.start()
    ready.wait()
    try:
        yield servers[0].url
    finally:
        servers[0].stop()
        thread.join()


def main() -> None:
    """Print a table of medians and 90 per cent quantiles, and one of drags."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--moves", type=int, default=40, help="moves of the slider per scene")
    parser.add_argument("--drags", type=int, default=5, help="drags of so many moves per scene")
    parser.add_argument("--only", choices=SCENES, help="scenes of one kind")
    options = parser.parse_args()
    moves = options.moves
    scenes = [
        (name, state, SLIDERS[kind])
        for kind, states in SCENES.items()
        if options.only in (None, kind)
        for name, state in states.items()
    ]
    chrome = browser()
    try:
        print("milliseconds (median, 90 %)   motion, sections   coarse diagram")
        for scene, state, slider in scenes:
            with served(state) as url:
                found = measure(chrome, url, slider, moves)
            cells = []
            for name in ("motion", "diagram"):
                tenths = statistics.quantiles(found[name], n=10)
                cells.append(f"{statistics.median(found[name]):7.0f} {tenths[-1]:7.0f}")
            print(f"{scene:28s}  {cells[0]:17s}  {cells[1]}", flush=True)
        print(f"\nafter {moves} moves (median, most)   milliseconds      motions")
        for scene, state, slider in scenes:
            with served(state) as url:
                drags = [drag(chrome, url, slider, moves) for _ in range(options.drags)]
            cells = [
                f"{statistics.median(each):7.0f} {max(each):7.0f}"
                for each in zip(*drags, strict=True)
            ]
            print(f"{scene:28s}  {cells[0]:17s}  {cells[1]}", flush=True)
    finally:
        chrome.quit()


if __name__ == "__main__":
    main()
