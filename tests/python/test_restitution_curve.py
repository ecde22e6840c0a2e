"""Coefficients of restitution that depend on the approach velocity."""

import copy
import json
import pickle

import numpy as np
import pytest

import vibroimpact as vi
from restitution_curves import CURVES, TABLE, check_product, same

BASE = {
    "mass_ratio": 0.6,
    "frequency_ratio": 2.0,
    "gap": 0.5,
    "drive_frequency": 1.8,
    "moment_amplitude": 1.0,
    "pendulum_damping": 0.02,
}
START = (0.0, 0.5, 0.0, 0.0)


def system(restitution, **more):
    """Return a system of this restitution."""
    return vi.System(restitution=restitution, **(BASE | more))


@pytest.mark.parametrize("law", ["poisson", "newton", "energetic", "paper"])
@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_a_table_of_equal_values_is_that_number_to_the_bit(law, friction):
    random = np.random.default_rng(3)
    starts = random.uniform([-0.3, -1, -0.2, -1], [0.3, 1, 0.2, 1], (8, 4))
    for r in (0.8, 0.3):
        number = system(r, law=law, friction=friction)
        table = number.replace(restitution=vi.RestitutionTable([0.1, 0.7], [r, r]))
        ours, theirs = (vi.simulate(s, initial=starts, periods=40) for s in (number, table))
        assert all(map(same, ours, theirs))
        assert sum(len(run.impacts) for run in ours) > 200
        single = vi.simulate(table, initial=starts[0], periods=40)
        assert same(single, ours[0])


@pytest.mark.parametrize("curve", CURVES)
def test_runs_in_lanes_are_those_by_themselves(curve):
    starts = np.random.default_rng(4).uniform(-0.2, 0.2, (12, 4)) * [1, 5, 1, 1]
    for friction in (0.0, 0.4):
        here = system(curve, friction=friction)
        together = vi.simulate(here, initial=starts, periods=30)
        alone = [vi.simulate(here, initial=start, periods=30) for start in starts]
        assert all(map(same, together, alone))


@pytest.mark.parametrize("curve", CURVES)
def test_a_ball_on_a_floor_in_closed_form(curve):
    """Under the acceleration 1: u' = r(u) u, flights of 2 r(u) u, then a geometric series."""
    ball = vi.System(
        mass_ratio=0,
        frequency_ratio=0,
        restitution=curve,
        gap=0,
        drive_frequency=0,
        static_moment=1,
        contact="direct",
    )
    run = vi.simulate(ball, initial=(-2.0, 0.0, 0.0, 0.0), time=60)
    time, u = 2.0, 2.0
    for impact in run.impacts:
        assert impact["time"] == pytest.approx(time, rel=1e-14)
        assert impact["approach_velocity"] == pytest.approx(u, rel=1e-12)
        u *= curve(u)
        assert -impact["v1_post"] == pytest.approx(u, rel=1e-12)
        time += 2.0 * u
    chatter = run.contacts[0]
    lowest = curve(0.0)
    # The rest of the series from the last impact told: 2 u (1 + r + r^2 + ...).
    time = run.impacts["time"][-1] + 2.0 * u / (1.0 - lowest)
    assert chatter["time"] == pytest.approx(time, rel=1e-13)
    assert (run.impacts["approach_velocity"] < 0.05).sum() >= 4


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize("law", ["poisson", "newton", "energetic"])
def test_each_impact_takes_r_at_its_own_speed(curve, law):
    run = vi.simulate(system(curve, law=law, friction=0.3), initial=START, periods=60)
    differs = 0
    for row in run.impacts:
        r = float(curve(row["approach_velocity"]))
        alone = vi.impact(
            run.system.replace(restitution=r),
            x1=row["x1"],
            v1=row["v1_pre"],
            v2=row["v2_pre"],
        )
        assert row["v1_post"] == pytest.approx(float(alone["v1_post"]), abs=1e-14)
        differs += abs(r - 0.9) > 0.01
    assert differs > 20
    audit = run.energy_audit()
    assert abs(audit.residual) < 1e-12 * audit.total


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_derivatives_of_a_run(curve, friction):
    """By the numbers of the curve and by the start, against differences."""
    here = system(curve, friction=friction)
    names = (*curve.names, "gap", "v1")
    found = vi.simulate(here, initial=START, periods=6).sensitivity(*names)
    assert not found.one_sided

    def end(name, by):
        start, machine = START, here
        if name == "v1":
            start = (0.0, 0.5 + by, 0.0, 0.0)
        else:
            machine = here.replace(**{name: getattr(here, name) + by})
        return vi.simulate(machine, initial=start, periods=6).final_state.state

    for place, name in enumerate(names):
        step = 1e-6
        slope = (np.array(end(name, step)) - np.array(end(name, -step))) / (2 * step)
        size = max(1.0, np.abs(slope).max())
        assert np.abs(found.final_state[:, place] - slope).max() < 1e-6 * size, name


