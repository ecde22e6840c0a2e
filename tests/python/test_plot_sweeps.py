"""Plots of charts and of Lyapunov exponents, and of every observable and branch of a diagram."""

from itertools import combinations

import numpy as np
import pytest
from matplotlib.collections import FillBetweenPolyCollection, PolyCollection, QuadMesh
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure

import vibroimpact as vi
from changed import with_columns
from vibroimpact.plot import labels
from vibroimpact.plot.axis_names import AT_IMPACT, ONCE_A_PERIOD

START = (0.0, 0.5, 0.0, 0.0)
FREQUENCIES = np.array([1.8, 1.2, 1.3, 1.5])  # not in order: a chart sorts them
MOMENTS = np.array([0.9, 1.0, 1.2])


@pytest.fixture
def ax():
    return Figure().subplots()


@pytest.fixture(scope="module")
def undamped() -> vi.System:
    return vi.System(
        mass_ratio=0.6,
        frequency_ratio=2.0,
        restitution=0.8,
        gap=0.5,
        drive_frequency=1.25,
        moment_amplitude=1.0,
    )


@pytest.fixture(scope="module")
def chart(undamped) -> vi.Chart:
    return vi.chart(
        undamped,
        initial=START,
        periods=60,
        keep=20,
        drive_frequency=FREQUENCIES,
        moment_amplitude=MOMENTS,
    )


@pytest.fixture(scope="module")
def diagram(undamped) -> vi.Diagram:
    return vi.bifurcation_diagram(
        undamped.replace(friction=0.5),
        initial=[START, (0.1, -0.5, 0.0, 0.0)],
        start=["forward", "backward"],
        periods=60,
        keep=20,
        exponents=True,
        drive_frequency=np.linspace(1.4, 1.7, 7),
    )


@pytest.fixture(scope="module")
def region(undamped) -> vi.StabilityRegion:
    motion = vi.simulate(undamped, initial=START, periods=600, keep=100).refine()
    plane = {"drive_frequency": (1.1, 1.6), "moment_amplitude": (0.8, 1.3)}
    return vi.stability_region(motion, max_points=60, **plane)


def drawn(ax) -> np.ma.MaskedArray:
    """The values of the one colour mesh, with the horizontal axis first."""
    (mesh,) = [item for item in ax.collections if isinstance(item, QuadMesh)]
    return np.ma.asarray(mesh.get_array()).T


def hatched(ax) -> dict[str, int]:
    """Number of cells under each hatch."""
    return {
        item.get_hatch(): len(item.get_paths())
        for item in ax.collections
        if isinstance(item, PolyCollection) and item.get_hatch()
    }


def legend(ax) -> list[str]:
    return [text.get_text() for text in ax.get_legend().get_texts()]


def all_kinds(chart):
    """A chart in which every cell has another kind of label, and what they are."""
    m = np.array([1, 2, 3, 4, 5, 6, 7, 8, 9, 2, 3, 0])
    n = np.array([1, 2, 3, 4, 5, 6, 7, 8, 9, -1, 0, 0])
    motion = np.array([*["periodic"] * 11, "chaotic"])
    shape = (4, 3)
    return with_columns(
        chart,
        m=m.reshape(shape),
        n=n.reshape(shape),
        motion=motion.reshape(shape),
        status=np.full(shape, "completed"),
    )


def test_each_kind_of_label_has_its_own_colour(chart, ax):
    vi.plot.chart(all_kinds(chart), ax=ax)
    order = np.argsort(FREQUENCIES)
    # Cells in the order of the list: eight periods, more, chatter, no impact, chaotic.
    expected = np.array([*range(11), labels.CHAOTIC]).reshape(4, 3)[order]
    assert drawn(ax).tolist() == expected.tolist()
    assert legend(ax) == [
        *(f"$m = {m}$" for m in range(1, 9)),
        "$m > 8$",
        r"chatter ($n = \infty$)",
        "no impact ($n = 0$)",
        "chaotic",
    ]
    faces = [to_hex(patch.get_facecolor()).upper() for patch in ax.get_legend().get_patches()]
    assert faces == [vi.plot.LABEL_STYLES[code].color for code in [*range(11), labels.CHAOTIC]]


