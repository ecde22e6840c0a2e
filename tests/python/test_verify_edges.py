"""`vi.verify` where it is easily too kind: after large transients, at grazes, at the law's end."""

import math

import mpmath as mp
import numpy as np
import pytest

import sizes
import vibroimpact as vi
from systems import PAPER, ROUGH, STICKY
from vibroimpact.verification import passes
from vibroimpact.verification.columns import FURTHER_NUMBERS
from vibroimpact.verification.judged import right_digits
from vibroimpact.verification.motion import Path, Problem
from vibroimpact.verification.pairs import pairs

pytest.importorskip("flint", reason="verification needs python-flint")

START = (0, 0.5, 0, 0)
DAMPED = PAPER.replace(drive_frequency=1.4, moment_amplitude=3, damping=(0.03, 0.03))
# A pendulum of amplitude 1 that just reaches a wall at rest.
WALL = vi.System(
    mass_ratio=0,
    frequency_ratio=1,
    restitution=0.5,
    gap=1 - 1e-14,
    drive_frequency=0,
    contact="direct",
)
#: Digits may differ by what the size of the motion does: a factor of three or so.
HALF_A_DIGIT = 0.5


def simulated(system, **options):
    return vi.simulate(system, initial=START, **options)


def worst(run, found):
    """The digits of the sections in units of the run's own size over the last five of them."""
    errors = np.stack([found.whole_sections[f"error_{q}"] for q in ("x1", "v1", "x2", "v2")], 1)
    sizes = np.abs(run.stroboscopic[: len(errors)])
    sizes = np.array([sizes[max(0, k - 4) : k + 1].max(axis=0) for k in range(len(sizes))])
    return -np.log10((errors / sizes).max(axis=1))


@pytest.mark.parametrize(
    ("v1", "periods"), sizes.either([(50, 60), (1e3, 50)], [(50, 60), (1e3, 70), (1e5, 60)])
)
def test_digits_after_a_large_transient_are_those_of_what_is_left(v1, periods):
    run = vi.simulate(DAMPED, initial=(0, v1, 0, 0), periods=periods)
    found = vi.verify(run, digits=4)
    far = (found.sections["digits"] > 0) & (np.arange(len(found.sections)) > 15)
    assert far.sum() > 10
    # what counts is the present motion and none of the start
    assert (found.sections["digits"][far] < worst(run, found)[far] + HALF_A_DIGIT).all()
    off = found.impacts["error_x1"] > 0.5 * np.abs(run.impacts["x1"][: len(found.impacts)])
    assert (found.impacts["digits"][off] < 1).all()
    assert not found.impacts["number"][off].size or found.last_right < len(run.impacts)


def test_a_value_next_to_zero_loses_no_digits():
    # at each maximum of the angle v1 goes through 0, and body 2 starts from rest at 0
    free = PAPER.replace(gap=5.0, damping=(0.0, 0.0))
    run = vi.simulate(free, initial=(0.7, 0.0, 0.0, 0.2), periods=30)
    found = vi.verify(run, digits=13)
    assert found.holds, str(found)
    assert vi.verify(simulated(PAPER, periods=1)).least_digits > 14


@pytest.mark.parametrize(
    ("omega", "moment", "length"),
    [
        (0.0, 1.0, {"time": 40.0}),
        (0.01, 1.0, {"periods": sizes.either(1, 2)}),
        (30.0, 400.0, {"periods": 60}),
    ],
)
def test_slow_drives_fast_ones_and_constant_load(omega, moment, length):
    system = PAPER.replace(
        drive_frequency=omega, damping=(0.2, 0.2), restitution=0.5, gap=0.2, moment_amplitude=moment
    )
    found = vi.verify(simulated(system, **length))
    assert found.holds, str(found)
    assert len(found.final) == 1
    assert len(found.impacts) > 0


def test_an_error_as_large_as_a_slow_motion_is_no_right_digit():
    # one drive period is six thousand times as long as the start's transient
    system = PAPER.replace(drive_frequency=1e-3, damping=(0.3, 0.3), gap=3.0)
    run = vi.simulate(system, initial=(0, sizes.either(1e3, 1e5), 0, 0), periods=1)
    sections = run.stroboscopic.copy()
    sections[0, 0] *= 2
    run.__dict__["stroboscopic"] = sections
    assert vi.verify(run, digits=1).sections["digits"][0] < HALF_A_DIGIT


