"""`vi.verify` of runs that keep their end only: what it says of the whole motion."""

import re

import numpy as np
import pytest

import sizes
import vibroimpact as vi
from systems import PAPER, STICKY
from vibroimpact.verification import stretches as stretches_module
from vibroimpact.verification.stretches import stretches
from vibroimpact.verification.watch import Watch

pytest.importorskip("flint", reason="verification needs python-flint")

CHAOTIC = PAPER.replace(drive_frequency=1.4, moment_amplitude=3)
# Chaotic for some 140 periods, then 1-1.
SETTLING = PAPER.replace(drive_frequency=1.446218487394958, moment_amplitude=1.5)
# Chaotic, with chatter and contact every now and then.
CONTACT = PAPER.replace(drive_frequency=1.4254237288135592, moment_amplitude=3, restitution=0.6)
START = (0, 0.5, 0, 0)
TABLES = ("impacts", "grazes", "contacts", "events", "sections")


def simulated(system=CHAOTIC, **options):
    return vi.simulate(system, initial=START, **options)


def lines(found):
    return str(found).splitlines()


@pytest.fixture(scope="module")
def whole():
    return vi.verify(simulated(periods=120))


@pytest.mark.parametrize("keep", sizes.either([0, 100], [0, 1, 100]))
def test_a_window_after_the_horizon_is_told_the_horizon_of_the_whole_motion(whole, keep):
    run = simulated(periods=600, keep=keep)
    found = vi.verify(run)
    assert (found.stopped, found.holds, found.from_start) == ("lost", False, True)
    assert found.horizon == whole.horizon
    assert found.last_right == whole.last_right > found.horizon.number
    assert not any(map(len, (found.impacts, found.contacts, found.sections)))
    # what the run has not kept is the run that keeps all, and no more of it than needed
    assert len(found.whole_impacts) == len(whole.impacts) < 200
    assert (found.whole_impacts["digits"] == whole.impacts["digits"]).all()
    assert (whole.whole_impacts == whole.impacts).all()
    assert found.first_kept == run.impact_count - len(run.impacts) + 1
    assert found.kept_from == run.kept_from
    begins = f"impact {found.first_kept} (time {run.kept_from:.6g})"
    if not keep:
        begins = f"time {run.kept_from:.6g}"
    assert lines(found)[:2] == [
        "nothing that is kept is verified" if keep else "nothing is kept",
        f"{lines(whole)[0]}; its window begins at {begins}",
    ]
    assert lines(found)[2:5] == lines(whole)[1:4]


def test_a_window_around_the_horizon_or_after_it_but_within_reach():
    found = vi.verify(simulated(periods=45, keep=30))
    number = found.horizon.number
    assert 1 < found.first_kept < number
    assert found.impacts["number"][0] == found.first_kept
    good = number - found.first_kept
    assert lines(found)[0].startswith(f"{good} of {len(found.impacts)} impacts and ")
    assert "that are kept hold to 10 digits" in lines(found)[0]
    assert f"up to impact {number - 1} (" in lines(found)[1]
    later = vi.verify(simulated(periods=45, keep=3))
    assert later.horizon == found.horizon
    assert lines(later)[0] == "nothing that is kept holds 10 digits"
    assert (
        later.impacts["number"].tolist() == found.impacts["number"][-len(later.impacts) :].tolist()
    )
    assert later.sections["row"].tolist() == [0, 1, 2]
    assert later.whole_sections["row"].tolist() == [*range(45)]
    assert (later.sections["time"] == found.sections["time"][-3:]).all()


def test_all_sentences_name_an_impact_once_and_agree(whole):
    # the last right digit, and the end of the comparison, are two things
    said = {
        name: int(re.search(rf"impact (\d+) .*{name}", str(whole))[1])
        for name in ("is the first with fewer than 10 digits", "is the last with a right digit")
    }
    ends = int(re.search(r"the comparison ends at impact (\d+) ", str(whole))[1])
    assert [*said.values(), ends] == [whole.horizon.number, whole.last_right, len(whole.impacts)]
    assert "only" not in str(whole)


