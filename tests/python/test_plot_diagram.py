"""Bifurcation plots show every point of the diagram once, in its colour, and what did not run."""

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PathCollection, PolyCollection
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure

import vibroimpact as vi
from changed import with_columns
from vibroimpact._core import PARAMETERS
from vibroimpact.plot.axis_names import PARAMETER_SYMBOLS
from vibroimpact.plot.labels import LABEL_STYLES, UNRESOLVED, label_handles
from vibroimpact.plot.style import legend_above


@pytest.fixture(scope="module")
def diagram() -> vi.Diagram:
    system = vi.System(
        mass_ratio=0.6,
        frequency_ratio=2.0,
        restitution=0.8,
        gap=0.5,
        drive_frequency=1.0,
        moment_amplitude=1.0,
        friction=0.5,
    )
    return vi.bifurcation_diagram(
        system,
        initial=(0.0, 0.5, 0.0, 0.0),
        periods=60,
        keep=20,
        drive_frequency=np.linspace(1.4, 1.7, 16),
    )


@pytest.fixture
def ax():
    return Figure().subplots()


def points(ax) -> PathCollection:
    (found,) = [item for item in ax.collections if isinstance(item, PathCollection)]
    return found


def rugs(ax) -> list[PolyCollection]:
    return [item for item in ax.collections if isinstance(item, PolyCollection)]


def by_row(*columns) -> np.ndarray:
    table = np.column_stack(columns)
    return table[np.lexsort(table.T)]


def test_black_points_are_the_impacts(diagram, ax):
    assert vi.plot.bifurcation(diagram, ax=ax) is ax
    drawn = np.asarray(points(ax).get_offsets())
    assert np.array_equal(drawn, np.column_stack([diagram.impact_parameter, diagram.x1]))
    assert points(ax).get_facecolor().tolist() == [[0.0, 0.0, 0.0, 1.0]]
    assert ax.get_xlabel() == r"drive frequency $\omega$"
    # No point lies on the frame.
    assert ax.get_xlim() == pytest.approx((1.397, 1.703))
    assert points(ax).get_rasterized()


def test_stroboscopic_points_are_the_first_state(diagram, ax):
    vi.plot.bifurcation(diagram, section="stroboscopic", ax=ax)
    expected = np.column_stack([diagram.stroboscopic_parameter, diagram.stroboscopic[:, 0]])
    assert np.array_equal(np.asarray(points(ax).get_offsets()), expected)


def test_each_impact_has_the_colour_of_its_regime(diagram, ax):
    assert len(set(diagram.regime.tolist())) >= 3
    vi.plot.bifurcation(diagram, color="regime", ax=ax)
    colors = [style.color for style in vi.plot.REGIME_STYLES.values()]
    drawn = [colors.index(to_hex(rgba).upper()) for rgba in points(ax).get_facecolor()]
    xy = np.asarray(points(ax).get_offsets())
    expected = by_row(diagram.impact_parameter, diagram.x1, diagram.regime)
    assert np.array_equal(by_row(xy[:, 0], xy[:, 1], drawn), expected)


def test_no_regime_is_drawn_as_a_block_over_another(diagram, ax):
    vi.plot.bifurcation(diagram, color="regime", ax=ax)
    drawn = points(ax).get_facecolor()
    changes = np.count_nonzero((np.diff(drawn, axis=0) != 0).any(axis=1))
    shares = np.bincount(diagram.regime) / len(diagram.regime)
    # In a random order neighbours differ with this probability; a sorted order has a few changes.
    expected = (1.0 - np.sum(shares**2)) * len(drawn)
    assert changes > 0.8 * expected


def test_regimes_present_are_named_in_the_legend(diagram, ax):
    vi.plot.bifurcation(diagram, color="regime", ax=ax)
    named = [text.get_text() for text in ax.get_legend().get_texts()]
    present = [vi.plot.REGIME_STYLES[code].text for code in np.unique(diagram.regime)]
    assert named == present


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"section": "stroboscopic", "color": "regime"}, "only impacts have a regime"),
        ({"section": "poincare"}, "section must be"),
        ({"color": "red"}, "color must be"),
    ],
)
def test_bad_arguments_are_named(diagram, ax, arguments, message):
    with pytest.raises(ValueError, match=message):
        vi.plot.bifurcation(diagram, ax=ax, **arguments)


def test_completed_runs_leave_no_rug_and_no_legend(diagram, ax):
    whole = with_columns(diagram, status=np.full(16, "completed"))
    vi.plot.bifurcation(whole, ax=ax)
    assert rugs(ax) == []
    assert ax.get_legend() is None


