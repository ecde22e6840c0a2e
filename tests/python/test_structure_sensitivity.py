"""Derivatives of runs of structures: against differences of runs, multipliers, and each other."""

import pickle

import numpy as np
import pytest

import sizes
import systems
import vibroimpact as vi
from ctrl_c import asks_of, ctrl_c_at
from random_structures import FAMILIES
from references import case_structure, reference
from struck import (
    BEAM,
    MOVING,
    PRESSED,
    REST,
    SETTLING,
    changed,
    masses_run,
    numbers_of,
    onset_between,
    pressed_run,
)

SCENES = reference("structure_sensitivity_reference.json")
TIMES = np.linspace(0.05, 0.95, 7)
#: Neighbours are so far away, as part of what varies.
NEAR = 2e-5


def direction(structure: vi.Structure, name: str) -> dict[str, object] | None:
    """The direction of a name that is none of the package's: a number of a vector, or of a stop."""
    if name.startswith(("static_load[", "damping_ratios[")):
        field, place = name[:-1].split("[")
        count = structure.coordinates
        return {field: np.eye(count)[int(place)]}
    if name.startswith(("amplitude_", "phase_")):
        return {name: 1.0}
    return None


@pytest.mark.parametrize("name", SCENES)
def test_derivatives_are_those_of_the_reference(name):
    scene = SCENES[name]
    structure = case_structure(scene)
    run = vi.simulate(structure, initial=scene["initial"], periods=scene["periods"])
    others = {by: direction(structure, by) for by in scene["by"]}
    others = {by: along for by, along in others.items() if along is not None}
    found = run.sensitivity(*(by for by in scene["by"] if by not in others), **others)
    number = scene["number"]
    assert len(run.impacts) > number
    count = structure.coordinates
    time, before, after = (table[number] for table in found.impacts)
    mine = np.vstack([time, before, after[count:]])
    # Roundings of the motion, as they grow, and over low velocities; chatter is extrapolated.
    starts = [by.startswith(("q_", "v_")) for by in scene["by"]]
    growth = max(
        abs(float(value))
        for at in (scene["impact"], scene["section"])
        for numbers, is_start in zip(at, starts, strict=True)
        if is_start
        for value in numbers
    )
    chatters = (run.contacts["kind"] == vi.EventKind.CHATTER).any()
    low = 0.0 if chatters else 1 / run.impacts["approach_velocity"].min()
    allowed = 64 * np.finfo(float).eps * (1 + growth + low) + (1e-12 if chatters else 0.0)
    worst = 0.0
    for rows, at in ((mine, scene["impact"]), (found.stroboscopic[-1], scene["section"])):
        for by, numbers in zip(scene["by"], at, strict=True):
            exact = np.array([float(value) for value in numbers])
            # Relative to the derivatives of the whole state.
            off = np.abs(rows[:, found.names.index(by)] - exact).max() / (1 + np.abs(exact).max())
            worst = max(worst, off)
            assert off < allowed, by
    print(f"{name}: off by at most {worst:.1e}")


def everything(run: vi.StructureRun, times) -> np.ndarray:
    """All numbers that are differentiated, in one row."""
    impacts = run.impacts
    sides = [np.hstack([impacts["q"], impacts[f"v_{side}"]]).ravel() for side in ("pre", "post")]
    states = [run.stroboscopic.ravel(), run.trajectory(times).ravel()]
    end = [run.final_state.q, run.final_state.v]
    return np.concatenate([impacts["time"], *sides, *states, *end])


def derivatives(found: vi.Sensitivity, times) -> np.ndarray:
    k = len(found.names)
    tables = [*found.impacts, found.stroboscopic, found.trajectory(times), found.final_state]
    return np.concatenate([table.reshape(-1, k) for table in tables])


