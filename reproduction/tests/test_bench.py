"""`vibroimpact bench` and `reproduce`: what they print; that a wrong number is noticed."""

import csv
import re
from pathlib import Path

import pytest

from han_jin_hu_2004.cli import bench as command

BENCH = "bench --seconds 1e-3"


def test_bench_prints_speed_and_accuracy(run_command, tmp_path):
    code, out, err = run_command(BENCH, "--csv", tmp_path / "bench.csv")
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[0].startswith("vibroimpact ")
    assert tuple(lines[1].split()) == command.NAMES
    with open(tmp_path / "bench.csv", encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["label"] for row in rows] == ["1-1", "chaotic", "1-inf"]
    for row in rows:
        assert float(row["time"]) > 0.0
        assert 0.0 <= float(row["error"]) <= float(row["allowed"])
    assert lines[-1].endswith("times as fast")


def test_every_column_is_explained():
    assert all(re.search(rf"^  {name} ", command.MORE, re.M) for name in command.NAMES)


@pytest.mark.parametrize("seconds", ["0", "-1", "inf", "nan"])
def test_a_bad_time_is_refused(run_command, seconds):
    code, out, err = run_command("bench --seconds", seconds)
    assert (code, out) == (2, "")
    assert "--seconds = " in err


def test_bench_notices_a_wrong_number(run_command, monkeypatch):
    monkeypatch.setattr(command, "SETTLING", 100)
    monkeypatch.setattr(command, "SETTLED", 1e-16)
    code, _, err = run_command(BENCH)
    assert code == 1
    assert "less accurate than it should be: periodic, Fig. 5(b)" in err


def test_reproduce_prints_the_table(run_command, tmp_path):
    code, out, err = run_command("reproduce --figures 6 --quiet --out", tmp_path)
    assert (code, err) == (0, "")
    assert re.findall(r"^Fig\. (\S+)", out, re.M) == ["6(a)", "6(b)", "6(c)"]
    named = [Path(line.partition(": ")[2]) for line in out.splitlines()[-2:]]
    assert named == [tmp_path / "index.md", tmp_path / "claims.md"]
    assert all(path.is_file() for path in [*named, tmp_path / "fig6.png"])
