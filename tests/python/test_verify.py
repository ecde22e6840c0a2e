"""`vi.verify`: what it says of periodic, chaotic, sticking and falsified runs.

Its errors are held against 60-digit runs by mpmath (benches/reference_runs.py), which share no code
with the reference simulator; that one has tests of its own in tests/reference.
"""

import ast
import dataclasses
import re
import subprocess
import sys
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest

import vibroimpact as vi
from systems import PAPER, STICKY
from vibroimpact.system import SYMBOLS
from vibroimpact.verification import motion, passes
from vibroimpact.verification.columns import IMPACT_NUMBERS

pytest.importorskip("flint", reason="verification needs python-flint")

CHAOTIC = PAPER.replace(drive_frequency=1.4, moment_amplitude=3)
START = (0, 0.5, 0, 0)
EPS = float(np.finfo(float).eps)


@pytest.fixture
def periodic():
    return vi.simulate(PAPER, initial=START, periods=12)


@pytest.fixture(scope="module")
def chaotic():
    run = vi.simulate(CHAOTIC, initial=START, periods=45)
    return run, vi.verify(run)


def falsified(run, table, row, **values):
    """The same run with numbers of one row changed."""
    rows = getattr(run, table).copy()
    for name, value in values.items():
        rows[name][row] = value
    run.__dict__[table] = rows
    return run


def test_a_periodic_run_holds_and_is_proved(periodic):
    found = vi.verify(periodic, digits=13)
    assert found.holds
    assert found.certified
    assert found.horizon is None
    assert found.kept == (len(found.impacts), 0, len(found.sections)) == (12, 0, 12)
    assert found.impacts["number"].tolist() == list(range(1, 13))
    assert 14 < found.least_digits < 16
    for name in IMPACT_NUMBERS:
        assert (found.impacts[f"error_{name}"] < 20 * EPS).all(), name
    assert (found.impacts["reference_error"] < 1e-60).all()
    assert found.impacts["regime_agrees"].all()
    assert not found.impacts["ambiguous"].any()
    assert "all 12 impacts, all 12 sections and the final state hold to 14 digits" in str(found)
    assert "enclosed by proof" in str(found)
    assert "no horizon" in repr(found)


def test_perturbations_of_a_stable_motion_do_not_grow():
    # once it has settled they decay as the largest multiplier says
    run = vi.simulate(PAPER.replace(damping=(0.1, 0.1)), initial=START, periods=30)
    found = vi.verify(run)
    motion_ = run.refine()
    rate = np.log(abs(motion_.multipliers).max()) / motion_.n
    later = found.impacts[-12:]["growth"]
    assert np.log(later[-1] / later[0]) / 11 == pytest.approx(rate, rel=0.1)
    assert found.growth < 0


def test_a_chaotic_run_has_a_horizon_and_says_its_true_errors(chaotic, bench):
    run, found = chaotic
    horizon = found.horizon
    assert horizon.event == "impact"
    assert horizon.reason == "digits"
    assert 10 < horizon.number < len(run.impacts) - 10
    assert found.growth > 0.2
    mp.mp.dps = 60
    parameters = {symbol: mp.mpf(getattr(run.system, name)) for symbol, name in SYMBOLS.items()}
    periods = int(run.impacts["period"][horizon.number - 1]) + 1
    exact, _ = bench("reference_runs").run(parameters, list(map(mp.mpf, START)), periods)
    assert len(exact) >= horizon.number
    for row, mine, (time, pre, post) in zip(found.impacts, run.impacts, exact, strict=False):
        assert row["certified"]
        true = {
            "x1": pre[0], "v1_pre": pre[1], "v1_post": post[1],
            "x2": pre[2], "v2_pre": pre[3], "v2_post": post[3],
        }  # fmt: skip
        for name, value in true.items():
            error = float(abs(value - mp.mpf(float(mine[name]))))
            assert row[f"error_{name}"] == pytest.approx(error, rel=1e-9, abs=1e-30), name
        error = float(abs(time - mp.mpf(float(mine["time"]))))
        assert row["error_time"] == pytest.approx(error, abs=np.spacing(mine["time"]))
        worst = max(*(float(abs(true[name] - mp.mpf(float(mine[name])))) for name in true), error)
        if row["number"] < horizon.number:
            assert worst < 1e-9
            assert row["digits"] >= found.digits
    assert found.impacts["digits"][horizon.number - 1] < found.digits
    assert f"the run holds 10 digits up to impact {horizon.number - 1} (time" in str(found)
    assert f"impact {horizon.number} (time {horizon.time:.6g}) is the first with" in str(found)


