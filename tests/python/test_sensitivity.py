"""Derivatives of runs: against multipliers, differences of runs, and each other."""

import pickle

import numpy as np
import pytest

import vibroimpact as vi
from ctrl_c import asks_of, ctrl_c_at
from references import reference, scene_initial, scene_system
from small_results import START, run
from struck import onset_between
from systems import PAPER
from vibroimpact._core import PARAMETERS
from vibroimpact.system import SYMBOLS

STATE = ("x1", "v1", "x2", "v2")
EVERY = [*PARAMETERS, *STATE]
BY = {**SYMBOLS, "phi": "phase"}
DAMPED = PAPER.replace(
    damping=(0.02, 0.03), force_amplitude=0.3, static_moment=0.1, static_force=-0.05, phase=0.3
)


# With contact that slides, sticks and is released.
CHATTERS = DAMPED.replace(restitution=0.3, drive_frequency=0.6, force_amplitude=0.8)

SCENES = reference("sensitivity_reference.json")


@pytest.mark.parametrize("name", SCENES)
def test_derivatives_are_those_of_the_reference(name):
    scene = SCENES[name]
    system = scene_system(scene).replace(contact=scene["contact"], law=scene["law"])
    of = vi.simulate(system, initial=scene_initial(scene), periods=scene["periods"])
    found = of.sensitivity(*(BY.get(symbol, symbol) for symbol in scene["by"]))
    number = len(scene["regimes"]) - 1
    assert len(of.impacts) > number
    time, before, after = (table[number] for table in found.impacts)
    mine = [time, *before, after[1], after[3]]
    for rows, at in ((mine, scene["impact"]), (found.stroboscopic[-1], scene["section"])):
        exact = np.array([[float(value) for value in row] for row in at.values()])
        # Relative to the derivatives of the whole state.
        off = np.abs(np.array(rows) - exact).max(axis=0) / (1 + np.abs(exact).max(axis=0))
        assert off.max() < 3e-14, found.names[off.argmax()]


@pytest.mark.parametrize(
    ("changes", "label"),
    [
        ({}, "1-1"),
        ({"drive_frequency": 2.75, "moment_amplitude": 1.5, "pendulum_damping": 0.05}, "2-1"),
        ({"friction": 0.3, "pendulum_damping": 0.02}, "1-1"),
    ],
)
def test_sections_of_a_periodic_motion_have_its_multipliers(changes, label):
    settled = vi.simulate(PAPER.replace(**changes), initial=START, periods=600, keep=10)
    motion = settled.refine()
    assert motion.label == label
    around = vi.simulate(motion.system, initial=motion.sections[0], periods=motion.m)
    matrix = around.sensitivity(*STATE).stroboscopic[-1]
    found = np.sort_complex(np.linalg.eigvals(matrix))
    assert found == pytest.approx(np.sort_complex(motion.multipliers), abs=1e-9)


def everything(of: vi.Run, times) -> np.ndarray:
    """All numbers that are differentiated, in one row."""
    impacts = of.impacts
    sides = [("x1", f"v1_{side}", "x2", f"v2_{side}") for side in ("pre", "post")]
    states = [np.column_stack([impacts[name] for name in names]).ravel() for names in sides]
    parts = [impacts["time"], *states, of.stroboscopic.ravel(), of.trajectory(times).ravel()]
    return np.concatenate([*parts, of.final_state.state])


def derivatives(found: vi.Sensitivity, times) -> np.ndarray:
    k = len(found.names)
    tables = [*found.impacts, found.stroboscopic, found.trajectory(times), found.final_state]
    return np.concatenate([table.reshape(-1, k) for table in tables])


