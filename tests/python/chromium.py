"""Headless Chromium on a page of the explorer; who needs it is skipped where it is missing."""

import json
import logging
import shutil
import threading
from contextlib import contextmanager

import pytest

from vibroimpact.explorer import compute
from vibroimpact.explorer.presets import DEFAULT, PRESETS
from vibroimpact.explorer.server import LocalServer

WIDTH, HEIGHT = 1440, 1000
# Seconds until something that never comes counts as missing; a busy machine may be slow.
PATIENCE = 300


def programs() -> tuple[str, str]:
    """Chromium and its driver; skips the test where one of them is missing."""
    browsers = map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))
    browser = next(filter(None, browsers), None)
    driver = shutil.which("chromedriver")
    if browser is None or driver is None:
        pytest.skip("needs Debian's packages chromium and chromium-driver")
    pytest.importorskip("selenium")
    return browser, driver


@contextmanager
def started():
    """Give a driver of headless Chromium that records requests and the console."""
    browser, driver = programs()
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = browser
    for flag in ("headless=new", "no-sandbox", "disable-gpu", "disable-dev-shm-usage"):
        options.add_argument(f"--{flag}")
    options.add_argument(f"--window-size={WIDTH},{HEIGHT}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    chrome = webdriver.Chrome(options=options, service=Service(driver))
    chrome.set_script_timeout(PATIENCE)
    try:
        yield chrome
    finally:
        chrome.quit()


@contextmanager
def serving(state=DEFAULT):
    """Give a server of the explorer, on a thread of its own."""
    ready, made = threading.Event(), []

    def serve():
        made.append(LocalServer(state))
        ready.set()
        made[0].run()

    thread = threading.Thread(target=serve)
    thread.start()
    ready.wait()
    try:
        yield made[0]
    finally:
        made[0].stop()
        thread.join()


class Records(logging.Handler):
    """Keeps what is logged as a warning or worse."""

    def __init__(self):
        super().__init__(logging.WARNING)
        self.messages: list[str] = []

    def emit(self, record):
        self.messages.append(record.getMessage())


class Window:
    """What a test does in the browser, and what it sees there."""

    def __init__(self, chrome, url):
        self.chrome, self.url = chrome, url

    def open(self, query=""):
        """Load a page, and wait until its motion and map are there."""
        self.chrome.get(f"{self.url}?{query}")
        self.wait("document.title == 'vibroimpact explorer' && Bokeh.documents.length > 0")
        self.wait(_model("film") + ".data.at.length > 0")

    @contextmanager
    def minimized(self):
        """Hide the page: it has no frames then."""
        self.chrome.minimize_window()
        try:
            self.wait("document.hidden")
            yield
        finally:
            # The page is as large as before.
            self.chrome.set_window_rect(x=0, y=0, width=WIDTH, height=HEIGHT)
            self.wait("!document.hidden")

    @contextmanager
    def of_width(self, width):
        """Give the window a width, and afterwards its own."""
        try:
            self.chrome.set_window_size(width, HEIGHT)
            self.wait(f"Math.abs(window.outerWidth - {width}) < 20")
            yield
        finally:
            self.chrome.set_window_size(WIDTH, HEIGHT)

    def js(self, code, *given):
        """Return what JavaScript gives."""
        return self.chrome.execute_script(code, *given)

    def wait(self, condition):
        """Wait until an expression of JavaScript is true."""
        from selenium.webdriver.support.wait import WebDriverWait

        WebDriverWait(self.chrome, PATIENCE, poll_frequency=0.05).until(
            lambda _: self.js(f"try {{ return {condition} }} catch (error) {{ return false }}")
        )

    def begin_again(self):
        """Show the first state on the page that is open, with every button as at first."""
        for name in ("dark", "code"):
            self.set(name, "active", False)
        self.set("playing", "active", True)
        self.set("preset", "value", "choose a preset")
        # What is shown may be left from before: the first state is there when it follows another.
        for preset in ("Paper, Fig. 5(c): 2-1", "Paper, Fig. 9(2): chaos"):
            self.set("preset", "value", preset)
            state = PRESETS[preset]
            self.wait(f"window.location.search == '?{state.to_query()}'")
            tip = state.system.tip(compute.motion(state).states[:, 0]).tolist()[100]
            self.wait(f"{_model('film')}.data.tip_x[100] == {tip!r}")
        self.settled()

    def get(self, name, field):
        """Return a field of a model."""
        return self.js(f"return {_model(name)}.{field}")

    def several(self, name, *fields):
        """Return several fields of a model, in one call."""
        return self.js(f"const m = {_model(name)}; return [{', '.join('m.' + f for f in fields)}]")

    def data(self, name, column):
        """Return a column of a source, as numbers."""
        return self.js(f"return Array.from({_model(name)}.data.{column})")

    def set(self, name, field, value):
        """Change a field of a model, as its widget does."""
        self.js(f"{_model(name)}.{field} = arguments[0]", value)

    def settled(self):
        """Wait until the motion has its verdict."""
        self.wait(f"{_model('verdict')}.text.includes('largest exponent')")

    def element(self, name):
        """Return the element of a model in the page, inside all shadow roots."""
        return self.js(f"return {_view(name)}.el")

    def press(self, name):
        """Press a button, once it has its place: what has just been shown is laid out later."""
        button = f"{_view(name)}.el.shadowRoot.querySelector('button')"
        self.wait(f"{button}.getBoundingClientRect().width > 0")
        self.js(f"return {button}").click()

    def points_at(self, figure, *points):
        """Return the places in the window of points of a figure."""
        return self.js(
            f"""
            const view = {_view(figure)}
            view.el.scrollIntoView({{block: "center"}})
            const box = view.el.getBoundingClientRect()
            const frame = view.frame
            const within = (x, size) => Math.min(Math.max(x, 1), size - 2)
            return arguments[0].map(([x, y]) => [
              within(box.left + frame.x_scale.compute(x), window.innerWidth),
              within(box.top + frame.y_scale.compute(y), window.innerHeight),
            ])
            """,
            points,
        )

    def click(self, figure, x, y):
        """Click at a point of a figure."""
        ((left, top),) = self.points_at(figure, (x, y))
        self._press(left, top)

    def drag(self, figure, start, end):
        """Draw a box from one point of a figure to another."""
        from selenium.webdriver.common.action_chains import ActionChains

        (left, top), (right, bottom) = self.points_at(figure, start, end)
        chain = ActionChains(self.chrome, duration=20)
        chain.w3c_actions.pointer_action.move_to_location(int(left), int(top))
        chain.w3c_actions.pointer_action.pointer_down()
        for part in (0.3, 0.7, 1.0):
            chain.w3c_actions.pointer_action.move_to_location(
                int(left + part * (right - left)), int(top + part * (bottom - top))
            )
        chain.w3c_actions.pointer_action.pointer_up()
        chain.perform()

    def _press(self, left, top):
        from selenium.webdriver.common.action_chains import ActionChains

        chain = ActionChains(self.chrome, duration=10)
        chain.w3c_actions.pointer_action.move_to_location(int(left), int(top))
        chain.w3c_actions.pointer_action.click()
        chain.perform()

    def complaints(self):
        """Return warnings and errors of the console since the last call."""
        return [
            entry["message"]
            for entry in self.chrome.get_log("browser")
            if entry["level"] in ("WARNING", "SEVERE")
        ]

    def requests(self):
        """Return the addresses of all requests since the last call."""
        messages = (json.loads(each["message"]) for each in self.chrome.get_log("performance"))
        found = []
        for message in (each["message"] for each in messages):
            if message["method"] == "Network.requestWillBeSent":
                found.append(message["params"]["request"]["url"])
            if message["method"] == "Network.webSocketCreated":
                found.append(message["params"]["url"])
        return found


def _model(name):
    return f"Bokeh.documents[0].get_model_by_name({name!r})"


def _view(name):
    return f"Bokeh.index.find_one_by_id({_model(name)}.id)"