def test_a_run_beyond_its_horizon_is_given_up_once_it_is_lost():
    system = PAPER.replace(drive_frequency=1.6, moment_amplitude=2)
    run = vi.simulate(system, initial=START, periods=200)
    found = vi.verify(run, digits=2)
    assert found.stopped == "lost"
    assert not found.holds
    assert len(found.impacts) < len(run.impacts) - 20
    assert (found.impacts["digits"][-30:] < 3).all()
    assert found.impacts["digits"][found.last_right - 1] >= 1
    assert (found.impacts["digits"][found.last_right :] < 1).all()
    last, end = found.last_right, len(found.impacts)
    assert 39 < end - last < 60
    assert f"impact {last} (time {found.impacts['time'][last - 1]:.6g}) is the last" in str(found)
    assert re.search(rf"the comparison ends at .*impact {end}\b.*: the run has parted", str(found))


def test_kept_impacts_are_those_of_the_whole_run(chaotic):
    whole, found = chaotic
    run = vi.simulate(CHAOTIC, initial=START, periods=45, keep=30)
    kept = vi.verify(run)
    assert len(kept.impacts) == len(run.impacts) < len(whole.impacts)
    assert kept.horizon == found.horizon
    later = found.impacts[-len(run.impacts) :]
    for name in ("number", "time", "regime", "certified"):
        assert (kept.impacts[name] == later[name]).all()
    for name in IMPACT_NUMBERS[1:]:
        assert kept.impacts[f"error_{name}"] == pytest.approx(later[f"error_{name}"], rel=1e-9)


@pytest.mark.parametrize("name", ["time", "time_in_period", "x1", "v1_pre", "v2_post"])
def test_a_falsified_number_is_found_where_it_stands(periodic, name):
    row = 7
    fake = falsified(periodic, "impacts", row, **{name: periodic.impacts[name][row] + 1e-9})
    found = vi.verify(fake)
    assert found.horizon == vi.verification.Disagreement(
        event="impact", number=row + 1, time=float(fake.impacts["time"][row]), reason="digits"
    )
    assert np.flatnonzero(found.impacts["digits"] < 10).tolist() == [row]
    column = "time" if name == "time_in_period" else name
    assert found.impacts[f"error_{column}"][row] == pytest.approx(1e-9, rel=1e-5)
    assert vi.verify(fake, digits=8).holds


def test_a_falsified_regime_section_or_nan_is_found(periodic):
    found = vi.verify(falsified(periodic, "impacts", 3, regime=vi.Regime.SLIP))
    assert (found.horizon.number, found.horizon.reason) == (4, "regime")
    assert not found.impacts["ambiguous"].any()
    found = vi.verify(falsified(periodic, "impacts", 2, v1_post=np.nan))
    assert (found.horizon.number, found.horizon.reason) == (3, "digits")
    del periodic.__dict__["impacts"]
    sections = periodic.stroboscopic.copy()
    sections[5, 2] += 1e-7
    periodic.__dict__["stroboscopic"] = sections
    found = vi.verify(periodic)
    assert (found.horizon.event, found.horizon.number) == ("section", 5)
    assert found.sections["error_x2"][5] == pytest.approx(1e-7)


def test_impacts_left_out_or_made_up_are_found(periodic):
    events = periodic.events
    # where one is missing the next one stands in its place
    for changed, number in ((np.delete(events, 6), 8), (events[:-3], 11)):
        periodic.__dict__["events"] = changed
        found = vi.verify(periodic)
        assert not found.holds
        assert (found.horizon.event, found.horizon.number) == ("impact", number)
    periodic.__dict__["events"] = np.append(events[:-1], events[-2:])
    found = vi.verify(periodic)
    assert found.stopped == "sequence"
    assert found.horizon.reason == "sequence"