def lost(run: vi.StructureRun, rows: int) -> np.ndarray:
    """What rounding over the approach velocity leaves in derivatives of each row's number."""
    speed = np.maximum(np.asarray(run.impacts["approach_velocity"]), 1e-300)
    speed = np.minimum.accumulate(speed)
    each = np.repeat(speed, 2 * run.system.coordinates)
    off = 1e-14 / np.concatenate([speed, each, each])
    return np.pad(off, (0, rows - len(off)))


def same_motion(runs) -> bool:
    first = runs[0]
    return all(
        np.array_equal(run.events["kind"], first.events["kind"])
        and np.array_equal(run.events["stop"], first.events["stop"])
        and np.array_equal(run.impacts["regime"], first.impacts["regime"])
        for run in runs
    )


def differences(structure, initial, time, name, times, h):
    """Central differences of second order, extrapolated; None where events differ."""
    runs = []
    for step in (h, -h, h / 2, -h / 2, 0.0):
        try:
            machine, start = changed(structure, initial, name, step)
            runs.append(vi.simulate(machine, initial=start, time=time, max_events=200))
        except (vi.StateError, vi.ParameterError):
            return None
    if not same_motion(runs):
        return None
    rows = [everything(run, times) for run in runs]
    wide, narrow = (rows[0] - rows[1]) / (2 * h), (rows[2] - rows[3]) / h
    return (4 * narrow - wide) / 3, np.abs(narrow - wide)


@pytest.mark.parametrize("family", FAMILIES)
def test_derivatives_of_random_structures_are_the_limits_of_differences(family):
    cases = sizes.either(36, 400)
    compared = columns = refused = 0
    worst = 0.0
    for seed in range(cases):
        structure, initial = FAMILIES[family](seed)
        time = 2.4 * structure.drive_period if structure.drive_frequency else 5.0
        run = vi.simulate(structure, initial=initial, time=time, max_events=200)
        if run.stop_reason not in ("completed", "rest"):
            continue
        times = TIMES * time
        names = numbers_of(structure)
        try:
            found = run.sensitivity(*names)
        except vi.SimulationError:
            refused += 1
            continue
        exact = derivatives(found, times)
        noise = lost(run, len(exact))
        compared += 1
        for column, name in enumerate(found.names):
            near = differences(structure, initial, time, name, times, NEAR)
            if near is None:
                continue
            columns += 1
            slope, curved = near
            size = 1 + np.abs(exact[:, column]).max()
            off = np.abs(slope - exact[:, column])
            # What third derivatives leave, and the rounding of two runs.
            allowed = (2e-8 + noise) * size + 0.05 * curved
            worst = max(worst, (off / allowed).max())
            assert (off <= allowed).all(), f"{family} {seed} {name}: {(off / allowed).max()}"
    print(
        f"{family}: {compared} runs, {refused} refused, {columns} columns; "
        f"largest error {worst:.2g} of what is allowed"
    )
    assert compared > cases / (4 if family == "corner" else 2)


def test_sections_of_a_periodic_motion_have_its_multipliers():
    motion = vi.simulate(SETTLING, initial=REST[1], periods=200, keep=50).refine()
    around = vi.simulate(SETTLING, initial=motion.state, periods=1)
    matrix = around.sensitivity("q_0", "v_0").stroboscopic[-1]
    found = np.sort_complex(np.linalg.eigvals(matrix).astype(complex))
    assert found == pytest.approx(np.sort_complex(motion.multipliers), abs=1e-12)


def test_a_spring_is_the_sum_of_its_entries():
    run = masses_run()
    spring = np.array([[1.0, -1.0], [-1.0, 1.0]])
    entries = ("stiffness[0,0]", "stiffness[0, 1]", "stiffness[1,1]")
    found = run.sensitivity(*entries, spring={"stiffness": spring})
    one, between, other, whole = np.moveaxis(found.stroboscopic, -1, 0)
    assert whole == pytest.approx(one - between + other, rel=1e-9, abs=1e-9)


