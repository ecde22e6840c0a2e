"""The reproduction: pages at print size that hold the computed data, files, and bad input."""

import json

import numpy as np
import pytest
from matplotlib.collections import PathCollection
from matplotlib.colors import to_rgba
from matplotlib.image import imread
from matplotlib.lines import Line2D

import vibroimpact as vi
from changed import with_columns
from han_jin_hu_2004 import (
    INITIAL,
    MOTIONS,
    TRANSITIONS,
    evidence,
    motions,
    reproduce,
    transitions,
)
from han_jin_hu_2004.layout import Page
from han_jin_hu_2004.motions import Shown
from han_jin_hu_2004.windows import Window, is_confirmed, period_windows

BY_ID = {transition.id: transition for transition in TRANSITIONS}


def texts(page) -> str:
    return "\n".join(text.get_text() for text in page.figure.findobj(match=is_text))


def is_text(artist) -> bool:
    return hasattr(artist, "get_text") and hasattr(artist, "get_fontsize")


def offsets(ax) -> np.ndarray:
    (points,) = [item for item in ax.collections if isinstance(item, PathCollection)]
    return np.asarray(points.get_offsets())


def test_transitions_are_those_of_the_captions():
    varied = {
        name: (s.friction, *s.damping, s.moment_amplitude, s.force_amplitude)
        for name, s in ((key, item.system) for key, item in BY_ID.items())
    }
    assert varied == {
        "4": (0.0, 0.0, 0.0, 1.0, 0.0),
        "7a": (0.0, 0.01, 0.01, 1.0, 0.5),
        "7b": (0.0, 0.1, 0.1, 1.0, 0.5),
        "7c": (0.0, 0.1, 0.1, 1.0, 1.5),
        "8a": (0.5, 0.0, 0.0, 1.0, 0.0),
        "8b": (0.4, 0.01, 0.01, 1.0, 0.5),
        "8c": (0.8, 0.01, 0.01, 1.0, 0.5),
    }


def test_a_page_of_diagrams_holds_both_sections():
    diagram = transitions.compute(BY_ID["7b"], 12, None)
    assert (diagram.parameter[0], diagram.parameter[-1]) == (0.2, 4.0)
    page = transitions.draw(7, [(BY_ID["7b"], diagram)], None)
    left, right = page.figure.get_axes() or page.figure.subfigs[0].get_axes()
    assert np.array_equal(offsets(left), np.column_stack([diagram.impact_parameter, diagram.x1]))
    assert np.array_equal(offsets(right)[:, 1], diagram.stroboscopic[:, 0])
    assert r"(b)  $\mu = 0$, $\zeta_1 = \zeta_2 = 0.1$, $f_1 = 1$, $f_2 = 0.5$" in texts(page)
    assert "last 100 of 600 drive periods, 12 frequencies" in texts(page)


def test_a_page_says_where_runs_stopped():
    diagram = transitions.compute(BY_ID["7c"], 12, None)
    status = diagram.status.astype("<U12")
    status[[0, 3, 4]] = ["painleve", "event_cap", "rest"]
    stopped = with_columns(diagram, status=status)
    page = transitions.draw(7, [(BY_ID["7c"], stopped)], "regime")
    # A motion at rest was carried to the end asked for.
    assert "grey rug: 1 runs ended by event_cap, 1 runs ended by painleve" in texts(page)
    assert "frictionless (100% of the impacts)" in texts(page)
    assert "right: states once per drive period, darker where they are denser" in texts(page)
    assert "grey rug" not in texts(transitions.draw(7, [(BY_ID["7c"], diagram)], "regime"))


def test_a_diagram_with_chatter_has_its_time_in_contact_beneath():
    diagram = transitions.compute(BY_ID["7c"], 39, None)
    assert diagram.n[:3].tolist() == [-1, -1, -1]
    page = transitions.draw(7, [(BY_ID["7c"], diagram)], None)
    section, stroboscopic, whole, low = page.figure.subfigs[0].get_axes()
    assert np.array_equal(offsets(section)[:, 1], diagram.x1)
    assert np.array_equal(offsets(stroboscopic)[:, 1], diagram.stroboscopic[:, 0])
    for ax in (whole, low):
        frequency, fraction = ax.get_lines()[0].get_data()
        assert np.array_equal(frequency, diagram.parameter)
        assert np.array_equal(fraction, diagram.contact_fraction)
    assert whole.get_xlim() == section.get_xlim()
    assert 0.45 < low.get_xlim()[1] < 1.0
    assert "complete chatter" in texts(page)
    without = transitions.compute(BY_ID["7b"], 12, None)
    assert "chatter" not in texts(transitions.draw(7, [(BY_ID["7b"], without)], None))


