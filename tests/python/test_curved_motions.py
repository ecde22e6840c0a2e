"""All motions with one impact whose restitution depends on the approach velocity.

References: simulations; the motions of constant restitutions, which another search finds; roots
that are known.
"""

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.single_impact.curved import Curved
from vibroimpact.single_impact.intervals import Interval
from vibroimpact.single_impact.pieces import pieces_of
from vibroimpact.single_impact.plane import Box, Pair, isolate_in_plane

LAW = vi.RestitutionPowerLaw(0.9, 0.05)
TABLE = vi.RestitutionTable([0.5, 2.0, 4.0, 6.0], [0.9, 0.6, 0.6, 0.4])
BASE = vi.System(
    mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    drive_frequency=1.8, moment_amplitude=1,
)  # fmt: skip
SYSTEMS = {
    "oblique": {},
    "force": {"force_amplitude": 0.3},
    "loads and damping": {"force_amplitude": 0.2, "static_moment": 0.2, "static_force": 0.1,
                          "pendulum_damping": 0.1, "oscillator_damping": 0.05},
    "direct": {"contact": "direct"},
    "moving wall": {"mass_ratio": 0.0, "force_amplitude": 0.2, "pendulum_damping": 0.1},
    "wall at rest": {"mass_ratio": 0.0, "pendulum_damping": 0.1},
    "half turns": {"drive_frequency": 2.0, "frequency_ratio": 1.3},
}  # fmt: skip


def system(curve, name="oblique"):
    return BASE.replace(restitution=curve, **SYSTEMS[name])


@pytest.mark.parametrize("curve", [LAW, TABLE], ids=["law", "table"])
@pytest.mark.parametrize("name", SYSTEMS)
def test_motions_repeat_in_simulation_with_these_multipliers(name, curve):
    here = system(curve, name)
    found = vi.periodic_motions(here)
    assert not found.undecided
    motions = [motion for motion in found if motion.admissible]
    assert motions
    for motion in found:
        x1, v1, v2, _ = motion.state
        assert motion.approach_velocity == pytest.approx(here.slope(x1) * v1 - v2, abs=1e-12)
        assert motion.residual < 1e-12

    def after(start):
        return np.array(vi.simulate(here, initial=start, periods=1).final_state.state)

    for motion in motions:
        start = np.array(motion.initial)
        assert np.abs(after(start) - start).max() < 1e-12
        own = vi.periodic_motion(here, initial=start, periods=1)
        assert np.abs(np.array(own.state) - motion.state).max() < 1e-12
        steps = 1e-6 * np.eye(4)
        if here.is_wall and here.force_amplitude == 0.0:
            steps = steps[:2]  # the wall stays where it is
        columns = [(after(start + step) - after(start - step)) / 2e-6 for step in steps]
        by_differences = np.linalg.eigvals(np.array(columns).T[: len(steps)])
        largest = np.abs(motion.multipliers).max()
        assert np.abs(by_differences).max() == pytest.approx(largest, rel=1e-5)


def crossings(here, n, within):
    """Where r(u) - r changes its sign along the motions of constant r: (x1, u) of both sides."""
    curve = here.restitution
    found, before = [], []
    speeds = np.linspace(1e-3, 12.0, 400)
    for r in np.linspace(curve(speeds).min(), curve(speeds).max(), 80).tolist():
        motions = vi.periodic_motions(here.replace(restitution=r), n, within=within)
        now = [(m.state[0], m.approach_velocity, m.state[3]) for m in motions]
        now = [(*one, curve(max(one[1], 0.0)) - r) for one in now]
        for one in now:
            for other in before:
                near = abs(one[0] - other[0]) + abs(one[1] - other[1]) < 0.2
                if near and abs(one[2] - other[2]) < 0.4 and one[3] * other[3] < 0.0:
                    found.append(np.array([one[:2], other[:2]]))
        before = now
    return found


