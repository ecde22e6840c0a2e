"""Motion through sustained contact: laws along the way, resuming, kept windows, labels, diagrams.

Equations: docs/theory.md, section 5; the scenes are those of tests/data/contact.json.
"""

import math

import numpy as np
import pytest

import vibroimpact as vi
from comparing import assert_same_bits
from references import reference, scene_initial, scene_system
from systems import LOW
from vibroimpact import EventKind

SCENES = reference("contact.json")
SYSTEMS = {name: scene_system({"phase": "0"} | scene) for name, scene in SCENES.items()}
STARTS = {name: scene_initial(scene) for name, scene in SCENES.items()}
# Least distance into the other body that counts: rounding of sin x1 - x2 - delta and of the time.
DEPTH = 1e-12
INITIAL = (0.0, 0.5, 0.0, 0.0)


def gap(system: vi.System, states: np.ndarray) -> np.ndarray:
    return np.sin(states[:, 0]) - states[:, 2] - system.gap


@pytest.fixture(scope="module", params=SCENES)
def run(request) -> vi.Run:
    return vi.simulate(SYSTEMS[request.param], initial=STARTS[request.param], periods=4)


def phases(run: vi.Run, *kinds: EventKind) -> list[tuple[float, float, int]]:
    """Start, end and kind of the stretches that events of these kinds begin."""
    rows = run.contacts
    ends = [*rows["time"][1:].tolist(), run.final_state.time]
    return [
        (start, end, kind)
        for start, end, kind in zip(rows["time"].tolist(), ends, rows["kind"].tolist(), strict=True)
        if kind in kinds
    ]


SLIDES = (EventKind.SLIDE_POSITIVE, EventKind.SLIDE_NEGATIVE)


def test_nothing_penetrates_and_forces_are_those_of_the_phase(run):
    system = run.system
    times = np.linspace(0.0, run.final_state.time, 40_000)
    motion = run.trajectory(times, forces=True)
    assert motion.shape == (len(times), 6)
    assert motion[:, :4].tobytes() == run.trajectory(times).tobytes()
    depth, normal, tangential = gap(system, motion), motion[:, 4], motion[:, 5]
    assert depth.max() <= DEPTH
    assert (normal >= 0.0).all()
    # Coulomb: an ulp or two for the product.
    assert (np.abs(tangential) <= system.friction * normal * (1 + 1e-15)).all()
    held = np.zeros(len(times), dtype=bool)
    for start, end, kind in phases(run, *SLIDES, EventKind.STICK):
        inside = (times >= start) & (times < end)
        held |= inside
        x1, v1, _, v2 = motion[inside, :4].T
        assert np.abs(depth[inside]).max() < 1e-15
        assert np.abs(v1 * np.cos(x1) - v2).max() < 1e-15
        if kind == EventKind.STICK:
            assert not v1.any()
            assert not v2.any()
        elif system.friction:
            slip = -system.friction * np.sign(v1) * np.sign(np.sin(x1)) * normal[inside]
            np.testing.assert_allclose(tangential[inside], slip, rtol=1e-15)
    assert held.any()
    assert normal[held].min() > 0.0
    assert not motion[~held, 4:].any()


def test_the_bodies_obey_newtons_law_in_contact(run):
    system, step = run.system, 1e-4
    for start, end, _ in phases(run, *SLIDES, EventKind.STICK):
        times = np.linspace(start, end, 21)[1:-1]
        (x1, v1, x2, v2, normal, tangential) = run.trajectory(times, forces=True).T
        after, before = (run.trajectory(times + sign * step) for sign in (1, -1))
        load = np.cos(system.drive_frequency * times)
        stiffness, z1 = system.frequency_ratio**2, system.pendulum_damping * system.frequency_ratio
        a1 = system.moment_amplitude * load - 2 * z1 * v1 - stiffness * x1
        a2 = system.force_amplitude * load - 2 * system.oscillator_damping * v2 - x2
        expected = np.column_stack(
            [a1 - normal * np.cos(x1) + tangential * np.sin(x1), a2 + system.mass_ratio * normal]
        )
        found = (after - before)[:, [1, 3]] / (2 * step)
        # Central differences: x''''' step^2/6 at time scales of some 0.3, and eps/step.
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-6)


def test_positions_are_continuous_and_velocities_jump_at_impacts_only(run):
    for table, columns in ((run.impacts, 2), (run.contacts, 4)):
        times = table["time"][table["time"] > 0.0]
        after, before = run.trajectory(times), run.trajectory(np.nextafter(times, 0.0))
        order = [0, 2, 1, 3][:columns]
        np.testing.assert_allclose(after[:, order], before[:, order], rtol=0.0, atol=1e-12)
    jumps = np.abs(run.impacts["v2_post"] - run.impacts["v2_pre"])
    assert jumps.min() > 0.0


