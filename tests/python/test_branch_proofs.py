"""Proofs over a range of a parameter: what they cover, enclose and refuse."""

import ast

import numpy as np
import pytest

import repository
import sizes
import vibroimpact as vi
from proved_branches import (
    branch,
    damped_proof,
    gap_branch,
    gap_proof,
    grazing_proof,
    neimark_sacker_proof,
    turned_proof,
)

flint = pytest.importorskip("flint")
walking = pytest.importorskip("vibroimpact.proof.walking")

FOLDER = repository.root() / "python" / "vibroimpact" / "proof"
TRUSTED = ("tube", "parts", "chain")


def test_a_damped_branch_is_stable_over_all_of_a_range():
    proof = damped_proof()
    (stretch,) = proof.stretches
    assert (stretch.lo, stretch.hi) == (1.797, 1.803)
    assert (stretch.verdict, stretch.stability) == ("proved", "stable")
    assert proof.bifurcations == proof.uncovered == ()
    assert "there is exactly one" in proof.statement


def test_the_theorem_on_the_page_is_the_one_that_is_shown():
    """But for its range, which is shorter here."""
    page = (repository.root() / "docs" / "proofs.md").read_text(encoding="utf-8")
    page = page.partition("## A range of a parameter")[2]
    quoted = page[page.index("> **Theorem.**") :].partition("\n\n")[0].splitlines()
    printed = " ".join(" ".join(line[1:] for line in quoted).split())
    shown = damped_proof().statement.replace("Theorem.", "**Theorem.**", 1)
    shown = shown.replace("[1.797, 1.803]", "[1.795, 1.805]")
    assert printed == " ".join(shown.split())


def test_what_is_proved_agrees_with_the_branch():
    """Motions of the branch, each proved by itself, lie where the tubes say."""
    motions = branch(0.05, 1.797, 1.803).at(drive_frequency=1.8001)
    (stretch,) = damped_proof().stretches
    assert stretch.lo < 1.8001 < stretch.hi
    assert [vi.prove(motion).stability for motion in motions] == [stretch.stability]


def test_a_saddle_node_is_turned_around():
    """It is one point; up to it there are two motions of this curve, and behind it none."""
    proof = turned_proof()
    turn = branch().bifurcations[3].value
    (found,) = [one for one in proof.bifurcations if one.kind == "saddle_node"]
    assert found.hi - found.lo < 1e-14
    assert abs(found.lo - turn) < 1e-9
    ends = [one for one in proof.stretches if abs(one.lo - found.hi) < 1e-14]
    assert {one.stability for one in ends} == {"stable", "unstable"}
    assert {one.verdict for one in ends} == {"proved"}
    assert not proof.uncovered


def test_a_period_doubling_ends_stability():
    doubling = branch().bifurcations[4].value
    proof = turned_proof()
    found = [one for one in proof.bifurcations if one.lo <= doubling <= one.hi]
    assert [one.kind for one in found] == ["period_doubling"]
    assert found[0].hi - found[0].lo < 1e-12
    (before,) = [one for one in proof.stretches if abs(one.hi - found[0].lo) < 1e-14]
    after = [one for one in proof.stretches if abs(one.lo - found[0].hi) < 1e-14]
    assert before.stability == "stable"
    assert "unstable" in [one.stability for one in after]


def test_a_period_doubling_of_unstable_motions_is_enclosed():
    """Another multiplier lies outside of the unit circle on both sides."""
    doubling = branch().bifurcations[2]
    moduli = sorted(abs(doubling.motion.multipliers))
    assert moduli[-1] > 1.2
    assert abs(moduli[-2] - 1.0) < 1e-9
    proof = vi.prove(branch(), within=(doubling.value - 1e-7, doubling.value + 1e-7))
    (found,) = proof.bifurcations
    assert found.kind == "period_doubling"
    assert found.hi - found.lo < 2e-15
    assert found.lo - 1e-12 <= doubling.value <= found.hi + 1e-12
    assert any(x.lo < found.lo < found.hi < x.hi for x in proof.stretches)
    assert not proof.uncovered