def test_the_low_frequencies_are_enlarged_with_an_example():
    coarse = transitions.compute(BY_ID["7c"], 4, None)
    (part,) = transitions.enlarge(BY_ID["7c"], coarse, 20, None)
    assert (part.diagram.parameter[0], part.diagram.parameter[-1]) == (0.2, 0.6)
    assert part.example.label == "1-inf"
    page = transitions.draw_enlargements(BY_ID["7c"], [part], "regime")
    assert r"$\omega = 0.3$: 1-$\infty$, 18.0% of the time in contact" in texts(page)
    assert "contact, sliding" in texts(page)
    *_, beneath, motion = page.figure.subfigs[0].get_axes()
    assert np.array_equal(beneath.get_lines()[0].get_ydata(), part.diagram.contact_fraction)
    assert motion.get_xlim()[1] == pytest.approx(600 * part.example.system.drive_period)


def fake_diagram(m, n):
    """A diagram as far as period_windows looks at it."""

    class Periods:
        parameter = np.linspace(0.0, 1.0, len(m))

    Periods.m, Periods.n = np.array(m), np.array(n)
    return Periods


def test_windows_are_runs_of_one_longer_period():
    m = [1, 3, 3, 3, 1, 5, 5, 5, 5, 5, 0, 4, 4, 4, 4, 6]
    n = [1, 2, 2, 2, 1, 5, 5, 4, 4, 4, 0, 0, 0, 0, 0, 3]
    x = np.linspace(0.0, 1.0, 16)
    assert set(period_windows(fake_diagram(m, n))) == {
        Window(x[1], x[3], 3, 2),
        Window(x[7], x[9], 5, 4),
    }
    assert period_windows(fake_diagram(m, n), at_least=4) == []


def test_windows_come_widest_first_and_widen_to_both_sides():
    m = [3, 3, 3, 1, 4, 4, 4, 4, 4]
    first, second = period_windows(fake_diagram(m, m))
    assert (first.m, second.m) == (4, 3)
    assert Window(1.0, 2.0, 3, 3).widened(0.25) == (0.75, 2.25)


def test_windows_of_one_period_are_joined_over_a_short_gap():
    m = [4, 4, 4, 4, 4, 4, 0, 4, 4, 4, 0, 0, 0, 0, 0, 0, 4, 4, 4]
    x = np.linspace(0.0, 1.0, len(m))
    assert period_windows(fake_diagram(m, m)) == [
        Window(x[0], x[9], 4, 4),
        Window(x[16], x[18], 4, 4),
    ]


@pytest.fixture(scope="module")
def undamped() -> vi.Diagram:
    return vi.bifurcation_diagram(
        BY_ID["4"].system,
        initial=INITIAL,
        # Long enough for the transients, chaotic at some of these, to have settled.
        periods=3000,
        drive_frequency=np.linspace(2.52, 2.60, 9),
    )


def test_a_window_is_confirmed_by_a_longer_run(undamped):
    assert is_confirmed(Window(2.55, 2.57, 8, 6), undamped)
    # A spiral into a 1-1 focus: its angle nearly repeats after three periods.
    assert not is_confirmed(Window(1.2295, 1.2325, 3, 3), undamped)


