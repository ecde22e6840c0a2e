"""The explorer in headless Chromium: views, clicks, zoom, presets, code, files, no foreign host."""

import csv
import io
import json
import logging
import random

import numpy as np
import pytest
from matplotlib import pyplot

import sizes
import vibroimpact as vi
from chromium import PATIENCE, WIDTH, Records, Window, serving, started
from vibroimpact.explorer import app, compute
from vibroimpact.explorer.axis import Axis
from vibroimpact.explorer.code import python_code
from vibroimpact.explorer.of_system import OfSystem
from vibroimpact.explorer.presets import DEFAULT, PRESETS
from vibroimpact.explorer.views.diagram import _MARKERS, BranchLines, _branch_key
from vibroimpact.explorer.views.parts import with_error

By = pytest.importorskip("selenium.webdriver.common.by").By
WebDriverWait = pytest.importorskip("selenium.webdriver.support.wait").WebDriverWait
# What an acknowledgement says of a picture.
WORDS = ("sent", "drawn")
# One line of each kind, and one of each bifurcation.
LINE = {"xs": [np.zeros(2)], "ys": [np.zeros(2)]}
EVERY = BranchLines(LINE, LINE, tuple((1.7, 0.0, kind) for kind in _MARKERS))
# The element of the key that has them, whatever a new map has written there.
KEY = f"""
const model = Bokeh.documents[0].get_model_by_name("diagram-key")
if (model.text != {json.dumps(_branch_key(EVERY))}) model.text = {json.dumps(_branch_key(EVERY))}
const key = Bokeh.index.find_one_by_id(model.id).el
"""
SMALL = {
    "diagram": compute.Detail(60, 0, 100, 20),
    "chart": compute.Detail(12, 8, 60, 20),
    "basins": compute.Detail(12, 8, 120, 20),
}


@pytest.fixture(scope="module")
def browser():
    """A window, and what the server logs meanwhile.

    One for all tests of this file in a process: a browser with a profile of its own, and a server
    at a free port.
    """
    records = Records()
    patch = pytest.MonkeyPatch()
    patch.setattr(compute, "FINE", SMALL)
    patch.setattr(compute, "COARSE", SMALL)
    # On a busy machine an acknowledgement may be late, but is not lost.
    patch.setattr(app, "PATIENCE", PATIENCE)
    logging.getLogger().addHandler(records)
    with started() as chrome, serving() as server:
        window = Window(chrome, server.url)
        window.records = records
        window.open()
        yield window
    logging.getLogger().removeHandler(records)
    patch.undo()


@pytest.fixture
def window(browser):
    """The window on its first state; afterwards nothing has complained."""
    browser.begin_again()
    yield browser
    assert browser.complaints() == []
    assert browser.records.messages == []


def test_each_view_is_drawn_and_nothing_comes_from_elsewhere(window):
    window.settled()
    for figure in ("machine-figure", "history-figure", "portrait-figure", "impact-figure"):
        box = window.js(
            "return arguments[0].getBoundingClientRect().toJSON()", element(window, figure)
        )
        assert box["width"] > 150, figure
        assert box["height"] > 100, figure
    foreign = [url for url in window.requests() if not own(url, window)]
    assert foreign == []


def element(window, name):
    return window.element(name)


def own(url, window):
    hosts = (window.url, window.url.replace("http", "ws"))
    return url.startswith((*hosts, "data:", "blob:", "chrome"))


def test_the_numbers_of_the_page_are_those_of_the_functions(window):
    window.settled()
    motion = compute.motion(DEFAULT)
    assert window.data("film", "v1") == motion.states[:, 1].tolist()
    assert window.data("stroboscopic", "place") == motion.run.stroboscopic[:, 0].tolist()
    diagram = compute.diagram(DEFAULT, SMALL["diagram"])
    first = diagram.x1[0].item()
    window.wait(f"Bokeh.documents[0].get_model_by_name('diagram').data.value[0] == {first!r}")
    assert window.data("diagram", "value") == diagram.x1.tolist()
    verdict = compute.verdict(DEFAULT, motion.run)
    text = window.get("verdict", "text")
    assert ">chaotic<" in text
    assert with_error(verdict.exponent, verdict.error) in text
    assert text.count("±") == 2
    assert "+-" not in text


