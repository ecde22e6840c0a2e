"""The sketch of a structure has its masses, springs, stops and loads, and gaps to scale."""

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, Rectangle
from matplotlib.text import Annotation

import vibroimpact as vi
from struck import BEAM, MIRRORED, MOVING, PRESSED
from vibroimpact.plot.style import GREEN, ORANGE, STOPS

# They meet each other, and the second one a wall.
PAIR = vi.Structure(
    [[1, 0], [0, 2]],
    [[2, -1], [-1, 1]],
    [vi.Stop([1, -1], 0.2, 0.7), vi.Stop([0, 1], 0.5, 0.8)],
    drive_amplitude=[1, 1j],
    drive_frequency=1.2,
)


@pytest.fixture
def ax():
    return Figure().subplots()


def springs(ax) -> int:
    return sum(each.get_gid() == "spring" for each in (*ax.get_lines(), *ax.patches))


def faces(ax, stop: int) -> list[float]:
    """Where the faces of a stop are, from the left."""
    lines = [each for each in ax.get_lines() if each.get_gid() == f"stop-{stop}"]
    assert all(to_rgb(each.get_color()) == to_rgb(STOPS[stop][0]) for each in lines)
    return sorted(float(each.get_xdata()[0]) for each in lines)


def pegs(ax) -> list[tuple[float, float]]:
    """Left and right side of what meets the walls."""
    found = [
        (each.get_x(), each.get_x() + each.get_width())
        for each in ax.patches
        if isinstance(each, Rectangle) and each.get_gid() == "peg"
    ]
    return sorted(found)


def blocks(ax) -> list[float]:
    return sorted(
        each.get_x() + 0.5 * each.get_width()
        for each in ax.patches
        if isinstance(each, Rectangle) and each.get_width() > 0.3
    )


def arrows(ax, color: str) -> list[tuple[float, float]]:
    """From where to where the arrows of a colour go along the line of motion."""
    found = [each for each in ax.texts if isinstance(each, Annotation)]
    return [
        (each.xyann[0], each.xy[0])
        for each in found
        if to_rgb(each.arrowprops["color"]) == to_rgb(color)
    ]


def wheels(ax) -> int:
    return sum(each.get_gid() == "wheel" for each in ax.patches)


def named(ax) -> list[str]:
    """What is named above the sketch."""
    legend = ax.get_legend()
    return [each.get_text() for each in legend.get_texts()] if legend.get_visible() else []


def texts(ax) -> list[str]:
    return [each.get_text() for each in ax.texts if each.get_text()]


def test_springs_are_the_entries_of_the_stiffness(ax):
    PAIR.plot(ax=ax)
    # Between the two, and from the first one to the frame: the second has k_11 = k_12 only.
    assert springs(ax) == 2
    assert blocks(ax) == [0.0, 1.0]
    assert {"$q_{0}$", "$q_{1}$", "0", "1"} <= {*texts(ax)}
    assert named(ax) == ["stop 0: gap 0.2", "stop 1: gap 0.5", "drive"]
    chain = 2.0 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1)
    for stiffness, count in (
        (chain, 5),  # three between neighbours, one at either end
        (chain + np.fliplr(np.diag([-1, 0, 0, -1])), 4),  # a ring: its last spring is an arc
        (np.diag([1.0, 0, 0, 0]), 1),
        (np.zeros((4, 4)), 0),
    ):
        other = Figure().subplots()
        vi.Structure(np.eye(4), stiffness, []).plot(ax=other)
        assert springs(other) == count
    ring = Figure().subplots()
    vi.Structure(np.eye(4), chain + np.fliplr(np.diag([-1, 0, 0, -1])), []).plot(ax=ring)
    assert sum(isinstance(each, FancyArrowPatch) for each in ring.patches) == 1


