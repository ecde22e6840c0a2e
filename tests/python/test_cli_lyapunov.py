"""`vibroimpact lyapunov`: the exponents it prints and writes are those of the function."""

import csv
import io

import numpy as np
import pytest
from matplotlib.image import imread

import vibroimpact as vi
from command_lines import LYAPUNOV, START, SYSTEM, example_file, fields

INITIAL = (0.0, 0.5, 0.0, 0.0)
ONE = LYAPUNOV + " --drive-frequency 1.545"
MANY = LYAPUNOV + " --vary drive-frequency 1.5 1.6 4"


@pytest.fixture
def rough() -> vi.System:
    return vi.System(
        mass_ratio=0.6,
        frequency_ratio=2.0,
        restitution=0.8,
        gap=0.5,
        moment_amplitude=1.0,
        drive_frequency=1.545,
        friction=0.5,
    )


def columns(path) -> dict[str, list[str]]:
    rows = list(csv.DictReader(io.StringIO(path.read_text(encoding="utf-8"))))
    return {name: [row[name] for row in rows] for name in rows[0]}


def numbers(table: dict[str, list[str]], name: str) -> np.ndarray:
    return np.array([table[f"{name}_{k}"] for k in (1, 2, 3, 4)], dtype=float).T


def test_one_motion(run_command, rough, tmp_path):
    code, out, err = run_command(ONE, "--csv", tmp_path / "h.csv", "--plot", tmp_path / "h.png")
    assert (code, err) == (0, "")
    expected = vi.lyapunov_spectrum(rough, initial=INITIAL, periods=200)
    lines = dict(line.split("  ", 1) for line in out.splitlines())
    assert lines["label"].strip() == expected.label
    for number, value in enumerate(expected.exponents, start=1):
        assert lines[f"exponent {number}"].split()[0] == f"{value:.6g}"
    assert float(lines["sum"]) == pytest.approx(expected.sum, rel=1e-8)
    table = columns(tmp_path / "h.csv")
    assert [float(value) for value in table["time"]] == expected.history_time.tolist()
    assert np.array_equal(numbers(table, "exponent"), expected.history)
    assert imread(tmp_path / "h.png").std() > 0.0


def test_over_a_parameter(run_command, rough, tmp_path):
    code, out, err = run_command(MANY, "--csv", tmp_path / "s.csv", "--plot", tmp_path / "s.png")
    assert (code, err) == (0, "")
    expected = vi.lyapunov_spectrum(
        rough, initial=INITIAL, periods=200, drive_frequency=np.linspace(1.5, 1.6, 4)
    )
    table = columns(tmp_path / "s.csv")
    assert list(map(float, table["drive_frequency"])) == np.linspace(1.5, 1.6, 4).tolist()
    assert np.array_equal(numbers(table, "exponent"), expected.exponents)
    assert np.array_equal(numbers(table, "error"), expected.error)
    assert table["label"] == expected.label.tolist()
    assert fields(out)["completed"] == "4 of 4 cells"
    positive = np.count_nonzero(expected.exponents[:, 0] > 2 * expected.error[:, 0])
    assert out.splitlines()[-1].split()[4] == str(positive)
    assert imread(tmp_path / "s.png").std() > 0.0


def test_a_constant_load_has_the_exponent_of_the_flow(run_command):
    line = f"lyapunov {SYSTEM} {START} --drive-frequency 0 --time 200"
    code, out, _ = run_command(line)
    assert code == 0
    assert out.count("(that of the flow)") == 1


def test_periods_and_keep_of_a_file_are_left_aside(run_command, rough, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.toml").write_text(example_file(), encoding="utf-8")
    line = "lyapunov --system a.toml --friction 0.5 --drive-frequency 1.545"
    _, out, _ = run_command(line)
    expected = vi.lyapunov_spectrum(rough, initial=INITIAL)
    assert f"time {expected.time:.6g}, {expected.impacts} impacts" in out