def test_a_stick_that_ends_at_the_edge_of_the_cone_goes_over_into_slip():
    # mbar + k cos x1 = 0.03 makes a large acceleration of the rounding left at the edge, where the
    # terms cancel: it must not turn the tip back into a stick for ever.
    system = vi.System(
        mass_ratio=0.1,
        frequency_ratio=1.0,
        restitution=0.5,
        gap=-0.005371245078809261,
        drive_frequency=0.25,
        damping=(1.5, 1.5),
        moment_amplitude=0.7909277031245514,
        force_amplitude=1.9240809458512826,
        friction=1.5,
        phase=5.21506229276049,
    )
    start = (0.7894412997238502, -0.4561884764677595, 1.1057451914205054, 0.9733558606342181)
    run = vi.simulate(system, initial=start, periods=12)
    assert run.stop_reason == "completed"
    sticks = phases(run, EventKind.STICK)
    assert len(sticks) >= 3
    assert min(end - begin for begin, end, _ in sticks) > 1e-6
    following = [row for begin, row, _ in phases(run, *SLIDES) if begin in {s[1] for s in sticks}]
    assert following


def test_skipped_hops_are_those_that_a_finer_tolerance_computes():
    name = "fig7c_omega_0.25"
    options = {"initial": STARTS[name], "periods": 1}
    fine = vi.simulate(SYSTEMS[name], **options)
    coarse = vi.simulate(SYSTEMS[name], **options, chatter_tolerance=1e-6)
    (chatter,) = coarse.contacts[coarse.contacts["kind"] == EventKind.CHATTER]
    begin, end = chatter["time"] - chatter["time_jump"], chatter["time"]
    computed = fine.impacts["time"]
    computed = computed[(computed > begin) & (computed < end)]
    assert 3 <= len(computed) < chatter["impacts_skipped"]
    assert len(coarse.impacts) < len(fine.impacts)
    # From the last common impact on the hops are the same flights, bit for bit but for the sums
    # of their times; the accumulation points differ by the tolerance.
    times = np.linspace(begin, computed[-1], 500)
    states = coarse.trajectory(times)
    difference = np.abs(states - fine.trajectory(times))[:, [0, 2]]
    assert difference.max() < 1e-12
    depth = gap(fine.system, states)
    assert depth.max() <= DEPTH
    assert depth.min() < -1e4 * DEPTH  # flights, not the contact they end in
    assert abs(fine.contacts["time"][0] - end) < 1e-6


def stops(run: vi.Run) -> list[float]:
    """Times at, before and inside everything that happens in the first two contacts."""
    rows = run.contacts[:8]
    (first, *_) = rows[rows["kind"] == EventKind.CHATTER]
    hop = first["time"] - np.array([0.9, 0.5, 0.1, 1e-6]) * first["time_jump"]
    middle = 0.5 * (rows["time"][1:] + rows["time"][:-1])
    beside = np.nextafter(rows["time"], 0.0)
    return np.unique(np.concatenate([hop, middle, beside, rows["time"]])).tolist()


@pytest.mark.parametrize("name", ["fig7c_omega_0.25", "friction_stick_slip"])
def test_a_run_resumed_anywhere_in_a_contact_is_one_long_run_bit_for_bit(name):
    system, start = SYSTEMS[name], STARTS[name]
    whole = vi.simulate(system, initial=start, periods=4)
    modes = set()
    for time in stops(whole):
        first = vi.simulate(system, initial=start, time=time)
        modes.add(first.final_state.mode)
        more = 4 - first.final_state.period
        last = first.resume(periods=more)
        assert last.final_state == whole.final_state
        assert last.impact_count == whole.impact_count
        for table in ("impacts", "contacts"):
            joined = np.concatenate([getattr(first, table), getattr(last, table)])
            assert joined.tobytes() == getattr(whole, table).tobytes(), (time, table)
        assert_same_bits(
            first.resume(periods=more, keep=1),
            vi.simulate(system, initial=start, periods=4, keep=1),
        )
        parts = first.time_in_contact + last.time_in_contact
        assert parts == pytest.approx(whole.time_in_contact, rel=1e-13)
    assert {"flight", "slide_negative"} <= modes
    assert ("stick" in modes) == (system.friction > 0.0)


def test_files_and_pickles_keep_a_run_that_ends_in_contact(tmp_path):
    name = "friction_stick_slip"
    whole = vi.simulate(SYSTEMS[name], initial=STARTS[name], periods=1)
    (start, end, _), *_ = phases(whole, EventKind.STICK)
    run = vi.simulate(SYSTEMS[name], initial=STARTS[name], time=0.5 * (start + end))
    assert run.final_state.mode == "stick"
    run.save(tmp_path / "run.npz")
    back = vi.load(tmp_path / "run.npz")
    assert_same_bits(back, run)
    assert_same_bits(back.resume(periods=3), run.resume(periods=3))
    times = np.linspace(0.0, run.final_state.time, 300)
    forces = run.trajectory(times, forces=True)
    assert back.trajectory(times, forces=True).tobytes() == forces.tobytes()


