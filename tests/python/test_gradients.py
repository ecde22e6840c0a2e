"""Gradients of functions of a run: against differences, and what would lose a derivative."""

import math

import numpy as np
import pytest

import vibroimpact as vi
from small_results import START
from struck import BEAM, MOVING, REST
from systems import PAPER
from two_masses import structure

SYSTEM = PAPER.replace(damping=(0.02, 0.05), friction=0.1, phase=0.3)
NAMES = ("gap", "restitution", "mass_ratio", "drive_frequency", "oscillator_damping", "v1", "x2")
WINDOW = {"initial": START, "periods": 12, "keep": 7}


def differences(function, system, names, **options):
    """The derivatives by central differences of the values alone."""
    given = system.to_dict() | dict(zip(("x1", "v1", "x2", "v2"), START, strict=True))
    found = []
    for name in names:
        ends = [
            vi.gradient(function, system, {name: given[name] + step}, **options)[0]
            for step in (-1e-6, 1e-6)
        ]
        found.append((np.asarray(ends[1]) - np.asarray(ends[0])) / 2e-6)
    return np.stack(found, axis=-1)


FUNCTIONS_OF_A_RUN = {
    "an impact": lambda run: run.impacts["time"][3],
    "the hardest impact": lambda run: run.impacts["approach_velocity"].max(),
    "energy lost": lambda run: run.impacts["energy_loss"].sum(),
    "impulses": lambda run: run.impacts["impulse_normal"] - 2.0 * run.impacts["impulse_tangential"],
    "the clock": lambda run: run.impacts["phase"] + run.impacts["time_in_period"],
    "the end": lambda run: run.final_state.state,
    "a coordinate of the end": lambda run: run.final_state.x2**2 / run.final_state.time,
    "power": lambda run: (
        2.0
        * run.system.oscillator_damping
        / run.system.mass_ratio
        * run.integral(lambda t, states: states[:, 3] ** 2)
    ),
    "power of the drive": lambda run: run.integral(
        lambda t, states: states[:, 1] * np.cos(run.system.drive_frequency * t + run.system.phase)
    ),
    "time": lambda run: run.integral(lambda t, states: np.ones(len(t))) / run.system.drive_period,
    "sections": lambda run: np.linalg.norm(run.stroboscopic[-3:], axis=0),
    "a trace": lambda run: run.trajectory([18.0, 22.0, 37.0])[:, 0].std(),
    "intervals": lambda run: np.median(np.diff(run.impacts["time"])),
    "the start": lambda run: run.initial @ np.arange(4.0),
    "several": lambda run: [run.system.gap, 3.0, run.impacts["x1"][0]],
}


@pytest.mark.parametrize("name", FUNCTIONS_OF_A_RUN)
def test_gradients_are_those_of_differences(name):
    function = FUNCTIONS_OF_A_RUN[name]
    value, slope = vi.gradient(function, SYSTEM, NAMES, **WINDOW)
    assert np.shape(slope) == (*np.shape(value), len(NAMES))
    expected = differences(function, SYSTEM, NAMES, **WINDOW)
    assert slope == pytest.approx(expected, rel=1e-6, abs=2e-8 * max(1.0, np.abs(value).max()))


def test_the_integral_of_the_damping_is_that_of_the_audit():
    run = vi.simulate(SYSTEM, **WINDOW)
    zeta1, zeta2 = SYSTEM.damping

    def work(run):
        def power(_, states):
            first = zeta1 * SYSTEM.frequency_ratio * states[:, 1] ** 2
            return -2.0 * (first + zeta2 * states[:, 3] ** 2 / SYSTEM.mass_ratio)

        return run.integral(power)

    value, _ = vi.gradient(work, SYSTEM, "gap", **WINDOW)
    assert value == pytest.approx(run.energy_audit().damping, rel=1e-12)


def test_values_are_those_of_the_run():
    run = vi.simulate(SYSTEM, **WINDOW)
    for column in (each for each in run.impacts.dtype.names if each not in ("regime", "period")):
        value, _ = vi.gradient(lambda r, c=column: r.impacts[c], SYSTEM, ["gap"], **WINDOW)
        assert np.array_equal(value, run.impacts[column])
    for name in ("regime", "period"):
        value, slope = vi.gradient(lambda r, c=name: r.impacts[c], SYSTEM, ["gap"], **WINDOW)
        assert np.array_equal(value, run.impacts[name])
        assert not slope.any()


