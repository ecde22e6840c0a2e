"""SI in, SI out: scales of a system, runs and pictures in SI, against conversion by hand."""

import copy
import math
import pickle

import matplotlib.pyplot as plt
import numpy as np
import pytest

import vibroimpact as vi

LENGTH, MASS, STIFFNESS, OTHER_MASS = 0.2, 0.3, 40.0, 0.5
OMEGA_2 = math.sqrt(STIFFNESS / OTHER_MASS)
MACHINE = {
    "pendulum_mass": MASS,
    "oscillator_mass": OTHER_MASS,
    "length": LENGTH,
    "torsional_stiffness": 1.5,
    "stiffness": STIFFNESS,
    "gap": 0.02,
    "restitution": 0.5,
    "drive_frequency": 12.0,
    "moment_amplitude": 0.4,
    "friction": 0.3,
}


@pytest.fixture(scope="module")
def system():
    return vi.System.from_physical(**MACHINE)


@pytest.fixture(scope="module")
def run(system):
    return vi.simulate(system, initial=(0.1, 1.0, 0.01, 0.02), time=20.0, units="SI")


def test_a_run_goes_on_for_seconds(system, run):
    in_seconds = run.resume(time=3.0, units="SI")
    assert in_seconds.final_state == run.resume(time=3.0 / system.scales.time).final_state
    assert in_seconds.in_si().final_state.time == pytest.approx(23.0, rel=1e-14)
    with pytest.raises(vi.ParameterError, match="units = 's'"):
        run.resume(time=3.0, units="s")
    with pytest.raises(vi.ParameterError, match="time = -1"):
        run.resume(time=-1.0, units="SI")


@pytest.fixture(scope="module")
def orbit(system):
    return vi.simulate(system, initial=(0, 0.1, 0, 0), periods=2000, keep=100).refine()


def without_scales(orbit):
    plain = orbit.system.replace(scales=None)
    return vi.simulate(plain, initial=orbit.initial, periods=100).refine()


def drawn_lines(axes):
    return [line.get_xydata() for ax in axes for line in ax.lines]


def test_a_motion_is_drawn_in_si(system, orbit):
    plain, si = vi.plot.orbit(orbit), vi.plot.orbit(orbit, units="SI")
    scales = system.scales
    factors = [
        (1.0, scales.frequency),
        (scales.length, scales.speed),
        (scales.time, scales.length),
    ]
    for one, other, factor in zip(plain, si, factors, strict=True):
        pairs = zip(drawn_lines([one]), drawn_lines([other]), strict=True)
        assert all(np.allclose(b, a * factor, rtol=1e-13, equal_nan=True) for a, b in pairs)
    assert [ax.get_xlabel() for ax in si] == [
        "angle $x_1$ of body 1 (rad)",
        "position $x_2$ of body 2 (m)",
        "time $t$ (s)",
    ]
    assert si[2].get_xlim()[1] == pytest.approx(orbit.period * scales.time)
    with pytest.raises(vi.ParameterError, match="scales"):
        vi.plot.orbit(without_scales(orbit), units="SI")
    plt.close("all")


AXES = {
    "drive_frequency": ((2.1, 2.2), "frequency", r"drive frequency $\Omega$ (rad/s)"),
    "gap": ((0.09, 0.1), "length", r"gap $\Delta$ (m)"),
    "restitution": ((0.4, 0.5), None, "restitution $r$"),
    "force_amplitude": ((0.0, 0.1), "force", "force amplitude $f_{20}$ (N)"),
    "static_moment": ((-0.1, 0.0), "energy", "static moment $C_{10}$ (N m)"),
    "static_force": ((0.0, 0.1), "force", "static force $F_{20}$ (N)"),
}


@pytest.mark.parametrize("name", AXES)
@pytest.mark.parametrize(
    ("section", "value", "unit"),
    [("impact", "approach_velocity", "speed"), ("stroboscopic", "x2", "length")],
)
def test_a_diagram_is_drawn_in_si(system, name, section, value, unit):
    values, of_axis, label = AXES[name]
    diagram = vi.bifurcation_diagram(
        system, initial=(0, 0.1, 0, 0), periods=60, keep=20, **{name: np.linspace(*values, 5)}
    )
    scales = system.scales
    options = {"section": section, "value": value}
    plain = vi.plot.bifurcation(diagram, **options).collections[0].get_offsets()
    ax = vi.plot.bifurcation(diagram, **options, units="SI")
    factor = 1.0 if of_axis is None else getattr(scales, of_axis)
    if name in ("force_amplitude", "static_force"):
        # The number is f20/(K2 l), or F20/(K2 l).
        factor = STIFFNESS * LENGTH
    expected = plain * [factor, getattr(scales, unit)]
    assert np.allclose(ax.collections[0].get_offsets(), expected, rtol=1e-12)
    assert ax.get_xlabel() == label
    assert ax.get_ylabel().endswith("(m/s)" if unit == "speed" else "(m)")
    room = 0.01 * (values[1] - values[0])
    limits = factor * np.array([values[0] - room, values[1] + room])
    assert ax.get_xlim() == pytest.approx(limits)
    plt.close("all")


