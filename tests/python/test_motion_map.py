"""Solutions over a grid: the same as one by one, and their figures."""

import math

import matplotlib as mpl
import numpy as np
import pytest

import vibroimpact as vi
from systems import PAPER
from vibroimpact.single_impact.results import SOLUTION_DTYPE

mpl.use("Agg")
SYSTEM = PAPER.replace(drive_frequency=1.0)
FREQUENCIES = np.array([0.65, 1.0, 1.25, 1.8, 2.0, 2.75])
MOMENTS = np.array([0.5, 0.95, 1.5])


@pytest.fixture(scope="module", params=[1, 2])
def grid(request):
    return vi.motion_map(
        SYSTEM,
        request.param,
        within=(-1.5, 1.5),
        drive_frequency=FREQUENCIES,
        moment_amplitude=MOMENTS,
    )


def test_rows_are_the_motions_of_every_point(grid):
    assert grid.shape == (6, 3)
    rows = iter(grid.solutions)
    for i, omega in enumerate(FREQUENCIES):
        for j, moment in enumerate(MOMENTS):
            system = SYSTEM.replace(drive_frequency=omega, moment_amplitude=moment)
            alone = vi.periodic_motions(system, grid.n, within=(-1.5, 1.5))
            assert grid.undecided[3 * i + j] == len(alone.undecided)
            assert grid.empty[3 * i + j] == alone.note.startswith("no isolated")
            for motion, row in zip(alone, rows, strict=False):
                assert row["point"] == 3 * i + j
                state = [row[name] for name in ("x1", "v1", "v2", "phase")]
                growth = max(1.0, np.abs(motion.return_map).max())
                assert np.abs(np.array(state) - motion.state).max() <= 1e-14 * growth
                assert row["admissible"] == motion.admissible
                assert row["stable"] == motion.stable
                size = abs(motion.multipliers[0])
                assert row["largest_multiplier"] == pytest.approx(size, rel=1e-9)
    assert next(rows, None) is None
    assert len(grid.solutions) >= 20


@pytest.mark.parametrize("contact", ["oblique", "direct"])
@pytest.mark.parametrize("n", [1, 3])
def test_solutions_of_a_batch_are_judged_like_single_ones(contact, n):
    random = np.random.default_rng([n, len(contact)])
    system = vi.System(
        mass_ratio=0.6,
        frequency_ratio=2.0,
        restitution=0.8,
        gap=0.3,
        drive_frequency=1.3,
        oscillator_damping=0.05,
        moment_amplitude=1.0,
        force_amplitude=0.4,
        phase=0.7,
        contact=contact,
    )
    varied = {
        # A wall, at rest and driven, among bodies that move.
        "mass_ratio": np.append(0.0, random.uniform(0.1, 1.5, 7)),
        "force_amplitude": np.append(0.0, random.uniform(0.1, 1.0, 4)),
    }
    found = vi.motion_map(system, n, within=(-1.5, 1.5), **varied)
    assert len(found.solutions) > 20
    for i, row in enumerate(found.solutions):
        motion = found.motion(i)
        assert motion.system == system.replace(
            **{name: float(found.parameter(name)[i]) for name in varied}
        )
        state = tuple(row[name] for name in ("x1", "v1", "v2", "phase"))
        # The state of a motion is that after the impact, mapped back.
        assert motion.state == pytest.approx(state, rel=1e-12, abs=1e-12)
        assert (row["admissible"], row["stable"]) == (motion.admissible, motion.stable)
        # The same eigenvalues; the modulus of an array may be rounded otherwise.
        size = abs(motion.multipliers[0])
        assert row["largest_multiplier"] == pytest.approx(size, rel=1e-15, nan_ok=True)