def test_axes_are_those_of_the_chart_in_its_order(chart, ax):
    assert vi.plot.chart(chart, ax=ax) is ax
    assert (ax.get_xlabel(), ax.get_ylabel()) == (
        r"drive frequency $\omega$",
        "moment amplitude $f_1$",
    )
    # Cells reach half way to their neighbours, and as far beyond the last.
    assert ax.get_xlim() == pytest.approx((1.15, 1.95), abs=1e-12)
    assert ax.get_ylim() == pytest.approx((0.85, 1.3), abs=1e-12)
    (mesh,) = [item for item in ax.collections if isinstance(item, QuadMesh)]
    edges = mesh.get_coordinates()[0, :, 0].tolist()
    assert edges == pytest.approx([1.15, 1.25, 1.4, 1.65, 1.95], abs=1e-12)
    assert mesh.get_rasterized()


def test_cells_without_label_are_hatched_and_named(chart, ax):
    status = np.full((4, 3), "completed", dtype="<U12")
    status[0, :2], status[1, 0] = "event_cap", "pending"
    motion = np.full((4, 3), "periodic", dtype="<U12")
    m = np.ones((4, 3), np.int64)
    motion[2, 0], m[2, 0] = "unresolved", 0
    changed = with_columns(chart, status=status, motion=motion, m=m, n=m)
    vi.plot.chart(changed, ax=ax)
    assert legend(ax) == ["$m = 1$", "unresolved", "pending", "event cap"]
    assert sorted(hatched(ax).values()) == [1, 1, 2]
    assert np.ma.count_masked(drawn(ax)) == 4
    assert len(hatched(ax)) == 3  # a hatch for each reason
    ax.figure.draw_without_rendering()  # colours are settled then
    assert all(
        to_hex(face) == "#ffffff"
        for item in ax.collections
        if item.get_hatch()
        for face in item.get_facecolor()
    )


def test_the_palette_is_told_apart_under_colour_vision_deficiencies():
    # Machado, Oliveira & Fernandes (2009), severity 1: protanopia, deuteranopia, tritanopia.
    protan = [0.152286, 1.052583, -0.204868, 0.114503, 0.786281, 0.099216]
    protan += [-0.003882, -0.048116, 1.051998]
    deutan = [0.367322, 0.860646, -0.227968, 0.280085, 0.672501, 0.047413]
    deutan += [-0.011820, 0.042940, 0.968881]
    tritan = [1.255528, -0.076749, -0.178779, -0.078411, 0.930809, 0.147602]
    tritan += [0.004733, 0.691367, 0.303900]
    colors = linear(np.array([to_rgb(style.color) for style in vi.plot.LABEL_STYLES]))
    for kind in (np.eye(3), protan, deutan, tritan):
        seen = cielab(np.clip(colors @ np.reshape(kind, (3, 3)).T, 0.0, 1.0))
        assert min(np.linalg.norm(a - b) for a, b in combinations(seen, 2)) > 25.0