@pytest.mark.parametrize("seed", [2, 3, 4, 8, 9, 11])
def test_no_motion_of_a_constant_restitution_is_missed(seed):
    random = np.random.default_rng(seed)
    if seed % 2:
        curve = vi.RestitutionPowerLaw(
            random.uniform(0.5, 1), random.uniform(0.05, 1), random.uniform(0.2, 0.8)
        )
    else:
        curve = vi.RestitutionTable(
            np.cumsum(random.uniform(0.2, 1.5, 4)), random.uniform(0.1, 1.0, 4)
        )
    here = vi.System(
        mass_ratio=random.uniform(0.2, 2), frequency_ratio=random.uniform(0.5, 2.5),
        restitution=curve, gap=random.uniform(-0.5, 0.6),
        drive_frequency=random.uniform(0.6, 3), moment_amplitude=random.uniform(0.5, 2),
        force_amplitude=(seed % 3) * 0.2, pendulum_damping=0.02, oscillator_damping=0.02,
        contact="direct" if seed == 4 else "oblique",
    )  # fmt: skip
    n, within = 1 + seed % 2, (-3.0, 3.0)
    motions = vi.periodic_motions(here, n, within=within)
    assert not motions.undecided
    places = np.array([(m.state[0], m.approach_velocity) for m in motions])
    expected = crossings(here, n, within)
    assert expected
    for pair in expected:
        low, high = pair.min(axis=0) - 0.05, pair.max(axis=0) + 0.05
        assert ((low <= places) & (places <= high)).all(axis=1).any()


def test_where_r_is_the_same_at_all_speeds_they_are_those_of_a_number():
    flat = vi.RestitutionTable([0.3, 2.0], [0.8, 0.8])
    one, other = vi.periodic_motions(BASE), vi.periodic_motions(system(flat))
    assert len(one) == len(other) == 12
    for a, b in zip(one, other, strict=True):
        assert a.state == pytest.approx(b.state, abs=1e-13)
        assert a.multipliers == pytest.approx(b.multipliers, abs=1e-10)
        assert a.admissible == b.admissible
    assert (one.within, one.bounded) == (other.within, other.bounded)


def test_speeds_at_which_r_jumps_from_one_number_to_another():
    # Knots at almost the same speed: the motions of two numbers, each on its side.
    steep = vi.RestitutionTable([2.0, 2.0 + 1e-7], [0.8, 0.5])
    found = vi.periodic_motions(system(steep))
    slow = [m for m in vi.periodic_motions(BASE) if m.approach_velocity < 2.0]
    fast = [
        m for m in vi.periodic_motions(BASE.replace(restitution=0.5)) if m.approach_velocity > 2.1
    ]
    outside = [m for m in found if not 2.0 < m.approach_velocity < 2.0 + 1e-7]
    expected = sorted(m.state for m in [*slow, *fast])
    assert len(outside) == len(expected)
    for motion, state in zip(outside, expected, strict=True):
        assert motion.state == pytest.approx(state, abs=1e-12)


def test_a_motion_at_a_knot_is_not_lost():
    (motion,) = [m for m in vi.periodic_motions(system(LAW)) if m.admissible]
    u, r = motion.approach_velocity, LAW(motion.approach_velocity)
    kinked = vi.RestitutionTable([u / 2, u, 2 * u], [0.9, r, 0.3])
    found = vi.periodic_motions(system(kinked))
    boxes = [(item.lo, item.hi) for item in found.undecided]
    boxes += [(m.state[0], m.state[0]) for m in found]
    assert any(lo - 1e-9 <= motion.state[0] <= hi + 1e-9 for lo, hi in boxes)
    assert {item.reason for item in found.undecided} <= {
        "an approach velocity at a knot of the restitution"
    }


def test_two_motions_that_merge():
    here = system(LAW, "loads and damping")

    def at(moment):
        return vi.periodic_motions(here.replace(moment_amplitude=moment), within=(-1.5, 1.5))

    low, high = 0.4, 0.6
    assert len(at(low)) == 0
    assert len(at(high)) == 2
    for _ in range(60):
        middle = 0.5 * (low + high)
        found = at(middle)
        if found.undecided:
            break
        assert len(found) in (0, 2)
        low, high = (low, middle) if len(found) else (middle, high)
    # Only this near to the double root does rounding decide, and there it says so.
    assert high - low < 1e-11
    (left,) = found.undecided
    assert "double root" in left.reason
    assert left.hi - left.lo < 1e-5
    for part, distance in ((1e-4, 0.1), (1e-8, 1e-3)):
        near = at(high * (1.0 + part))
        one, other = sorted(m.state[0] for m in near)
        assert one < 0.5 * (left.lo + left.hi) < other
        assert other - one < distance
        # A saddle-node: a multiplier is 1 there.
        assert max(np.abs(m.multipliers - 1.0).min() for m in near) < 10.0 * distance
        assert not at(low * (1.0 - part)).motions