def test_a_kept_window_may_begin_in_contact():
    # The contact lasts from drive phase 2.8 to 4.3: at phase 3.5 a period begins inside it.
    system = SYSTEMS["fig7c_omega_0.25"].replace(phase=3.5)
    whole = vi.simulate(system, initial=INITIAL, periods=30)
    kept = vi.simulate(system, initial=INITIAL, periods=30, keep=5)
    assert kept.contacts["kind"][0] == EventKind.RELEASE
    assert kept.final_state.mode in ("slide_positive", "slide_negative")
    tail = whole.contacts[whole.contacts["time"] > kept.kept_from]
    assert kept.contacts.tobytes() == tail.tobytes()
    times = np.linspace(kept.kept_from, kept.final_state.time, 500)
    forces = kept.trajectory(times, forces=True)
    assert forces[0, 4] > 0.0
    np.testing.assert_allclose(forces, whole.trajectory(times, forces=True), rtol=0, atol=1e-12)
    held = np.count_nonzero(forces[:, 4]) / len(times)
    assert kept.time_in_contact / (5 * system.drive_period) == pytest.approx(held, abs=0.005)
    # All five sections lie inside the contact.
    assert np.abs(gap(system, kept.stroboscopic)).max() < 1e-15
    assert kept.label == "1-inf"


def test_sections_inside_a_contact_lie_on_it():
    name = "fig7c_omega_0.25"
    run = vi.simulate(SYSTEMS[name], initial=STARTS[name], periods=12, section_phase=3.5)
    assert np.abs(gap(run.system, run.stroboscopic)).max() < 1e-15
    times = (3.5 + 2 * math.pi * np.arange(12)) / run.system.drive_frequency
    np.testing.assert_allclose(run.trajectory(times), run.stroboscopic, rtol=0.0, atol=1e-11)
    assert run.label == "1-inf"
    at_start = vi.simulate(SYSTEMS[name], initial=STARTS[name], periods=12)
    assert at_start.contacts.tobytes() == run.contacts.tobytes()


def test_labels_over_the_low_frequencies_of_figure_7c():
    # docs/theory.md, section 5: complete chatter in every period for omega <= 0.48.
    for frequency in np.arange(0.20, 0.481, 0.04):
        system = LOW.replace(drive_frequency=frequency)
        run = vi.simulate(system, initial=INITIAL, periods=200, keep=40)
        assert run.label == "1-inf", frequency
        assert (run.period.m, run.period.n) == (1, math.inf)
        chatters = run.contacts[run.contacts["kind"] == EventKind.CHATTER]
        assert len(np.unique(chatters["period"])) == 40
    above = vi.simulate(LOW.replace(drive_frequency=0.5), initial=INITIAL, periods=200, keep=40)
    assert (above.label, above.period.n, type(above.period.n)) == ("1-9", 9, int)
    assert above.time_in_contact == 0.0


def test_diagrams_tell_chatter_and_the_part_of_time_in_contact(tmp_path):
    frequencies = [0.25, 0.30, 0.45, 0.55]
    diagram = vi.bifurcation_diagram(
        LOW, initial=INITIAL, periods=200, keep=40, drive_frequency=frequencies
    )
    assert diagram.status.tolist() == ["completed"] * 4
    assert diagram.m.tolist() == [1, 1, 1, 1]
    assert diagram.n.tolist() == [-1, -1, -1, 6]
    # docs/theory.md, section 5, to the digits it gives.
    known, digit = np.array([0.24, 0.18, 0.095, 0.0]), np.array([5e-3, 5e-3, 5e-4, 0.0])
    assert (np.abs(diagram.contact_fraction - known) <= digit).all()
    for frequency, fraction in zip(frequencies, diagram.contact_fraction, strict=True):
        system = LOW.replace(drive_frequency=frequency)
        run = vi.simulate(system, initial=INITIAL, periods=200, keep=40)
        length = run.final_state.time - run.kept_from
        assert fraction == run.time_in_contact / length
    diagram.save(tmp_path / "diagram.npz")
    back = vi.load(tmp_path / "diagram.npz")
    assert back.contact_fraction.tobytes() == diagram.contact_fraction.tobytes()
    assert back.n.tobytes() == diagram.n.tobytes()
    nothing = vi.bifurcation_diagram(
        LOW, initial=INITIAL, periods=2, keep=0, drive_frequency=[0.25]
    )
    assert np.isnan(nothing.contact_fraction).all()