def linear(srgb):
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def cielab(rgb):
    to_xyz = [[0.4125, 0.3576, 0.1804], [0.2127, 0.7152, 0.0722], [0.0193, 0.1192, 0.9503]]
    xyz = rgb @ np.transpose(to_xyz) / [0.9505, 1.0, 1.0888]
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16.0 / 116.0)
    x, y, z = f.T
    return np.column_stack([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def test_exponents_have_a_scale_with_zero_in_the_middle(chart, ax):
    exponent = np.linspace(-3.0, 0.2, 12).reshape(4, 3)
    exponent[1, 1], exponent[2, 2] = -np.inf, np.nan
    changed = with_columns(chart, largest_exponent=exponent)
    vi.plot.chart(changed, color="exponent", ax=ax)
    values = drawn(ax)
    expected = np.ma.masked_invalid(np.maximum(exponent, -1e300))[np.argsort(FREQUENCIES)]
    assert np.array_equal(values.mask, np.isnan(exponent)[np.argsort(FREQUENCIES)])
    assert np.ma.allequal(values, expected)
    (mesh,) = [item for item in ax.collections if isinstance(item, QuadMesh)]
    assert (mesh.norm.vmin, mesh.norm.vmax) == (-0.2, 0.2)
    below, zero, above = mesh.to_rgba([-1e300, 0.0, 0.2])
    assert below[2] > below[0]
    assert above[0] > above[2]
    assert zero[:3] == pytest.approx([1.0, 1.0, 1.0], abs=0.05)
    (bar,) = [other for other in ax.figure.axes if other is not ax]
    assert bar.get_ylabel() == r"largest Lyapunov exponent $\lambda_1$"
    assert legend(ax) == ["no exponent"]
    assert list(hatched(ax).values()) == [1]


@pytest.mark.parametrize(
    ("exponents", "limit"), [([-3.0, -0.5], 3.0), ([0.0, 0.0], 1.0), ([np.nan, -np.inf], 1.0)]
)
def test_the_scale_fits_charts_without_chaos(chart, ax, exponents, limit):
    changed = with_columns(chart, largest_exponent=np.resize(exponents, (4, 3)))
    vi.plot.chart(changed, color="exponent", ax=ax)
    (mesh,) = [item for item in ax.collections if isinstance(item, QuadMesh)]
    assert (mesh.norm.vmin, mesh.norm.vmax) == (-limit, limit)


def test_borders_lie_over_a_chart(chart, region, ax):
    vi.plot.chart(chart, ax=ax)
    limits = ax.get_xlim(), ax.get_ylim()
    cells = legend(ax)
    vi.plot.bifurcation_curves(region, halo=True, legend=False, ax=ax)
    assert (ax.get_xlim(), ax.get_ylim()) == limits
    assert legend(ax) == cells
    thick = [
        line
        for line in ax.lines
        if line.get_gid().endswith("-stability") and not line.get_gid().startswith("halo")
    ]
    assert len(thick) == len(region.arcs) > 0
    for line, arc in zip(thick, sorted(region.arcs, key=kinds_in_order), strict=True):
        assert line.get_gid() == f"{arc.kind}-stability"
        halo = ax.lines[[*ax.lines].index(line) - 1]
        assert halo.get_gid() == f"halo-{line.get_gid()}"
        assert halo.get_linewidth() > line.get_linewidth()
        assert halo.get_zorder() < line.get_zorder()
        inside = arc.bounds_stability
        assert np.array_equal(np.column_stack(line.get_data())[inside], arc.values[inside])


def kinds_in_order(arc) -> int:
    return [*vi.plot.BIFURCATION_STYLES].index(arc.kind)


def test_a_region_among_curves_gives_its_arcs(region, ax):
    vi.plot.bifurcation_curves([region, region.arcs[0]], ax=ax)
    assert len([line for line in ax.lines if line.get_gid() in vi.plot.BIFURCATION_STYLES]) == (
        len(region.arcs) + 1
    )
    assert not any(line.get_gid().startswith("halo") for line in ax.lines)


def test_borders_of_other_parameters_are_refused(undamped, region, ax):
    swapped = vi.chart(
        undamped,
        initial=START,
        periods=8,
        keep=4,
        exponents=False,
        moment_amplitude=MOMENTS,
        drive_frequency=FREQUENCIES,
    )
    vi.plot.chart(swapped, ax=ax)
    with pytest.raises(
        vi.ParameterError, match=r"allowed: curves over moment .* and drive frequency"
    ):
        vi.plot.bifurcation_curves(region, ax=ax)


@pytest.fixture(scope="module")
def spectrum(undamped) -> vi.LyapunovSpectrum:
    chaotic = undamped.replace(drive_frequency=1.545, friction=0.5)
    found = vi.lyapunov_spectrum(chaotic, initial=START, periods=300)
    assert isinstance(found, vi.LyapunovSpectrum)
    return found


def test_convergence_of_a_spectrum(spectrum, ax):
    assert vi.plot.lyapunov(spectrum, ax=ax) is ax
    lines = ax.lines[:4]
    for k, line in enumerate(lines):
        assert np.array_equal(line.get_xdata(), spectrum.history_time)
        assert np.array_equal(line.get_ydata(), spectrum.history[:, k])
    half = spectrum.error[:, None] * np.sqrt(spectrum.time / spectrum.history_time)
    for k, band in enumerate(error_bands(ax)):
        assert band[0] == pytest.approx(spectrum.exponents[k] - half[k])
        assert band[1] == pytest.approx(spectrum.exponents[k] + half[k])
    assert len(error_bands(ax)) == 4
    first = legend(ax)[0]
    assert first.startswith(r"$\lambda_1$ $= 0.0")
    assert r"\pm" in first
    assert ax.lines[-1].get_ydata() == [0.0, 0.0]


def test_exponents_that_do_not_exist_are_named(undamped, ax):
    plastic = undamped.replace(restitution=0.0)
    found = vi.lyapunov_spectrum(plastic, initial=START, periods=100)
    assert np.isneginf(found.exponents).any()
    vi.plot.lyapunov(found, ax=ax)
    assert legend(ax)[3] == r"$\lambda_4$ $= -\infty$"
    assert np.isnan(ax.lines[3].get_ydata()).all()


def test_exponents_along_a_parameter(undamped, ax):
    values = np.array([1.6, 1.5, 1.55])
    found = vi.lyapunov_spectrum(
        undamped.replace(friction=0.5), initial=START, periods=200, drive_frequency=values
    )
    vi.plot.lyapunov(found, ax=ax)
    order = np.argsort(values)
    for k in range(4):
        assert np.array_equal(ax.lines[k].get_xdata(), values[order])
        assert np.array_equal(ax.lines[k].get_ydata(), found.exponents[order, k])
        band = error_bands(ax)[k]
        assert band[0] == pytest.approx(found.exponents[order, k] - found.error[order, k])
        assert band[1] == pytest.approx(found.exponents[order, k] + found.error[order, k])
    assert legend(ax) == [rf"$\lambda_{k}$" for k in (1, 2, 3, 4)]
    assert (ax.get_xlabel(), ax.get_ylabel()) == (
        r"drive frequency $\omega$",
        r"Lyapunov exponents $\lambda$",
    )


def error_bands(ax) -> list[np.ndarray]:
    """Lower and upper edge of each band between curves."""
    found = []
    for item in ax.collections:
        if isinstance(item, FillBetweenPolyCollection):
            corners = item.get_paths()[0].vertices
            n = (len(corners) - 3) // 2
            found.append(np.array([corners[1 : n + 1, 1], corners[n + 2 : -1, 1][::-1]]))
    return found


def test_exponents_of_each_branch_of_a_diagram(diagram, ax):
    vi.plot.lyapunov(diagram, ax=ax)
    exponents = diagram.largest_exponent.reshape(4, 7)
    for k in range(4):
        expected = np.where(np.isneginf(exponents[k]), np.nan, exponents[k])
        assert np.array_equal(ax.lines[k].get_ydata(), expected, equal_nan=True)
    assert legend(ax) == [
        "forward from (0, 0.5, 0, 0)",
        "forward from (0.1, -0.5, 0, 0)",
        "backward from (0, 0.5, 0, 0)",
        "backward from (0.1, -0.5, 0, 0)",
    ]
    assert len({line.get_color() for line in ax.lines[:4]}) == 4


def test_exponents_that_are_minus_infinity_are_marked_at_the_bottom(diagram, ax):
    exponents = np.zeros((4, 7))
    exponents[1, 2:4] = -np.inf
    vi.plot.lyapunov(with_columns(diagram, largest_exponent=exponents), ax=ax)
    (marks,) = [item for item in ax.collections if item.get_gid() == "minus-infinity-1"]
    (path,) = marks.get_paths()
    step = diagram.values[1] - diagram.values[0]
    edges = path.vertices[:, 0].min(), path.vertices[:, 0].max()
    assert edges == pytest.approx((diagram.values[2] - step / 2, diagram.values[3] + step / 2))
    assert np.isnan(ax.lines[1].get_ydata()).sum() == 2


@pytest.mark.parametrize("value", AT_IMPACT)
def test_every_observable_of_the_impact_section_is_drawn(diagram, ax, value):
    vi.plot.bifurcation(diagram, value=value, color="branch", ax=ax)
    points = np.asarray(ax.collections[0].get_offsets())
    expected = np.column_stack([diagram.impact_parameter, getattr(diagram, value)])
    assert sorted(points.tolist()) == sorted(expected.tolist())
    assert ax.get_ylabel() == AT_IMPACT[value]


@pytest.mark.parametrize(("column", "value"), [*enumerate(ONCE_A_PERIOD)])
def test_every_state_of_the_stroboscopic_section_is_drawn(diagram, ax, column, value):
    vi.plot.bifurcation(diagram, section="stroboscopic", value=value, ax=ax)
    points = np.asarray(ax.collections[0].get_offsets())
    expected = [*zip(diagram.stroboscopic_parameter, diagram.stroboscopic[:, column], strict=True)]
    assert sorted(map(tuple, points)) == sorted(expected)
    assert ax.get_ylabel() == ONCE_A_PERIOD[value]


def test_branches_have_colours_and_names(diagram, ax):
    vi.plot.bifurcation(diagram, ax=ax)
    points = ax.collections[0]
    drawn = {
        (float(x), float(y), to_hex(rgba).upper())
        for (x, y), rgba in zip(points.get_offsets(), points.get_facecolor(), strict=True)
    }
    colors = [vi.plot.diagram.branch_color(k) for k in range(4)]
    branch = np.repeat(diagram.branch, np.diff(diagram.offset))
    expected = {
        (x, y, colors[k])
        for x, y, k in zip(diagram.impact_parameter, diagram.x1, branch, strict=True)
    }
    assert drawn == expected
    assert legend(ax)[:4] == vi.plot.diagram.branch_names(diagram)


def test_points_have_the_colours_of_their_labels(diagram, ax):
    vi.plot.bifurcation(diagram, color="label", ax=ax)
    codes = np.repeat(labels.label_codes(diagram).ravel(), np.diff(diagram.offset))
    palette = [labels.label_style(code).point_color for code in codes]
    points = ax.collections[0]
    drawn = [to_hex(rgba).upper() for rgba in points.get_facecolor()]
    assert sorted(drawn) == sorted(to_hex(color).upper() for color in palette)
    assert len(set(drawn)) > 1
    assert legend(ax)[0] == labels.label_style(codes.min()).text


def test_a_value_is_marked_if_any_branch_ended_early_there(diagram, ax):
    status = np.full((4, 7), "completed", dtype="<U12")
    status[0, 2] = status[3, 2] = status[3, 3] = "jammed"
    vi.plot.bifurcation(with_columns(diagram, status=status), ax=ax)
    assert legend(ax)[-1] == "jammed: 2 of 7 values"
    (rug,) = [item for item in ax.collections if item.get_gid() == "status-jammed"]
    (path,) = rug.get_paths()
    half = 0.5 * (diagram.values[1] - diagram.values[0])
    ends = path.vertices[:, 0].min(), path.vertices[:, 0].max()
    assert ends == pytest.approx((diagram.values[2] - half, diagram.values[3] + half))


def test_contact_fractions_of_branches_are_lines_of_their_own(diagram, ax):
    vi.plot.contact_fraction(diagram, ax=ax)
    fractions = diagram.contact_fraction.reshape(4, 7)
    assert [line.get_ydata().tolist() for line in ax.lines] == fractions.tolist()
    assert all(np.array_equal(line.get_xdata(), diagram.values) for line in ax.lines)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda c, d: vi.plot.chart(d), "chart = "),
        (lambda c, d: vi.plot.chart(c, color="period"), "color = 'period'"),
        (lambda c, d: vi.plot.chart(c, color="exponent", limit=0.0), "limit = 0.0"),
        (lambda c, d: vi.plot.lyapunov(c), "drawn by plot.chart"),
        (lambda c, d: vi.plot.lyapunov(3), "result = 3"),
        (lambda c, d: vi.plot.bifurcation(d, value="x2"), "value must be one of x1, v1, v2"),
        (
            lambda c, d: vi.plot.bifurcation(d, section="stroboscopic", value="phase"),
            "not 'phase'",
        ),
    ],
)
def test_bad_input_is_named(chart, diagram, call, message):
    with pytest.raises(vi.ParameterError, match=message):
        call(chart, diagram)


def test_results_without_exponents_are_refused(undamped):
    plain = vi.chart(
        undamped,
        initial=START,
        periods=8,
        keep=4,
        exponents=False,
        drive_frequency=[1.2, 1.3],
        moment_amplitude=[1.0],
    )
    with pytest.raises(vi.ParameterError, match="without exponents"):
        vi.plot.chart(plain, color="exponent")
    diagram = vi.bifurcation_diagram(
        undamped, initial=START, periods=8, keep=4, drive_frequency=[1.2, 1.3]
    )
    with pytest.raises(vi.ParameterError, match="without exponents"):
        vi.plot.lyapunov(diagram)