def test_an_enlarged_window_is_computed_on_a_finer_grid(undamped):
    windows = [window for window in period_windows(undamped) if is_confirmed(window, undamped)]
    assert (8, 6) in {(window.m, window.n) for window in windows}
    parts = transitions.enlarge(BY_ID["4"], undamped, 200, None)
    assert len(parts) == min(len(windows), transitions.MOST_WINDOWS)
    for part in parts:
        grid = part.diagram.parameter
        assert grid[0] < part.window.low < part.window.high < grid[-1]
        assert len(grid) == 20
    page = transitions.draw_enlargements(BY_ID["4"], parts, None)
    shown, found = len(parts), len(windows)
    which = f"all {found} that Fig. 4 has" if shown == found else f"the {shown} widest of {found}"
    assert which in texts(page)
    assert "8-6" in texts(page)
    (panels,) = (part.get_axes() for part in page.figure.subfigs)
    page.figure.draw_without_rendering()
    sizes = {tuple(round(side, 6) for side in ax.get_position().size) for ax in panels}
    assert len(sizes) == 1
    for ax, part in zip(panels, parts, strict=False):
        low, high = ax.get_ylim()
        x1 = part.diagram.x1
        own = (part.diagram.m == part.window.m) & (part.diagram.n == part.window.n)
        of_motion = x1[np.repeat(own, np.diff(part.diagram.offset))]
        assert low < of_motion.min() < of_motion.max() < high
        beyond = np.count_nonzero((x1 < low) | (x1 > high))
        assert beyond < 0.006 * len(x1)
        assert ("outside the frame" in ax.get_title(loc="left")) == (beyond > 0)


def test_far_impacts_do_not_flatten_the_branches_but_are_counted(undamped):
    (part, *_) = transitions.enlarge(BY_ID["4"], undamped, 200, None)
    x1 = np.array(part.diagram.x1)
    x1[[3, 70]] = [40.0, -40.0]
    far = transitions.Enlargement(with_columns(part.diagram, x1=x1), part.window, 1)
    page = transitions.draw_enlargements(BY_ID["4"], [far], None)
    ax, *_ = page.figure.subfigs[0].get_axes()
    assert -5.0 < ax.get_ylim()[0] < ax.get_ylim()[1] < 5.0
    low, high = ax.get_ylim()
    beyond = np.count_nonzero((x1 < low) | (x1 > high))
    assert beyond >= 2
    assert ax.get_title(loc="left").endswith(f"; {beyond} impacts outside the frame")


def test_periods_are_named_in_order():
    known = [(1, 4), (1, 12), (1, -1), (2, 3)]
    many = [pair for pair in reversed(known) for _ in range(3)]
    wide = transitions.compute(BY_ID["7c"], len(many), None)
    m, n = (np.array(column) for column in zip(*many, strict=True))
    part = transitions.Enlargement(with_columns(wide, m=m, n=n), None, 0)
    page = transitions.draw_enlargements(BY_ID["7c"], [part], None)
    assert r"periodic motions: 1-4, 1-12, 1-$\infty$, 2-3" in texts(page)


def test_the_enlarged_range_names_the_periods_found_in_it():
    coarse = transitions.compute(BY_ID["8a"], 4, None)
    (part, *_) = transitions.enlarge(BY_ID["8a"], coarse, 160, None)
    assert (part.window, len(part.diagram)) == (None, 40)
    assert (part.diagram.parameter[0], part.diagram.parameter[-1]) == (1.5, 1.6)
    page = transitions.draw_enlargements(BY_ID["8a"], [part], "regime")
    assert np.count_nonzero((part.diagram.m == 1) & (part.diagram.n == 1)) >= 3
    assert "40 frequencies; periodic motions: 1-1" in texts(page)


def shown(name, **more) -> Shown:
    (motion,) = [motion for motion in MOTIONS if motion.id == name]
    run = vi.simulate(motion.system, initial=INITIAL, periods=600, keep=100)
    return Shown(motion, run, **more)


def test_both_coexisting_motions_are_drawn():
    (motion,) = [motion for motion in MOTIONS if motion.id == "9(3)"]
    other = evidence.coexisting(motion.system, "4-5", starts=evidence.random_starts(3))
    page = motions.draw(9, [shown("9(3)", other=other)], "regime")
    assert len(page.figure.subfigs) == 2
    assert "paper: 4-5; found: 6-7" in texts(page)
    assert "found: 4-5" in texts(page)
    first, second = (part.get_axes()[0] for part in page.figure.subfigs)
    assert first.get_xlim()[1] == pytest.approx(600 * motion.system.drive_period)
    assert second.get_xlim()[1] == pytest.approx(other.run.final_state.time)