def test_all_masses_springs_and_loads_together_change_nothing():
    # Twice the masses, stiffness, damping and forces: the same motion.
    structure = PRESSED.replace(damping_ratios=None, damping=0.1 * np.eye(2))
    run = vi.simulate(structure, initial=REST[2], periods=6)
    fields = ("mass", "stiffness", "damping", "static_load", "drive_amplitude")
    multiplier = {name: getattr(structure, name) for name in fields}
    found = run.sensitivity("gap_0", all=multiplier)
    size = np.abs(found.stroboscopic[..., 0]).max()
    assert len(run.impacts) > 3
    assert np.abs(found.stroboscopic[..., 1]).max() < 1e-11 * (1 + size)
    assert np.abs(found.impacts.time[:, 1]).max() < 1e-11 * (1 + size)


def test_a_unit_of_time_moves_all_times_alike():
    # Frequencies, damping and velocities s times as large: all happens in 1/s of the time.
    structure = masses_run().system
    start = np.array([[0.0, 0.0], [0.3, -0.1]])
    run = vi.simulate(structure, initial=start, periods=8)
    faster = {
        "stiffness": 2 * structure.stiffness,
        "damping": structure.damping_matrix if hasattr(structure, "damping_matrix") else None,
        "static_load": 2 * structure.static_load,
        "drive_amplitude": 2 * structure.drive_amplitude,
        "drive_frequency": structure.drive_frequency,
        "v": start[1],
    }
    if structure.damping is None:
        del faster["damping"]  # the ratios stay as they are
    else:
        faster["damping"] = structure.damping
    found = run.sensitivity(faster=faster)
    times = np.asarray(run.impacts["time"])
    size = np.abs(run.sensitivity("gap_0").impacts.time).max()
    assert found.impacts.time[:, 0] == pytest.approx(-times, abs=1e-11 * (1 + size))
    q = np.asarray(run.impacts["q"])
    assert found.impacts.before[:, : q.shape[1], 0] == pytest.approx(0 * q, abs=1e-11 * (1 + size))


def spring_of(k2: float) -> vi.Structure:
    return PRESSED.replace(stiffness=[[4, -1], [-1, k2]], gap_1=0.5 * k2 + 0.5)


def test_a_function_of_a_number_is_differentiated_by_the_chain_rule():
    run = pressed_run()
    found = run.sensitivity(k2=(spring_of, 3.0), own={"stiffness": [[0, 0], [0, 1]], "gap_1": 0.5})
    of_function, own = np.moveaxis(found.stroboscopic, -1, 0)
    assert of_function == pytest.approx(own, rel=1e-9, abs=1e-10)


def test_a_structure_from_modes_has_its_derivatives_in_physical_coordinates():
    run = vi.simulate(BEAM, initial=REST[3], periods=4)
    names = ("gap_0", "restitution_0", "drive_frequency")
    directions = {
        "tip": {"stiffness": np.diag([0.0, 0.0, 1.0])},
        "mode": {"frequencies": [0.0, 1.0]},
        "load": {"static_load": [0.0, 0.0, 1.0]},
    }
    found = run.sensitivity(*names, **directions)
    assert found.stroboscopic.shape == (len(run.stroboscopic), 6, 6)

    def moved(step, name):
        changes = {
            "gap_0": lambda: BEAM.replace(gap=0.3 + step),
            "restitution_0": lambda: BEAM.replace(restitution=0.8 + step),
            "drive_frequency": lambda: BEAM.replace(drive_frequency=1.3 + step),
            "mode": lambda: BEAM.replace(frequencies=[1.0, 3.0 + step]),
            "load": lambda: BEAM.replace(static_load=[0, 0, step]),
        }
        return vi.simulate(changes[name](), initial=REST[3], periods=4).stroboscopic

    for name in (*names, "mode", "load"):
        h = 2e-6  # an impact with a low velocity curves the motion
        wide, narrow = (moved(s, name) - moved(-s, name) for s in (h, h / 2))
        slope = (4 * narrow / h - wide / (2 * h)) / 3
        mine = found.stroboscopic[..., found.names.index(name)].reshape(slope.shape)
        assert mine == pytest.approx(slope, rel=1e-6, abs=1e-6), name