def test_an_impact_at_a_knot_without_a_jump_of_the_slope_is_not_marked():
    for values in ([0.8, 0.8, 0.8], [0.8, 0.8, 0.6]):
        flat = vi.RestitutionTable([1.0, 2.0, 4.0], values)
        ball = vi.System(
            mass_ratio=0,
            frequency_ratio=0,
            restitution=flat,
            gap=1,
            drive_frequency=0,
            contact="direct",
        )
        for speed in (1.0, 2.0):
            found = vi.simulate(ball, initial=(0, speed, 0, 0), time=1.1).sensitivity("v1")
            jumps = speed == 2.0 and values[2] != values[1]
            assert [at.reason for at in found.one_sided] == ["restitution_knot"] * jumps


def test_knots_on_a_straight_line_are_not_marked():
    # Slopes of these differ by rounding.
    ball = vi.System(
        mass_ratio=0,
        frequency_ratio=0,
        restitution=vi.RestitutionTable([0.1, 0.2, 0.3], [0.8, 0.7, 0.6]),
        gap=1,
        drive_frequency=0,
        contact="direct",
    )
    found = vi.simulate(ball, initial=(0, 0.2, 0, 0), time=6).sensitivity("v1")
    assert len(found.impacts.time) == 1
    assert not len(found.one_sided)


def test_an_impact_at_a_knot_is_marked():
    ball = vi.System(
        mass_ratio=0,
        frequency_ratio=0,
        restitution=vi.RestitutionTable([0.5, 2.0], [0.9, 0.6]),
        gap=1,
        drive_frequency=0,
        contact="direct",
    )
    found = vi.simulate(ball, initial=(0.0, 2.0, 0.0, 0.0), time=1).sensitivity("v1", "r_1")
    assert [at.reason for at in found.one_sided] == ["restitution_knot"]
    # From above r is constant.
    assert found.impacts.after[0, 1] == pytest.approx([-0.6, -2.0], rel=1e-15)


@pytest.mark.parametrize("curve", CURVES)
def test_multipliers_have_the_product_of_the_determinants(curve):
    here = system(curve, drive_frequency=1.25, moment_amplitude=1.3)
    motion = vi.simulate(here, initial=START, periods=600, keep=60).refine()
    check_product(curve, motion, motion.initial, 2.0 * 0.02 * 2.0)


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize("law", ["poisson", "energetic", "paper"])
def test_the_reference_agrees(curve, law):
    run = vi.simulate(system(curve, law=law, friction=0.2), initial=START, periods=8)
    found = vi.verify(run)
    assert found.horizon is None
    assert found.certified
    assert found.impacts["regime_agrees"].all()
    errors = [name for name in found.impacts.dtype.names if name.startswith("error_")]
    for name in errors:
        assert found.impacts[name].max() < 1e-12, name


@pytest.mark.parametrize("curve", CURVES)
def test_copies_and_files(curve, tmp_path):
    here = system(curve)
    namespace = vars(vi)
    for other in (
        eval(repr(here), dict(namespace)),
        vi.System.from_dict(here.to_dict()),
        vi.System.from_json(here.to_json()),
        pickle.loads(pickle.dumps(here)),
        copy.deepcopy(here),
        here.replace(restitution=dict(curve.to_dict())),
    ):
        assert other == here
        assert hash(other) == hash(here)
    assert here != system(0.9)
    assert json.loads(here.to_json())["restitution"] == curve.to_dict()
    run = vi.simulate(here, initial=START, periods=20)
    run.save(tmp_path / "run")
    again = vi.load(tmp_path / "run")
    assert again.system == here
    assert same(run, again)
    assert same(run.resume(periods=10), again.resume(periods=10))