def test_chatter_and_contact_are_compared_and_no_proof_is_claimed():
    run = vi.simulate(STICKY, initial=START, periods=1)
    found = vi.verify(run)
    assert found.holds
    assert len(found.contacts) == len(run.contacts) > 3
    assert not found.contacts["certified"].any()
    assert found.impacts["certified"][0]
    assert not found.certified
    assert (found.contacts["kind"] == run.contacts["kind"]).all()
    assert "by proof, the rest by two precisions" in str(found)
    fake = falsified(run, "contacts", 2, x1=run.contacts["x1"][2] + 1e-8)
    horizon = vi.verify(fake).horizon
    assert (horizon.number, horizon.reason) == (2, "digits")
    assert horizon.event == vi.EventKind(run.contacts["kind"][2]).name.lower()


@pytest.mark.parametrize(
    "system",
    [
        PAPER.replace(drive_frequency=1.545, friction=0.5, law="newton", phase=1.0),
        PAPER.replace(drive_frequency=1.545, friction=0.5, law="energetic"),
        PAPER.replace(drive_frequency=1.545, friction=0.5, law="paper"),
        PAPER.replace(contact="direct", damping=(1.0, 2.0)),
        PAPER.replace(mass_ratio=0.0, force_amplitude=0.2),
        PAPER.replace(drive_frequency=2.0),  # at resonance
    ],
    ids=["newton", "energetic", "paper", "direct", "wall", "resonance"],
)
def test_every_law_and_contact(system):
    run = vi.simulate(system, initial=START, periods=8, section_phase=1.0)
    found = vi.verify(run, digits=12)
    assert found.holds, str(found)
    assert found.certified
    assert len(found.sections) == len(run.stroboscopic)


def test_without_a_drive_period():
    ball = PAPER.replace(drive_frequency=0.0, damping=(0.05, 0.05))
    run = vi.simulate(ball, initial=START, time=6.0)
    found = vi.verify(run)
    assert found.holds
    assert len(found.impacts) == len(run.impacts) > 0
    assert len(found.sections) == 0


def test_a_run_read_back_and_a_resumed_one(periodic, tmp_path):
    periodic.save(tmp_path / "run.npz")
    found = vi.verify(vi.load(tmp_path / "run.npz"))
    assert (found.impacts == vi.verify(periodic).impacts).all()
    further = periodic.resume(periods=3)
    assert vi.verify(further).holds


def test_a_cap_on_events_ends_it(periodic):
    found = vi.verify(periodic, max_events=5)
    assert found.stopped == "event_cap"
    assert not found.holds
    assert 3 <= len(found.impacts) <= 5
    assert found.horizon is None
    assert "the comparison ends at impact 5 (time" in str(found)
    assert "more than 5 impacts (max_events)" in str(found)


def test_a_longer_chatter_without_friction():
    # its enclosed impacts are more than those that two precisions list, and end in it
    run = vi.simulate(STICKY.replace(restitution=0.6, friction=0.0), initial=START, periods=1)
    found = vi.verify(run)
    assert found.holds, str(found)
    assert len(found.contacts) == 3
    assert len(found.impacts) == len(run.impacts)


@pytest.mark.parametrize("cap", [10, 14])
def test_a_cap_within_a_chatter_is_no_disagreement(cap):
    run = vi.simulate(STICKY, initial=START, periods=1)
    first = int(np.flatnonzero(run.events["kind"] == vi.EventKind.CHATTER)[0])
    found = vi.verify(run, max_events=cap)
    assert len(found.impacts) <= first < cap + 8
    assert (found.stopped, found.horizon) == ("event_cap", None)


def test_a_run_that_ends_within_a_chatter_is_no_disagreement():
    # the run lists impacts that the reference, which completes the chatter, does not need
    system = vi.System(
        mass_ratio=0.0,
        frequency_ratio=0.16723335777827783,
        restitution=0.34918700785936074,
        gap=-0.3505199736059521,
        drive_frequency=3.262812350902484,
        damping=(0.793140651020276, 0.061649660432052895),
        moment_amplitude=1.4514464740274218,
        force_amplitude=0.7219050166467347,
        phase=2.1122922402526414,
    )
    start = (-0.6345106282973689, 0.22107904594179661, 1.4339593993169673, -0.7765899838684083)
    run = vi.simulate(system, initial=start, periods=12, max_events=25)
    found = vi.verify(run)
    assert found.holds, str(found)
    assert 5 < len(found.impacts) < len(run.impacts) == 25
    # an impact after the accumulation point is none of the chatter
    late = falsified(run, "impacts", 24, time=1.39)
    assert vi.verify(late).stopped == "sequence"