def test_directions_are_pickled_and_compared():
    run = pressed_run()
    found = run.sensitivity("gap_0", k2={"stiffness": [[0, 0], [0, 1]]})
    again = pickle.loads(pickle.dumps(found))
    assert again == found
    assert (again.final_state == found.final_state).all()
    assert found != run.sensitivity("gap_0", k2={"stiffness": [[1, 0], [0, 0]]})


def test_a_kept_window_has_the_derivatives_of_the_whole():
    whole = vi.simulate(PRESSED, initial=REST[2], periods=12)
    kept = vi.simulate(PRESSED, initial=REST[2], periods=12, keep=4)
    all_of_it, found = (run.sensitivity("gap_0", "drive_frequency") for run in (whole, kept))
    assert len(found.impacts.time) == len(kept.impacts)
    last = all_of_it.stroboscopic[-len(kept.stroboscopic) :]
    assert found.stroboscopic == pytest.approx(last, abs=1e-13)
    times = np.linspace(kept.kept_from, kept.final_state.time, 9)
    assert found.trajectory(times) == pytest.approx(all_of_it.trajectory(times), abs=1e-11)


@pytest.mark.parametrize(
    ("names", "directions", "named"),
    [
        ((), {}, "names"),
        (("gap", "gap"), {}, "gap"),
        (("gaps",), {}, "gaps"),
        (("gap_7",), {}, "gap_7"),
        (("q_2",), {}, "q_2"),
        (("stiffness[0,2]",), {}, "stiffness"),
        (("stiffness[0]",), {}, "stiffness"),
        ((3,), {}, "names"),
        (("friction_1",), {}, "friction_1"),
        ((), {"k": {}}, "k"),
        ((), {"k": 2.0}, "k"),
        ((), {"k": {"stifness": [[1, 0], [0, 1]]}}, "stiffness"),
        ((), {"k": {"stiffness": [[1, 2], [0, 1]]}}, "symmetric"),
        ((), {"k": {"stiffness": [[1, 0, 0]]}}, "stiffness"),
        ((), {"k": {"mass": [[np.nan, 0], [0, 1]]}}, "mass"),
        ((), {"k": {"gap_9": 1.0}}, "gap_9"),
        ((), {"k": {"frequencies": [1.0, 2.0]}}, "frequencies"),
        ((), {"k": spring_of}, "k"),
        ((), {"k": (spring_of, 2.0)}, "stiffness"),
        ((), {"k": (lambda k: k, 2.0)}, "Structure"),
        ((), {"k": (lambda k: PRESSED, 2.0)}, "k"),
    ],
)
def test_bad_names_and_directions_are_refused(names, directions, named):
    with pytest.raises(vi.ParameterError, match=named):
        pressed_run().sensitivity(*names, **directions)


def test_coordinates_that_cannot_change_alone_are_refused():
    run = vi.simulate(BEAM, initial=REST[3], periods=2)
    with pytest.raises(vi.ParameterError, match=r"^names = 'v_0' .* alone; .*\{'v': shapes @ p\}"):
        run.sensitivity("v_0")
    with pytest.raises(vi.ParameterError, match=r"^a\['q'\] = .*; allowed: shapes @ p"):
        run.sensitivity(a={"q": [1.0, 0.0, 0.0]})
    found = run.sensitivity(a={"v": BEAM.shapes @ [1.0, 0.0]})
    assert found.final_state.shape == (6, 1)


def run_of_a_system():
    """A short run of a system, which is no structure."""
    return vi.simulate(systems.PAPER, initial=(0, 0.5, 0, 0), time=3)


@pytest.mark.parametrize("make", [pressed_run, run_of_a_system])
def test_units_are_refused_and_arrays_are_read_only(make):
    run = make()
    with pytest.raises(TypeError, match=r"^sensitivity\(\) takes no units=: derivatives are "):
        run.sensitivity("gap", units="SI")
    found = run.sensitivity("gap")
    for rows in (found.trajectory(1.0), found.trajectory([1.0, 2.0]), found.final_state):
        assert not rows.flags.writeable