def test_an_impact_that_the_run_takes_for_a_graze_is_told():
    run = vi.simulate(WALL, initial=(0, 1, 0, 0), time=20.0)
    assert (len(run.impacts), len(run.grazes)) == (0, 3)
    found = vi.verify(run)
    assert not found.holds
    assert found.horizon.event == "graze"
    assert (found.horizon.number, found.horizon.reason) == (0, "digits")
    assert found.missed["graze"].tolist() == [0, 1, 2]
    # v = sqrt(1 - gap^2) is reversed to half
    gap = mp.mpf(WALL.gap)
    speed = float(mp.sqrt(1 - gap**2))
    assert found.missed["jump"][0] == pytest.approx(1.5 * speed, rel=1e-7)
    assert 6 < found.final["digits"][0] < 7
    assert "3 impacts of the exact motion, each a graze of the run" in str(found)
    rough = vi.verify(run, digits=5)
    assert rough.holds
    assert "each a graze of the run" in str(rough)


def test_a_graze_that_is_none_in_the_exact_motion_is_no_disagreement():
    run = vi.simulate(WALL.replace(gap=1 + 2.0**-52), initial=(0, 1, 0, 0), time=20.0)
    found = vi.verify(run)
    assert found.holds, str(found)
    assert found.certified
    assert len(found.missed) == 0


def test_nothing_compared_neither_holds_nor_is_certified(monkeypatch):
    follow = Problem.follow

    def interrupted(*given, **options):
        done = follow(*given, **options)
        return passes.Pass(done.bits, [], [], stopped="")

    monkeypatch.setattr(Problem, "follow", interrupted)
    run = vi.simulate(WALL.replace(gap=2.0), initial=(0, 1, 0, 0), time=20.0)
    found = vi.verify(run)
    assert (found.stopped, len(found.final)) == ("completed", 0)
    assert not found.holds
    assert not found.certified
    assert not re_search_holds(str(found))


def re_search_holds(text):
    return "hold to" in text or "holds to" in text or "by proof" in text


@pytest.mark.parametrize("length", [{"time": 30.0}, {"periods": 9, "keep": 0}, {"periods": 9}])
def test_the_final_state_is_compared(length):
    run = simulated(PAPER, **length)
    found = vi.verify(run)
    assert found.holds
    assert found.final["time"][0] == run.final_state.time
    assert found.final["error_x1"][0] < 1e-14
    assert found.final["certified"][0]
    assert "the final state hold" in str(found)
    wrong = simulated(PAPER, **length)
    state = run.final_state
    x1 = state.x1 + 1e-7
    wrong.__dict__["final_state"] = type(state)(
        x1=x1, v1=state.v1, x2=state.x2, v2=state.v2, time=state.time, period=state.period,
        time_in_period=state.time_in_period, mode=state.mode,
    )  # fmt: skip
    found = vi.verify(wrong)
    assert not found.holds
    assert (found.horizon.event, found.horizon.reason) == ("final_state", "digits")
    assert found.final["error_x1"][0] == pytest.approx(1e-7, rel=1e-6)


def test_a_run_capped_at_an_impact_ends_with_the_state_after_it():
    run = simulated(PAPER, periods=12, max_events=7)
    assert run.final_state.v1 == run.impacts["v1_post"][-1]
    found = vi.verify(run)
    assert found.holds
    assert len(found.final) == 1


def test_the_bound_of_the_time_is_one(bench):
    run = simulated(PAPER, periods=12)
    found = vi.verify(run)
    mp.mp.dps = 60
    parameters = {
        symbol: mp.mpf(getattr(PAPER, name)) for symbol, name in vi.system.SYMBOLS.items()
    }
    exact, _ = bench("reference_runs").run(parameters, list(map(mp.mpf, START)), 12)
    assert len(exact) == len(found.impacts)
    period = 2 * mp.pi / mp.mpf(PAPER.drive_frequency)
    for bound, mine, (time, *_) in zip(found.impacts, run.impacts, exact, strict=True):
        since = time - int(mine["period"]) * period
        for value, true in ((mine["time"], time), (mine["time_in_period"], since)):
            assert mp.mpf(bound["error_time"]) >= abs(true - mp.mpf(float(value)))
        assert bound["error_time"] < 1e-14
    # rounding to one number counts for no lost digit, however long the run
    assert (found.impacts["digits"] > 14).all()