def difference(system: vi.System, initial, name: str, observe, *, h: float) -> np.ndarray | None:
    """Central differences of second order, extrapolated; None where events differ."""
    rows = []
    for step in (h, -h, h / 2, -h / 2):
        start = dict(zip(STATE, initial, strict=True))
        changed = system
        if name in start:
            start[name] += step
        else:
            changed = system.replace(**{name: getattr(system, name) + step})
        rows.append(observe(changed, tuple(start.values())))
    if len({row.shape for row in rows}) > 1:
        return None
    wide, narrow = (rows[0] - rows[1]) / (2 * h), (rows[2] - rows[3]) / h
    return (4 * narrow - wide) / 3


@pytest.mark.parametrize(
    ("system", "time"),
    [
        (DAMPED, 12.0),
        (DAMPED.replace(friction=0.4, drive_frequency=1.1), 12.0),
        (DAMPED.replace(friction=1.4, law="energetic"), 12.0),
        (DAMPED.replace(friction=0.8, law="newton"), 12.0),
        (DAMPED.replace(contact="direct"), 12.0),
        (DAMPED.replace(mass_ratio=0.01, friction=0.1), 12.0),
        (DAMPED.replace(pendulum_damping=1.0, oscillator_damping=1.7), 12.0),
        (DAMPED.replace(drive_frequency=2.0, pendulum_damping=0.0), 12.0),
        # Chatter with contact that slides, sticks and is released.
        (DAMPED.replace(restitution=0.3, drive_frequency=0.6, force_amplitude=0.8), 10.0),
        (DAMPED.replace(restitution=0.3, drive_frequency=0.5, friction=0.9), 10.0),
        (DAMPED.replace(restitution=0.0, drive_frequency=0.6, force_amplitude=0.8), 10.0),
    ],
)
def test_derivatives_are_the_limits_of_differences(system, time):
    of = vi.simulate(system, initial=START, time=time)
    times = np.linspace(0.3, time - 0.3, 7)
    found = of.sensitivity(*(name for name in EVERY if name not in at_its_border(system)))

    def observe(changed, start):
        return everything(vi.simulate(changed, initial=start, time=time), times)

    exact = derivatives(found, times)
    size = np.abs(exact).max(axis=0)
    for column, name in enumerate(found.names):
        near = difference(system, START, name, observe, h=1e-4)
        assert near is not None
        # What differences of a run leave of its digits.
        assert near == pytest.approx(exact[:, column], abs=2e-8 * (1 + size[column])), name


def at_its_border(system: vi.System) -> set[str]:
    lower = {"friction", "restitution", "mass_ratio", "pendulum_damping"}
    return {name for name in lower if getattr(system, name) == 0.0}


def test_friction_has_a_derivative_where_there_is_none():
    of = vi.simulate(PAPER, initial=START, time=10)
    found = of.sensitivity("friction")
    h = 1e-7
    little = vi.simulate(PAPER.replace(friction=h), initial=START, time=10)
    slope = (little.impacts["time"] - of.impacts["time"]) / h
    assert found.impacts.time[:, 0] == pytest.approx(slope, rel=1e-5, abs=1e-6)


def test_at_resonance_a_body_without_a_drive_has_derivatives():
    # The force drives the other body, at the natural frequency of the undamped pendulum.
    at = PAPER.replace(
        frequency_ratio=1.3, drive_frequency=1.3, moment_amplitude=0, force_amplitude=1
    )
    found = vi.simulate(at, initial=START, periods=5).sensitivity("frequency_ratio")
    h = 1e-6
    near = [
        vi.simulate(at.replace(frequency_ratio=1.3 + step), initial=START, periods=5)
        for step in (h, -h)
    ]
    times = [other.impacts["time"] for other in near]
    assert len(times[0]) > 3
    assert found.impacts.time[:, 0] == pytest.approx((times[0] - times[1]) / (2 * h), rel=1e-6)


def test_contact_after_a_plastic_impact_needs_no_last_digit():
    # The times of the two events of one instant may differ in their last digit.
    plastic = DAMPED.replace(restitution=0, force_amplitude=0.8)
    gaps = []
    for omega in np.linspace(0.5, 1.5, 21):
        of = vi.simulate(plastic.replace(drive_frequency=omega), initial=START, periods=20)
        apart = of.contacts["time_in_period"][:, np.newaxis] - of.impacts["time_in_period"]
        gaps.extend(np.abs(apart).min(axis=1))
        assert np.isfinite(of.sensitivity("gap").final_state).all()
    assert any(0 < gap < 1e-14 for gap in gaps)


