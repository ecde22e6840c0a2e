"""`vibroimpact simulate`: what it prints, and that its files hold the run bit for bit."""

import csv
import io
import sys

import numpy as np
import pytest
from matplotlib.image import imread

import vibroimpact as vi
from command_lines import SIMULATE, START, SYSTEM, fields


@pytest.fixture
def paper_run() -> vi.Run:
    system = vi.System(
        mass_ratio=0.6,
        frequency_ratio=2.0,
        restitution=0.8,
        gap=0.5,
        moment_amplitude=1.0,
        drive_frequency=1.8,
    )
    return vi.simulate(system, initial=(0.0, 0.5, 0.0, 0.0), periods=600, keep=100)


def test_simulate_prints_label_and_evidence(run_command, paper_run):
    code, out, err = run_command(SIMULATE)
    assert (code, err) == (0, "")
    printed = fields(out)
    assert printed["label"] == paper_run.label == "1-1"
    assert printed["residual"] == f"{paper_run.period.residual:.3g}"
    assert printed["impacts"] == f"{paper_run.impact_count}, {len(paper_run.impacts)} kept"
    assert printed["stopped"] == "completed"
    for value in paper_run.final_state.time, *paper_run.final_state.state:
        assert out.count(repr(value)) == printed["state"].count(repr(value)) == 1


def test_a_run_that_stops_early_says_why_once(run_command):
    code, out, _ = run_command(SIMULATE + " --max-events 50")
    printed = fields(out)
    assert (code, printed["stopped"]) == (3, "event_cap")
    assert printed["impacts"].startswith("50, ")
    assert out.count("x1 = ") == out.count(" at t = ") == 1


def test_impacts_as_csv_are_exact(run_command, paper_run):
    code, out, err = run_command(SIMULATE + " --csv -")
    assert code == 0
    assert fields(err)["label"] == "1-1"
    rows = list(csv.DictReader(io.StringIO(out)))
    assert list(rows[0]) == list(paper_run.impacts.dtype.names)
    assert len(rows) == len(paper_run.impacts)
    for name in ("time", "x1", "v1_pre", "energy_loss"):
        assert [float(row[name]) for row in rows] == paper_run.impacts[name].tolist()
    assert {row["regime"] for row in rows} == {"frictionless"}


def test_simulate_writes_its_files(run_command, paper_run, tmp_path):
    code, _, _ = run_command(
        SIMULATE,
        "--csv",
        tmp_path / "a.csv",
        "--save",
        tmp_path / "a.npz",
        "--plot",
        tmp_path / "a.png",
    )
    assert code == 0
    assert vi.load(tmp_path / "a.npz").impacts.tobytes() == paper_run.impacts.tobytes()
    assert len((tmp_path / "a.csv").read_text(encoding="utf-8").splitlines()) == 101
    assert imread(tmp_path / "a.png").std() > 0.0


def test_negative_numbers_with_exponents_are_values(run_command, tmp_path):
    line = f"simulate {SYSTEM} --drive-frequency 1.8 --initial -1e-3 -.5 -2E-1 -1. --periods 5"
    assert run_command(line, "--save", tmp_path / "a.npz")[0] == 0
    assert vi.load(tmp_path / "a.npz").initial == (-1e-3, -0.5, -0.2, -1.0)


def test_a_constant_load_takes_a_time(run_command, tmp_path):
    line = f"simulate {SYSTEM} --drive-frequency 0 {START} --time 5"
    code, out, _ = run_command(line, "--plot", tmp_path / "a.pdf")
    assert code == 0
    assert fields(out)["state"].endswith("at t = 5.0")
    assert (tmp_path / "a.pdf").read_bytes().startswith(b"%PDF")


def test_complete_chatter_is_named_in_words(run_command):
    low = f"{SYSTEM} --force-amplitude 1.5 --pendulum-damping 0.1 --oscillator-damping 0.1 {START}"
    code, out, _ = run_command(f"simulate {low} --drive-frequency 0.25 --periods 100 --keep 20")
    printed = fields(out)
    assert (code, printed["label"]) == (0, "1-inf")
    share = float(printed["contact"].split()[0]) * 0.25 / (20 * 2 * np.pi)
    assert share == pytest.approx(0.24, abs=5e-3)  # docs/theory.md, section 5
    code, out, _ = run_command(
        f"diagram {low} --vary drive-frequency 0.25 0.3 2 --periods 100 --keep 20 --quiet"
    )
    assert (code, fields(out)["1-inf"]) == (0, "2 cells")


def test_verify_says_how_far_the_numbers_hold(run_command):
    pytest.importorskip("flint")
    line = f"simulate {SYSTEM} {START} --drive-frequency 1.8 --periods 6 --verify"
    code, out, err = run_command(line + " --quiet")
    assert (code, err) == (0, "")
    assert ", all 6 sections and the final state hold to 15 digits" in out
    assert fields(out)["verified"].startswith("the exact motion: enclosed by proof")
    chaos = line.replace("1.8 --periods 6", "1.4 --moment-amplitude 3 --periods 25")
    code, out, err = run_command(chaos + " 13")
    assert code == 3
    assert "fewer than 13 digits" in out
    assert "/25 [" in err  # of the progress bar, in drive periods


def test_verify_is_refused_before_anything_runs(run_command, monkeypatch):
    code, out, err = run_command(SIMULATE + " --verify 20")
    assert (code, out) == (2, "")
    assert "verify = 20 is not allowed" in err
    monkeypatch.setitem(sys.modules, "flint", None)
    code, out, err = run_command(SIMULATE + " --verify")
    assert (code, out) == (2, "")
    assert "pip install python-flint" in err