def test_a_diagram_over_a_physical_quantity_has_the_scales_of_each_system():
    def machine(stiffness):
        return vi.System.from_physical(**MACHINE | {"stiffness": stiffness})

    diagram = vi.bifurcation_diagram(
        machine, initial=(0, 0.1, 0, 0), periods=60, keep=20, stiffness=[38.0, 42.0]
    )
    options = {"section": "stroboscopic", "value": "v2"}
    plain = vi.plot.bifurcation(diagram, **options).collections[0].get_offsets()
    ax = vi.plot.bifurcation(diagram, **options, units="SI")
    speeds = [machine(stiffness).scales.speed for stiffness in (38.0, 42.0)]
    assert speeds[0] != speeds[1]
    expected = plain[:, 1] * np.repeat(speeds, 20)
    assert np.allclose(ax.collections[0].get_offsets()[:, 1], expected, rtol=1e-12)
    assert ax.get_xlabel() == "stiffness $K_2$ (N/m)"
    plt.close("all")


def test_a_branch_is_drawn_in_si_over_its_diagram(system, orbit):
    span = (orbit.system.drive_frequency - 0.02, orbit.system.drive_frequency + 0.02)
    branch = orbit.follow(drive_frequency=span)
    diagram = vi.bifurcation_diagram(
        system, initial=(0, 0.1, 0, 0), periods=60, keep=20, drive_frequency=np.linspace(*span, 3)
    )
    options = {"diagram": diagram, "section": "stroboscopic", "value": "v1"}
    plain = vi.plot.branches(branch, **options)
    ax = vi.plot.branches(branch, **options, units="SI")
    factor = [system.scales.frequency] * 2
    for one, other in zip(plain.collections[1:], ax.collections[1:], strict=True):
        for a, b in zip(one.get_segments(), other.get_segments(), strict=True):
            assert np.allclose(b, a * factor, rtol=1e-12)
    for one, other in zip(plain.lines, ax.lines, strict=True):
        assert np.allclose(other.get_xydata(), one.get_xydata() * factor, rtol=1e-12)
    assert ax.get_xlabel() == r"drive frequency $\Omega$ (rad/s)"
    assert ax.get_ylabel().endswith("(rad/s)")
    without = vi.Branch(parameter="gap", pieces=(), bifurcations=(), ends=branch.ends)
    assert vi.plot.branches(without, units="SI", legend=False).get_xlabel() == r"gap $\delta$"
    plt.close("all")


def test_scales_are_those_of_the_machine(system):
    scales = system.scales
    assert (scales.length, scales.mass) == (LENGTH, MASS)
    assert scales.time == pytest.approx(1 / OMEGA_2, rel=1e-15)
    by_hand = {
        "frequency": OMEGA_2,
        "speed": LENGTH * OMEGA_2,
        "impulse": MASS * LENGTH * OMEGA_2,
        "force": MASS * LENGTH * OMEGA_2**2,
        "energy": MASS * LENGTH**2 * OMEGA_2**2,
    }
    for name, value in by_hand.items():
        assert getattr(scales, name) == pytest.approx(value, rel=1e-14), name


def test_scales_survive_every_round_trip(system, run, tmp_path):
    run.save(tmp_path / "run.npz")
    trips = [
        eval(repr(system), {"System": vi.System}),
        vi.System.from_dict(system.to_dict()),
        vi.System.from_json(system.to_json()),
        pickle.loads(pickle.dumps(system)),
        copy.copy(system),
        copy.deepcopy(system),
        system.replace(restitution=0.4),
        vi.load(tmp_path / "run.npz").system,
        pickle.loads(pickle.dumps(run)).system,
    ]
    for trip in trips:
        assert trip.scales == system.scales


def test_scales_have_no_influence_on_what_is_equal(system):
    plain = system.replace(scales=None)
    assert plain.scales is None
    assert "scales" not in plain.to_dict()
    assert plain == system
    assert hash(plain) == hash(system)
    assert system != system.replace(gap=0.3)
    start = (0.0, 0.5, 0.0, 0.0)
    one, other = (vi.simulate(each, initial=start, periods=20) for each in (plain, system))
    assert np.array_equal(one.impacts, other.impacts)