def test_a_function_makes_the_system():
    def rig(stiffness, mass):
        return vi.System.from_physical(
            pendulum_mass=3, oscillator_mass=mass, length=0.1, torsional_stiffness=500,
            stiffness=stiffness, gap=0.05, restitution=0.8, drive_frequency=180,
            moment_amplitude=300,
        )  # fmt: skip

    def last(run):
        return run.final_state.x1 + run.system.mass_ratio

    at = {"stiffness": 50e3, "mass": 5.0, "v1": 0.5}
    value, slope = vi.gradient(last, rig, at, initial=START, periods=8)
    for place, (name, step) in enumerate({"stiffness": 1.0, "mass": 1e-4, "v1": 1e-5}.items()):
        ends = [
            vi.gradient(last, rig, at | {name: at[name] + sign * step}, initial=START, periods=8)
            for sign in (-1.0, 1.0)
        ]
        assert slope[place] == pytest.approx((ends[1][0] - ends[0][0]) / (2 * step), rel=1e-6)
    assert np.isfinite(value)


def test_an_impact_at_a_moving_end_has_its_part():
    # The rate jumps from 1 to -restitution at the impact, which the gap moves.
    ball = vi.System(
        mass_ratio=0, frequency_ratio=0, restitution=0.5, gap=1, drive_frequency=0, contact="direct"
    )
    value, slope = vi.gradient(
        lambda run: run.integral(lambda t, states: states[:, 1]),
        ball,
        ["gap", "restitution"],
        initial=(0, 2, 0, 0),
        time=1,
    )
    assert value == pytest.approx(0.5)
    assert slope == pytest.approx([1.5, -1.0])


def first(run):
    """When the first impact comes."""
    return run.impacts["time"][0]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"function": 3}, "function"),
        ({"function": lambda run: "late"}, "function"),
        ({"function": lambda run: run.impacts["impulse"][0]}, "impulse"),
        ({"function": lambda run: run.integral(lambda t, x: 1.0)}, "rate"),
        ({"names": ["gab"]}, "did you mean gap"),
        ({"names": []}, "names"),
        ({"names": ["gap", "gap"]}, "each once"),
        ({"names": 3}, "names"),
        ({"names": [3]}, "names"),
        ({"names": {"gap": math.nan}}, r"names\['gap'\] = nan"),
        ({"names": {"restitution": 2.0}}, "restitution = 2"),
        ({"system": 3}, "system"),
        ({"system": lambda width: PAPER, "names": ["width"]}, "values"),
        ({"system": lambda width: PAPER, "names": {"gap": 0.5}}, "width"),
        ({"periods": 0}, "periods"),
        ({"initial": [START, START]}, "initial"),
    ],
)
def test_wrong_arguments_are_named(change, said):
    given = {"function": first, "system": PAPER, "names": ["gap"], "initial": START, "periods": 3}
    with pytest.raises((vi.ParameterError, vi.StateError), match=said):
        vi.gradient(**given | change)


@pytest.mark.parametrize(
    ("function", "said"),
    [
        (lambda run: run.system.mass, "mass has no derivatives"),
        (lambda run: run.final_state.mode, "mode has no derivatives"),
    ],
)
def test_unknown_attributes_are_named(function, said):
    with pytest.raises(AttributeError, match=said):
        vi.gradient(function, PAPER, ["gap"], initial=START, periods=3)


def test_an_end_that_moves_and_is_no_section_is_refused():
    for option in ({"section_phase": 1.0}, {"keep": 0}):
        options = {"initial": START, "periods": 3} | option
        with pytest.raises(vi.ParameterError, match=r"give time, or .* keep of at least 1"):
            vi.gradient(lambda run: run.final_state.x1, PAPER, ["drive_frequency"], **options)
        vi.gradient(lambda run: run.final_state.x1, PAPER, ["gap"], **options)


def test_an_integral_over_chatter_is_refused():
    sticky = PAPER.replace(
        drive_frequency=0.25, restitution=0.3, damping=(0.1, 0.1), moment_amplitude=3.0
    )

    def work(run):
        return run.integral(lambda t, states: states[:, 1])

    with pytest.raises(vi.ParameterError, match="chatter"):
        vi.gradient(work, sticky, ["gap"], initial=START, periods=3)