def made_as_a_whole(run, system, **options):
    """What the stretches of a run come to, and the run that keeps all."""
    parts, full = stretches(run, 10_000), simulated(system, **options)
    assert parts.from_start
    for name in TABLES:
        mine = [getattr(part, name) for part in (parts.lead, parts.kept)]
        true = getattr(full, "stroboscopic" if name == "sections" else name)
        if name == "events":
            mine = [rows["time"] for rows in mine]
            true = true["time"]
        assert np.array_equal(np.concatenate(mine), true), name
    return parts


@pytest.mark.parametrize("system", [CHAOTIC, STICKY, PAPER], ids=["chaotic", "sticky", "periodic"])
@pytest.mark.parametrize("phase", [0.0, 1.0])
def test_what_a_run_has_not_kept_is_made_again_to_the_same_bits(system, phase, tmp_path):
    options = {"section_phase": phase, "chatter_tolerance": 1e-9}
    run = simulated(system, periods=9, keep=4, **options)
    made_as_a_whole(run, system, periods=9, **options)
    run.save(tmp_path / "run.npz")
    made_as_a_whole(vi.load(tmp_path / "run.npz"), system, periods=9, **options)
    made_as_a_whole(run.resume(periods=3), system, periods=12, **options)
    made_as_a_whole(run.resume(periods=3, keep=1), system, periods=12, **options)
    further = run.resume(time=1.25)
    made_as_a_whole(further, system, time=run.final_state.time + 1.25, **options)
    capped = simulated(system, periods=9, max_events=6, **options).resume(periods=9, max_events=11)
    made_as_a_whole(capped, system, periods=18, max_events=11, **options)


def test_a_run_that_keeps_all_is_not_made_again(monkeypatch):
    monkeypatch.delattr(stretches_module, "simulated")
    parts = stretches(simulated(periods=9), 100)
    assert (parts.lead, parts.again, parts.from_start) == (None, None, True)


@pytest.mark.parametrize("horizon", ['"Periods":900', '"Time":4000.0'])
def test_an_interrupted_run(horizon):
    full = simulated(periods=30)
    # as after Ctrl-C: the run ends before its horizon
    run = simulated(periods=20, keep=5)
    core = run._core
    text = core.to_json().replace('"Periods":20', horizon).replace('"completed"', '"interrupted"')
    tables = {
        name: getattr(core, name)
        for name in ("impacts", "stroboscopic", "events", "grazes", "contacts")
    }
    run = vi.Run(type(core).from_parts(text, **tables), run.system, run.initial)
    assert run.stop_reason == "interrupted"
    parts = stretches(run, 10_000)
    assert parts.from_start
    assert parts.again.final_state.period == 21
    assert (parts.lead.impacts == full.impacts[: len(parts.lead.impacts)]).all()
    found = vi.verify(run, digits=5)
    assert (found.stopped, found.holds) == ("completed", True)


def test_no_more_is_made_again_than_the_reference_may_follow():
    run = simulated(PAPER, periods=5000, keep=10)
    parts = stretches(run, 20)
    assert parts.from_start
    assert parts.again.final_state.period == 21
    found = vi.verify(run, max_events=20)
    assert (found.stopped, found.horizon, found.holds) == ("event_cap", None, False)
    assert len(found.impacts) == 0
    assert 15 < len(found.whole_impacts) <= 20
    assert lines(found)[0] == "nothing that is kept is verified"
    assert lines(found)[1].startswith(f"the run holds 14 digits up to impact {found.last_right} (")
    assert "more than 20 drive periods (max_events)" in lines(found)[2]


def test_a_run_that_finds_its_digits_again_is_followed_on():
    run = simulated(SETTLING, periods=320, keep=20)
    assert run.label == "1-1"
    found = vi.verify(run, digits=2)
    assert found.horizon.number < found.first_kept
    assert (found.whole_impacts["digits"] < 1).sum() > 60
    assert (found.stopped, found.holds) == ("completed", True)
    assert lines(found)[0].startswith("all 20 impacts, all 20 sections that are kept and the final")
    assert re.search(r"is the first with fewer than 2 digits, impact \d+ .* the last", str(found))