def test_every_solution_knows_its_parameters(grid):
    points = grid.solutions["point"]
    assert np.array_equal(grid.parameter("drive_frequency"), FREQUENCIES[points // 3])
    assert np.array_equal(grid.parameter("moment_amplitude"), MOMENTS[points % 3])
    assert grid.solutions.dtype == SOLUTION_DTYPE
    assert f"period {grid.n}-1 over 6 drive_frequency x 3 moment_amplitude" in repr(grid)


def test_part_of_a_map_is_the_map_of_that_part(grid):
    part = grid.at(moment_amplitude=0.95)
    whole = vi.motion_map(
        SYSTEM.replace(moment_amplitude=0.95),
        grid.n,
        within=(-1.5, 1.5),
        drive_frequency=FREQUENCIES,
    )
    assert part.system == whole.system
    assert part.solutions.tobytes() == whole.solutions.tobytes()
    assert np.array_equal(part.undecided, whole.undecided)
    assert np.array_equal(part.empty, whole.empty)
    other = grid.at(drive_frequency=1.8)
    assert list(other.grid) == ["moment_amplitude"]
    assert set(other.solutions["point"]) <= {0, 1, 2}


def test_a_wall_at_rest_over_its_place():
    system = vi.System(
        mass_ratio=0.0,
        frequency_ratio=1.0,
        restitution=0.8,
        gap=1.0,
        drive_frequency=1.0,
        pendulum_damping=0.05,
        moment_amplitude=1.0,
        contact="direct",
    )
    found = vi.motion_map(system, gap=[0.5, 1.0])
    (row,) = found.solutions[(found.solutions["point"] == 1) & found.solutions["admissible"]]
    assert row["approach_velocity"] == pytest.approx(1.695732937594882, rel=1e-12)


@pytest.mark.parametrize(
    ("system", "arguments", "match"),
    [
        (SYSTEM, {}, "varied parameters must be one or two of mass_ratio.*got nothing"),
        (SYSTEM, {"colour": [1.0]}, "got colour"),
        (SYSTEM, {"contact": ["direct"]}, "got contact"),
        (SYSTEM, {"gap": [0.1], "restitution": [0.5], "phase": [0.0]}, "one or two of"),
        (SYSTEM, {"gap": []}, r"gap = \[\] is not allowed; allowed: an array of at least one"),
        (SYSTEM, {"gap": [0.1, math.nan]}, r"gap\[1\] = nan is not allowed"),
        (SYSTEM, {"drive_frequency": [1.0, 0.0]}, "drive_frequency = 0.0 is not allowed"),
        (SYSTEM, {"restitution": [0.5, 1.5]}, "restitution = 1.5 is not allowed"),
        (SYSTEM, {"friction": [0.0, 0.1]}, "friction = 0.1 is not allowed"),
        (SYSTEM, {"gap": [0.1], "n": 0}, "n = 0 is not allowed"),
        (SYSTEM, {"gap": [0.1], "within": (1, 0)}, "within = .* is not allowed"),
        (3, {"gap": [0.1]}, "system = 3 is not allowed"),
    ],
)
def test_bad_input(system, arguments, match):
    with pytest.raises(vi.ParameterError, match=match):
        vi.motion_map(system, **arguments)


def test_a_part_that_is_not_there(grid):
    with pytest.raises(vi.ParameterError, match=r"moment_amplitude = 0\.7 is not allowed"):
        grid.at(moment_amplitude=0.7)
    with pytest.raises(vi.ParameterError, match="one of two varied parameters"):
        grid.at(gap=0.5)
    with pytest.raises(vi.ParameterError, match="one of two varied parameters"):
        grid.at(moment_amplitude=0.5).at(drive_frequency=1.8)


def points(ax):
    """Drawn points by the name of their kind."""
    return {line.get_label(): np.column_stack(line.get_data()) for line in ax.get_lines()}


def expected(part, chosen):
    x1 = part.solutions["x1"]
    return np.column_stack([part.parameter("drive_frequency"), x1])[chosen]


def another(found):
    """Verdicts of a criterion that calls a swing to one side stable."""
    return "side", found.solutions["x1"] > 0.0


def test_branches_hold_every_solution_under_any_verdict(grid):
    part = grid.at(moment_amplitude=1.5)
    rows = part.solutions
    _, stable = another(part)
    drawn = points(vi.plot.motion_branches(part, criterion=another(part)))
    assert np.array_equal(drawn["stable by side"], expected(part, stable))
    assert np.array_equal(drawn["unstable by side"], expected(part, ~stable))
    with pytest.raises(ValueError, match=f"criterion side: {len(rows)} verdicts on "):
        vi.plot.stability_map(grid, criterion=another(part))
    drawn = points(vi.plot.motion_branches(part))
    real, stable = rows["admissible"], rows["stable"]
    assert np.array_equal(drawn["stable motion"], expected(part, real & stable))
    assert np.array_equal(drawn["unstable motion"], expected(part, real & ~stable))
    assert np.array_equal(drawn["not admissible"], expected(part, ~real))
    names = [handle.get_label() for handle in vi.plot.motion_handles(part)]
    assert names == ["stable motion", "unstable motion", "not admissible"]
    mpl.pyplot.close("all")


def test_the_space_leaves_out_what_is_no_motion(grid):
    ax = vi.plot.motion_space(grid)
    drawn = sum(len(line.get_data_3d()[0]) for line in ax.get_lines())
    assert drawn == grid.solutions["admissible"].sum()
    ax = vi.plot.motion_space(grid, criterion=another(grid), every=(2, 1))
    shown = grid.solutions["point"] // 3 % 2 == 0
    drawn = sum(len(line.get_data_3d()[0]) for line in ax.get_lines())
    assert drawn == shown.sum()
    mpl.pyplot.close("all")


@pytest.mark.parametrize("other", [True, False])
def test_the_map_has_three_levels(grid, other):
    criterion = another(grid) if other else None
    (mesh,) = vi.plot.stability_map(grid, criterion=criterion).collections
    rows = grid.solutions
    counted = np.ones(len(rows), bool) if other else rows["admissible"]
    stable = another(grid)[1] if other else rows["admissible"] & rows["stable"]
    for point, level in enumerate(np.asarray(mesh.get_array()).T.ravel()):
        here = rows["point"] == point
        assert level == (counted & here).any().astype(int) + (stable & here).any()
    handles = vi.plot.stability_handles(criterion="side" if other else "")
    assert [handle.get_label().endswith(" by side") for handle in handles] == [other] * 2
    mpl.pyplot.close("all")


def test_a_figure_needs_its_number_of_parameters(grid):
    with pytest.raises(ValueError, match="one varied parameter is needed"):
        vi.plot.motion_branches(grid)
    with pytest.raises(ValueError, match="two varied parameters are needed"):
        vi.plot.stability_map(grid.at(moment_amplitude=0.5))


def test_a_map_of_one_value_is_drawn():
    # Limits that are equal would be a warning, and warnings are errors here.
    one = vi.motion_map(PAPER, drive_frequency=[1.8])
    low, high = vi.plot.motion_branches(one).get_xlim()
    assert low < 1.8 < high
    mpl.pyplot.close("all")
