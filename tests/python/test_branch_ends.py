"""What is said where a branch does not go on."""

import dataclasses

import pytest

import vibroimpact as vi
from branch_cases import CASES
from test_symmetric_motions import symmetric_motion
from vibroimpact.continuation.newton import OutsideDomain
from vibroimpact.orbits import BifurcationKind, PathEnd
from vibroimpact.orbits.endings import why_ended
from vibroimpact.orbits.kinds import BORDERS
from vibroimpact.orbits.structure_problem import StructureProblem


def test_every_early_end_has_a_sentence_that_says_what_leads_on():
    done = {PathEnd.BOUND, PathEnd.CLOSED, PathEnd.START}
    # A path that is stopped has the kind of the point as its end.
    early = [*set(PathEnd) - done - {PathEnd.STOPPED}, *BORDERS, BifurcationKind.PERIOD_DOUBLING]
    for end in early:
        text = why_ended(end, "the detail")
        assert len(text.split()) > 8, end
        assert any(word in text for word in ("leads on", "shows what follows", "followed on"))
    for end in (PathEnd.REFUSED, PathEnd.NO_CONVERGENCE, PathEnd.OUTSIDE_DOMAIN):
        assert "the detail" in why_ended(end, "the detail")
    assert [why_ended(end, "") for end in done] == [""] * 3


def test_a_cap_on_the_points_is_named():
    branch = symmetric_motion().follow(drive_frequency=(0.9, 1.9), max_points=5)
    assert branch.ends == ("points", "points")
    assert all("max_points" in why for why in branch.why_not)
    facts = branch._facts()
    assert (facts["first end"], facts["last end"]) == branch.why_not


@pytest.mark.parametrize("case", ["chatter", "one_one", "slides_and_sticks"])
def test_ends_and_reasons_go_together(case):
    start, ranges = CASES[case]
    branch = start().follow(**ranges)
    for end, why in zip(branch.ends, branch.why_not, strict=True):
        assert bool(why) == (end not in ("bound", "closed", "start")), (end, why)
    if case == "chatter":
        assert branch.ends[1] == "chatter_onset"
        assert "infinitely many" in branch.why_not[1]


def test_a_branch_that_ends_at_its_halves_says_so():
    start, ranges = CASES["one_one"]
    doubling = start().follow(**ranges).of_kind("period_doubling")[0]
    doubled = vi.switch_branch(doubling, drive_frequency=(1.5, 1.6))
    assert doubled.ends == ("start", "period_doubling")
    assert doubled.why_not[0] == ""
    assert "two halves of the motion have become the same" in doubled.why_not[1]


def test_a_motion_that_a_run_does_not_confirm_is_named(monkeypatch):
    # The verdict is made to fail from a value on.
    known = StructureProblem.motion

    def unconfirmed(self, u, p):
        motion = known(self, u, p)
        if p[0] < 1.35:
            return motion
        return dataclasses.replace(motion, admissible=False, why_not="flight 1 meets stop 0")

    monkeypatch.setattr(StructureProblem, "motion", unconfirmed)
    branch = symmetric_motion().follow(drive_frequency=(1.25, 1.4))
    assert branch.ends == ("bound", "refused")
    assert branch.why_not[0] == ""
    assert "no motion: flight 1 meets stop 0; a run from" in branch.why_not[1]


def test_equations_that_cease_to_exist_are_named(monkeypatch):
    known = StructureProblem.residual

    def residual(self, u, p):
        if p[0] > 1.35:
            raise OutsideDomain("nothing is known there")
        return known(self, u, p)

    monkeypatch.setattr(StructureProblem, "residual", residual)
    branch = symmetric_motion().follow(drive_frequency=(1.25, 1.4))
    assert branch.ends == ("bound", "outside domain")
    assert "do not exist beyond" in branch.why_not[1]
    assert branch.values.max() == pytest.approx(1.35, abs=1e-6)
