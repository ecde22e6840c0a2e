"""The figure of basins: every cell in the colour of its attractor, and why others have none."""

import dataclasses

import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_hex, to_rgba
from matplotlib.figure import Figure

import vibroimpact as vi
from vibroimpact.sweeps import STATUS_NAMES


@pytest.fixture(scope="module")
def basins() -> vi.Basins:
    system = vi.System(
        mass_ratio=0.6,
        frequency_ratio=2,
        restitution=0.8,
        gap=0.5,
        friction=0.5,
        moment_amplitude=1,
        drive_frequency=1.5752,
    )
    return vi.basins(system, x1=np.linspace(-1.2, 0.8, 16), v1=np.linspace(-2.5, 2.5, 12))


@pytest.fixture
def ax():
    return Figure().subplots()


def mesh(ax) -> QuadMesh:
    (found,) = (artist for artist in ax.collections if isinstance(artist, QuadMesh))
    return found


def colors(ax, shape) -> np.ndarray:
    """Colour of each cell as drawn, in the order (first axis, second axis); "" where none."""
    drawn = mesh(ax)
    values = np.ma.masked_array(drawn.get_array()).reshape(shape[::-1]).T
    flat = np.ma.getdata(values).ravel()
    hexes = np.array([to_hex(drawn.cmap(drawn.norm(value))) for value in flat])
    return np.where(np.ma.getmaskarray(values).ravel(), "", hexes).reshape(shape)


def texts(ax) -> list[str]:
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_every_cell_has_the_colour_of_its_attractor(basins, ax):
    assert vi.plot.basins(basins, ax=ax) is ax
    palette = [to_hex(color) for color in vi.plot.BASIN_COLORS]
    expected = np.where(
        basins.attractor >= 0, np.array(palette)[np.maximum(basins.attractor, 0)], ""
    )
    assert np.array_equal(colors(ax, basins.attractor.shape), expected)
    corners = mesh(ax).get_coordinates()
    centers = 0.25 * (corners[1:, 1:] + corners[:-1, 1:] + corners[1:, :-1] + corners[:-1, :-1])
    assert np.allclose(centers[0, :, 0], basins.axes["x1"])
    assert np.allclose(centers[:, 0, 1], basins.axes["v1"])


def test_the_legend_names_attractors_with_shares_and_reasons(basins, ax):
    vi.plot.basins(basins, sections=True, ax=ax)
    shares = [f"{100 * share:.3g} %" for share in basins.shares]
    assert texts(ax) == [f"4-5, {shares[0]}", f"6-7, {shares[1]}", "bodies overlap"]
    assert ax.patch.get_hatch()
    assert (ax.get_xlabel(), ax.get_ylabel()) == (
        "position $x_1$ of body 1",
        r"velocity $\dot x_1$ of body 1",
    )


def test_sections_are_marked_where_they_are(basins, ax):
    vi.plot.basins(basins, sections=True, ax=ax)
    marked = [np.column_stack(line.get_data()) for line in ax.lines]
    for points, attractor in zip(marked, basins.attractors, strict=True):
        assert np.array_equal(points, attractor.sections[:, :2])
    assert len({line.get_marker() for line in ax.lines}) == 2
    without = Figure().subplots()
    vi.plot.basins(basins, ax=without)
    assert not without.lines
    # The axes show the grid, wherever the sections lie.
    assert without.get_xlim() == ax.get_xlim()


def title(ax) -> list[str]:
    """The lines above the entries of the legend."""
    return ax.get_legend().get_title().get_text().splitlines()


def test_the_legend_says_what_the_marks_are(basins, ax):
    starts = r"starts with $x_2$ = 0, $\dot x_2$ = 0"
    marks = r"marks: the attractors once per drive period, whatever their $x_2$, $\dot x_2$"
    vi.plot.basins(basins, sections=True, ax=ax)
    assert title(ax) == [starts, marks]
    without = Figure().subplots()
    vi.plot.basins(basins, ax=without)
    assert title(without) == [starts]


def test_the_legend_is_silent_on_marks_that_lie_outside(basins, ax):
    far = [
        dataclasses.replace(each, sections=each.sections + np.array((10.0, 0, 0, 0)))
        for each in basins.attractors
    ]
    vi.plot.basins(dataclasses.replace(basins, attractors=tuple(far)), sections=True, ax=ax)
    assert ax.lines
    assert len(title(ax)) == 1


def test_the_legend_fits_the_page_of_a_new_figure(basins):
    try:
        figure = vi.plot.basins(basins).figure
        figure.canvas.draw()
        box = figure.axes[0].get_legend().get_window_extent()
        assert 0 <= box.x0 < box.x1 <= figure.bbox.x1
        assert 0 <= box.y0 < box.y1 <= figure.bbox.y1
    finally:
        pyplot.close("all")


def test_other_reasons_are_grey_and_named(basins, ax):
    status, attractor = basins.status_code.copy(), basins.attractor.copy()
    status[0], attractor[0] = STATUS_NAMES.index("event_cap"), -1
    status[1], attractor[1] = STATUS_NAMES.index("unresolved"), -1
    status[2], attractor[2] = STATUS_NAMES.index("pending"), -1
    changed = dataclasses.replace(basins, status_code=status, attractor=attractor)
    vi.plot.basins(changed, ax=ax)
    drawn = colors(ax, attractor.shape)
    greys = {drawn[0, 0], drawn[1, 0]}
    assert len(greys) == 2
    assert all(len(set(to_rgba(grey)[:3])) == 1 for grey in greys)
    assert set(drawn[2]) == {""}
    assert {"event cap", "unresolved"} <= set(texts(ax))


def test_axes_in_any_order_and_of_one_value(basins, ax):
    falling = dataclasses.replace(
        basins,
        axes=basins.axes | {"x1": basins.axes["x1"][::-1].copy()},
        attractor=basins.attractor[::-1].copy(),
        status_code=basins.status_code[::-1].copy(),
    )
    vi.plot.basins(basins, sections=True, ax=ax)
    other = Figure().subplots()
    vi.plot.basins(falling, sections=True, ax=other)
    shape = basins.attractor.shape
    assert np.array_equal(colors(other, shape), colors(ax, shape))
    single = dataclasses.replace(
        basins,
        axes=basins.axes | {"v1": np.array([0.5])},
        attractor=basins.attractor[:, :1].copy(),
        status_code=basins.status_code[:, :1].copy(),
    )
    third = Figure().subplots()
    vi.plot.basins(single, sections=True, ax=third)
    assert third.get_ylim() == (0.0, 1.0)


def test_without_attractors_and_without_axes(basins):
    nothing = dataclasses.replace(
        basins,
        attractors=(),
        attractor=np.full_like(basins.attractor, -1),
        status_code=np.zeros_like(basins.status_code),
    )
    try:
        ax = vi.plot.basins(nothing)
        assert ax.get_legend() is None
    finally:
        pyplot.close("all")