def test_runs_that_stopped_are_marked_where_they_are(diagram, ax):
    status = np.full(16, "completed", dtype="<U12")
    status[[0, 1, 2, 7]] = "jammed"
    status[15] = "event_cap"
    vi.plot.bifurcation(with_columns(diagram, status=status), ax=ax)
    capped, jammed = rugs(ax)
    half = 0.5 * (diagram.parameter[1] - diagram.parameter[0])
    value = diagram.parameter
    spans = [(path.vertices[:, 0].min(), path.vertices[:, 0].max()) for path in jammed.get_paths()]
    expected = [(value[0], value[2] + half), (value[7] - half, value[7] + half)]
    assert np.array(spans) == pytest.approx(np.array(expected), abs=1e-12)
    (capped_path,) = capped.get_paths()
    assert capped_path.vertices[:, 0].min() == pytest.approx(value[15] - half, abs=1e-12)
    assert capped_path.vertices[:, 1].max() <= jammed.get_paths()[0].vertices[:, 1].min()
    assert [text.get_text() for text in ax.get_legend().get_texts()] == [
        "event_cap: 1 of 16 values",
        "jammed: 4 of 16 values",
    ]


def test_values_without_impact_are_marked_above_their_empty_columns(diagram, ax):
    free = vi.bifurcation_diagram(
        diagram.system.replace(pendulum_damping=0.1, oscillator_damping=0.1),
        initial=(0.0, 0.5, 0.0, 0.0),
        periods=60,
        keep=20,
        drive_frequency=[1.5, 1.6, 3.6, 3.8],
    )
    assert (np.diff(free.offset) == 0).tolist() == [False, False, True, True]
    vi.plot.bifurcation(free, ax=ax)
    (strip,) = rugs(ax)
    (path,) = strip.get_paths()
    assert strip.get_gid() == "no-impact"
    assert (path.vertices[:, 0].min(), path.vertices[:, 0].max()) == pytest.approx((2.6, 3.8))
    text = "no impact in the kept drive periods"
    assert [entry.get_text() for entry in ax.get_legend().get_texts()] == [text]
    assert [handle.get_label() for handle in vi.plot.no_impact_handles(free)] == [text]
    both = vi.bifurcation_diagram(
        free.system.replace(moment_amplitude=0.05),
        initial=(0, 0, 0, 0),
        periods=20,
        keep=5,
        start=["forward", "backward"],
        drive_frequency=[3.8, 4.0],
    )
    (handle,) = vi.plot.no_impact_handles(both)
    assert handle.get_label() == f"{text}, on any branch"
    # Of a run that stopped early nobody knows.
    assert vi.plot.no_impact_handles(with_columns(free, status=np.full(4, "jammed"))) == []
    assert vi.plot.no_impact_handles(diagram) == []


@pytest.mark.parametrize(
    ("phase", "section_phase", "text"),
    [(0.0, 0.0, "0"), (1.0, 0.0, "1"), (0.25, 0.5, "0.75"), (6.0, 1.0, "0.7168")],
)
def test_the_stroboscopic_section_names_its_drive_phase(ax, diagram, phase, section_phase, text):
    shifted = vi.bifurcation_diagram(
        diagram.system.replace(phase=phase),
        initial=(0.0, 0.5, 0.0, 0.0),
        periods=4,
        keep=2,
        section_phase=section_phase,
        drive_frequency=[1.4, 1.5],
    )
    vi.plot.bifurcation(shifted, section="stroboscopic", ax=ax)
    assert ax.get_ylabel() == rf"position $x_1$ of body 1 once per drive period, at $\psi = {text}$"


def test_a_section_over_the_phase_itself_is_named_by_its_symbol(ax, diagram):
    start = (0.0, 0.5, 0.0, 0.0)
    over = vi.bifurcation_diagram(
        diagram.system, initial=start, periods=4, keep=2, phase=[0.0, 1.0]
    )
    vi.plot.bifurcation(over, section="stroboscopic", value="v2", ax=ax)
    assert (
        ax.get_ylabel()
        == r"velocity $\dot x_2$ of body 2 once per drive period, at $\psi = \varphi$"
    )


def test_styles_are_those_of_the_regimes_and_all_differ():
    styles = vi.plot.REGIME_STYLES
    assert list(styles) == list(vi.Regime)
    for of in ("color", "marker", "text"):
        assert len({getattr(style, of) for style in styles.values()}) == len(vi.Regime)


def test_every_parameter_has_its_symbol():
    assert set(PARAMETER_SYMBOLS) == set(PARAMETERS)


def test_without_axes_a_new_figure_is_made_and_not_shown(diagram, monkeypatch):
    monkeypatch.setattr(pyplot, "show", lambda *_, **__: pytest.fail("a plot called show"))
    with mpl.rc_context({"backend": "Agg"}):
        before = pyplot.get_fignums()
        ax = vi.plot.bifurcation(diagram)
        assert len(pyplot.get_fignums()) == len(before) + 1
        pyplot.close(ax.figure)