def test_plastic_impacts_that_end_in_contact_have_the_derivative_by_restitution():
    # A little restitution makes bounces, which close the contact again at once.
    ball = vi.System(
        mass_ratio=0,
        frequency_ratio=0,
        restitution=0,
        gap=0,
        drive_frequency=0,
        moment_amplitude=1,
        contact="direct",
    )
    at_rest = vi.simulate(ball, initial=(-1, 0, 0, 0), time=3.2).sensitivity("restitution")
    assert at_rest.final_state[:, 0] == pytest.approx([0, 0, 0, 0], abs=1e-15)
    largest = 0.0
    for friction in (0.0, 0.25):
        for law in ("poisson", "newton", "energetic"):
            at = vi.System(
                mass_ratio=0.9,
                frequency_ratio=1.37,
                restitution=0,
                gap=0.31,
                drive_frequency=1.23,
                moment_amplitude=0.8,
                force_amplitude=0.3,
                phase=0.4,
                friction=friction,
                pendulum_damping=0.04,
                oscillator_damping=0.07,
                law=law,
            )

            def final(restitution: float, at: vi.System = at) -> np.ndarray:
                of = at.replace(restitution=restitution)
                return vi.simulate(of, initial=(0.05, 0.2, -0.1, 0.3), time=30).final_state.state

            run = vi.simulate(at, initial=(0.05, 0.2, -0.1, 0.3), time=30)
            assert len(run.contacts) > 2
            h = 1e-6
            slope = (4 * np.subtract(final(h), final(0)) - np.subtract(final(2 * h), final(0))) / (
                2 * h
            )
            found = run.sensitivity("restitution").final_state[:, 0]
            assert found == pytest.approx(slope, rel=1e-5, abs=1e-6)
            largest = max(largest, np.abs(found).max())
    assert largest > 0.1


#: Systems whose first impacts end in contact that slides either way, sticks and is released.
SETTLES = [
    DAMPED.replace(force_amplitude=0.8, drive_frequency=0.6),
    DAMPED.replace(force_amplitude=0.8, drive_frequency=0.5, friction=0.4),
    DAMPED.replace(drive_frequency=0.25, moment_amplitude=3, force_amplitude=1.5, friction=0.3),
    DAMPED.replace(force_amplitude=0.8, drive_frequency=0.6, friction=1.4),
    DAMPED.replace(force_amplitude=0.8, drive_frequency=0.6, contact="direct"),
]


@pytest.mark.parametrize("system", SETTLES)
def test_few_bounces_have_nearly_the_derivatives_of_none(system):
    names = ("restitution", "gap", "mass_ratio", "drive_frequency", "moment_amplitude", "v1")

    def found(restitution: float) -> np.ndarray:
        run = vi.simulate(system.replace(restitution=restitution), initial=START, time=9)
        assert len(run.contacts) > 0
        return run.sensitivity(*names).final_state

    plastic = found(0)
    for restitution in 10.0 ** np.arange(-12, -3):
        off = np.abs(found(restitution) - plastic) / (1 + np.abs(plastic))
        assert off.max() < 1e-11 + 40 * restitution


@pytest.mark.parametrize("system", SETTLES[:-1])
def test_no_friction_is_the_limit_of_little(system):
    def found(friction: float) -> np.ndarray:
        of = system.replace(friction=friction, restitution=0.2)
        return vi.simulate(of, initial=START, time=9).sensitivity("friction", "gap").final_state

    assert np.abs(found(0)[:, 0]).max() > 0.1
    assert found(0) == pytest.approx(found(1e-9), rel=1e-7, abs=1e-7)


