"""Plots mark sustained contact where it is, and complete chatter where a diagram has it."""

from itertools import pairwise

import numpy as np
import pytest
from matplotlib.collections import PathCollection, PolyCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

import vibroimpact as vi
from changed import with_columns
from references import reference, scene_initial, scene_system
from systems import LOW
from vibroimpact import EventKind
from vibroimpact.plot.marks import ContactSpan, contact_spans
from vibroimpact.plot.style import CHATTER_COLOR

SCENE = reference("contact.json")["friction_stick_slip"]
HISTORIES = (vi.plot.time_history, vi.plot.gap_history, vi.plot.displacement_history)


@pytest.fixture(scope="module")
def run() -> vi.Run:
    system = scene_system({"phase": "0"} | SCENE)
    return vi.simulate(system, initial=scene_initial(SCENE), periods=4)


@pytest.fixture
def ax():
    return Figure().subplots()


def bands(ax) -> dict[str, PolyCollection]:
    found = [item for item in ax.collections if isinstance(item, PolyCollection)]
    return {item.get_gid(): item for item in found}


def intervals(band: PolyCollection) -> list[tuple[float, float]]:
    paths = band.get_paths()
    return [(path.vertices[:, 0].min(), path.vertices[:, 0].max()) for path in paths]


def expected(run: vi.Run, mode: str, start: float) -> list[tuple[float, float]]:
    """The phases of one mode that begin after a time, from the events; slides are joined."""
    rows = run.contacts[run.contacts["kind"] != EventKind.CHATTER]
    found: list[tuple[float, float]] = []
    for row, after in pairwise(rows):
        name = {EventKind.STICK: "stick", EventKind.RELEASE: ""}.get(row["kind"], "slide")
        if name == mode and row["time"] > start:
            joins = bool(found) and found[-1][1] == row["time"]
            begin = found.pop()[0] if joins else row["time"]
            found.append((begin, after["time"]))
    return found


@pytest.mark.parametrize("draw", HISTORIES, ids=lambda draw: draw.__name__)
def test_histories_have_bands_where_contact_lasts(run, ax, draw):
    draw(run, periods=2, ax=ax)
    start = 2 * run.system.drive_period
    assert set(bands(ax)) == {"contact-slide", "contact-stick"}
    for mode in ("slide", "stick"):
        wanted = expected(run, mode, start)
        assert len(wanted) == (4 if mode == "slide" else 2)
        assert intervals(bands(ax)[f"contact-{mode}"]) == wanted
    slide, stick = bands(ax)["contact-slide"], bands(ax)["contact-stick"]
    assert stick.get_hatch()
    assert not slide.get_hatch()
    # Darker in grey too.
    luminance = [0.2126, 0.7152, 0.0722]
    assert stick.get_facecolor()[0, :3] @ luminance < slide.get_facecolor()[0, :3] @ luminance
    labels = ax.get_legend_handles_labels()[1]
    assert labels[:2] == ["contact, sliding", "contact, sticking"]
    assert ax.get_xlim() == pytest.approx((start, run.final_state.time))


def test_without_lasting_contact_nothing_is_marked(system, initial, ax):
    flying = vi.simulate(system, initial=initial, periods=10)
    assert len(flying.contacts) == 0
    for draw in (*HISTORIES, vi.plot.phase_portrait, vi.plot.contact_force):
        draw(flying, ax=ax)
    assert bands(ax) == {}
    assert not any("contact" in label for label in ax.get_legend_handles_labels()[1])


def test_spans_are_cut_at_the_window_and_add_up_to_the_time_in_contact(run):
    whole = contact_spans(run, (0.0, run.final_state.time))
    total = sum(span.end - span.start for span in whole)
    assert total == pytest.approx(run.time_in_contact, rel=1e-13)
    first = whole[0]
    middle = 0.5 * (first.start + first.end)
    cut = contact_spans(run, (middle, middle + 0.1))
    assert cut == [ContactSpan(middle, middle + 0.1, "slide")]
    assert contact_spans(run, (0.0, 1.0)) == []


@pytest.mark.parametrize("kind", [EventKind.SLIDE_POSITIVE, EventKind.STICK])
def test_a_window_that_begins_in_contact_is_marked_from_its_start(run, kind):
    row = int(np.flatnonzero(run.contacts["kind"] == kind)[-1])
    begin, end = run.contacts["time"][row : row + 2]
    first = vi.simulate(run.system, initial=run.initial, time=0.5 * (begin + end))
    more = first.resume(time=10.0)
    span = contact_spans(more, (more.kept_from, more.final_state.time))[0]
    mode = "stick" if kind == EventKind.STICK else "slide"
    assert span == ContactSpan(more.kept_from, more.contacts["time"][0], mode)


