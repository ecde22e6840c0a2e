"""Counting instructions: what is made of the counts, and one small program counted."""

import json
import shutil

import pytest

import repository

BENCHES = repository.root() / "benches"
CONDITIONS = {"rustc": "1.95.0", "vector instructions": "V3"}


@pytest.fixture
def script(bench):
    return bench("instructions")


@pytest.fixture
def report(script):
    """Report these counts against those, both under the same conditions unless said."""

    def call(then, now, **changed):
        committed = {"conditions": CONDITIONS, "counts": then}
        return script.report(committed, CONDITIONS | changed, now, dict.fromkeys(now, "call"))

    return call


@pytest.mark.parametrize(
    ("then", "now", "verdict"),
    [
        (1000.0, 1000.0, "same"),
        (1000.0, 1033.0, "same"),
        (1000.0, 1035.0, "more"),
        (1000.0, 967.0, "same"),
        (1000.0, 965.0, "less"),
        # A few instructions are no change of a kernel that has few.
        (10.0, 14.0, "same"),
        (10.0, 15.0, "more"),
        (None, 1000.0, "new"),
        (1000.0, None, "gone"),
    ],
)
def test_a_kernel_is_judged_by_its_committed_count(script, then, now, verdict):
    counts = [{} if count is None else {"kernel": count} for count in (then, now)]
    (row,) = script.compare(*counts)
    assert (row.verdict, row.committed, row.now) == (verdict, then, now)
    assert row.failed == (verdict in ("more", "new", "gone"))


def test_the_margin_is_a_choice(script):
    assert script.compare({"kernel": 1000.0}, {"kernel": 1035.0}, 0.1)[0].verdict == "same"


def test_the_yardstick_is_not_judged(script):
    (row,) = script.compare({script.YARDSTICK: 500.0}, {script.YARDSTICK: 900.0})
    assert not row.failed


def test_a_part_is_a_difference(script):
    def kernel(name, minus):
        return script.Kernel(name, "call", 1, (1, 2), minus, ())

    kernels = [kernel("whole", None), kernel("with part", "whole")]
    found = script.differences(kernels, {"whole": 100.0, "with part": 130.25})
    assert found == {"whole": 100.0, "with part": 30.2}


def test_more_instructions_are_an_error_that_says_where(report, capsys):
    assert report({"a": 1000.0, "b": 100.0}, {"a": 1000.0, "b": 200.0}) == 1
    printed = capsys.readouterr().out
    assert "only on one side: b\n" in printed
    assert "make instructions-update" in printed
    (row,) = [line for line in printed.splitlines() if line.startswith("b ")]
    assert row.split() == ["b", "call", "100.0", "200.0", "2.000", "more"]


def test_as_many_or_fewer_are_none(report, capsys):
    assert report({"a": 1000.0, "b": 100.0}, {"a": 1000.0, "b": 50.0}) == 0
    assert "cost less by over 3%: b\n" in capsys.readouterr().out


def test_other_compilers_are_named_and_judged_with_a_wider_margin(report, capsys):
    assert report({"a": 1000.0}, {"a": 1100.0}) == 1
    assert report({"a": 1000.0}, {"a": 1100.0}, rustc="1.97.0") == 0
    assert report({"a": 1000.0}, {"a": 1130.0}, rustc="1.97.0") == 1
    printed = capsys.readouterr().out
    assert "rustc 1.97.0" in printed
    assert "the committed counts: rustc 1.95.0" in printed


def test_other_instructions_are_named_and_not_judged(report, capsys):
    assert report({"a": 100.0}, {"a": 200.0}, **{"vector instructions": "Scalar"}) == 0
    assert "not judged" in capsys.readouterr().out


def test_without_valgrind_nothing_is_counted(script, monkeypatch, capsys):
    monkeypatch.setattr(script.shutil, "which", lambda _: None)
    assert script.main([]) == 2
    assert "valgrind is needed" in capsys.readouterr().err


def test_a_log_without_count_is_an_error(script):
    assert script.instructions("==12== I   refs:      1,234,567\n") == 1234567
    with pytest.raises(script.CannotCount, match="Illegal instruction"):
        script.instructions("==12== Illegal instruction\n")


def test_a_program_that_fails_is_an_error(script):
    with pytest.raises(script.CannotCount, match="exit code 1"):
        script.count(script.Kernel("no", "call", 1, (1, 2), None, ("false",)))


def test_the_committed_counts_are_of_known_conditions(script):
    committed = json.loads((BENCHES / "instructions.json").read_text(encoding="utf-8"))
    assert set(script.MUST_AGREE) < set(committed["conditions"])
    assert min(committed["counts"].values()) > 0.0


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="no valgrind")
def test_counts_are_the_same_again_and_free_of_the_start(script):
    program = str(script.native.program(BENCHES / "yardstick.c"))

    def count(*repetitions):
        return script.count(script.Kernel("G", "evaluation", 1, repetitions, None, (program,)))

    first = count(100, 300)
    assert first == count(100, 300)
    # Seven calls of the C library's functions and two exponentials; a start is some 100,000.
    assert 300.0 < first < 3000.0
    assert count(200, 300) == pytest.approx(first, rel=0.02)
