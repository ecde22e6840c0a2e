"""The stress tests at reduced size, and that they can fail (docs/stress.md)."""

import csv
import dataclasses
import math
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

import repository
import sizes
import vibroimpact as vi

ROOT = repository.root()
FOLDER = ROOT / "benches" / "stress"
PAGE = (ROOT / "docs" / "stress.md").read_text(encoding="utf-8")
PICTURES = ROOT / "docs" / "images" / "stress"
# A page should not take long to load.
LARGEST_PICTURE = 60_000
# Random cases of each range.
CASES = sizes.either(1, 4)


@dataclasses.dataclass(frozen=True)
class Quick:
    """What a quick run has left: its folder, its exit status, and what it printed last."""

    out: Path
    status: int
    verdict: str


@pytest.fixture(scope="module")
def quick_run(tmp_path_factory) -> Quick:
    """A quick run."""
    out = tmp_path_factory.mktemp("stress")
    command = [sys.executable, str(FOLDER), "--quick", "--cases", str(CASES), "--out", str(out)]
    done = subprocess.run(
        command, capture_output=True, text=True, env=os.environ | {"MPLBACKEND": "Agg"}
    )
    assert done.stderr == ""
    return Quick(out, done.returncode, done.stdout.splitlines()[-1])


@pytest.fixture(scope="module")
def quick(quick_run) -> Path:
    """The folder of that run."""
    return quick_run.out


def test_nothing_breaks_in_the_ranges_that_hold(quick_run):
    assert quick_run.status == 0, quick_run.verdict


def test_what_broke_is_named(quick_run):
    assert (quick_run.status == 0) == quick_run.verdict.startswith("nothing broke")
    assert quick_run.status == 0 or re.fullmatch(r"\w+: \d+ of \d+", quick_run.verdict)


@pytest.fixture(scope="module")
def exact():
    """The module that judges a case."""
    sys.path.insert(0, str(FOLDER))
    try:
        import exact
    finally:
        sys.path.remove(str(FOLDER))
    return exact


def test_a_quick_run_draws_what_the_page_shows(quick):
    drawn = {path.name for path in quick.glob("*.png")}
    kept = {path.name for path in PICTURES.iterdir()}
    assert drawn == kept
    for name in kept:
        assert f"](images/stress/{name})" in PAGE
        assert (PICTURES / name).stat().st_size <= LARGEST_PICTURE
        pixels = imread(quick / name)
        assert pixels.shape == imread(PICTURES / name).shape
        assert (pixels[..., :3] < 0.9).any(axis=-1).mean() > 0.01


def test_every_row_is_written(quick):
    def read(path):
        return list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))

    for path in quick.glob("*.png"):
        assert read(path.with_suffix(".csv"))
    rows = read(quick / "resonance.csv")
    assert [row["outcome"] for row in rows] == CASES * ["within"]
    assert all(0 <= float(row["units"]) <= 1 for row in rows)
    # The ladder of values begins there, if it has several.
    assert CASES == 1 or float(rows[0]["value"]) == 0


@pytest.fixture(scope="module")
def case(exact):
    """The 1-1 motion of Fig. 5(a), over some impacts."""
    system = vi.System(
        mass_ratio=0.6,
        frequency_ratio=2.0,
        restitution=0.8,
        gap=0.5,
        drive_frequency=1.25,
        moment_amplitude=1.0,
    )
    return exact.Case(system, (0.0, 0.5, 0.0, 0.0), 12.0)


def test_a_right_run_is_within_the_bound(exact, case):
    verdict = exact.judge(case)
    assert verdict.outcome == exact.Outcome.WITHIN
    assert 0 < verdict.units < 1
    assert verdict.impacts >= 2


@pytest.mark.parametrize("size", [3e-13, 1e-9])
def test_a_wrong_run_is_called_wrong(exact, case, size, monkeypatch):
    simulate = vi.simulate

    def off(system, **options):
        # As if the law had another coefficient of restitution.
        return simulate(system.replace(restitution=0.8 + size), **options)

    monkeypatch.setattr(exact.vi, "simulate", off)
    verdict = exact.judge(case)
    assert verdict.outcome == exact.Outcome.WRONG
    assert min(verdict.units, verdict.conditioned) > 1


def test_another_sequence_is_called_wrong(exact, case, monkeypatch):
    simulate = vi.simulate

    def without_contact(system, **options):
        return simulate(system.replace(gap=5.0), **options)

    monkeypatch.setattr(exact.vi, "simulate", without_contact)
    verdict = exact.judge(case)
    assert verdict.outcome == exact.Outcome.WRONG
    assert verdict.detail.startswith("0 impacts, not ")


def test_a_motion_without_continuation_is_a_typed_stop(exact):
    # A wall that moves on drives a tip at -pi/2, which has no room left.
    system = vi.System(
        mass_ratio=0.0, frequency_ratio=0.0, restitution=0.6, gap=0.0, drive_frequency=1.0
    )
    x1 = -math.pi / 2 + 1e-9
    start = (x1, 0.0, math.sin(x1) + 0.02, -1.0)
    verdict = exact.judge(exact.Case(system, start, 0.1))
    assert verdict.outcome == exact.Outcome.STOPPED
    assert verdict.detail.startswith("jammed")


def test_a_case_is_shortened_to_its_first_impacts(exact, case):
    long = dataclasses.replace(case, time=500.0)
    short = exact.shortened(long, most=3)
    run = vi.simulate(short.system, initial=short.initial, time=short.time)
    assert len(run.impacts) == 3
    assert np.isclose(exact.shortened(short, most=3).time, short.time, rtol=0, atol=0)


def test_bad_arguments_are_refused():
    done = subprocess.run([sys.executable, str(FOLDER), "--fast"], capture_output=True, text=True)
    assert done.returncode == 2
    assert "--fast" in done.stderr
