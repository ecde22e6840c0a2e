"""The command line: what it prints, writes and returns, and that bad input has no traceback."""

import csv
import io
import shlex

import numpy as np
import pytest
from matplotlib.image import imread

import vibroimpact as vi
from vibroimpact import commands
from vibroimpact.cli import main
from vibroimpact.paper import MOTIONS, claims

SYSTEM = "--mass-ratio 0.6 --frequency-ratio 2 --restitution 0.8 --gap 0.5 --moment-amplitude 1"
START = "--initial 0 0.5 0 0"
SIMULATE = f"simulate {SYSTEM} --drive-frequency 1.8 {START} --periods 600 --keep 100"
DIAGRAM = (
    f"diagram {SYSTEM} {START} --vary drive-frequency 1.7 1.9 5 --periods 60 --keep 20 --quiet"
)


@pytest.fixture
def run_command(capsys):
    """Run one command line and return its exit code, output and error output."""

    def run(line: str, *more: object) -> tuple[int, str, str]:
        code = main([*shlex.split(line), *map(str, more)])
        return code, *capsys.readouterr()

    return run


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


def fields(text: str) -> dict[str, str]:
    return dict(line.split(None, 1) for line in text.splitlines())


def test_simulate_prints_label_and_evidence(run_command, paper_run):
    code, out, err = run_command(SIMULATE)
    assert (code, err) == (0, "")
    printed = fields(out)
    assert printed["label"] == paper_run.label == "1-1"
    assert printed["residual"] == f"{paper_run.period.residual:.3g}"
    assert printed["impacts"] == f"{paper_run.impact_count}, {len(paper_run.impacts)} kept"
    assert repr(paper_run.final_state.x1) in printed["state"]


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


def test_the_command_of_a_claim_gives_its_label(run_command):
    (motion,) = [motion for motion in MOTIONS if motion.id == "9(1)"]
    run = vi.simulate(motion.system, initial=(0.0, 0.5, 0.0, 0.0), periods=600, keep=100)
    claim = claims.evaluate(motion, run)
    program, line = claim.command.split(None, 1)
    assert program == "vibroimpact"
    code, out, _ = run_command(line)
    assert (code, fields(out)["label"]) == (0, claim.found)


def test_diagram_counts_motions_and_writes_its_files(run_command, tmp_path):
    code, out, err = run_command(
        DIAGRAM,
        "--csv",
        tmp_path / "d.csv",
        "--save",
        tmp_path / "d.npz",
        "--plot",
        tmp_path / "d.png",
    )
    assert (code, err) == (0, "")
    diagram = vi.load(tmp_path / "d.npz")
    assert diagram.parameter.tolist() == np.linspace(1.7, 1.9, 5).tolist()
    printed = fields(out)
    assert printed["completed"] == f"{np.count_nonzero(diagram.status == 'completed')} of 5 values"
    for m, n in set(zip(diagram.m.tolist(), diagram.n.tolist(), strict=True)):
        if m:
            count = np.count_nonzero((diagram.m == m) & (diagram.n == n))
            assert printed[f"{m}-{n}"] == f"{count} values"
    rows = list(csv.DictReader(io.StringIO((tmp_path / "d.csv").read_text(encoding="utf-8"))))
    assert [float(row["x1"]) for row in rows] == diagram.x1.tolist()
    assert [float(row["drive_frequency"]) for row in rows] == diagram.impact_parameter.tolist()
    assert imread(tmp_path / "d.png").std() > 0.0


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
    assert (code, fields(out)["1-inf"]) == (0, "2 values")


def test_reproduce_prints_the_table(run_command, tmp_path):
    code, out, err = run_command("reproduce --figures 6 --quiet --out", tmp_path)
    assert (code, err) == (0, "")
    assert [line.split()[0] for line in out.splitlines()[2:]] == ["6a", "6b", "6c"]
    assert (tmp_path / "fig6-regimes.png").is_file()


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (SIMULATE.replace("0.8", "1.5"), "restitution = 1.5"),
        (SIMULATE.replace("--gap 0.5", ""), "missing system parameters: gap"),
        (SIMULATE.replace("--initial 0 0.5 0 0", "--initial 1 0 0 0"), "initial"),
        (SIMULATE.replace("--keep 100", "--keep 601"), "keep = 601"),
        (SIMULATE + " --law wishful", "law"),
        (SIMULATE + " --plot a.xyz", "allowed endings"),
        (SIMULATE + " --save missing/a.npz", "missing"),
        (DIAGRAM.replace("drive-frequency", "label"), "--vary label: allowed are mass_ratio"),
        (DIAGRAM.replace("1.9 5", "1.9 many"), "--vary"),
        (DIAGRAM.replace("1.9 5", "1.9 0"), "COUNT = 0"),
        ("reproduce --out x --figures 11", "figures = [11]"),
    ],
)
def test_bad_input_gives_code_2_and_one_line(run_command, line, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, err = run_command(line)
    assert (code, out) == (2, "")
    assert err.startswith("vibroimpact: ")
    assert message in err
    assert err.count("\n") == 1


@pytest.mark.parametrize("line", ["", "unknown", "simulate --gap wide", "reproduce"])
def test_unparsable_arguments_give_code_2(line, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(shlex.split(line))
    assert stopped.value.code == 2
    assert "usage: vibroimpact" in capsys.readouterr().err


def test_help_and_version_succeed(capsys):
    for words, expected in (
        (["--version"], vi.__version__),
        (["simulate", "--help"], "--drive-frequency"),
        (["diagram", "--help"], "--vary NAME FIRST LAST COUNT"),
    ):
        with pytest.raises(SystemExit) as stopped:
            main(words)
        assert stopped.value.code == 0
        assert expected in capsys.readouterr().out


def test_interruption_gives_code_130(run_command, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(commands, "simulate_motion", interrupted)
    assert run_command(SIMULATE) == (130, "", "vibroimpact: interrupted\n")


def test_an_interrupted_diagram_is_saved_as_far_as_it_got(run_command, monkeypatch, tmp_path):
    whole = commands.bifurcation_diagram

    def interrupted(*arguments, **options):
        raise vi.Interrupted("interrupted after some points", whole(*arguments, **options))

    monkeypatch.setattr(commands, "bifurcation_diagram", interrupted)
    code, out, err = run_command(DIAGRAM, "--save", tmp_path / "part.npz")
    assert (code, err) == (130, "vibroimpact: interrupted after some points\n")
    assert "of 5 values" in out
    assert len(vi.load(tmp_path / "part.npz")) == 5


def test_a_failed_computation_gives_code_1(run_command, monkeypatch):
    def failed(*_, **__):
        raise vi.SimulationError("at time 1, after 2 events")

    monkeypatch.setattr(commands, "simulate_motion", failed)
    assert run_command(SIMULATE) == (1, "", "vibroimpact: at time 1, after 2 events\n")