def test_a_dead_end_of_both_holds():
    # the wall moves towards the tip, which friction holds
    system = PAPER.replace(
        mass_ratio=0.0, friction=2.0, force_amplitude=1.5, gap=0.2, drive_frequency=0.6
    )
    run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=20)
    assert run.stop_reason == "jammed"
    assert vi.verify(run).holds


@pytest.mark.parametrize("reason", ["jammed", "painleve"])
def test_a_dead_end_of_the_run_alone_is_found(periodic, monkeypatch, reason):
    monkeypatch.setattr(vi.Run, "stop_reason", reason)
    found = vi.verify(periodic)
    assert found.horizon == vi.verification.Disagreement(
        event="stop", number=0, time=periodic.final_state.time, reason="sequence"
    )
    assert found.stopped == "sequence"
    assert len(found.impacts) == 12
    assert f"the run ends as {reason}" in found.stop_detail
    assert "the run holds 14 digits up to impact 12 (time" in str(found)


def test_a_dead_end_of_the_exact_motion_alone_is_found(periodic, monkeypatch):
    follow = motion.Problem.follow
    time = float(periodic.impacts["time"][7])

    def ending(*given, **options):
        done = follow(*given, **options)
        return dataclasses.replace(done, entries=done.entries[:8], ends=time + 0.1)

    monkeypatch.setattr(motion.Problem, "follow", ending)
    found = vi.verify(periodic)
    assert (found.stopped, found.horizon.event) == ("sequence", "stop")
    assert found.horizon.time == time + 0.1
    assert len(found.impacts) == 8
    assert "the run holds 15 digits up to impact 8 (time" in str(found)


def test_a_cap_on_precision_ends_it(periodic, monkeypatch):
    # a reference as good as this would need more bits than are allowed
    monkeypatch.setattr(passes, "GOOD", 1e-300)
    found = vi.verify(periodic, max_precision=512)
    assert found.stopped == "precision_cap"
    assert not found.holds
    assert not found.certified
    assert len(found.impacts) == 12
    assert 1e-80 < found.impacts["reference_error"].max() < 1e-60


def test_ctrl_c_hands_over_what_is_verified(periodic, monkeypatch):
    tell = motion._Followed._tell

    def interrupting(self, entry):
        tell(self, entry)
        if len(self.story) == 5:
            raise KeyboardInterrupt

    monkeypatch.setattr(motion._Followed, "_tell", interrupting)
    with pytest.raises(vi.Interrupted, match="verified so far") as caught:
        vi.verify(periodic)
    found = caught.value.result
    assert found.stopped == "interrupted"
    assert len(found.impacts) == 5
    assert found.impacts["certified"].all()
    assert not found.holds


def test_what_cannot_be_verified_is_refused(periodic):
    with pytest.raises(vi.ParameterError, match="run = 3 is not allowed"):
        vi.verify(3)
    for digits in (0, 15, 2.5, True, None):
        with pytest.raises(vi.ParameterError, match="digits"):
            vi.verify(periodic, digits=digits)
    for bits in (511, 10**6, 600.5):
        with pytest.raises(vi.ParameterError, match="max_precision"):
            vi.verify(periodic, max_precision=bits)
    with pytest.raises(vi.ParameterError, match="max_events"):
        vi.verify(periodic, max_events=0)


def test_without_python_flint_the_extra_is_named(periodic, monkeypatch):
    monkeypatch.setitem(sys.modules, "flint", None)
    with pytest.raises(ImportError, match=r"pip install python-flint$") as caught:
        vi.verify(periodic)
    assert caught.value.name == "flint"


def test_the_reference_uses_nothing_of_the_package():
    folder = Path(vi.__file__).parent / "reference"
    modules = sorted(folder.glob("*.py"))
    assert len(modules) > 8
    for path in modules:
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.Import):
                used = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                used = [] if node.level == 1 else ["." * node.level + (node.module or "")]
            else:
                continue
            for name in used:
                assert name.partition(".")[0] in {"flint", *sys.stdlib_module_names}, path.name


def test_the_import_needs_no_python_flint():
    code = "import sys; sys.modules['flint'] = None; import vibroimpact as vi; print(vi.verify)"
    done = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True)
    assert done.returncode == 0, done.stderr


def test_results_are_frozen(periodic):
    found = vi.verify(periodic)
    with pytest.raises(dataclasses.FrozenInstanceError):
        found.digits = 3
    with pytest.raises(ValueError, match="read-only"):
        found.impacts["digits"][0] = 16