def test_one_sided_derivatives_are_told():
    ball = vi.System(
        mass_ratio=0, frequency_ratio=0, restitution=0.5, gap=0, drive_frequency=0, contact="direct"
    )
    told = []

    def end(run):
        told.extend(each.reason for each in run.one_sided)
        return run.final_state.v1

    value, slope = vi.gradient(end, ball, ["v1"], initial=(0, 2, 0, 0), time=1)
    assert (value, slope.tolist(), told) == (-1.0, [-0.5], ["start_on_contact"])


# Structures.

MOVED_STOPS = MOVING.replace(damping_ratios=[0.05])


def of_mass_and_gap(mass=1.1, gap=0.6, frequency=0.7):
    """A structure of other numbers."""
    stops = [vi.Stop([2], gap, 0.9, amplitude=0.4), vi.Stop([-1], 0.4, 0.9)]
    return vi.Structure(
        [[mass]], [[1.0]], stops, damping=[[0.1]], drive_amplitude=[1], drive_frequency=frequency
    )


def of_mass(mass):
    """A structure of a mass between stops at rest."""
    return MOVED_STOPS.replace(
        mass=[[mass]], damping=[[0.1]], stops=[vi.Stop([2], 0.4, 0.6), MOVING.stops[1]]
    )


def fourth_order(function, machine, at, name, **options):
    """A derivative by differences of fourth order: near low impacts the second ones are large."""

    def value(steps):
        return vi.gradient(function, machine, at | {name: at[name] + steps * 1e-6}, **options)[0]

    return (8 * (value(1) - value(-1)) - (value(2) - value(-2))) / 12e-6


OF_STRUCTURES = {
    "time": lambda run: run.impacts["time"].sum(),
    "velocity": lambda run: run.impacts["approach_velocity"].sum(),
    "energy": lambda run: run.impacts["energy_loss"].sum(),
    "impulse": lambda run: run.impacts["impulse_normal"].sum(),
    "clock": lambda run: run.impacts["phase"].sum() + 3.0 * run.impacts["time_in_period"].sum(),
    "place": lambda run: run.impacts["q"].sum() + run.impacts["v_post"].max(),
    "the end": lambda run: run.final_state.q_0 + run.final_state.state.sum(),
    "sections": lambda run: run.stroboscopic.std(),
    "a trace": lambda run: run.trajectory([1.0, 5.0]).mean(),
    "power": lambda run: run.integral(lambda t, states: states[:, 1, 0] ** 2),
    "itself": lambda run: run.system.drive_frequency * run.initial[0, 0] + run.system.gap_0,
}


@pytest.mark.parametrize("name", OF_STRUCTURES)
def test_gradients_of_structures_are_those_of_differences(name):
    function = OF_STRUCTURES[name]
    options = {"initial": [[0.1], [0.2]], "periods": 4}
    cases = [
        (MOVED_STOPS, {"drive_frequency": 0.7, "gap_0": 0.6, "restitution_1": 0.9, "v_0": 0.2}),
        (of_mass_and_gap, {"mass": 1.1, "gap": 0.6, "frequency": 0.7, "q_0": 0.1}),
    ]
    if name == "energy":
        cases.append((of_mass, {"mass": 1.1}))
    for machine, at in cases:
        _, slope = vi.gradient(function, machine, at, **options)
        for place, each in enumerate(at):
            expected = fourth_order(function, machine, at, each, **options)
            assert slope[place] == pytest.approx(expected, rel=1e-7, abs=3e-8)


@pytest.mark.parametrize("way", ["normal", "tangential"])
def test_gradients_of_impulses_with_friction_at_stops(way):
    machine, options = structure(), {"initial": REST[2], "periods": 6}
    at = {"gap_0": machine.stops[0].gap, "drive_frequency": machine.drive_frequency}

    def squares(run):
        return (run.impacts[f"impulse_{way}"] ** 2).sum()

    value, slope = vi.gradient(squares, machine, at, **options)
    assert value == pytest.approx(squares(vi.simulate(machine, **options)), rel=1e-14)
    assert value > 1e-3
    for place, each in enumerate(at):
        expected = fourth_order(squares, machine, at, each, **options)
        assert slope[place] == pytest.approx(expected, rel=1e-6, abs=3e-8)


def on_wall(law, friction, **fields):
    """Impacts on a wall at rest and on one that moves, with their regimes."""
    given = {"restitution": 0.7, "oscillator_damping": 0.1, "law": law, "friction": friction}
    return vi.System(mass_ratio=0, **given | fields)