def test_a_portrait_marks_the_path_in_contact(run, ax):
    vi.plot.phase_portrait(run, periods=1, points_per_period=500, ax=ax)
    lines = {line.get_label(): line for line in ax.get_lines()}
    x, v = np.array(lines["contact, sliding"].get_data())
    known = ~np.isnan(x)
    curve = np.array(lines[r"$x_1,\ \dot x_1$"].get_data()).T.tolist()
    assert all([*point] in curve for point in zip(x[known], v[known], strict=True))
    # Two slides around one stick: the gaps between them are not drawn over.
    assert np.count_nonzero(~known) == 2
    x, v = np.array(lines["contact, sticking"].get_data())
    stick = run.contacts[run.contacts["kind"] == EventKind.STICK][-1]
    assert np.nanmax(np.abs(x - stick["x1"])) < 1e-15
    # The last point is the first of the slide that follows: at rest to rounding.
    assert np.nanmax(np.abs(v)) < 1e-15
    assert lines["contact, sticking"].get_linestyle() == "None"
    # The second body's marks are in the drawing, not in the legend again.
    assert ax.get_legend_handles_labels()[1].count("contact, sliding") == 1


def test_contact_force_is_that_of_the_run_and_jumps_at_its_events(run, ax):
    assert vi.plot.contact_force(run, periods=2, ax=ax) is ax
    lines = {line.get_label(): np.array(line.get_data()) for line in ax.get_lines()}
    time, normal = lines["normal, $p$"]
    forces = run.trajectory(time, forces=True)
    assert np.array_equal(normal, forces[:, 4])
    assert np.array_equal(lines["tangential"], [time, forces[:, 5]])
    for row in run.contacts[-4:]:
        (at,) = np.flatnonzero(time == row["time"])
        assert time[at] - time[at - 1] < 1e-12
        # The time is known to an ulp only.
        assert normal[at] == pytest.approx(row["normal_force"], abs=1e-12)
    begin = run.contacts[run.contacts["kind"] == EventKind.CHATTER][-1]["time"]
    (at,) = np.flatnonzero(time == begin)
    assert normal[at - 1] == 0.0 < normal[at]
    assert set(bands(ax)) >= {"contact-slide", "contact-stick"}
    assert ax.get_ylabel() == "contact force"


@pytest.fixture(scope="module")
def diagram() -> vi.Diagram:
    return vi.bifurcation_diagram(
        LOW,
        initial=(0.0, 0.5, 0.0, 0.0),
        periods=120,
        keep=20,
        drive_frequency=[0.25, 0.3, 0.5, 0.6],
    )


def points(ax) -> PathCollection:
    (found,) = [item for item in ax.collections if isinstance(item, PathCollection)]
    return found


@pytest.mark.parametrize("section", ["impact", "stroboscopic"])
def test_complete_chatter_has_a_colour_and_a_strip(diagram, ax, section):
    assert diagram.n.tolist()[:2] == [-1, -1]
    assert (diagram.n[2:] > 0).all()
    vi.plot.bifurcation(diagram, section=section, ax=ax)
    parameter = np.asarray(points(ax).get_offsets())[:, 0]
    colors = [to_hex(color).upper() for color in points(ax).get_facecolor()]
    assert colors == [CHATTER_COLOR if value < 0.4 else "#000000" for value in parameter]
    assert intervals(bands(ax)["complete-chatter"]) == [(0.25, 0.4)]
    assert [text.get_text() for text in ax.get_legend().get_texts()] == [
        r"complete chatter ($m$-$\infty$)"
    ]


def test_regimes_keep_their_colours_and_the_strip_stays(diagram, ax):
    vi.plot.bifurcation(diagram, color="regime", ax=ax)
    assert {to_hex(color) for color in points(ax).get_facecolor()} == {"#000000"}
    assert "complete-chatter" in bands(ax)
    styles = {style.color for style in vi.plot.REGIME_STYLES.values()}
    assert CHATTER_COLOR not in styles


def test_without_chatter_there_is_no_strip(diagram, ax):
    finite = with_columns(diagram, n=np.abs(diagram.n))
    vi.plot.bifurcation(finite, ax=ax)
    assert bands(ax) == {}
    assert ax.get_legend() is None
    assert vi.plot.chatter_handles(finite) == []


def test_the_part_of_time_in_contact_is_the_diagrams(diagram, ax):
    assert vi.plot.contact_fraction(diagram, ax=ax) is ax
    parameter, fraction = ax.get_lines()[0].get_data()
    assert np.array_equal(parameter, diagram.parameter)
    assert np.array_equal(fraction, diagram.contact_fraction)
    assert fraction[0] > 0.2
    assert (ax.get_xlabel(), ax.get_ylim()[0]) == (r"drive frequency $\omega$", 0.0)
