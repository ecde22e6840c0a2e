"""The sketch of the machine: it is drawn, names every quantity, legibly, and is to scale."""

import inspect
import itertools
import math
import runpy
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import rgb_to_hsv, to_rgb
from matplotlib.image import imread
from matplotlib.patches import Circle, Rectangle
from matplotlib.text import Annotation

import repository
import vibroimpact as vi

ROOT = repository.root()
SCRIPT = ROOT / "examples" / "schematic.py"
PICTURE = ROOT / "docs" / "images" / "schematic.png"
DRIVE = r"\cos(\Omega T + \varphi)$"
# What the left panel writes for each argument of `vi.System.from_physical`.
PHYSICAL = {
    "pendulum_mass": "$M_1$",
    "oscillator_mass": "$M_2$",
    "length": "$l$",
    "torsional_stiffness": "$K_1$",
    "stiffness": "$K_2$",
    "torsional_damping": "$C_1$",
    "damping": "$C_2$",
    "moment_amplitude": rf"$f_{{10}}\,{DRIVE}",
    "force_amplitude": rf"$f_{{20}}\,{DRIVE}",
    "drive_frequency": rf"$f_{{10}}\,{DRIVE}",
    "phase": rf"$f_{{10}}\,{DRIVE}",
    "gap": r"$\Delta$",
    "friction": r"$\mu,\ r$",
    "restitution": r"$\mu,\ r$",
}
# How the right panel writes the coordinates, their velocities and the impulses.
IMPACT = ["$x_1$", r"$\sin x_1$", "$x_2$", r"$\delta$", "$P$", r"$\mu P$"]
IMPACT += [r"$\dot x_1$", r"$\dot x_1\, \cos x_1$", r"$\dot x_1\, \sin x_1$", r"$\dot x_2$"]
# Arguments that choose a model, and are nothing that could be drawn; loads that act where the drive
# does.
NOT_DRAWN = {"contact", "law", "static_moment", "static_force"}


@pytest.fixture(scope="module")
def script() -> SimpleNamespace:
    return SimpleNamespace(**runpy.run_path(str(SCRIPT)))


@pytest.fixture(scope="module")
def figure(script):
    with vi.plot.publication_style():
        figure = script.draw()
        figure.canvas.draw()
    return figure


def labels(ax) -> list[Annotation]:
    """Everything that is written in a panel; arrows are annotations without text."""
    return [text for text in ax.texts if text.get_text()]


def test_the_script_draws_it(script, tmp_path, capsys):
    out = tmp_path / "sketch.png"
    script.main(["--out", str(out)])
    assert capsys.readouterr().out == f"{out}\n"
    kept = imread(PICTURE)
    assert imread(out).shape == kept.shape
    # Sharp at the 840 pixels that a README has, also on screens with two pixels in each of them.
    assert kept.shape[1] >= 1680
    assert 5_000 < PICTURE.stat().st_size <= 150_000


def test_every_physical_quantity_is_named(figure):
    arguments = set(inspect.signature(vi.System.from_physical).parameters)
    assert set(PHYSICAL) == arguments - NOT_DRAWN
    written = {text.get_text() for text in labels(figure.axes[0])}
    assert written == {*PHYSICAL.values(), r"$\theta$", "$X$"}


def test_an_impact_has_its_names(figure):
    written = [text.get_text() for text in labels(figure.axes[1])]
    assert sorted(written) == sorted([*IMPACT, "$M_2$"])


def test_no_label_covers_another_or_leaves_the_page(figure):
    boxes = [text.get_window_extent() for ax in figure.axes for text in labels(ax)]
    boxes += [text.get_window_extent() for text in figure.texts]
    assert len(boxes) >= 26
    for one, other in itertools.combinations(boxes, 2):
        assert not one.overlaps(other)
    for box in boxes:
        assert figure.bbox.x0 <= box.x0 < box.x1 <= figure.bbox.x1
        assert figure.bbox.y0 <= box.y0 < box.y1 <= figure.bbox.y1


def test_no_label_lies_on_something_drawn(script):
    with vi.plot.publication_style():
        figure = script.draw()
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        names = [text for ax in figure.axes for text in labels(ax)]
        boxes = [(text.get_text(), text.get_window_extent()) for text in names]
        for text in names:
            text.set_visible(False)
        canvas.draw()
    pixels = np.asarray(canvas.buffer_rgba())[::-1]
    for text, box in boxes:
        behind = pixels[int(box.y0) : math.ceil(box.y1), int(box.x0) : math.ceil(box.x1)]
        assert behind.size
        assert (behind == behind[0, 0]).all(), f"{text} is not on a plain ground"


def test_lengths_are_to_scale(figure, script):
    for ax, angle in zip(figure.axes, (0.0, script.ANGLE), strict=True):
        (body,) = (patch for patch in ax.patches if isinstance(patch, Rectangle))
        tips = [
            patch.center
            for patch in ax.patches
            if isinstance(patch, Circle) and patch.radius == script.BALL
        ]
        tip = (math.sin(angle), -math.cos(angle))
        assert any(math.dist(tip, each) < 1e-12 for each in tips)
        # At rest the gap is delta; in the impact the ball touches the face.
        gap = body.get_x() - (tip[0] + script.BALL)
        assert gap == pytest.approx(0.0 if angle else script.GAP, abs=1e-12)
        assert body.get_y() < tip[1] < body.get_y() + body.get_height()
        size = ax.get_window_extent()
        across, up = size.width / abs(ax.viewLim.width), size.height / abs(ax.viewLim.height)
        assert across == pytest.approx(up, rel=1e-9)


def hue(text: Annotation) -> float:
    """The hue of a label's colour, in degrees."""
    return 360.0 * rgb_to_hsv(to_rgb(text.get_color()))[0]


def test_colours_are_what_captions_call_them(figure):
    names = {text.get_text(): text for text in labels(figure.axes[1])}
    for impulse in ("$P$", r"$\mu P$"):
        assert 20.0 < hue(names[impulse]) < 45.0  # orange; red is at 0, yellow at 60
    for velocity in (r"$\dot x_1$", r"$\dot x_2$"):
        assert 190.0 < hue(names[velocity]) < 250.0  # blue
    for page in ("README.md", "docs/theory.md", "docs/index.md"):
        text = (ROOT / page).read_text(encoding="utf-8")
        caption = text.split("images/schematic.png)", 1)[1][:2000].lower()
        assert "blue" in caption
        assert "orange" in caption


@pytest.mark.parametrize(
    "page", ["README.md", "docs/index.md", "docs/theory.md", "docs/howto/machine.md"]
)
def test_pages_show_it(page):
    assert "images/schematic.png)" in (ROOT / page).read_text(encoding="utf-8")


def test_the_command_is_there():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    kept = PICTURE.relative_to(ROOT).as_posix()
    assert f"python examples/schematic.py --out {kept}\n" in makefile
    assert "| `make schematic` |" in (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")


def test_a_bad_argument_is_refused(script, capsys):
    with pytest.raises(SystemExit) as caught:
        script.main(["--fast"])
    assert caught.value.code == 2
    assert "--fast" in capsys.readouterr().err