def test_friction_that_would_reverse_in_a_slide_has_its_derivative():
    # From the start on the contact the tip slides one way, and back.
    at = vi.System(
        mass_ratio=0.9,
        frequency_ratio=1,
        restitution=0,
        gap=0,
        drive_frequency=0.3,
        moment_amplitude=0.1,
        static_moment=0.6,
        static_force=-0.3,
    )
    start = (0.1, 0.3, np.sin(0.1), 0.3 * np.cos(0.1))
    run = vi.simulate(at, initial=start, time=6)
    sides = np.sign(run.trajectory(np.linspace(0, 6, 50))[:, 1])
    assert {-1, 1} <= set(sides)
    found = run.sensitivity("friction").final_state[:, 0]

    def final(friction: float) -> np.ndarray:
        return vi.simulate(at.replace(friction=friction), initial=start, time=6).final_state.state

    h = 1e-6
    slope = (4 * np.subtract(final(h), final(0)) - np.subtract(final(2 * h), final(0))) / (2 * h)
    assert np.abs(found).max() > 0.05
    assert found == pytest.approx(slope, rel=1e-6, abs=1e-8)


def test_a_free_body_under_a_moment_that_does_not_turn_has_closed_derivatives():
    phase, t = 1.0, 3.0
    free = vi.System(
        mass_ratio=0.6,
        frequency_ratio=0,
        restitution=0.8,
        gap=50,
        drive_frequency=0,
        moment_amplitude=1,
        pendulum_damping=0.3,
        phase=phase,
    )
    run = vi.simulate(free, initial=(0.1, 0.2, 0, 0), time=t)
    found = run.sensitivity("drive_frequency", "frequency_ratio").trajectory([t])[0]
    # x1'' = cos(omega t + phi) - 2 zeta omega0 x1' - omega0^2 x1, at omega = omega0 = 0.
    slowed = 0.2 * np.array([t**2 / 2, t]) + np.cos(phase) * np.array([t**3 / 6, t**2 / 2])
    assert found[:2, 0] == pytest.approx(-np.sin(phase) * np.array([t**3 / 6, t**2 / 2]), rel=1e-14)
    assert found[:2, 1] == pytest.approx(-2 * 0.3 * slowed, rel=1e-14)


def test_sections_lie_on_the_trajectory():
    of = vi.simulate(DAMPED, initial=START, periods=4, section_phase=1.0)
    names = ("gap", "phase", "drive_frequency")
    found = of.sensitivity(*names)
    period = DAMPED.drive_period
    times = period * (np.arange(4) + 1.0 / (2 * np.pi))
    fixed = found.trajectory(times)
    assert found.stroboscopic[..., :2] == pytest.approx(fixed[..., :2], abs=1e-10)
    # In time they move with the drive frequency.
    rates = (of.trajectory(times + 1e-6) - of.trajectory(times - 1e-6)) / 2e-6
    moved = fixed[..., 2] - rates * (times / DAMPED.drive_frequency)[:, np.newaxis]
    assert found.stroboscopic[..., 2] == pytest.approx(moved, abs=1e-6)


def test_a_kept_window_and_a_resumed_run_have_the_derivatives_of_the_whole():
    whole = vi.simulate(DAMPED, initial=START, periods=20)
    kept = vi.simulate(DAMPED, initial=START, periods=20, keep=5)
    resumed = vi.simulate(DAMPED, initial=START, periods=12).resume(periods=8)
    all_of_it = whole.sensitivity("gap", "drive_frequency")
    for part in (kept, resumed):
        found = part.sensitivity("gap", "drive_frequency")
        assert len(found.impacts.time) == len(part.impacts) > 3
        assert len(found.stroboscopic) == len(part.stroboscopic)
        for mine, of_all in zip(found.impacts, all_of_it.impacts, strict=True):
            assert (mine == of_all[-len(mine) :]).all()
        assert (found.stroboscopic == all_of_it.stroboscopic[-len(part.stroboscopic) :]).all()
        assert (found.final_state == all_of_it.final_state).all()
        times = np.linspace(part.kept_from, part.final_state.time, 9)
        assert (found.trajectory(times) == all_of_it.trajectory(times)).all()


