"""The example that confirms the verdicts of Figs. 2 and 3, at reduced size; it can fail."""

import re
import runpy

import pytest

import repository
import vibroimpact as vi
from han_jin_hu_2004.parameters import paper_system

EXAMPLE = repository.root() / "examples" / "confirm_verdicts.py"


@pytest.fixture(scope="module")
def example():
    return runpy.run_path(str(EXAMPLE))


def test_verdicts_are_confirmed(example, capsys):
    assert example["main"](["--frequencies", "24", "--every", "20"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(":")[0] for line in lines] == [
        f"Fig. {figure}, {verdict}" for figure in (2, 3) for verdict in ("stable", "unstable")
    ]
    for line in lines:
        confirmed, simulated = re.search(r": (\d+) of (\d+) confirmed", line).groups()
        assert int(confirmed) == int(simulated) > 0


def test_wrong_verdicts_are_not_confirmed(example):
    motions = vi.periodic_motions(paper_system(drive_frequency=1.25), 1)
    seen = set()
    for motion in motions:
        if motion.admissible:
            size = abs(motion.multipliers[0])
            assert example["is_confirmed"](motion, motion.stable, size)
            assert not example["is_confirmed"](motion, not motion.stable, size)
            seen.add(motion.stable)
    assert seen == {True, False}


@pytest.mark.parametrize("arguments", [["--every", "0"], ["--frequencies", "1"], ["--figure", "4"]])
def test_bad_arguments_are_refused(example, arguments, capsys):
    with pytest.raises(SystemExit) as caught:
        example["main"](arguments)
    assert caught.value.code == 2
    assert "error" in capsys.readouterr().err