def test_the_machine_moves(window):
    frame = "Bokeh.documents[0].get_model_by_name('rod').data.x[1]"
    first = window.js(f"return {frame}")
    window.wait(f"{frame} != {first!r}")
    tips = DEFAULT.system.tip(compute.motion(DEFAULT).states[:, 0])
    assert window.js(f"return {frame}") in tips.tolist()
    # Another motion is another film.
    window.set("friction-slider", "value", 0.125)
    other = DEFAULT.replace(friction=0.125)
    window.wait("window.location.search.includes('friction=0.125&')")
    tips = other.system.tip(compute.motion(other).states[:, 0]).tolist()
    window.wait(f"{tips}.includes({frame})")
    window.wait(f"Bokeh.documents[0].get_model_by_name('film').data.tip_x[100] == {tips[100]!r}")
    window.set("playing", "active", False)


def test_a_slider_redraws_and_the_address_follows(window):
    window.settled()
    window.set("friction-slider", "value", 0.125)
    state = DEFAULT.replace(friction=0.125)
    window.wait("window.location.search.includes('friction=0.125&')")
    motion = compute.motion(state)
    speed = motion.states[5, 1].item()
    window.wait(f"Bokeh.documents[0].get_model_by_name('film').data.v1[5] == {speed!r}")
    # The address alone leads back to the state.
    window.chrome.refresh()
    window.wait("Bokeh.documents[0].get_model_by_name('friction').value == '0.125'")


def test_a_dragged_slider_sends_a_motion_when_the_last_is_drawn(window):
    window.settled()
    window.js(
        """
        const found = (name) => Bokeh.documents[0].get_model_by_name(name)
        let waiting = 0
        window.most = window.count = 0
        found("film").properties.data.change.connect(() => {
          window.count++
          window.most = Math.max(window.most, ++waiting)
        })
        found("motion-drawn").properties.tags.change.connect(() => waiting = 0)
        for (let k = 1; k <= 40; k++) found("friction-slider").value = 0.015 * k
        """
    )
    last = DEFAULT.replace(friction=0.6)
    tip = last.system.tip(compute.motion(last).states[:, 0]).tolist()[100]
    window.wait(f"Bokeh.documents[0].get_model_by_name('film').data.tip_x[100] == {tip!r}")
    assert window.js("return window.most") == 1
    assert window.js("return window.count") < 40


def test_a_page_that_nobody_sees_acknowledges_at_once(window):
    window.settled()
    window.js("window.frames_drawn = 0")
    with window.minimized():
        window.js("requestAnimationFrame(() => window.frames_drawn++)")
        for friction in (0.125, 0.25):
            window.set("friction-slider", "value", friction)
            state = DEFAULT.replace(friction=friction)
            tip = state.system.tip(compute.motion(state).states[:, 0]).tolist()[100]
            window.wait(f"Bokeh.documents[0].get_model_by_name('film').data.tip_x[100] == {tip!r}")
            window.wait(
                "Bokeh.documents[0].get_model_by_name('motion-drawn').tags[0] =="
                " Bokeh.documents[0].get_model_by_name('motion-sent').tags[0]"
            )
        assert window.js("return window.frames_drawn") == 0


def test_a_picture_makes_no_layout_and_places_no_glyph(window):
    window.settled()
    # What nobody sees has no view, which would make a layout of the page whenever it changes.
    hidden = ["address", *(f"{name}-{word}" for name in ("motion", "map") for word in WORDS)]
    views = window.js(
        """
        const found = (name) => Bokeh.documents[0].get_model_by_name(name)
        const figures = [...Bokeh.documents[0]._all_models.values()].filter(
          (model) => model.type == "Figure")
        const views = figures.flatMap(
          (figure) => Bokeh.index.find_one_by_id(figure.id).computed_renderer_views)
        const watch = (type, records) => {
          const observer = new MutationObserver((seen) => records.push(...seen))
          const which = views.filter((view) => (view.model.type == "GlyphRenderer") == type)
          for (const {position} of which) observer.observe(position.el, {childList: true})
          return records
        }
        window.glyphs = watch(true, [])
        window.others = watch(false, [])
        return arguments[0].map((name) => Bokeh.index.find_one_by_id(found(name).id))
        """,
        hidden,
    )
    assert views == [None] * len(hidden)
    # A larger motion has other ranges, with numbers of another width beside the axes.
    state = DEFAULT.replace(moment_amplitude=3.0)
    window.set("moment_amplitude-slider", "value", 3.0)
    speed = compute.motion(state).states[5, 1].item()
    window.wait(f"Bokeh.documents[0].get_model_by_name('film').data.v1[5] == {speed!r}")
    window.wait("window.others.length > 0")
    assert window.js("return window.glyphs.length") == 0
    window.wait(
        """(() => {
          const id = Bokeh.documents[0].get_model_by_name("portrait-figure").id
          return Bokeh.index.find_one_by_id(id).axis_views.every((view) => {
            const box = view.el.getBoundingClientRect()
            return Math.abs(box.width - view.bbox.width) < 1
              && Math.abs(box.height - view.bbox.height) < 1
          })
        })()"""
    )