def test_open_phases_are_not_taken_for_motions():
    """F and G vanish where the linear conditions are singular; a motion is there only by chance."""
    here = vi.System(
        mass_ratio=0.9236335423809616, frequency_ratio=1.4207387706987433,
        restitution=vi.RestitutionPowerLaw(0.8612576386679771, 0.571616707356831, 0.59712924),
        gap=0.3689695802990234, drive_frequency=3.422693571500638,
        moment_amplitude=0.8031368360608298, force_amplitude=-0.5819251842717874,
        pendulum_damping=0.1538343403736266, phase=0.015432476950503315,
    )  # fmt: skip
    assert not vi.periodic_motions(here).undecided


@pytest.mark.parametrize("curve", [LAW, TABLE], ids=["law", "table"])
def test_pieces_hold_the_curve_and_its_slope(curve):
    levels, slopes = pieces_of(curve)
    for piece in slopes:
        low, high = piece.ends
        s = np.linspace(low, high, 200)
        at = piece.at(Interval(s))
        u = piece.speed(s)
        r = curve(u)
        for enclosed, value in ((at.rho, r / (1 + r)), (at.inverse, 1 / u)):
            slack = 4e-16 * np.abs(value) + 1e-300
            assert (enclosed.lo - slack <= value).all()
            assert (value <= enclosed.hi + slack).all()
            assert (enclosed.width <= 1e-12 * np.abs(value)).all()
        over = piece.at(Interval(s[:-1], s[1:]))
        for value, slope in ((r / (1 + r), over.rho_slope), (1 / u, over.inverse_slope)):
            mean = np.diff(value) / np.diff(s)
            slack = 1e-12 * np.abs(value[1:]) / np.diff(s)
            assert (slope.lo - slack <= mean).all()
            assert (mean <= slope.hi + slack).all()
    for level in levels:
        inside = 0.5 * (max(level.lo, 0.0) + min(level.hi, 50.0))
        assert curve(inside) == level.r
        assert level.side(inside) == 1
    starts = sorted([level.lo for level in levels] + [float(p.speed(p.ends[0])) for p in slopes])
    knots = curve.speeds if curve is TABLE else [curve.least_speed]
    assert starts == pytest.approx([-np.inf, *knots])


@pytest.mark.parametrize("name", ["force", "loads and damping", "direct", "moving wall"])
def test_conditions_over_boxes_hold_those_at_points(name):
    curved = Curved(system(LAW, name), 2)
    (piece,) = pieces_of(LAW)[1]
    random = np.random.default_rng(1)
    lo = np.column_stack([random.uniform(-3, 3, 500), random.uniform(0, 8, 500)])
    size = 10 ** random.uniform(-6, -0.5, (500, 1))
    ends = [lo + part * size * [1.0, 1.0] for part in (0.0, 0.3, 1.0)]
    over = curved.over(piece, Box(*(Interval(lo[:, k], ends[2][:, k]) for k in (0, 1))))
    at = [curved.over(piece, Box(*(Interval(one[:, k]) for k in (0, 1)))) for one in ends]
    width = size[:, 0]
    for place, (by_x, by_s) in ((0, (2, 3)), (1, (4, 5))):
        whole, values = over[place], [each[place] for each in at]
        for value in values:
            assert (whole.lo <= value.hi).all()
            assert (value.lo <= whole.hi).all()
        # The mean-value theorem along the diagonal.
        change = (over[by_x] + over[by_s]) * width
        assert (change.lo <= values[2].hi - values[0].lo).all()
        assert (values[2].lo - values[0].hi <= change.hi).all()
        # Narrow boxes have narrow slopes, so that these are not whole lines.
        narrow = width < 1e-5
        assert (over[by_x].width < 1e-3 * (1.0 + over[by_x].largest))[narrow].all()


@pytest.mark.parametrize("name", ["oblique", "force", "loads and damping", "moving wall"])
def test_the_speed_of_solutions_is_that_of_the_linear_conditions(name):
    curved = Curved(system(LAW, name), 1)
    for r in (0.2, 0.9):
        equations = curved.at(r)
        for x1 in (-0.7, 0.2, 1.1):
            at = Interval(np.array([x1]))
            matrix, rhs = equations.linear(np.zeros(1, np.int64), at)
            v, w, p, *_ = np.linalg.solve(matrix.middle[0], rhs.middle[0])
            kappa, par = np.cos(x1), equations.parameters
            before = kappa * (v + kappa * p) - (w - par.mass_ratio[0] * p)
            u = curved.speed(at, equations.rho)
            expected = par.drive_frequency[0] * before
            assert u.middle[0] == pytest.approx(expected, rel=1e-9)
            assert u.width[0] < 1e-9 * (1.0 + abs(expected))