def test_si_units():
    given = {
        "pendulum_mass": 3,
        "oscillator_mass": 5,
        "length": 0.1,
        "torsional_stiffness": 500,
        "stiffness": 50e3,
        "gap": 0.05,
        "drive_frequency": 180,
        "moment_amplitude": 300,
    }
    machine = vi.System.from_physical(**given, restitution=vi.RestitutionTable([1, 20], [0.9, 0.5]))
    assert machine.scales.speed == pytest.approx(10.0)
    assert machine.restitution.speeds == pytest.approx([0.1, 2.0])
    back = machine.to_physical()
    assert back["restitution"].speeds == pytest.approx([1, 20])
    longer = machine.replace(length=0.2, units="SI")
    assert longer.restitution.speeds * longer.scales.speed == pytest.approx([1, 20])
    faster = machine.replace(restitution=vi.RestitutionPowerLaw(0.9, 2.0), units="SI")
    assert faster.restitution.least_speed == pytest.approx(0.2)


def test_numbers_vary_by_name():
    here = system(TABLE)
    assert (here.r_1, here.replace(r_1=0.6).r_1) == (0.75, 0.6)
    diagram = vi.bifurcation_diagram(here, r_2=[0.4, 0.5, 0.6], initial=START, periods=60, keep=5)
    for place, value in enumerate((0.4, 0.5, 0.6)):
        run = vi.simulate(here.replace(r_2=value), initial=START, periods=60, keep=5)
        assert np.array_equal(diagram.run(place).impacts, run.impacts)
    motion = vi.simulate(here, initial=START, periods=600, keep=60).refine()
    branch = motion.follow(r_2=(0.45, 0.5))
    [there] = branch.at(r_2=0.47)
    assert there.system.r_2 == 0.47
    assert there.admissible


def test_values_of_a_table_are_found_from_times_of_impacts():
    here = system(TABLE)
    run = vi.simulate(here, initial=START, periods=20)
    heard = vi.measure(run, "impact_times", noise=1e-4, seed=1)
    start = here.replace(r_1=0.7, r_2=0.55)
    found = vi.fit(heard, start, unknown=["r_1", "r_2"], initial=START)
    assert found.verdict == "fits"
    for name, value in (("r_1", 0.75), ("r_2", 0.5)):
        assert abs(found.values[name] - value) < 4.0 * found.errors[name] < 0.01


HOSTILE = [
    (([0.2, 0.1], [0.9, 0.8]), r"speeds\[1\] = 0.1"),
    (([0.1, 0.1], [0.9, 0.8]), r"speeds\[1\] = 0.1"),
    (([0.0, 0.1], [0.9, 0.8]), r"speeds\[0\] = 0.0"),
    (([-0.1, 0.1], [0.9, 0.8]), r"speeds\[0\] = -0.1"),
    (([0.1, np.nan], [0.9, 0.8]), r"speeds\[1\]"),
    (([0.1, np.inf], [0.9, 0.8]), r"speeds\[1\]"),
    (([0.1, 0.2], [0.9, np.nan]), r"values\[1\]"),
    (([0.1, 0.2], [0.9, 1.1]), r"values\[1\] = 1.1"),
    (([0.1, 0.2], [0.9, 0.0]), r"values\[1\] = 0.0"),
    (([0.1], [0.9]), "2 to 16"),
    (([], []), "2 to 16"),
    ((range(1, 18), [0.5] * 17), "2 to 16"),
    (([0.1, 0.2], [0.9]), "2 values"),
    (([[0.1, 0.2]], [[0.9, 0.8]]), "speeds"),
    (("0.1", [0.9]), "speeds"),
]


@pytest.mark.parametrize(("given", "message"), HOSTILE)
def test_hostile_tables(given, message):
    with pytest.raises(vi.ParameterError, match=message):
        vi.RestitutionTable(*given)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ((1.5, 0.1), "r_low = 1.5"),
        ((0.0, 0.1), "r_low = 0.0"),
        ((0.9, 0.0), "least_speed = 0.0"),
        ((0.9, np.inf), "least_speed = inf"),
        ((0.9, 0.1, 1.0), "exponent = 1.0"),
        ((0.9, 0.1, np.nan), "exponent = nan"),
    ],
)
def test_hostile_power_laws(given, message):
    with pytest.raises(vi.ParameterError, match=message):
        vi.RestitutionPowerLaw(*given)