def test_a_bad_number_is_told_beside_its_field(window):
    box = element(window, "restitution").shadow_root.find_element(By.CSS_SELECTOR, "input")
    box.clear()
    box.send_keys("1.5\n")
    # The empty field, on the way, has a message of its own.
    window.wait(
        "Bokeh.documents[0].get_model_by_name('restitution-error').text"
        ".includes('allowed: a number in [0, 1]')"
    )


def test_a_click_on_a_column_shows_its_motion(window):
    window.wait("Bokeh.documents[0].get_model_by_name('diagram').data.at.length > 0")
    window.click("diagram-figure", 1.7, 0.0)
    values = np.linspace(1.4, 2.0, SMALL["diagram"].columns)
    window.wait("Bokeh.documents[0].get_model_by_name('drive_frequency').value != '1.545'")
    shown = float(window.get("drive_frequency", "value"))
    chosen = values[np.argmin(abs(values - shown))].item()
    # The field shows it rounded, the address has all of its digits.
    assert shown == pytest.approx(chosen, abs=1e-6)
    assert f"drive_frequency={chosen!r}&" in window.js("return window.location.search")
    window.settled()
    state = DEFAULT.replace(drive_frequency=chosen)
    verdict = compute.verdict(state, compute.motion(state).run)
    window.wait(
        f"Bokeh.documents[0].get_model_by_name('verdict').text.includes('>{verdict.label}<')"
    )


def test_a_box_zooms_and_the_way_back(window):
    window.wait("Bokeh.documents[0].get_model_by_name('diagram').data.at.length > 0")
    window.drag("diagram-figure", (1.5, 0.6), (1.6, -0.2))
    window.wait("Number(Bokeh.documents[0].get_model_by_name('vary_low').value) > 1.45")
    low, high = (float(window.get(f"vary_{end}", "value")) for end in ("low", "high"))
    assert abs(low - 1.5) < 0.01
    assert abs(high - 1.6) < 0.01
    window.wait("Math.min(...Bokeh.documents[0].get_model_by_name('diagram').data.at) > 1.45")
    window.press("back")
    window.wait("Bokeh.documents[0].get_model_by_name('vary_low').value == '1.4'")


@pytest.mark.parametrize("shown", [1, 2])
def test_a_box_zooms_cells_and_the_way_back(window, shown):
    name, low, box = (
        ("chart", "across_low", ((1.6, 1.2), (1.8, 0.8))),
        ("basins", "right_low", ((-0.2, 0.4), (0.2, -0.4))),
    )[shown - 1]
    window.set("map", "active", shown)
    window.wait(f"Bokeh.documents[0].get_model_by_name('{name}').data.image.length > 0")
    before = window.get(low, "value")
    window.drag(f"{name}-figure", *box)
    window.wait(f"Bokeh.documents[0].get_model_by_name('{low}').value != '{before}'")
    assert abs(float(window.get(low, "value")) - box[0][0]) < 0.02
    left = f"Bokeh.documents[0].get_model_by_name('{name}').data.x[0]"
    window.wait(f"Math.abs({left} - {window.get(low, 'value')}) < 0.02")
    window.press("back")
    window.wait(f"Bokeh.documents[0].get_model_by_name('{low}').value == '{before}'")


@pytest.mark.parametrize("shown", [1, 2])
def test_a_click_on_a_cell_shows_its_motion(window, shown):
    name = OfSystem.maps[shown]
    window.set("map", "active", shown)
    window.wait(f"Bokeh.documents[0].get_model_by_name('{name}').data.image.length > 0")
    field, x, y = (("moment_amplitude", 1.7, 1.5), ("v1", 0.2, 1.0))[shown - 1]
    before = window.get(field, "value")
    window.click(f"{name}-figure", x, y)
    window.wait(f"Bokeh.documents[0].get_model_by_name('{field}').value != '{before}'")
    assert abs(float(window.get(field, "value")) - y) < 0.3