def test_coexisting_chaos_is_drawn_over_the_same_times():
    (motion,) = [motion for motion in MOTIONS if motion.id == "9(4)"]
    item = motions.simulated(motion)
    assert item.beside.run.initial == item.other.run.initial
    page = motions.draw(9, [item], None)
    assert "paper: chaotic; found: 154-77" in texts(page)
    assert "found: chaotic" in texts(page)
    first, second, third = (part.get_axes() for part in page.figure.subfigs)
    assert first[0].get_xlim() == second[0].get_xlim()
    for section, drawn in ((first[1], item), (second[1], item.beside)):
        small, large = (len(dots.get_offsets()) for dots in section.collections[:2])
        assert (small, large) == (len(drawn.long_run.impacts), len(drawn.run.impacts))
    # The periodic one draws 77 points again and again, the chaotic one many more.
    distinct = [
        len({tuple(point) for point in np.round(axes[1].collections[0].get_offsets()[-2000:], 6)})
        for axes in (first, second)
    ]
    assert distinct[0] < 160
    assert distinct[1] > 1000
    # Neighbours of the periodic one come nearer, those of the chaotic one go away.
    periodic, chaotic = (np.log10(line.get_ydata()) for line in third[0].lines)
    assert periodic[-1] < -4
    assert chaotic[-1] > 4
    # A return map that is not one of a periodic motion, which would have a single point.
    returns = third[1].collections[0].get_offsets()
    assert len(np.unique(np.round(returns, 6), axis=0)) > 100


def legend_of(page):
    (legend,) = page.figure.legends
    return {
        text.get_text(): line
        for text, line in zip(legend.get_texts(), legend.get_lines(), strict=True)
    }


@pytest.mark.parametrize("color", [None, "regime"])
def test_a_body_is_one_line_of_the_legend(color):
    page = motions.draw(5, [shown("5b")], color)
    entries = legend_of(page)
    pendulum = r"pendulum: left $\sin x_1-\delta$, right $x_1,\ \dot x_1$"
    oscillator = r"oscillator: left $x_2$, right $x_2,\ \dot x_2$"
    marks = {"impact"} if color is None else {"frictionless"}
    assert set(entries) == {r"$\cos\omega t$", pendulum, oscillator} | marks
    for body in (pendulum, oscillator):
        drawn = [
            line
            for ax in page.figure.subfigs[0].get_axes()
            for line in ax.get_lines()
            if line.get_label() == body
        ]
        assert len(drawn) == 2
        assert {line.get_color() for line in drawn} == {entries[body].get_color()}
    assert entries[pendulum].get_color() != entries[oscillator].get_color()


@pytest.mark.parametrize("color", [None, "regime"])
def test_the_legend_says_which_impacts_a_section_shows(color):
    item = shown("9(2)")
    longer = vi.simulate(item.motion.system, initial=INITIAL, periods=1000, keep=400)
    page = motions.draw(9, [Shown(item.motion, item.run, longer)], color)
    large, small = (
        "right, large: impacts of drive periods 501 to 600",
        "right, small: impacts of drive periods 601 to 1,000",
    )
    entries = legend_of(page)
    assert entries[large].get_markersize() > entries[small].get_markersize()
    if color is None:
        _, section = page.figure.subfigs[0].get_axes()
        for name, dots, run in (
            (small, section.collections[0], longer),
            (large, section.collections[1], item.run),
        ):
            assert len(dots.get_offsets()) == len(run.impacts)
            assert to_rgba(entries[name].get_color()) == tuple(dots.get_facecolor()[0])


def test_sporadic_impacts_are_drawn_from_the_start():
    item = shown("10")
    long_run = vi.simulate(item.motion.system, initial=INITIAL, periods=600)
    page = motions.draw_sporadic(Shown(item.motion, item.run, long_run), None)
    history, zoom = page.figure.subfigs[0].get_axes()
    assert history.get_xlim() == (0.0, 400.0)
    low, high = zoom.get_xlim()
    assert low < long_run.impacts["time"][0] < high
    assert "9 impacts within 600 drive periods" in texts(page)
    with pytest.raises(ValueError, match="long run"):
        motions.draw_sporadic(item, None)