def test_a_drive_that_stands_still_has_no_phase():
    still = vi.Structure([[1]], [[1]], [vi.Stop([1], 0.3, 0.8)])
    run = vi.simulate(still, initial=[[0], [1]], time=5)
    for name in ("drive_frequency", "phase"):
        with pytest.raises(vi.ParameterError, match=name):
            run.sensitivity(name)


def test_a_graze_is_marked():
    wall = vi.Structure([[1]], [[1]], [vi.Stop([1], 1, 0.5)])
    run = vi.simulate(wall, initial=[[0], [1]], time=3)
    assert len(run.grazes) == 1
    found = run.sensitivity("gap", "v_0")
    (mark,) = found.one_sided
    assert mark.reason == "graze"
    assert run.events[mark.index]["kind"] == vi.EventKind.GRAZE
    assert found.final_state == pytest.approx(np.array([[0, np.sin(3)], [0, np.cos(3)]]))


def test_a_border_of_regimes_is_marked():
    # It falls onto the table without slip: friction holds on either side of 0.
    table = vi.Structure(
        np.eye(2),
        np.zeros((2, 2)),
        [vi.Stop([1, 0], 1.0, 0.5, friction=0.4, tangent=[0, 1])],
    )
    straight, aslant = (
        vi.simulate(table, initial=[[0, 0], [1, slip]], time=1.5) for slip in (0.0, 0.1)
    )
    marks = [run.sensitivity("friction").one_sided for run in (straight, aslant)]
    assert [mark.reason for mark in marks[0]] == ["regime_border"]
    assert marks[1] == ()


def test_a_stop_that_closes_without_force_is_marked():
    # A plastic impact where the load on the stop is just balanced by the spring.
    for load, reasons in ((1.0, ["contact_border"]), (1.5, [])):
        balanced = vi.Structure(
            [[1]], [[1]], [vi.Stop([1], 1.0, 0.0)], static_load=[load], damping=[[0.0]]
        )
        run = vi.simulate(balanced, initial=[[0], [1]], time=2)
        found = run.sensitivity("v_0")
        closes = run.contacts["kind"] == vi.EventKind.CLOSED
        assert closes.any() or not reasons
        assert [mark.reason for mark in found.one_sided] == reasons


def test_chatter_near_its_onset_is_marked():
    # A ball on a table that presses on it with cos t, until pi/2.
    table = vi.Structure(
        [[1]], [[0]], [vi.Stop([1], 0.0, 0.5)], drive_amplitude=[1], drive_frequency=1
    )

    def fallen(height):
        return vi.simulate(table, initial=[[-height], [0]], time=1.8)

    low, high = onset_between(0.01, 0.1, fallen)
    assert high - low < 1e-15
    near, far = (fallen(low * (1 - part)) for part in (1e-5, 1e-3))
    (mark,) = near.sensitivity("gap").one_sided
    assert mark.reason == "chatter_onset"
    assert near.events[mark.index]["kind"] == vi.EventKind.CLOSED
    assert far.sensitivity("gap").one_sided == ()
    # Nearer to it what comes of its derivatives is still known: none of them is left at rest.
    found = fallen(low * (1 - 1e-9)).sensitivity("gap")
    assert found.final_state[..., 0] == pytest.approx([1, 0], abs=1e-12)


@pytest.mark.parametrize("omega", [0.3, 0.7, 1.0, 1.1, 1.7, 1.8, 2.2, 2.9, 7.3])
@pytest.mark.parametrize("phase", [0.0, 1.3])
def test_a_run_that_ends_exactly_on_a_section_has_all_of_them(omega, phase):
    for structure in (SETTLING, PRESSED):
        machine = structure.replace(drive_frequency=omega)
        for k in (1, 2, 7):
            end = (2 * np.pi * k + phase) / omega
            for time in (np.nextafter(end, 0), end, np.nextafter(end, 1e3)):
                start = REST[machine.coordinates]
                run = vi.simulate(machine, initial=start, time=time, section_phase=phase)
                found = run.sensitivity("gap", "drive_frequency")
                assert len(found.stroboscopic) == len(run.stroboscopic)