def test_presets_code_and_files(window):
    for name in ("Impact oscillator (a wall)", "Two oscillators head on", "Bouncing ball"):
        window.set("preset", "value", name)
        query = PRESETS[name].to_query()
        window.wait(f"window.location.search == '?{query}'")
    window.set("preset", "value", "Paper, Fig. 5(b): 1-1")
    state = PRESETS["Paper, Fig. 5(b): 1-1"]
    window.wait(f"window.location.search == '?{state.to_query()}'")
    window.set("code", "active", True)
    window.wait("Bokeh.documents[0].get_model_by_name('code-text').tags.length > 0")
    assert window.get("code-text", "tags") == [python_code(state)]
    window.settled()
    window.js(
        """
        window.saved = []
        const make = URL.createObjectURL
        URL.createObjectURL = (blob) => {
          blob.text().then((text) => window.saved.push(text))
          return make(blob)
        }
        """
    )
    window.press("motion-csv")
    window.wait("window.saved.length == 1")
    rows = [*csv.DictReader(io.StringIO(window.js("return window.saved[0]")))]
    run = vi.simulate(state.system, initial=state.initial, periods=600, keep=100)
    assert [float(row["x1"]) for row in rows] == run.impacts["x1"].tolist()


def test_the_branch_is_laid_over_the_diagram(browser):
    state = PRESETS["Paper, Fig. 5(b): 1-1"].replace(
        branch=True, vary=Axis(name="drive_frequency", low=1.78, high=1.84)
    )
    browser.open(state.to_query())
    for lines in ("stable", "unstable"):
        browser.wait(f"Bokeh.documents[0].get_model_by_name('{lines}').data.xs.length > 0")
    assert browser.complaints() == []


@pytest.mark.parametrize("width", [1000, 1250, 1440])
def test_nothing_lies_over_anything_in_a_window_of_any_width(window, width):
    with window.of_width(width):
        window.wait(
            """(() => {
              const box = (name) => Bokeh.index.find_one_by_id(
                Bokeh.documents[0].get_model_by_name(name).id).el.getBoundingClientRect()
              const play = box("playing"), next = box("history-figure")
              const tall = ["impact-figure", "stroboscopic-figure", "diagram-figure"]
              return play.width > 40 && (play.right < next.left || play.bottom < next.top)
                && tall.every((name) => box(name).height > 140 && box(name).width > 120)
                && document.documentElement.scrollWidth <= window.innerWidth
            })()"""
        )


def test_the_key_of_a_branch_wraps(window):
    with window.of_width(1400):
        window.wait(
            f"""(() => {{
              {KEY}
              const words = [...key.shadowRoot.querySelectorAll(".key")]
              const right = key.getBoundingClientRect().right
              return words.length == {2 + len(_MARKERS)}
                && words.every((each) => each.getBoundingClientRect().right <= right)
                && document.documentElement.scrollWidth <= window.innerWidth
            }})()"""
        )


@pytest.mark.parametrize("width", [1000, 1280, 1440])
def test_no_canvas_lies_over_a_field_of_its_map(window, width):
    lowest = {"diagram": "start", "chart": "upward_high", "basins": "up_high"}
    with window.of_width(width):
        for shown, (name, field) in enumerate(lowest.items()):
            window.set("map", "active", shown)
            window.wait(
                f"""(() => {{
                  const view = (name) => Bokeh.index.find_one_by_id(
                    Bokeh.documents[0].get_model_by_name(name).id).el
                  const box = view("{field}").shadowRoot.querySelector(".bk-input")
                  const top = view("{name}-figure").getBoundingClientRect().top
                  return top > 0 && box.getBoundingClientRect().bottom <= top
                }})()"""
            )


def test_the_code_is_as_wide_as_the_page_and_the_button_says_what_it_does(window):
    window.set("code", "active", True)
    window.wait("Bokeh.documents[0].get_model_by_name('code-text').tags.length > 0")
    text = element(window, "code-text").shadow_root.find_element(By.CSS_SELECTOR, "pre")
    assert text.rect["width"] > 0.9 * WIDTH
    assert window.get("playing", "label") == "pause"
    window.set("playing", "active", False)
    assert window.get("playing", "label") == "play"