@pytest.mark.parametrize(
    "system",
    [
        PAPER,
        ROUGH,
        ROUGH.replace(law="newton"),
        ROUGH.replace(law="energetic", friction=1.5),
        ROUGH.replace(law="paper"),
        PAPER.replace(law="paper", mass_ratio=0.0, force_amplitude=0.2),
        PAPER.replace(mass_ratio=0.0, friction=0.4, force_amplitude=0.2),
        PAPER.replace(contact="direct", phase=-2.0),
    ],
    ids=["free", "poisson", "newton", "energetic", "paper", "paper wall", "wall", "direct"],
)
def test_phase_impulses_and_energy_are_compared(system):
    run = simulated(system, periods=4)
    found = vi.verify(run, digits=12)
    assert found.holds, str(found)
    for name in FURTHER_NUMBERS:
        assert (found.impacts[f"error_{name}"] < 1e-12).all(), name
        rows = run.impacts.copy()
        rows[name][1] += 1e-6
        fake = simulated(system, periods=4)
        fake.__dict__["impacts"] = rows
        wrong = vi.verify(fake)
        assert (wrong.horizon.number, wrong.horizon.reason) == (2, "digits")
        assert wrong.impacts[f"error_{name}"][1] == pytest.approx(1e-6, rel=1e-5)
        assert np.flatnonzero(wrong.impacts["digits"] < 10).tolist() == [1]


def test_a_phase_next_to_a_whole_turn():
    run = simulated(PAPER, periods=2)
    rows = run.impacts.copy()
    rows["phase"][0] += 2 * math.pi
    run.__dict__["impacts"] = rows
    assert vi.verify(run).impacts["error_phase"][0] < 1e-14


def test_head_on_impacts_under_the_printed_law():
    head_on = PAPER.replace(contact="direct", law="paper")
    found = vi.verify(simulated(head_on, periods=5))
    assert found.holds, str(found)
    assert found.certified


FAILING = PAPER.replace(
    law="paper", friction=0.8, drive_frequency=1.4, damping=(0.01, 0.01), force_amplitude=0.5
)
# It creates energy at each impact, up to 1e65 times the start's speed.
EXPLODING = vi.System(
    friction=1.6463883163290705,
    restitution=0.6921857046995211,
    mass_ratio=0.006124458739860627,
    frequency_ratio=1.178717278940411,
    drive_frequency=0.05,
    damping=(0.0, 0.05944136479492833),
    moment_amplitude=0.0007819291048701068,
    force_amplitude=1.4021256428196756,
    gap=-0.27152244995397207,
    phase=3.3892886512555314,
    law="paper",
)


def test_a_failure_of_the_printed_law_is_the_same_in_both():
    run = simulated(FAILING, periods=50)
    assert run.stop_reason == "law_failed"
    found = vi.verify(run)
    assert found.holds, str(found)
    assert len(found.impacts) == len(run.impacts) == 4
    assert len(found.final) == 1
    assert "the run and the exact motion both end at time 11.94" in str(found)


def test_a_failure_of_the_law_in_one_of_both_is_found(monkeypatch):
    run = simulated(PAPER, periods=12)
    monkeypatch.setattr(vi.Run, "stop_reason", "law_failed")
    found = vi.verify(run)
    assert (found.stopped, found.horizon.event) == ("sequence", "stop")
    assert "the run ends as law_failed" in found.stop_detail
    monkeypatch.undo()
    run = simulated(FAILING, periods=50)
    monkeypatch.setattr(vi.Run, "stop_reason", "completed")
    state = run.final_state
    values = {name: getattr(state, name) for name in ("x1", "v1", "x2", "v2", "mode")}
    run.__dict__["final_state"] = type(state)(
        **values, time=state.time + 1, period=state.period, time_in_period=state.time_in_period + 1
    )
    found = vi.verify(run)
    assert (found.stopped, found.horizon.event) == ("sequence", "stop")
    assert "for which the law has no outcome" in found.stop_detail


def test_speeds_beyond_all_measure_are_judged():
    start = (-0.2949307542752404, 0.0325584538532131, 0.03644336753883337, -0.5980887256462895)
    run = vi.simulate(EXPLODING, initial=start, periods=2, max_events=300)
    assert run.stop_reason == "law_failed"
    assert np.abs(run.final_state.v1) > 1e60
    found = vi.verify(run)
    assert len(found.impacts) == len(run.impacts)
    assert 0 < found.horizon.number < len(run.impacts)