def test_publication_style_ends_with_its_block():
    before = mpl.rcParams["font.size"]
    with vi.plot.publication_style():
        assert mpl.rcParams["font.size"] == vi.plot.PUBLICATION["font.size"] != before
    assert mpl.rcParams["font.size"] == before


@pytest.mark.parametrize("dots_per_inch", [72, 100, 150])
def test_points_of_the_usual_size_are_seen_at_every_resolution(diagram, dots_per_inch):
    figure = Figure(dpi=dots_per_inch)
    canvas = FigureCanvasAgg(figure)
    ax = vi.plot.bifurcation(diagram, legend=False, ax=figure.subplots())
    ax.set_axis_off()
    canvas.draw()
    pixels = np.asarray(canvas.buffer_rgba())[..., :3]
    assert (pixels.min(axis=2) < 128).sum() >= len(np.unique(diagram.x1.round(2)))


def area(diagram, **options):
    ax = Figure().subplots()
    vi.plot.bifurcation(diagram, ax=ax, **options)
    (size,) = points(ax).get_sizes()
    return size


def test_points_are_smaller_the_more_of_them_are_apart(diagram):
    system = diagram.system
    sizes = []
    for number in (5, 40, 200, 400):
        values = np.linspace(1.6, 2.2, number)
        many = vi.bifurcation_diagram(
            system, initial=(0, 0.5, 0, 0), periods=200, keep=50, drive_frequency=values
        )
        sizes.append(area(many))
    assert sizes == sorted(sizes, reverse=True)
    assert 1.0 <= sizes[-1] < sizes[0] <= 12.0
    assert area(diagram, size=0.25) == 0.25


def test_points_that_a_periodic_motion_repeats_count_once(diagram):
    options = {"initial": (0, 0.5, 0, 0), "periods": 400, "drive_frequency": [2.1, 2.15, 2.2]}
    few, many = (vi.bifurcation_diagram(diagram.system, keep=k, **options) for k in (5, 200))
    assert len(many.x1) > 30 * len(few.x1)
    assert area(few) == area(many) == 12.0


def test_without_friction_the_legend_says_that_all_impacts_have_one_regime(diagram, ax):
    smooth = vi.bifurcation_diagram(
        diagram.system.replace(friction=0.0),
        initial=(0, 0.5, 0, 0),
        periods=200,
        keep=10,
        drive_frequency=[1.8, 1.85],
    )
    vi.plot.bifurcation(smooth, color="regime", ax=ax)
    (text,) = ax.get_legend().get_texts()
    assert text.get_text() == "all impacts: frictionless"


def test_points_of_every_label_are_seen_on_white():
    """At least 1.4 to 1 in luminance (WCAG 2, relative luminance), unlike the areas of charts."""
    for style in LABEL_STYLES:
        linear = [
            c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4
            for c in to_rgb(style.point_color)
        ]
        assert 1.05 / (np.dot([0.2126, 0.7152, 0.0722], linear) + 0.05) > 1.4, style


def test_motions_without_impact_have_a_colour_of_their_own(diagram, ax):
    system = diagram.system.replace(gap=2.0, pendulum_damping=0.1, oscillator_damping=0.1)
    free = vi.bifurcation_diagram(
        system, initial=(0.0, 0.5, 0.0, 0.0), periods=300, keep=40, drive_frequency=[1.1, 1.2, 2.3]
    )
    vi.plot.bifurcation(free, section="stroboscopic", color="label", ax=ax)
    assert set(np.asarray(free.label)) == {"1-0"}
    drawn = {to_hex(color) for color in points(ax).get_facecolors()}
    named = {to_hex(handle.get_facecolor()) for handle in ax.get_legend().legend_handles}
    assert drawn == named == {"#8f00ff"}


@pytest.mark.parametrize(("width", "rows"), [(6.4, 1), (3.4, 2)])
def test_the_legend_stands_in_as_few_rows_as_fit(diagram, width, rows):
    figure = Figure(figsize=(width, 4.8), layout="constrained")
    with vi.plot.publication_style():
        ax = vi.plot.bifurcation(diagram, color="regime", ax=figure.subplots())
    figure.draw_without_rendering()
    legend = ax.get_legend()
    assert len(legend.get_texts()) == 3
    bottoms = {round(handle.get_window_extent().y0) for handle in legend.legend_handles}
    assert len(bottoms) == rows
    assert legend.get_window_extent().x1 <= figure.bbox.x1


def test_a_legend_of_many_labels_stays_within_the_default_figure():
    figure = pyplot.figure(layout="constrained")
    ax = figure.add_subplot()
    legend_above(ax, label_handles(range(UNRESOLVED + 1)), columns=4)
    figure.draw_without_rendering()
    assert ax.get_legend().get_window_extent().x1 <= figure.bbox.x1
    assert ax.get_window_extent().width > 0.8 * figure.bbox.width
    pyplot.close(figure)