def test_a_run_that_cannot_be_made_again_is_judged_by_what_it_keeps():
    run = simulated(PAPER, periods=30, keep=5)
    core = type(run._core).from_parts(
        run._core.to_json().replace('"impact_count":29', '"impact_count":30'),
        **{
            name: getattr(run._core, name)
            for name in ("impacts", "stroboscopic", "events", "grazes", "contacts")
        },
    )
    other = vi.Run(core, run.system, run.initial)
    assert other.impact_count == run.impact_count + 1
    found = vi.verify(other)
    assert not found.from_start
    assert found.holds
    assert len(found.whole_impacts) == len(found.impacts) == len(run.impacts)
    assert "only what is kept is judged" in str(found)
    assert "only what is kept" not in str(vi.verify(run))


def test_a_chaotic_run_with_contact_is_left_by_its_sections():
    run = simulated(CONTACT, periods=130)
    # Rounding decides how often: chatter, a slide and a release in each phase.
    assert len(run.contacts) >= 3
    found = vi.verify(run, digits=4)
    assert found.stopped == "lost"
    assert len(found.sections) < 120
    assert found.horizon is not None


def test_the_watch_counts_rows_in_a_row():
    watch = Watch(stretches(simulated(periods=100), 1000), None)
    here = [(row * 1.0, state) for row, state in enumerate(watch.sections)]
    watch.begin(64)
    assert not any(watch.section(number, time, state) for number, (time, state) in enumerate(here))
    told = [watch.section(number, time, state + 1) for number, (time, state) in enumerate(here)]
    assert told.index(True) == 39
    watch.begin(64)
    told = [
        watch.section(number, time, state + (number % 40 > 0))
        for number, (time, state) in enumerate(here)
    ]
    assert not any(told)


def test_the_watch_counts_impacts_in_a_row():
    run = simulated(periods=100)
    watch = Watch(stretches(run, 1000), None)
    times = run.impacts["time"]

    def told(shifts):
        watch.begin(64)
        return [watch.impact(number, time) for number, time in enumerate(times + shifts)]

    assert not any(told(np.zeros(len(times))))
    assert told(np.full(len(times), 0.05)).index(True) == 39
    assert not any(told(0.05 * (np.arange(len(times)) % 40 > 0)))
    # after sustained contact the numbers of impacts tell nothing
    run = simulated(STICKY, periods=40)
    watch = Watch(stretches(run, 1000), None)
    assert len(watch.times) == (run.impacts["time"] < run.contacts["time"][0]).sum() < 30
    times = run.impacts["time"]
    assert not any(told(np.ones(len(times))))


def test_ctrl_c_while_the_run_is_made_again(monkeypatch):
    run = simulated(periods=45, keep=3)

    def interrupted(*_, **__):
        raise vi.Interrupted("interrupted", run)

    monkeypatch.setattr(stretches_module, "simulated", interrupted)
    with pytest.raises(vi.Interrupted, match="verified so far") as caught:
        vi.verify(run)
    found = caught.value.result
    assert (found.stopped, found.horizon, len(found.whole_impacts)) == ("interrupted", None, 0)
    assert "nothing is compared: interrupted" in str(found)
    assert "proof" not in str(found)


def test_progress_is_shown_on_demand(capsys):
    run = simulated(PAPER, periods=12)
    vi.verify(run)
    assert capsys.readouterr().err == ""
    vi.verify(run, progress=True)
    shown = capsys.readouterr().err
    assert "pass 1, " in shown
    assert re.search(r"1[12]/12 \[.*period", shown)
    ball = PAPER.replace(drive_frequency=0.0, damping=(0.05, 0.05))
    run = simulated(ball, time=6.0)
    vi.verify(run, progress=True)
    assert f"{run.impact_count}/{run.impact_count} [" in capsys.readouterr().err
    with pytest.raises(vi.ParameterError, match="progress"):
        vi.verify(run, progress=1)