def test_what_needs_a_number_says_so():
    here = system(TABLE)
    run = vi.simulate(here, initial=START, periods=600, keep=60)
    for message, call in (
        ("approach_velocity = None", lambda: vi.impact_regimes(here)),
        ("approach_velocity = None", lambda: vi.impact_agreement(here)),
        ("restitution", lambda: run.sensitivity("restitution")),
        ("restitution", lambda: vi.bifurcation_diagram(
            here, restitution=[0.5], initial=START, periods=5)),
        ("restitution", lambda: run.refine().follow(restitution=(0.5, 0.6))),
        (r"r_1 = 1.5", lambda: here.replace(r_1=1.5)),
    ):  # fmt: skip
        with pytest.raises(vi.ParameterError, match=message):
            call()
    with pytest.raises(vi.ParameterError, match="for proofs of branches"):
        vi.prove(run.refine().follow(r_2=(0.49, 0.5)))
    proof = vi.prove(run.refine())
    assert proof.verdict == "undecided"
    assert "approach velocity" in proof.why


def test_functions_that_make_systems():
    """Values and speeds of a table change, in SI all speeds with the units, or a power law does."""

    def with_table(gap):
        return system(vi.RestitutionTable(TABLE.speeds, [0.9, 0.75 - 0.1 * gap, 0.5]), gap=gap)

    def in_si(restitution):
        return lambda stiffness: vi.System.from_physical(
            pendulum_mass=3, oscillator_mass=5, length=0.1, torsional_stiffness=500,
            stiffness=stiffness, gap=0.05, restitution=restitution,
            drive_frequency=180, moment_amplitude=300,
        )  # fmt: skip

    table_in_si = in_si(vi.RestitutionTable([0.5, 3.0, 10.0], TABLE.values))

    for maker, name, values in (
        (with_table, "gap", [0.4, 0.5]),
        (in_si(vi.RestitutionPowerLaw(0.9, 0.5, 0.2)), "stiffness", [49e3, 5e4]),
        (table_in_si, "stiffness", [1e3, 5e4]),
    ):
        diagram = vi.bifurcation_diagram(maker, **{name: values}, initial=START, periods=60, keep=5)
        for place, value in enumerate(values):
            made = maker(value)
            run = vi.simulate(made, initial=START, periods=60, keep=5)
            assert np.array_equal(diagram.run(place).impacts, run.impacts)
            assert diagram.run(place).system == made
    motion = vi.simulate(with_table(0.5), initial=START, periods=600, keep=60).refine()
    branch = motion.follow(gap=(0.45, 0.5, 0.55), system=with_table)
    [there] = branch.at(gap=0.47)
    assert there.system == with_table(0.47)
    own = vi.simulate(there.system, initial=there.initial, periods=there.m)
    assert own.final_state.state == pytest.approx(there.initial, abs=1e-9)


def test_functions_that_change_what_has_no_number_are_refused():
    def maker(x):
        knots = [0.05, 0.2, 0.3][: round(x)], [0.9, 0.5, 0.4][: round(x)]
        return system(vi.RestitutionTable(*knots))

    with pytest.raises(vi.ParameterError, match=r"x = 3.0: restitution = .* by name"):
        vi.bifurcation_diagram(maker, x=[2.0, 3.0], initial=START, periods=5)


def test_a_number_of_a_curve_beside_another_curve_is_refused():
    here = system(TABLE)
    for changes in ({"restitution": 0.5, "r_0": 0.3}, {"r_0": 0.3, "restitution": TABLE}):
        with pytest.raises(vi.ParameterError, match=r"^r_0 = 0\.3 is not allowed"):
            here.replace(**changes)
    stop = vi.Stop([1], 0.1, TABLE)
    with pytest.raises(vi.ParameterError, match=r"^r_0 = 0\.3 is not allowed"):
        stop.replace(restitution=0.5, r_0=0.3)


def test_a_power_law_over_the_whole_range_of_speeds():
    # By logarithms: the quotient of both speeds is beyond the range of numbers.
    for least, speed in ((1e-308, 10.0), (1e-300, 1e300)):
        law = vi.RestitutionPowerLaw(0.9, least, 0.25)
        wanted = 0.9 * np.exp(-0.25 * (np.log(speed) - np.log(least)))
        assert law(speed) == pytest.approx(wanted, rel=1e-12)