def test_a_graze_is_proved_from_both_sides():
    """The steady oscillation without impacts just reaches a gap of this size.

    Motions with an impact double their period just before.
    """
    proof = grazing_proof()
    graze = 1 / np.hypot(1 - 4, 2 * 0.05 * 2.0)
    grazes = [one for one in proof.bifurcations if one.kind == "grazing"]
    assert [one.label for one in grazes] == ["1-1", "1-0"]
    assert all(one.hi - one.lo < 1e-14 and abs(one.lo - graze) < 1e-12 for one in grazes)
    (doubling,) = [one for one in proof.bifurcations if one.kind == "period_doubling"]
    motions = [one for one in proof.stretches if one.verdict == "proved"]
    assert [(one.lo, one.hi, one.label, one.stability) for one in motions] == [
        (0.33, doubling.lo, "1-1", "stable"),
        (doubling.hi, grazes[0].lo, "1-1", "unstable"),
        (grazes[1].hi, 0.34, "1-0", "stable"),
    ]
    assert {one.why for one in proof.stretches if one.verdict == "disproved"} == {
        "leg 1: the bodies do not approach",
        "leg 1: a stop is met in a flight",
    }
    assert not proof.uncovered


def test_an_impact_without_slip_before_it_is_a_border_of_both_directions():
    """The angle is 0 there: slip has one direction up to it, and the other one from it on."""
    found = branch(0.0, 1.5, 1.9, 0.1)
    (border,) = [one.value for one in found.bifurcations if str(one.kind) == "regime_border"]
    proof = vi.prove(found, within=(border - 1e-5, border + 1e-5))
    assert [x.kind for x in proof.bifurcations] == ["regime_border"] * 2
    assert all(x.hi - x.lo < 2e-15 for x in proof.bifurcations)
    assert all(abs(x.lo - border) < 1e-12 for x in proof.bifurcations)
    motions = [x for x in proof.stretches if x.verdict == "proved"]
    assert [(x.lo, x.hi) for x in sorted(motions, key=lambda x: x.lo)] == [
        (border - 1e-5, proof.bifurcations[0].lo),
        (proof.bifurcations[1].hi, border + 1e-5),
    ]
    others = {x.why for x in proof.stretches if x.verdict == "disproved"}
    assert others == {"leg 1: slip has the other direction"}
    assert not proof.uncovered


def test_what_no_tube_reaches_is_listed():
    found = branch(0.0, 1.5, 1.9, 0.1)
    (border,) = [one.value for one in found.bifurcations if str(one.kind) == "regime_border"]
    proof = vi.prove(found, within=(border - 1e-7, border + 1e-7), max_tubes=2)
    (left,) = [one for one in proof.uncovered if "regime_border" in one.why]
    assert left.lo == left.hi == border


def test_a_neimark_sacker_bifurcation_is_enclosed():
    known, proof = branch().bifurcations[6], neimark_sacker_proof()
    assert str(known.kind) == "neimark_sacker"
    (found,) = proof.bifurcations
    assert found.kind == "neimark_sacker"
    assert found.lo - 1e-12 <= known.value <= found.hi + 1e-12
    assert found.hi - found.lo < 1e-14
    assert [one.stability for one in proof.stretches] == ["stable", "unstable"]
    assert not proof.uncovered


def test_a_border_between_regimes_is_a_zero_of_its_condition():
    """Slip that goes on, and slip that reverses: both sequences are proved up to the border."""
    found = branch(0.0, 1.5, 2.5, 0.1)
    border = next(x.value for x in found.bifurcations if abs(x.value - 2.38089) < 1e-4)
    proof = vi.prove(found, within=(border - 1e-5, border + 1e-5))
    assert [x.kind for x in proof.bifurcations] == ["regime_border"] * 2
    assert all(x.lo - 1e-9 <= border <= x.hi + 1e-9 for x in proof.bifurcations)
    assert all(x.hi - x.lo < 1e-14 for x in proof.bifurcations)
    motions = [x for x in proof.stretches if x.verdict == "proved"]
    assert min(x.lo for x in motions) == border - 1e-5
    assert max(x.hi for x in motions) == border + 1e-5
    assert {x.why for x in proof.stretches if x.verdict == "disproved"} == {
        "leg 1: slip stops",
        "leg 1: slip goes on",
    }


def test_friction():
    proof = vi.prove(branch(0.0, 1.78, 1.82, 0.5), within=sizes.either((1.8, 1.801), (1.78, 1.82)))
    assert [(x.verdict, x.stability) for x in proof.stretches] == [("proved", "stable")]
    assert not proof.uncovered


def test_longer_ranges():
    (stretch,) = vi.prove(branch(0.05, 1.75, 1.85)).stretches
    assert (stretch.lo, stretch.hi, stretch.stability) == (1.75, 1.85, "stable")
    proof = vi.prove(branch(0.0, 1.75, 1.85))
    assert [x.kind for x in proof.bifurcations] == ["neimark_sacker"]