@pytest.mark.parametrize(
    "scales",
    [
        {"length": 1.0, "mass": 1.0},
        {"length": 1.0, "mass": 1.0, "tme": 1.0},
        {"length": 0.0, "mass": 1.0, "time": 1.0},
        {"length": math.nan, "mass": 1.0, "time": 1.0},
        3.0,
    ],
)
def test_what_are_no_scales_is_refused(system, scales):
    with pytest.raises(vi.ParameterError, match=r"^scales"):
        system.replace(scales=scales)


def test_start_and_time_in_si_are_those_by_hand(system, run):
    by_hand = vi.simulate(
        system,
        initial=(0.1, 1.0 / OMEGA_2, 0.01 / LENGTH, 0.02 / (LENGTH * OMEGA_2)),
        time=20.0 * OMEGA_2,
    )
    assert np.allclose(run.initial, by_hand.initial, rtol=1e-15)
    assert run.final_state.time == pytest.approx(by_hand.final_state.time, rel=1e-15)
    assert run.in_si().initial == pytest.approx((0.1, 1.0, 0.01, 0.02), rel=1e-14)
    assert run.in_si().final_state.time == pytest.approx(20.0, rel=1e-14)


def test_a_run_in_si_has_the_numbers_by_hand(run):
    si = run.in_si()
    assert len(run.impacts) > 20
    by_hand = {
        "time": 1 / OMEGA_2,
        "period": 1,
        "x1": 1,
        "v1_pre": OMEGA_2,
        "v1_post": OMEGA_2,
        "x2": LENGTH,
        "v2_pre": LENGTH * OMEGA_2,
        "v2_post": LENGTH * OMEGA_2,
        "phase": 1,
        "regime": 1,
        "impulse_normal": MASS * LENGTH * OMEGA_2,
        "impulse_tangential": MASS * LENGTH * OMEGA_2,
        "energy_loss": MASS * LENGTH**2 * OMEGA_2**2,
    }
    for name, unit in by_hand.items():
        assert np.allclose(si.impacts[name], run.impacts[name] * unit, rtol=1e-13), name
    units = [1, OMEGA_2, LENGTH, LENGTH * OMEGA_2]
    assert np.allclose(si.stroboscopic, run.stroboscopic * units, rtol=1e-13)
    assert np.allclose(si.events["time"] * OMEGA_2, run.events["time"], rtol=1e-13)
    times = np.linspace(0.0, 20.0, 50)
    force = MASS * LENGTH * OMEGA_2**2
    wanted = run.trajectory(times / run.system.scales.time, forces=True) * [*units, force, force]
    assert np.allclose(si.trajectory(times, forces=True), wanted, rtol=1e-12, atol=1e-15)
    audit, works = run.energy_audit(), si.energy_audit()
    assert works.moment == pytest.approx(audit.moment * MASS * (LENGTH * OMEGA_2) ** 2, rel=1e-13)
    assert not si.impacts.flags.writeable


def test_momentum_and_energy_are_conserved_in_si(run):
    hit = run.in_si().impacts[5]
    normal = OTHER_MASS * (hit["v2_post"] - hit["v2_pre"])
    assert abs(normal) == pytest.approx(hit["impulse_normal"], rel=1e-9)
    energies = [
        0.5 * MASS * (LENGTH * hit[f"v1_{when}"]) ** 2 + 0.5 * OTHER_MASS * hit[f"v2_{when}"] ** 2
        for when in ("pre", "post")
    ]
    assert energies[0] - energies[1] == pytest.approx(hit["energy_loss"], rel=1e-9)


def test_the_whole_window_can_be_asked_for_in_seconds(run):
    si = run.in_si()
    rows = si.trajectory([si.kept_from, si.final_state.time])
    assert np.allclose(rows[1], si.final_state.state, rtol=1e-12)
    with pytest.raises(vi.ParameterError, match="kept window"):
        si.trajectory([25.0])


@pytest.mark.parametrize("forces", [False, True])
def test_one_time_in_seconds_gives_one_row(run, forces):
    si = run.in_si()
    middle = 0.5 * (si.kept_from + si.final_state.time)
    for time in (si.kept_from, middle, np.float64(middle), np.array(middle), si.final_state.time):
        row = si.trajectory(time, forces=forces)
        assert row.shape == ((6,) if forces else (4,))
        assert np.array_equal(row, si.trajectory([float(time)], forces=forces)[0])
    for time in (25.0, math.nan, "0.5", [[0.5]]):
        with pytest.raises(vi.ParameterError, match=r"^t "):
            si.trajectory(time, forces=forces)