def test_a_graze_is_marked():
    # The bodies touch without velocity: x1 = sin t meets a wall at rest at 1.
    wall = vi.System(
        mass_ratio=0, frequency_ratio=1, restitution=0.5, gap=1, drive_frequency=0, contact="direct"
    )
    of = vi.simulate(wall, initial=(0, 1, 0, 0), time=3)
    assert len(of.grazes) == 1
    found = of.sensitivity("gap", "v1")
    (mark,) = found.one_sided
    assert mark.reason == "graze"
    assert of.events[mark.index]["kind"] == vi.EventKind.GRAZE
    # The motion that goes by knows nothing of the wall.
    assert found.final_state[:, 0] == pytest.approx([0, 0, 0, 0])
    assert found.final_state[:2, 1] == pytest.approx([np.sin(3), np.cos(3)])


def reasons(run: vi.Run) -> list[str]:
    """Why the derivatives of a run are one-sided, and at which events."""
    return [mark.reason for mark in run.sensitivity("gap").one_sided]


def test_a_start_on_the_contact_is_marked():
    edge = PAPER.replace(friction=0.5, gap=-np.sin(0.3))
    of = vi.simulate(edge, initial=(-0.3, 0.0, 0.0, -0.5), time=0.5)
    assert reasons(of)[:1] == ["start_on_contact"]


def test_a_border_of_regimes_is_marked():
    # The pendulum rests at x1 = 0.3, where it is at its equilibrium, and is struck there: x1' = 0.
    still = vi.System(
        mass_ratio=0.6,
        frequency_ratio=2,
        restitution=0.5,
        gap=0.1,
        drive_frequency=0,
        friction=0.5,
        static_moment=0.3 * 4,
    )
    of = vi.simulate(still, initial=(0.3, 0.0, 0.5, -2.0), time=0.6)
    assert len(of.impacts) == 1
    assert of.impacts["v1_pre"][0] == pytest.approx(0, abs=1e-16)
    assert reasons(of) == ["regime_border"]
    # Beside it the impact is inside of a regime.
    assert reasons(vi.simulate(still, initial=(0.3, 0.1, 0.5, -2.0), time=0.6)) == []


@pytest.mark.parametrize(("load", "why"), [(1.0, ["contact_border"]), (1.5, [])])
def test_contact_that_begins_without_force_is_marked(load, why):
    # A plastic impact where the spring just balances the load: nothing presses on the wall.
    wall = vi.System(
        mass_ratio=0,
        frequency_ratio=1,
        restitution=0,
        gap=1,
        drive_frequency=0,
        static_moment=load,
        contact="direct",
    )
    of = vi.simulate(wall, initial=(0, 1, 0, 0), time=2)
    assert len(of.contacts) == 1
    assert reasons(of) == why


def test_chatter_near_its_onset_is_marked():
    # A ball on a table, to which a force cos t presses it: from high enough it still bounces at
    # pi/2, when nothing presses any more.
    table = vi.System(
        mass_ratio=0,
        frequency_ratio=0,
        restitution=0.5,
        gap=0,
        drive_frequency=1,
        moment_amplitude=1,
        contact="direct",
    )

    def fallen(height):
        return vi.simulate(table, initial=(-height, 0, 0, 0), time=1.8)

    low, high = onset_between(0.01, 0.1, fallen)
    assert high - low < 1e-15
    near, far = fallen(low * (1 - 1e-9)), fallen(low * (1 - 1e-3))
    for of in (near, far):
        assert of.contacts["kind"][0] == vi.EventKind.CHATTER
    # The force falls as the root of the distance from the onset.
    assert 0 < near.contacts["normal_force"][0] < 1e-5 < 1e-2 < far.contacts["normal_force"][0]
    (mark,) = near.sensitivity("gap").one_sided
    assert mark.reason == "chatter_onset"
    assert near.events[mark.index]["kind"] == vi.EventKind.CHATTER
    assert mark.time == near.contacts["time"][0]
    assert reasons(far) == []