def test_ctrl_c_keeps_the_derivatives_so_far():
    run = vi.simulate(MOVING, initial=REST[1], periods=20)
    whole = run.sensitivity("gap_0", "v_0")
    asks = asks_of(lambda: run.sensitivity("gap"))
    with ctrl_c_at(asks // 2) as stopped:
        run.sensitivity("gap_0", "v_0")
    part = stopped.value.result
    assert 0 < part.until < run.final_state.time == whole.until
    m = len(part.stroboscopic)
    assert 0 < m < len(whole.stroboscopic)
    assert (part.stroboscopic == whole.stroboscopic[:m]).all()
    times = np.linspace(0, part.until, 7)
    assert (part.trajectory(times) == whole.trajectory(times)).all()


def chattering() -> vi.Structure:
    """Two masses whose motion comes to repeat itself, with chatter and a closed stop."""
    return vi.Structure(
        [[1, 0], [0, 2]],
        [[2, -1], [-1, 1]],
        [vi.Stop([1, 0], 0.1, 0.4), vi.Stop([-1, 0], 0.3, 0.4)],
        damping_ratios=[0.2, 0.3],
        drive_amplitude=[0, 1],
        drive_frequency=0.41,
    )


def settling() -> vi.Structure:
    """Two masses whose motion comes to repeat itself every second period, without contact."""
    return vi.Structure(
        [[1, 0], [0, 2]],
        [[2, -1], [-1, 1]],
        [vi.Stop([1, 0], 0.3, 0.5)],
        damping_ratios=[0.2, 0.3],
        drive_amplitude=[1, 1],
        drive_frequency=1.7,
    )


@pytest.mark.parametrize("make", [chattering, settling])
def test_what_repeats_is_differentiated_as_what_does_not(make):
    structure = make()
    start = np.full((2, structure.coordinates), 0.01)
    names = numbers_of(structure)
    long = vi.simulate(structure, initial=start, periods=400)
    sections = long.stroboscopic
    again = np.flatnonzero((sections[:-2] == sections[2:]).all(axis=(1, 2)))
    assert len(again) > 200, "this motion is to repeat itself"
    found = long.sensitivity(*names)
    # Runs that end before their cycles are worth the while are followed all the way.
    first = int(again[0])
    for periods in (first + 2, first + 40, first + 100):
        run = vi.simulate(structure, initial=start, periods=periods)
        other = run.sensitivity(*names)
        for mine, its in zip(found.impacts, other.impacts, strict=True):
            size = 1 + np.abs(its).max(axis=0)
            assert (np.abs(mine[: len(its)] - its) / size).max() < 1e-9
        its = other.stroboscopic
        assert np.abs(found.stroboscopic[: len(its)] - its).max() < 1e-9 * (1 + np.abs(its).max())
    # At times as at sections, whose times move with the frequency alone.
    late = np.array([first + 5, first + 150, 390])
    at_times = found.trajectory(late * 2 * np.pi / structure.drive_frequency)
    columns = [names.index(name) for name in names if name != "drive_frequency"]
    at_sections = found.stroboscopic[late - 1][:, :, columns]
    assert np.abs(at_times[:, :, columns] - at_sections).max() < 1e-8
    # Of the last periods alone.
    last = vi.simulate(structure, initial=start, periods=400, keep=50).sensitivity(*names)
    assert np.abs(last.final_state - found.final_state).max() < 1e-9
    for mine, its in zip(found.impacts, last.impacts, strict=True):
        assert np.abs(mine[-len(its) :] - its).max() < 1e-9 * (1 + np.abs(its).max())