@pytest.mark.parametrize("text", ["short", "an entry of some width", 25 * "wide "])
def test_a_legend_fits_on_its_page(text):
    with vi.plot.publication_style():
        page = Page("", 1, 120.0)
        page.row("", columns=1)
        page.legend([Line2D([], [], label=f"{text} {number}") for number in range(13)])
        page.figure.draw_without_rendering()
        (legend,) = page.figure.legends
        box, paper = legend.get_window_extent(), page.figure.bbox
    assert paper.x0 <= box.x0 < box.x1 <= paper.x1
    assert len(legend.get_texts()) == 13


def test_reproduce_writes_pages_of_print_size_and_the_claims(tmp_path, capsys):
    out = tmp_path / "new" / "figures"
    result = reproduce(out, figures=[4, 5], frequencies=8, formats=("png", "pdf"))
    # Without friction every impact is of one regime: nothing to colour.
    pages = ["fig4", "fig5"]
    written = [f"{page}.{suffix}" for page in pages for suffix in ("png", "pdf")]
    assert [path.name for path in result.files] == [
        *written,
        "claims.json",
        "claims.md",
        "index.md",
    ]
    assert all(path.is_file() for path in result.files)
    assert imread(out / "fig5.png").shape[1] == pytest.approx(180 / 25.4 * 300, abs=1)
    assert (out / "fig5.pdf").read_bytes().startswith(b"%PDF")
    stored = json.loads((out / "claims.json").read_text(encoding="utf-8"))
    assert [claim["id"] for claim in stored] == ["5a", "5b", "5c"]
    assert [claim.id for claim in result.claims] == ["5a", "5b", "5c"]
    assert "# The paper's named motions" in (out / "claims.md").read_text(encoding="utf-8")
    report = capsys.readouterr()
    assert report.out == ""
    assert "figure 4: no window of period m > 2 on this grid" in report.err


def test_figure_7_comes_with_the_claim_of_its_low_frequencies(tmp_path):
    result = reproduce(tmp_path, figures=[7], frequencies=8, progress=False)
    pages = ["fig7", "fig7c-enlarged"]
    assert [path.stem for path in result.files] == [*pages, "claims", "claims", "index"]
    (claim,) = result.claims
    assert (claim.id, claim.verdict) == ("7c-low", "refuted")
    assert claim.decided_by.startswith("drive periods in which a complete chatter ends: 100 of 100")
    page = (tmp_path / "claims.md").read_text(encoding="utf-8")
    assert "## Fig. 7(c), low frequencies: refuted" in page


def test_a_figure_with_several_regimes_is_also_coloured_by_them(tmp_path):
    result = reproduce(tmp_path, figures=[8, 9], frequencies=8, progress=False)
    names = {path.stem for path in result.files}
    assert {"fig8", "fig8-regimes", "fig9", "fig9-regimes"} <= names
    index = (tmp_path / "index.md").read_text(encoding="utf-8")
    assert "| [fig9](fig9.png) | [fig9-regimes](fig9-regimes.png) | four motions" in index
    assert {stem for stem in names if f"[{stem}]({stem}.png)" in index} == names - {
        "claims",
        "index",
    }


@pytest.mark.parametrize("processes", [1, 2])
def test_reproduce_counts_its_parts(tmp_path, capsys, processes):
    reproduce(tmp_path, figures=[5, 6], processes=processes)
    first, *lines = capsys.readouterr().err.splitlines()
    assert first.startswith(f"2 parts, {processes} at a time")
    assert [line.partition(" s ")[2] for line in lines] == ["(1 of 2)", "(2 of 2)"]
    assert {line.partition(":")[0] for line in lines} == {"figure 5", "figure 6"}


def test_reproduce_can_be_silent(tmp_path, capsys):
    reproduce(tmp_path, figures=[5], progress=False)
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"figures": [1, 4]}, r"figures = \[1\]: allowed are 2, 3, 4, 5, 6, 7, 8, 9, 10"),
        ({"formats": ["gif"]}, r"formats = \['gif'\]: allowed are png, pdf, svg"),
        ({"frequencies": 1}, "frequencies = 1: allowed is an integer >= 2"),
        ({"processes": 0}, "processes = 0: allowed is an integer >= 1"),
    ],
)
def test_bad_input_is_named_before_anything_is_written(tmp_path, arguments, message):
    with pytest.raises(vi.ParameterError, match=message):
        reproduce(tmp_path / "out", **arguments)
    assert not (tmp_path / "out").exists()
