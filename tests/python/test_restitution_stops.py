"""Coefficients of restitution at a structure's stops that depend on the approach velocity."""

import copy
import itertools
import pickle

import numpy as np
import pytest

import vibroimpact as vi
from restitution_curves import CURVES, LAW, TABLE, check_product, same
from struck import REST


def pair(one, other=0.8, *, friction=0.0, law="poisson", simultaneous="stop", **more):
    """Return two masses, the second between two stops; friction at the first one."""
    rough = {"friction": friction, "tangent": [1, 0]} if friction else {}
    fields = {"damping_ratios": [0.02, 0.03], "drive_amplitude": [1.5, 0], "drive_frequency": 1.3}
    return vi.Structure(
        [[1, 0], [0, 0.7]],
        [[5, -2], [-2, 2.5]],
        [vi.Stop([0, 1], 0.3, one, **rough), vi.Stop([0, -1], 0.4, other)],
        law=law,
        simultaneous=simultaneous,
        **(fields | more),
    )


def single(restitution, **more):
    """Return a driven mass with one stop."""
    fields = {"damping_ratios": [0.02], "drive_amplitude": [1.0], "drive_frequency": 2.0}
    return vi.Structure([[1]], [[1]], [vi.Stop([1], 0.2, restitution)], **(fields | more))


def corner(restitution, simultaneous):
    """Return a mass that is pressed into a corner of two stops which see each other."""
    return vi.Structure(
        np.eye(2),
        np.eye(2),
        [vi.Stop([1, 0], 0.2, restitution), vi.Stop([0.8, 0.6], 0.2, restitution)],
        damping_ratios=[0.05, 0.05],
        static_load=[0.5, 0.4],
        drive_amplitude=[0.5, 0.2],
        drive_frequency=0.9,
        simultaneous=simultaneous,
    )


def wedge(restitution):
    """Return a mass that is pressed on a stop and struck at one that presses it more."""
    return vi.Structure(
        np.eye(2),
        np.eye(2),
        [vi.Stop([1, 0], 0.2, restitution), vi.Stop([-0.8, 0.6], 0.1, restitution)],
        static_load=[3.0, 0.6],
        drive_amplitude=[0.0, 0.5],
        drive_frequency=0.7,
        simultaneous="together",
    )


EQUAL = [pair(0.8, friction=f, law=w) for f, w in
         itertools.product((0.0, 0.4), ("poisson", "newton", "energetic"))]  # fmt: skip
EQUAL += [corner(0.6, rule) for rule in ("sequence", "together")]


@pytest.mark.parametrize("number", EQUAL)
def test_a_table_of_equal_values_is_that_number_to_the_bit(number):
    stops = [
        stop.replace(restitution=vi.RestitutionTable([0.1, 0.7], [stop.restitution] * 2))
        for stop in number.stops
    ]
    table = number.replace(stops=stops)
    starts = np.random.default_rng(3).uniform(-0.2, 0.15, (6, 2, 2)) * [[[1.0], [4.0]]]
    ours, theirs = (vi.simulate(s, initial=starts, periods=40) for s in (number, table))
    assert all(map(same, ours, theirs))
    assert sum(len(run.impacts) for run in ours) > 200
    assert same(vi.simulate(table, initial=starts[0], periods=40), ours[0])


@pytest.mark.parametrize("curve", CURVES)
def test_runs_in_lanes_are_those_by_themselves(curve):
    starts = np.random.default_rng(4).uniform(-0.2, 0.2, (12, 2, 2)) * [[[1.0], [4.0]]]
    for friction in (0.0, 0.4):
        here = pair(curve, LAW, friction=friction)
        together = vi.simulate(here, initial=starts, periods=30)
        alone = [vi.simulate(here, initial=start, periods=30) for start in starts]
        assert all(map(same, together, alone))