def test_roots_in_the_plane():
    """A circle and a cubic meet in six points at most; here numpy finds them as roots of one."""
    for shift in (0.0, 0.3, 0.7):

        def enclose(box, shift=shift):
            x, s = box
            f = x.square() + s.square() - 4.0
            g = s - x * (x.square() - 2.0) - shift
            one = Interval(np.ones(len(x.lo)))
            return Pair(f, g, 2.0 * x, 2.0 * s, -(3.0 * x.square() - 2.0), one)

        cubic = np.poly1d([1.0, 0.0, -2.0, shift])
        roots = (np.poly1d([1.0, 0.0, -4.0]) + cubic**2).roots
        expected = np.sort(roots[np.abs(roots.imag) < 1e-9].real)
        side = Interval(np.array([-3.0]), np.array([3.0]))
        found = isolate_in_plane(enclose, Box(side, side))
        assert not len(found.undecided.x.lo)
        assert found.root.x.middle == pytest.approx(expected, abs=1e-12)
        assert found.root.s.middle == pytest.approx(cubic(expected), abs=1e-11)
        assert (found.root.x.width < 1e-13).all()
        # They touch: a double root is undecided, not lost.

    def touching(box):
        x, s = box
        one, zero = Interval(np.ones(len(x.lo))), Interval(np.zeros(len(x.lo)))
        return Pair(s - x.square(), s + zero, -2.0 * x, one, zero, one)

    found = isolate_in_plane(touching, Box(side, side))
    assert not len(found.root.x.lo)
    left = found.undecided.x
    assert left.lo.min() <= 0.0 <= left.hi.max()
    assert left.largest.max() < 1e-3


def test_maps_are_the_motions_of_their_points():
    here = system(TABLE)
    grid = {"r_1": [0.55, 0.6], "drive_frequency": [1.6, 1.8]}
    solutions = vi.motion_map(here, **grid)
    assert not solutions.undecided.any()
    assert not solutions.pending.any()
    row = 0
    for r_1 in grid["r_1"]:
        for omega in grid["drive_frequency"]:
            for motion in vi.periodic_motions(here.replace(r_1=r_1, drive_frequency=omega)):
                there = solutions.solutions[row]
                assert tuple(there)[1:5] == motion.state
                assert there["stable"] == motion.stable
                assert solutions.motion(row).multipliers == pytest.approx(
                    motion.multipliers, abs=1e-9
                )
                row += 1
    assert row == len(solutions.solutions)
    with pytest.raises(vi.ParameterError, match=r"one or two of mass_ratio, .* r_0, r_1"):
        vi.motion_map(here, restitution=[0.5])


def test_maps_of_impacts_are_those_of_the_restitution_at_one_speed():
    here = system(TABLE).replace(friction=0.3)
    x1, ratio = np.linspace(-1, 1, 9), np.linspace(-2, 2, 9)
    for u in (0.1, 1.3, 7.0):
        found = vi.impact_regimes(here, x1=x1, velocity_ratio=ratio, approach_velocity=u)
        v1 = u * ratio[:, None]
        each = vi.impact(here, x1=x1, v1=v1, v2=v1 * here.slope(x1) - u)
        assert np.array_equal(found.regime, each["regime"])
        assert found.restitution == pytest.approx(each["effective_restitution"], rel=1e-12)
        before = 0.5 * each["v1_pre"] ** 2 + 0.5 * each["v2_pre"] ** 2 / here.mass_ratio
        lost = each["energy_loss"] / before
        assert found.energy_loss == pytest.approx(lost, rel=1e-9, abs=1e-12)
        assert (found.approach_velocity, found.system) == (u, here)
        agreed = vi.impact_agreement(here, steps=(30, 100), cells=5, approach_velocity=u)
        number = here.replace(restitution=TABLE(u))
        expected = vi.impact_agreement(number, steps=(30, 100), cells=5)
        assert np.array_equal(agreed.difference, expected.difference, equal_nan=True)
    # By default the range is that of this r.
    wide = [vi.impact_regimes(here, approach_velocity=u).velocity_ratio.max() for u in (0.1, 7.0)]
    assert wide[0] > 1.2 * wide[1]
    for given in (None, 0.0, -1.0, np.nan):
        with pytest.raises(vi.ParameterError, match=f"approach_velocity = {given}"):
            vi.impact_regimes(here, approach_velocity=given)
    with pytest.raises(vi.ParameterError, match="approach_velocity"):
        vi.impact_agreement(here, cells=3)


def test_that_they_are_all_is_not_proved_as_a_theorem():
    with pytest.raises(vi.ParameterError, match="for proofs that motions are all"):
        vi.prove(vi.periodic_motions(system(LAW)))