def test_times_go_on_where_they_pass_a_drive_period():
    """The time of the impact, told within one period, jumps there; the branch does not."""
    found, jumps = branch(0.05, 1.725, 1.805), 1.729
    below, above = (found.at(drive_frequency=jumps + x)[0] for x in (-5e-4, 5e-4))
    assert below.nodes[0, -1] - above.nodes[0, -1] > 3.6
    proof = vi.prove(found, within=(jumps + 5e-4, jumps + 15e-4), max_tubes=40)
    assert proof.verdict == "proved"
    assert not proof.uncovered


def test_a_branch_of_a_structure():
    proof = gap_proof()
    (stretch,) = proof.stretches
    assert (stretch.lo, stretch.hi, stretch.stability) == (0.29999, 0.30001, "stable")
    assert (proof.parameter, proof.uncovered) == ("gap_0", ())


def test_a_cap_leaves_the_rest_uncovered():
    proof = vi.prove(branch(0.05, 1.797, 1.803), max_tubes=1)
    assert any("max_tubes" in one.why for one in proof.uncovered)
    assert max(one.hi for one in proof.uncovered) == 1.803
    shown = max((one.hi for one in proof.stretches), default=1.797)
    assert min(one.lo for one in proof.uncovered) <= shown


def test_an_interrupt_keeps_the_tubes_so_far(monkeypatch):
    whole, asked = walking.tube_from, []

    def tube_from(*arguments):
        asked.append(arguments)
        if len(asked) > 3:
            raise KeyboardInterrupt
        return whole(*arguments)

    monkeypatch.setattr(walking, "tube_from", tube_from)
    with pytest.raises(vi.Interrupted) as caught:
        vi.prove(branch(0.05, 1.797, 1.803))
    proof = caught.value.result
    assert len(proof.certificate["pieces"][0]["tubes"]) == 3
    assert [one.stability for one in proof.stretches] == ["stable"]
    assert [one.why for one in proof.uncovered] == ["interrupted"]


@pytest.mark.parametrize("interrupts", [1, 2])
def test_an_interrupt_in_the_end_keeps_what_is_verified(interrupts, monkeypatch, tmp_path):
    """The first one loses nothing; the second one ends it with the tubes that are verified."""
    from vibroimpact.proof import branch_files

    whole, asked = branch_files.examine_chain, []

    def examine_chain(*arguments):
        asked.append(arguments)
        for count, told in enumerate(whole(*arguments)):
            if count == 5 and len(asked) <= interrupts:
                raise KeyboardInterrupt
            yield told

    monkeypatch.setattr(branch_files, "examine_chain", examine_chain)
    with pytest.raises(vi.Interrupted) as caught:
        vi.prove(gap_branch(), within=(0.29999, 0.30001))
    found, (all_of_it,) = caught.value.result, gap_proof().stretches
    (stretch,) = found.stretches
    if interrupts == 1:
        assert stretch == all_of_it
        assert not found.uncovered
    else:
        assert stretch.stability == "stable"
        assert all_of_it.lo <= stretch.lo < stretch.hi < all_of_it.hi
        assert "interrupted before it was verified" in {one.why for one in found.uncovered}
    found.save(tmp_path / "branch.json")
    assert vi.check_proof(tmp_path / "branch.json").statement == found.statement


@pytest.mark.parametrize("within", [(1.0, 2.0), (1.8, 1.8), 1.8, (float("nan"), 1.8)])
def test_bad_ranges_are_refused(within):
    with pytest.raises(vi.ParameterError, match="within"):
        vi.prove(branch(0.05, 1.797, 1.803), within=within)


def test_only_a_branch_has_a_range():
    motion = branch(0.05, 1.797, 1.803).pieces[0].motion(0)
    with pytest.raises(vi.ParameterError, match="within"):
        vi.prove(motion, within=(1.0, 2.0))


# What it rests on.


def test_what_a_proof_of_a_branch_rests_on_can_be_read():
    lines = sum(len((FOLDER / f"{name}.py").read_text().splitlines()) for name in TRUSTED)
    assert 300 < lines <= 600


def test_the_verifier_of_branches_uses_nothing_else():
    # Of `near` any matrix is right.
    own = {f".{name}" for name in (*TRUSTED, "formulas", "verifier", "certificate", "near")}
    allowed = own | {".", "flint", "__future__", "typing", "copy"}
    allowed |= {"collections.abc", "contextlib", "dataclasses", "functools", "itertools", "math"}
    for name in TRUSTED:
        for node in ast.walk(ast.parse((FOLDER / f"{name}.py").read_text())):
            if isinstance(node, ast.Import):
                assert {alias.name for alias in node.names} <= allowed
            if isinstance(node, ast.ImportFrom):
                assert "." * node.level + (node.module or "") in allowed