def test_springs_to_the_frame_lie_along_the_motion(ax):
    chain = 2.0 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1)
    chain[1, 1] += 1.0
    vi.Structure(np.eye(3), chain, [], damping=0.1 * np.eye(3)).plot(ax=ax)
    ends = [
        [(x[0], y[0]), (x[-1], y[-1])]
        for x, y in (line.get_data() for line in ax.get_lines() if line.get_gid() == "spring")
    ]
    assert all(start[1] == end[1] for start, end in ends)
    # Beside both ends of the row, and above the block between.
    assert min(x for pair in ends for x, _ in pair) < -0.5
    assert max(x for pair in ends for x, _ in pair) > 2.5
    assert sorted({y > 0.2 for pair in ends for _, y in pair}) == [False, True]
    assert "damping is not drawn" in texts(ax)


def test_what_meets_has_the_colour_of_its_stop(ax):
    MIRRORED.plot(ax=ax)
    (peg,) = pegs(ax)
    for number, side in ((0, peg[1]), (1, peg[0])):
        color = to_rgb(STOPS[number][0])
        xs = {float(e.get_xdata()[0]) for e in ax.get_lines() if to_rgb(e.get_color()) == color}
        assert xs == {side, *faces(ax, number)}


def test_gaps_are_in_one_scale_and_close_with_the_motion(ax):
    PAIR.plot(ax=ax)
    (peg,) = pegs(ax)
    left, right = faces(ax, 0)
    (wall,) = faces(ax, 1)
    assert (right - left) / (wall - peg[1]) == pytest.approx(0.2 / 0.5)
    # At a contact faces meet.
    touching = Figure().subplots()
    vi.plot.machine(PAIR, [[0.7, 0.5], [0, 0]], ax=touching)
    assert np.ptp(faces(touching, 0)) == pytest.approx(0.0, abs=1e-12)
    assert faces(touching, 1)[0] == pytest.approx(pegs(touching)[0][1], abs=1e-12)
    assert blocks(touching)[1] > 1.0


def test_walls_stand_on_the_side_where_they_are_met(ax):
    MIRRORED.plot(ax=ax)
    (peg,) = pegs(ax)
    assert faces(ax, 1)[0] < peg[0] < peg[1] < faces(ax, 0)[0]
    assert peg[0] - faces(ax, 1)[0] == pytest.approx(faces(ax, 0)[0] - peg[1])
    # A normal of 2 is met at half of the gap.
    moving = Figure().subplots()
    MOVING.plot(ax=moving)
    assert named(moving)[:2] == [
        "stop 0: gap 0.6, met at 0.3, moves by \N{PLUS-MINUS SIGN}0.4",
        "stop 1: gap 0.4",
    ]
    # It moves, and the other does not.
    assert len(arrows(moving, STOPS[0][0])) == 1
    assert not arrows(moving, STOPS[1][0])
    assert wheels(moving) == 2
    # Two stops on one side are below each other.
    two = vi.Structure([[1]], [[1]], [vi.Stop([1], 0.3, 1), vi.Stop([1], 0.5, 1)])
    below = Figure().subplots()
    two.plot(ax=below)
    assert len(pegs(below)) == 2
    assert faces(below, 0) < faces(below, 1)


def test_arrows_are_the_loads(ax):
    PRESSED.plot(ax=ax)
    assert len(arrows(ax, GREEN)) == len(arrows(ax, ORANGE)) == 2
    assert all(tip > start for start, tip in arrows(ax, ORANGE))
    # A quarter period after each other, at a phase at which the first is at its largest.
    at_phase = Figure().subplots()
    PAIR.plot(phase=0.0, ax=at_phase)
    ((start, tip),) = arrows(at_phase, GREEN)
    assert tip - start == pytest.approx(0.3)
    later = Figure().subplots()
    PAIR.plot(phase=0.5 * np.pi, ax=later)
    ((start, tip),) = arrows(later, GREEN)
    assert start == 1.0
    assert tip - start == pytest.approx(-0.3)