def test_without_scales_si_is_a_typed_error(system):
    plain = system.replace(scales=None)
    start = (0, 0.5, 0, 0)
    run = vi.simulate(plain, initial=start, periods=10)
    for call in (
        lambda: vi.simulate(plain, initial=start, periods=10, units="SI"),
        run.in_si,
        lambda: vi.plot.time_history(run, units="SI"),
    ):
        with pytest.raises(vi.ParameterError, match="from_physical"):
            call()
    with pytest.raises(vi.ParameterError, match="units = 'si'"):
        vi.simulate(system, initial=start, periods=10, units="si")


def test_states_go_there_and_back(system):
    states = np.array([[0.1, 0.2, 0.3, 0.4], [1.0, -2.0, 3.0, -4.0]])
    scales = system.scales
    assert np.allclose(scales.from_si(scales.to_si(states)), states, rtol=1e-15)
    with pytest.raises(vi.ParameterError, match="states"):
        scales.to_si([1.0, 2.0])


LABELS = {
    "time_history": ("(s)", "(m)"),
    "gap_history": ("(s)", "(m)"),
    "displacement_history": ("(s)", "(rad), $x_2$ (m)"),
    "phase_portrait": ("(rad), $x_2$ (m)", "(rad/s), $\\dot x_2$ (m/s)"),
    "impact_section": ("(rad)", "(rad/s)"),
    "contact_force": ("(s)", "(N)"),
    "stroboscopic": ("(rad)", "(rad/s)"),
}


@pytest.mark.parametrize("name", LABELS)
def test_pictures_in_si_are_those_of_the_run_times_its_scales(run, name):
    draw = getattr(vi.plot, name)
    plain, si = draw(run), draw(run, units="SI")
    x, y = LABELS[name]
    assert si.get_xlabel().endswith(x)
    assert si.get_ylabel().endswith(y)
    assert "(" not in plain.get_xlabel()
    if name == "impact_section":
        points = si.collections[0].get_offsets()
        assert np.allclose(points[:, 1], run.impacts["v1_pre"] * OMEGA_2, rtol=1e-13)
    elif name == "stroboscopic":
        points = si.collections[0].get_offsets()
        assert np.allclose(points, run.in_si().stroboscopic[:, :2], rtol=1e-13)
    elif name != "phase_portrait":
        times = [np.asarray(ax.lines[-1].get_xdata(), float) for ax in (plain, si)]
        assert np.allclose(times[0] / OMEGA_2, times[1], rtol=1e-13)
    plt.close("all")


def test_a_window_in_si_is_in_seconds(run):
    ax = vi.plot.gap_history(run, units="SI", window=(15.0, 16.0))
    assert ax.get_xlim() == pytest.approx((15.0, 16.0), rel=1e-12)
    g = run.system.gap_function(run.trajectory([15.5 / run.system.scales.time]))[0] * LENGTH
    line = ax.lines[-1]
    assert np.interp(15.5, line.get_xdata(), line.get_ydata()) == pytest.approx(g, abs=1e-4)
    plt.close("all")


def test_all_that_is_kept_can_be_drawn_in_seconds(run):
    # Near its ends, of which some are rounded away from the kept part on their way to seconds.
    for periods in range(3, 30):
        part = vi.simulate(run.system, initial=run.initial, periods=periods, keep=2)
        si = part.in_si()
        window = (si.kept_from, si.final_state.time)
        ax = vi.plot.displacement_history(part, units="SI", window=window)
        assert ax.get_xlim() == pytest.approx(window, rel=1e-14)
        plt.close("all")
    with pytest.raises(vi.ParameterError, match="kept window"):
        vi.plot.time_history(part, units="SI", window=(0.0, window[1]))
    with pytest.raises(vi.ParameterError, match="window ="):
        vi.plot.time_history(part, units="SI", window=(2.0, 1.0))


@pytest.mark.parametrize("name", ["force_amplitude", "static_force"])
def test_a_force_on_a_wall_has_no_unit(system, name):
    wall = system.replace(mass_ratio=0.0)
    call = {"initial": (-0.1, 0.1, 0, 0), "periods": 20, "keep": 10}
    diagram = vi.bifurcation_diagram(wall, **call, **{name: [0.0, 0.1]})
    with pytest.raises(vi.ParameterError, match=rf"^mass_ratio = 0\.0 .*{name} in N: a wall"):
        vi.plot.bifurcation(diagram, section="stroboscopic", units="SI")
    assert vi.plot.bifurcation(diagram, section="stroboscopic").get_xlabel()
    plt.close("all")