@pytest.mark.parametrize("curve", CURVES)
def test_two_bodies_head_on_are_a_system(curve):
    """Equal but for rounding, which a chaotic motion would let grow: this one settles."""
    numbers = {"drive_frequency": 1.25, "phase": 0.3}
    mbar, omega0, zeta1, zeta2, f1, f2 = 0.6, 2.0, 0.05, 0.1, 1.3, 0.2
    system = vi.System(
        mass_ratio=mbar, frequency_ratio=omega0, restitution=curve, gap=0.3,
        pendulum_damping=zeta1, oscillator_damping=zeta2, moment_amplitude=f1, force_amplitude=f2,
        contact="direct", **numbers,
    )  # fmt: skip
    structure = vi.Structure(
        np.diag([1, 1 / mbar]),
        np.diag([omega0**2, 1 / mbar]),
        [vi.Stop([1, -1], 0.3, curve)],
        damping=np.diag([2 * zeta1 * omega0, 2 * zeta2 / mbar]),
        drive_amplitude=[f1, f2 / mbar],
        **numbers,
    )
    one = vi.simulate(system, initial=(0.0, 0.5, 0.0, 0.0), periods=40)
    other = vi.simulate(structure, initial=[[0, 0], [0.5, 0]], periods=40)
    assert len(one.impacts) == len(other.impacts) > 30
    for name in ("time", "approach_velocity"):
        assert other.impacts[name] == pytest.approx(one.impacts[name], rel=1e-9)
    ours, theirs = (run.sensitivity(*curve.names, "gap") for run in (one, other))
    order = [0, 2, 1, 3]  # x1, x2, v1, v2
    found = theirs.final_state.reshape(4, -1)
    assert found == pytest.approx(ours.final_state[order], rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("curve", CURVES)
def test_a_ball_on_a_floor_in_closed_form(curve):
    """Under the acceleration 1: u' = r(u) u, flights of 2 r(u) u, then a geometric series."""
    ball = vi.Structure([[2.0]], [[0.0]], [vi.Stop([1], 0.0, curve)], static_load=[2.0])
    run = vi.simulate(ball, initial=[[-2.0], [0.0]], time=60)
    time, u = 2.0, 2.0
    for impact in run.impacts:
        assert impact["time"] == pytest.approx(time, rel=1e-14)
        assert impact["approach_velocity"] == pytest.approx(u, rel=1e-12)
        u *= curve(u)
        time += 2.0 * u
    lowest = curve(0.0)
    chatter = run.contacts[0]
    time = run.impacts["time"][-1] + 2.0 * u / (1.0 - lowest)
    assert chatter["time"] == pytest.approx(time, rel=1e-13)
    # Derivatives pass through it: none of its time but by r, since the drop is given.
    # The drop is given: the state after it rests, and only its time depends on r.
    [name, *_] = curve.names
    found = run.sensitivity(name)
    assert np.abs(found.trajectory(59.0)).max() < 1e-12
    step = 1e-6
    times = [
        vi.simulate(ball.replace(**{name: curve(0.0) + by}), initial=[[-2.0], [0.0]], time=60)
        for by in (-step, step)
    ]
    early, late = (run.impacts["time"][8] for run in times)
    assert found.impacts.time[8, 0] == pytest.approx((late - early) / (2 * step), rel=1e-6)


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize("law", ["poisson", "newton", "energetic"])
def test_each_impact_takes_r_at_its_own_speed(curve, law):
    here = pair(curve, friction=0.05, law=law)
    run = vi.simulate(here, initial=REST[2], periods=60)
    differs = 0
    for row in run.impacts:
        r = float(curve(row["approach_velocity"])) if row["stop"] == 0 else 0.8
        normal = here.stops[row["stop"]].normal
        if row["regime"] in (vi.Regime.FRICTIONLESS, vi.Regime.SLIP):
            assert normal @ row["v_post"] == pytest.approx(-r * (normal @ row["v_pre"]), abs=1e-13)
            differs += abs(r - 0.9) > 0.01 and row["stop"] == 0
    assert differs > 20
    audit = run.energy_audit()
    assert abs(audit.residual) < 1e-12 * audit.total


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_derivatives_of_a_run(curve, friction):
    """By the numbers of the curves and by the start, against differences."""
    here = pair(curve, TABLE, friction=friction)
    names = (*curve.names, *(f"{name}_1" for name in TABLE.names), "gap_0", "v_1")
    found = vi.simulate(here, initial=REST[2], periods=5).sensitivity(*names)
    assert not found.one_sided

    def end(name, by):
        start, machine = REST[2].copy(), here
        if name == "v_1":
            start[1, 1] += by
        else:
            machine = here.replace(**{name: value_of(here, name) + by})
        return vi.simulate(machine, initial=start, periods=5).final_state.state.ravel()

    for place, name in enumerate(names):
        if curve is TABLE and name in TABLE.names:
            continue  # of both stops, which is tested by those of one
        step = 1e-6
        slope = (np.array(end(name, step)) - np.array(end(name, -step))) / (2 * step)
        size = max(1.0, np.abs(slope).max())
        assert np.abs(found.final_state[..., place] - slope).max() < 2e-6 * size, name


def value_of(machine, name):
    """Return a number of a structure by its name."""
    what, _, place = name.rpartition("_")
    if what in ("r", "speed") or not place.isdigit():
        return getattr(machine.stops[0], name)
    return getattr(machine.stops[int(place)], what)


def test_numbers_of_all_stops_are_the_sum_of_those_of_each():
    here = pair(TABLE, TABLE)
    run = vi.simulate(here, initial=REST[2], periods=5)
    found = run.sensitivity("r_1", "r_1_0", "r_1_1").final_state
    assert found[..., 0] == pytest.approx(found[..., 1] + found[..., 2], rel=1e-12)
    assert np.abs(found[..., 1]).max() > 0.1
    assert np.abs(found[..., 2]).max() > 0.1
    made = run.sensitivity(both={"r_1": 1.0}).final_state
    assert made[..., 0] == pytest.approx(found[..., 0], rel=1e-12)

    def machine(x):
        return pair(vi.RestitutionTable(TABLE.speeds, [0.9, x, 0.5]), TABLE)

    by_function = run.sensitivity(x=(machine, 0.75)).final_state
    assert by_function[..., 0] == pytest.approx(found[..., 1], rel=1e-8)

    def moved(x):
        return pair(vi.RestitutionTable([0.05, x, 1.0], TABLE.values), TABLE)

    ours, theirs = run.sensitivity("speed_1_0"), run.sensitivity(x=(moved, 0.3))
    assert theirs.final_state == pytest.approx(ours.final_state, rel=1e-8)
    assert np.abs(ours.final_state).max() > 0.01


def test_derivatives_where_several_stops_are_struck_at_once():
    here, start = wedge(TABLE), np.array([[0.2, 0.0], [0.0, 1.0]])
    run = vi.simulate(here, initial=start, periods=1)
    pressed = run.impacts[run.impacts["approach_velocity"] == 0.0]
    assert len(pressed) >= 3
    found = run.sensitivity("r_1", "r_2", "v_1")

    def end(name, by):
        first, machine = start.copy(), here
        if name == "v_1":
            first[1, 1] += by
        else:
            machine = here.replace(**{name: TABLE.values[int(name[-1])] + by})
        return vi.simulate(machine, initial=first, periods=1).final_state.state.ravel()

    for place, name in enumerate(("r_1", "r_2", "v_1")):
        step = 1e-6
        slope = (np.array(end(name, step)) - np.array(end(name, -step))) / (2 * step)
        size = max(1.0, np.abs(slope).max())
        assert np.abs(found.final_state[..., place] - slope).max() < 2e-6 * size, name


def test_an_impact_at_a_knot_is_marked():
    table = vi.RestitutionTable([0.5, 2.0], [0.9, 0.6])
    ball = vi.Structure([[1.0]], [[0.0]], [vi.Stop([1], 1.0, table)])
    found = vi.simulate(ball, initial=[[0.0], [2.0]], time=1).sensitivity("v_0", "r_1")
    assert [at.reason for at in found.one_sided] == ["restitution_knot"]
    # From above r is constant.
    assert found.impacts.after[0].reshape(2, 2)[1] == pytest.approx([-0.6, -2.0], rel=1e-15)


@pytest.mark.parametrize("curve", CURVES)
def test_multipliers_have_the_product_of_the_determinants(curve):
    here = single(curve)
    motion = vi.simulate(here, initial=REST[1], periods=600, keep=60).refine()
    check_product(curve, motion, motion.state, 2.0 * 0.02)


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_the_reference_agrees(curve, friction):
    run = vi.simulate(pair(curve, TABLE, friction=friction), initial=REST[2], periods=6)
    found = vi.verify(run)
    assert found.horizon is None
    assert found.certified
    assert found.impacts["regime_agrees"].all()
    for name in [name for name in found.impacts.dtype.names if name.startswith("error_")]:
        assert found.impacts[name].max() < 1e-11, name


def test_the_reference_agrees_where_several_stops_are_struck_at_once():
    run = vi.simulate(wedge(TABLE), initial=[[0.2, 0.0], [0.0, 1.0]], periods=1)
    assert vi.verify(run).horizon is None


@pytest.mark.parametrize("curve", CURVES)
def test_copies_and_files(curve, tmp_path):
    here = pair(curve)
    for other in (
        eval(repr(here), vars(vi) | {"array": np.array}),
        vi.Structure.from_dict(here.to_dict()),
        vi.Structure.from_json(here.to_json()),
        pickle.loads(pickle.dumps(here)),
        copy.deepcopy(here),
    ):
        assert other == here
        assert hash(other) == hash(here)
    stop = here.stops[0]
    assert vi.Stop.from_dict(stop.to_dict()) == stop != pair(0.9).stops[0]
    run = vi.simulate(here, initial=REST[2], periods=20)
    run.save(tmp_path / "run")
    again = vi.load(tmp_path / "run")
    assert again.system == here
    assert same(run, again)
    assert same(run.resume(periods=10), again.resume(periods=10))


def test_numbers_vary_by_name():
    here = single(TABLE)
    assert here.stops[0].r_1 == 0.75
    assert here.replace(r_1=0.6).stops[0].r_1 == here.replace(r_1_0=0.6).stops[0].r_1 == 0.6
    assert here.stops[0].replace(r_2=0.4).restitution == vi.RestitutionTable(
        TABLE.speeds, [0.9, 0.75, 0.4]
    )
    mixed = pair(0.7, LAW)
    assert mixed.replace(r_low=0.8).stops[1].r_low == 0.8
    assert mixed.replace(restitution_0=0.5).stops[0].restitution == 0.5
    diagram = vi.bifurcation_diagram(here, r_2=[0.4, 0.5, 0.6], initial=REST[1], periods=60, keep=5)
    for place, value in enumerate((0.4, 0.5, 0.6)):
        run = vi.simulate(here.replace(r_2=value), initial=REST[1], periods=60, keep=5)
        assert np.array_equal(diagram.run(place).impacts, run.impacts)
    motion = vi.simulate(here, initial=REST[1], periods=600, keep=60).refine()
    for name in ("r_2", "r_2_0"):
        [there] = motion.follow(**{name: (0.45, 0.5)}).at(**{name: 0.47})
        assert there.system.stops[0].r_2 == 0.47
        assert there.admissible
        run = vi.simulate(there.system, initial=there.state, periods=there.m)
        assert run.final_state.state == pytest.approx(there.state, abs=1e-9)


def test_a_value_of_a_table_is_found_from_times_of_impacts():
    here = single(TABLE)
    run = vi.simulate(here, initial=REST[1], periods=30)
    heard = vi.measure(run, "impact_times", noise=1e-4, seed=1)
    found = vi.fit(heard, here.replace(r_2=0.55), unknown=["r_2"], initial=REST[1])
    assert found.verdict == "fits"
    assert abs(found.values["r_2"] - 0.5) < 4.0 * found.errors["r_2"] < 0.01


def test_a_file_of_the_command_line(run_command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    curve = "{ speeds = [0.05, 0.3, 1.0], values = [0.9, 0.75, 0.5] }"
    (tmp_path / "rig.toml").write_text(
        "[structure]\nmass = [[1]]\nstiffness = [[1]]\ndamping_ratios = [0.02]\n"
        "drive_amplitude = [1]\ndrive_frequency = 2.0\n"
        f"stops = [{{ normal = [1], gap = 0.2, restitution = {curve} }}]\n"
        "[run]\ninitial = [[0], [0]]\nperiods = 60\nkeep = 20\n",
        encoding="utf-8",
    )
    assert run_command("simulate --system rig.toml --save run.npz")[0] == 0
    run = vi.simulate(single(TABLE), initial=REST[1], periods=60, keep=20)
    assert vi.load("run.npz") == run
    line = "simulate --system rig.toml --set r-1 0.6 --set r-0-0 0.95 --save run.npz"
    assert run_command(line)[0] == 0
    assert vi.load("run.npz").system == single(TABLE).replace(r_1=0.6, r_0=0.95)
    line = "diagram --system rig.toml --vary r-1 0.4 0.6 3 --quiet --periods 20 --keep 5"
    assert run_command(f"{line} --save d.npz")[0] == 0
    assert vi.load("d.npz").parameter.tolist() == [0.4, 0.5, 0.6]
    code, _, said = run_command("simulate --system rig.toml --set r-3 0.6")
    assert (code, "r-1, r-2" in said) == (2, True)


def test_what_is_refused_says_so():
    here = single(TABLE)
    mixed = pair(0.7, LAW)
    run = vi.simulate(here, initial=REST[1], periods=600, keep=60)
    for message, call in (
        ("restitution = 1.5", lambda: vi.Stop([1], 0.1, 1.5)),
        ("restitution = 'r'", lambda: vi.Stop([1], 0.1, "r")),
        (r"stops\[0\].r_1 = 1.5", lambda: here.replace(r_1=1.5)),
        ("r_7 = 0.5", lambda: here.replace(r_7=0.5)),
        ("r_low_0 = 0.5", lambda: mixed.replace(r_low_0=0.5)),
        ("restitution", lambda: run.sensitivity("restitution")),
        ("restitution_0", lambda: run.sensitivity("restitution_0")),
        ("r_5", lambda: run.sensitivity("r_5")),
        ("restitution", lambda: run.sensitivity(x={"restitution": 1.0})),
        ("restitution", lambda: vi.bifurcation_diagram(
            here, restitution=[0.5], initial=REST[1], periods=5)),
        ("restitution", lambda: run.refine().follow(restitution=(0.5, 0.6))),
    ):  # fmt: skip
        with pytest.raises(vi.ParameterError, match=message):
            call()
    with pytest.raises(vi.ParameterError, match="for proofs of branches"):
        vi.prove(run.refine().follow(gap=(0.19, 0.2)))
    proof = vi.prove(run.refine())
    assert proof.verdict == "undecided"
    assert "approach velocity" in proof.why