def test_digits_of_numbers_at_the_ends_of_the_range():
    assert right_digits(1e-300, 1e300) == 16
    assert right_digits(5e-324, 1.7e308) == 16
    assert right_digits(1e300, 1e-300) == 0
    assert right_digits(math.inf, math.inf) == 0
    assert right_digits(1e-3, 1.0) == pytest.approx(3)


def test_a_section_within_the_end_of_a_chatter_is_not_passed_over(monkeypatch):
    run = simulated(STICKY, periods=1)
    found = vi.verify(run)
    assert (found.stopped, found.holds) == ("completed", True)
    path = Path._at

    def unknown(self, time, until, state):
        return None if time is self.times[0] else path(self, time, until, state)

    monkeypatch.setattr(Path, "_at", unknown)
    found = vi.verify(run)
    assert (found.stopped, found.holds, len(found.sections)) == ("undecided", False, 0)
    assert "section 0 (time 25.1327) lies at an event" in found.stop_detail


@pytest.mark.parametrize("law", ["newton", "energetic"])
def test_a_tip_that_sticks_on_a_wall(law):
    # once it sticks u changes no more: newton ends there, energetic where its work is returned
    system = vi.System(
        friction=1.5,
        restitution=0.9,
        mass_ratio=0,
        frequency_ratio=0.1,
        drive_frequency=0.05,
        damping=(0.85, 1.05),
        moment_amplitude=2.4,
        force_amplitude=0.5,
        gap=0.35,
        phase=5.83,
        law=law,
    )
    run = vi.simulate(system, initial=(-0.85, -0.98, -0.2, 0.05), periods=2, max_events=20)
    stuck = run.impacts["regime"] == vi.Regime.STICK_RESTITUTION
    assert stuck.any()
    found = vi.verify(run, digits=8)
    assert found.holds, str(found)
    assert found.impacts["regime_agrees"].all()


def test_a_run_that_ends_before_its_window_begins():
    system = PAPER.replace(
        mass_ratio=0.0, friction=2.0, force_amplitude=1.5, gap=0.2, drive_frequency=0.6
    )
    run = simulated(system, periods=20, keep=2)
    assert run.stop_reason == "jammed"
    assert run.final_state.period < 17
    found = vi.verify(run)
    assert found.from_start
    assert "another version" not in str(found)
    assert len(found.whole_impacts) == run.impact_count > 0


@pytest.mark.parametrize(
    ("mass_ratio", "frequency_ratio", "restitution", "gap", "drive", "moment", "friction"),
    [
        # the run's last impact is plastic, and of the exact motion the first of a chatter
        (1.64, 1.223, 3.418616487564482e-05, 0.118, 2.992, 1.108, 0.0),
        # the run lists more impacts before it than the exact motion before its chatter
        (1.293, 1.24, 0.0018620954981612469, 0.082, 1.818, 2.602, 0.3),
    ],
)
def test_a_chatter_that_one_side_tells_as_a_plastic_impact(
    mass_ratio, frequency_ratio, restitution, gap, drive, moment, friction
):
    system = vi.System(
        mass_ratio=mass_ratio,
        frequency_ratio=frequency_ratio,
        restitution=restitution,
        gap=gap,
        drive_frequency=drive,
        moment_amplitude=moment,
        friction=friction,
        damping=(0.02, 0.02),
    )
    run = simulated(system, periods=6)
    found = vi.verify(run, digits=12)
    assert (found.stopped, found.holds) == ("completed", True)
    assert len(found.contacts) == len(run.contacts) > 1
    assert len(found.sections) == 6


@pytest.mark.parametrize(
    ("told", "exact", "last"),
    [
        ("iS", "iicS", (2, 4)),
        ("iiiS", "iicS", (4, 4)),
        ("iicS", "iS", (4, 2)),
        # another contact, one out of a flight, an impact after the chatter, one chatter more
        ("iN", "iicS", (1, 1)),
        ("irS", "ircS", (2, 2)),
        ("iS", "iiciS", (1, 1)),
        ("iS", "icicS", (1, 1)),
        ("iS", "iiS", (1, 1)),
    ],
)
def test_events_that_belong_together(told, exact, last):
    names = {
        "i": "impact", "c": "chatter", "S": "slide_positive", "N": "slide_negative", "r": "release"
    }  # fmt: skip
    spelled = [[names[letter] for letter in word] for word in (told, exact)]
    assert list(pairs(*spelled))[-1] == last