def test_what_has_no_place_in_a_row_is_told(ax):
    stops = [vi.Stop([1, 0, -1], 0.2, 1), vi.Stop([-1, 1, 0], 0.2, 1), vi.Stop([1, 1, 0], 1, 1)]
    vi.Structure(np.eye(3), np.eye(3), stops).plot(ax=ax)
    said = [text for text in texts(ax) if text.startswith("stop")]
    minus = "\N{MINUS SIGN}"
    assert said == [
        f"stop 0: q₀ {minus} q₂ = 0.2 at contact",
        f"stop 1: {minus}q₀ + q₁ = 0.2 at contact",
        "stop 2: q₀ + q₁ = 1 at contact",
    ]
    many = vi.Structure(np.eye(20), np.eye(20), [vi.Stop(row, 0.1, 1) for row in np.eye(20)])
    row = many.plot()
    assert len(blocks(row)) == 12
    assert "and 8 coordinates more, with 8 stops" in texts(row)
    assert row.figure.get_figwidth() > 12


def test_a_structure_of_modes_has_its_shapes(ax):
    BEAM.plot(ax=ax)
    shapes = [each for each in ax.get_lines() if str(each.get_label()).startswith("mode")]
    assert [each.get_label() for each in shapes] == [
        r"mode 0, $\omega$ = 1",
        r"mode 1, $\omega$ = 3",
    ]
    for mode, curve in enumerate(shapes):
        shape = BEAM.shapes[:, mode]
        assert curve.get_ydata() == pytest.approx(shape / np.abs(shape).max())
    (stop,) = [each for each in ax.get_lines() if each.get_gid() == "stop-0"]
    assert (stop.get_xdata()[0], stop.get_ydata()[0] > 1.0) == (2, True)
    assert "driven" in [each.get_label() for each in ax.get_lines()]


@pytest.mark.parametrize(
    ("state", "words"),
    [
        (np.zeros(4), "^state of shape"),
        (3, "^state = 3"),
        (np.zeros((3, 2, 2)), "(?s)state = .* allowed: one state, rows q and v of shape"),
        ([[0, 0], [0, np.nan]], r"^state\[1, 1\] = nan"),
        ([["a", "b"], ["c", "d"]], r"^state\[0, 0\] = 'a' is not allowed; .* not text$"),
    ],
)
def test_a_sketch_needs_a_state_of_the_structure(state, words):
    with pytest.raises((vi.ParameterError, vi.StateError), match=words):
        vi.plot.machine(PAIR, state)
    with pytest.raises(vi.ParameterError, match="phase"):
        PAIR.plot(phase="now")


# Walls on both sides of each body, and two more that move.
@pytest.mark.parametrize("bodies", [1, 2, 3, 4])
@pytest.mark.parametrize("count", [1, 2, 4, 6])
def test_no_name_lies_on_another(bodies, count):
    rows = [side * row for row in np.eye(bodies) for side in (1.0, -1.0)]
    stops = [
        vi.Stop(rows[k % len(rows)], 0.00388 + 0.00012 * k, 0.7, amplitude=0.0002 * (k > 3))
        for k in range(count)
    ]
    loads = {"drive_amplitude": np.ones(bodies), "static_load": np.ones(bodies)}
    stiffness = 3.0 * np.eye(bodies) - np.eye(bodies, k=1) - np.eye(bodies, k=-1)
    ax = vi.Structure(np.eye(bodies), stiffness, stops, drive_frequency=1.0, **loads).plot()
    ax.figure.canvas.draw()
    legend = ax.get_legend()
    assert len(legend.get_texts()) == count + 2
    places = [each.get_window_extent() for each in ax.texts if each.get_text()]
    places.append(legend.get_window_extent())
    assert not any(a.overlaps(b) for k, a in enumerate(places) for b in places[:k])
    x0, y0, x1, y1 = ax.figure.bbox.extents
    assert all(x0 <= a.x0 < a.x1 <= x1 and y0 <= a.y0 < a.y1 <= y1 for a in places)