@pytest.mark.parametrize("omega", [0.3, 0.7, 1.0, 1.1, 1.7, 1.8, 2.2, 2.9, 7.3])
@pytest.mark.parametrize("phase", [0.0, 1.3])
def test_a_run_that_ends_exactly_on_a_section_has_all_of_them(omega, phase):
    system = DAMPED.replace(drive_frequency=omega)
    sticky = system.replace(restitution=0.3, friction=0.9)  # with contact
    for machine in (system, sticky):
        for k in (1, 2, 3, 7):
            end = (2 * np.pi * k + phase) / omega
            for time in (np.nextafter(end, 0), end, np.nextafter(end, 1e3)):
                of = vi.simulate(machine, initial=START, time=time, section_phase=phase)
                found = of.sensitivity("gap", "drive_frequency")
                assert len(found.stroboscopic) == len(of.stroboscopic)
                if len(of.stroboscopic) >= k + (phase > 0):
                    last = found.stroboscopic[-1][:, 0]
                    assert last == pytest.approx(found.final_state[:, 0], abs=1e-9)


def test_ctrl_c_keeps_the_derivatives_so_far():
    for of in (
        vi.simulate(DAMPED, initial=START, periods=30),
        vi.simulate(CHATTERS, initial=START, periods=6),
    ):
        whole = of.sensitivity("gap", "v1")
        asks = asks_of(lambda of=of: of.sensitivity("gap"))
        with ctrl_c_at(asks // 2) as stopped:
            of.sensitivity("gap", "v1")
        part = stopped.value.result
        assert 0 < part.until < of.final_state.time == whole.until
        n, m = len(part.impacts.time), len(part.stroboscopic)
        assert 0 < n < len(whole.impacts.time)
        assert 0 < m < len(whole.stroboscopic)
        for mine, all_of_it in zip(part.impacts, whole.impacts, strict=True):
            assert (mine == all_of_it[:n]).all()
        assert (part.stroboscopic == whole.stroboscopic[:m]).all()
        times = np.linspace(0, part.until, 7)
        assert (part.trajectory(times) == whole.trajectory(times)).all()
        with pytest.raises(vi.ParameterError, match="kept window"):
            part.trajectory(of.final_state.time)


@pytest.mark.parametrize(
    "names",
    [(), ("gap", "gap"), ("gaps",), ("q_0",), ("contact",), ("gap", "nan"), (["gap", "v1"],)],
)
def test_bad_names_are_refused(names):
    with pytest.raises(vi.ParameterError, match="names"):
        run().sensitivity(*names)


def test_friction_of_direct_contact_is_refused():
    direct = vi.simulate(PAPER.replace(contact="direct"), initial=START, periods=2)
    with pytest.raises(vi.ParameterError, match="friction"):
        direct.sensitivity("friction")


def test_the_names_are_what_the_arrays_are_by():
    of = vi.simulate(DAMPED, initial=START, periods=3)
    both, one = of.sensitivity("v1", "mass_ratio"), of.sensitivity("mass_ratio")
    assert both.names == ("v1", "mass_ratio")
    assert (both.impacts.before[..., 1] == one.impacts.before[..., 0]).all()
    assert (both.final_state[:, 1] == one.final_state[:, 0]).all()
    again = pickle.loads(pickle.dumps(both))
    assert again == both
    assert (again.final_state == both.final_state).all()
    assert both != one


def test_times_outside_of_the_window_are_refused():
    found = vi.simulate(DAMPED, initial=START, periods=3).sensitivity("gap")
    with pytest.raises(vi.ParameterError, match="kept window"):
        found.trajectory([1.0, 1e3])
    for wrong in (np.nan, "a", None):
        with pytest.raises(vi.ParameterError, match=r"^t = .* allowed: a finite number, or an arr"):
            found.trajectory(wrong)