def test_copy_says_that_it_has_copied(window):
    window.set("code", "active", True)
    window.wait("Bokeh.documents[0].get_model_by_name('code-text').tags.length > 0")
    window.js(
        """
        const copy = Bokeh.documents[0].get_model_by_name("copy")
        window.labels = []
        copy.properties.label.change.connect(() => window.labels.push(copy.label))
        navigator.clipboard.writeText = async (text) => window.copied = text
        """
    )
    window.press("copy")
    window.wait("window.labels.join() == 'copied,copy'")
    assert window.js("return window.copied") == python_code(DEFAULT)


def test_dark_and_light(window):
    window.set("dark", "active", True)
    window.wait("window.location.search.includes('theme=dark')")
    color = "return getComputedStyle(arguments[0]).backgroundColor"
    assert window.js(color, element(window, "page")) == "rgb(16, 19, 22)"
    # Nothing is left of the light page, at the edge of no canvas.
    for name in ("machine", "history", "portrait", "impact", "stroboscopic", "diagram"):
        WebDriverWait(window.chrome, PATIENCE).until(
            lambda _, name=name: edges(window, f"{name}-figure").max() < 0.2
        )


def edges(window, figure):
    """Return the pixels at the top and the left of a figure, as it is seen."""
    place = "const {top, left} = arguments[0].getBoundingClientRect(); return [top, left]"
    top, left = map(round, window.js(place, element(window, figure)))
    seen = pyplot.imread(io.BytesIO(window.chrome.get_screenshot_as_png()))[..., :3]
    across, down = seen[top : top + 2, left : left + 50], seen[top : top + 50, left : left + 2]
    return np.array([across, down.swapaxes(0, 1)])


def test_the_signs_of_a_key_change_with_the_page(window):
    for dark, ink in ((False, "rgb(26, 30, 35)"), (True, "rgb(231, 234, 238)")):
        # As the server changes it with the theme, but for a key that it writes anew.
        window.set("page", "css_classes", ["dark" if dark else "light"])
        window.wait(
            f"""(() => {{
              {KEY}
              const signs = [...key.shadowRoot.querySelectorAll(".key span")].slice(2)
              return signs.length == {len(_MARKERS)}
                && signs.every((each) => getComputedStyle(each).color == "{ink}")
            }})()"""
        )


def actions(window, draw):
    """Do something at random, as an impatient user does."""
    numbers = (
        "friction",
        "gap",
        "restitution",
        "mass_ratio",
        "drive_frequency",
        "moment_amplitude",
    )
    kind = draw.choice(
        ("slide", "slide", "type", "choose", "map", "click", "zoom", "preset", "press")
    )
    if kind == "slide":
        name = draw.choice(numbers)
        low, high = window.several(f"{name}-slider", "start", "end")
        window.set(f"{name}-slider", "value", draw.uniform(low, high))
    elif kind == "type":
        text = draw.choice(("0.3", "1", "-1", "1e3", "nan", "x", "", "1e400", "0"))
        window.set(draw.choice((*numbers, "x1", "v1", "vary_low", "vary_high")), "value", text)
    elif kind == "choose":
        name, values = draw.choice(
            (
                ("law", ("poisson", "newton", "energetic", "paper")),
                ("contact", ("oblique", "direct")),
                ("value", [*OfSystem.values]),
                ("start", ("fresh", "forward", "backward")),
                ("vary", ("gap", "friction", "restitution", "phase", "drive_frequency")),
            )
        )
        window.set(name, "value", draw.choice(values))
    elif kind == "map":
        window.set("map", "active", draw.randrange(3))
    elif kind in ("click", "zoom"):
        figure = f"{OfSystem.maps[window.get('map', 'active')]}-figure"
        ends = (f"{axis}_range.{end}" for axis in "xy" for end in ("start", "end"))
        left, right, bottom, top = window.several(figure, *ends)
        place = [(draw.uniform(left, right), draw.uniform(bottom, top)) for _ in range(2)]
        if kind == "click":
            window.click(figure, *place[0])
        else:
            window.drag(figure, *place)
    elif kind == "preset":
        window.set("preset", "value", draw.choice([*PRESETS]))
    else:
        name = draw.choice(("branch", "code", "dark", "playing"))
        window.set(name, "active", not window.get(name, "active"))


def test_random_actions_leave_no_error(window):
    draw = random.Random(20041)
    for _ in range(sizes.either(40, 1000)):
        actions(window, draw)
    window.set("preset", "value", "choose a preset")
    window.set("preset", "value", "Paper, Fig. 5(a): 1-1")
    window.wait("Bokeh.documents[0].get_model_by_name('verdict').text.includes('>1-1<')")