# A wall at rest; one that moves, from random ones that have these regimes.
WALLS = {
    "smooth": (0.0, {"frequency_ratio": 0.5, "gap": 0.2, "drive_frequency": 1.3,
                     "moment_amplitude": 2.0, "force_amplitude": 0.3}),
    "at rest": (0.3, {"frequency_ratio": 0.5, "gap": 0.2, "drive_frequency": 1.3,
                      "moment_amplitude": 2.0}),
    "sticks": (1.12, {"frequency_ratio": 1.63, "gap": -0.796, "drive_frequency": 1.786,
                      "moment_amplitude": 0.584}),
    "moves": (1.1, {"frequency_ratio": 1.0, "gap": -0.2, "drive_frequency": 1.1,
                    "moment_amplitude": 1.0, "force_amplitude": 0.3}),
    "reverses": (1.409, {"frequency_ratio": 1.826, "gap": 0.171, "drive_frequency": 1.594,
                         "moment_amplitude": 1.859, "force_amplitude": 0.3}),
}  # fmt: skip


@pytest.mark.parametrize("law", ["poisson", "newton", "energetic"])
@pytest.mark.parametrize("name", WALLS)
def test_impulses_and_losses_on_walls_have_derivatives(name, law):
    friction, fields = WALLS[name]
    machine = on_wall(law, friction, **fields)
    options = {"initial": (-1.2, 0.1, 0, 0), "time": 6.0}
    names = ["gap", "restitution", "moment_amplitude", "drive_frequency"]
    names += ["friction"] if friction else []
    at = {each: getattr(machine, each) for each in names}
    for column in ("impulse_normal", "impulse_tangential", "energy_loss"):

        def first(run, column=column):
            return run.impacts[column][:3]

        value, slope = vi.gradient(first, machine, at, **options)
        assert np.array_equal(value, first(vi.simulate(machine, **options)))
        for place, each in enumerate(names):
            expected = fourth_order(first, machine, at, each, **options)
            assert slope[..., place] == pytest.approx(expected, rel=1e-6, abs=1e-6)


def test_every_regime_on_walls_is_among_those():
    found = set()
    for friction, fields in WALLS.values():
        machine = on_wall("poisson", friction, **fields)
        run = vi.simulate(machine, initial=(-1.2, 0.1, 0, 0), time=6.0)
        found |= {
            (vi.Regime(r).name, run.impacts["v2_pre"].any()) for r in run.impacts["regime"][:3]
        }
    both = {("STICK_RESTITUTION", moves) for moves in (False, True)}
    both |= {("REVERSAL_RESTITUTION", moves) for moves in (False, True)}
    assert found >= both | {("SLIP", True), ("REVERSAL_APPROACH", True), ("FRICTIONLESS", True)}


def test_the_impulse_that_holds_a_tip_on_a_wall_needs_a_number_for_r():
    friction, fields = WALLS["sticks"]
    curve = vi.RestitutionPowerLaw(0.8, 0.1)
    machine = on_wall("poisson", friction, **fields).replace(restitution=curve)
    options = {"initial": (-1.2, 0.1, 0, 0), "time": 6.0}
    with pytest.raises(vi.ParameterError, match=r"impulse_normal'\] has no derivatives"):
        vi.gradient(lambda run: run.impacts["impulse_normal"].sum(), machine, ["gap"], **options)
    at = {"gap": machine.gap}

    def lost(run):
        return run.impacts["energy_loss"].sum()

    _, slope = vi.gradient(lost, machine, at, **options)
    expected = fourth_order(lost, machine, at, "gap", **options)
    assert slope[0] == pytest.approx(expected, rel=1e-6)


def test_gradients_of_beams_from_modes():
    options = {"initial": REST[3], "periods": 5}
    for name in ("velocity", "energy", "impulse", "place"):
        function = OF_STRUCTURES[name]
        _, slope = vi.gradient(function, BEAM, ["gap", "drive_frequency"], **options)
        for place, (each, value) in enumerate({"gap": 0.3, "drive_frequency": 1.3}.items()):
            expected = fourth_order(function, BEAM, {each: value}, each, **options)
            assert slope[place] == pytest.approx(expected, rel=1e-7, abs=3e-8)


@pytest.mark.parametrize("found", [None, True, np.bool_(False), "gap"])
def test_a_function_that_returns_no_number_is_refused(found):
    with pytest.raises(vi.ParameterError, match="a function that returns a number, or an array"):
        vi.gradient(lambda run: found, SYSTEM, ["gap"], initial=(0, 0.5, 0, 0), periods=2)
