"""Proofs that n-1 motions without friction are all there are."""

import copy
import json
from dataclasses import replace

import numpy as np
import pytest

import vibroimpact as vi
from small_results import solutions_proof
from systems import PAPER

flint = pytest.importorskip("flint")
isolating = pytest.importorskip("vibroimpact.proof.isolating")
all_solutions = pytest.importorskip("vibroimpact.proof.all_solutions")

WALL = {"mass_ratio": 0.0, "force_amplitude": 0.0}
MOVING = {"mass_ratio": 0.0, "force_amplitude": 0.1, "oscillator_damping": 0.1, "gap": 0.2}
DAMPED = {"pendulum_damping": 0.1, "oscillator_damping": 0.05, "static_moment": 0.2, "phase": 1.0}
# What is changed in the system of the paper, n, and whether x1 has a bound.
CASES = {
    "paper, n = 2": ({}, 2, True),
    "paper, n = 3": ({"drive_frequency": 2.7}, 3, True),
    "damped, with loads": (DAMPED | {"static_force": -0.1, "force_amplitude": 0.2}, 1, True),
    "r = 0": ({"restitution": 0.0, "drive_frequency": 1.1}, 1, True),
    "r = 1": ({"restitution": 1.0} | DAMPED, 1, True),
    "head-on": ({"contact": "direct", "drive_frequency": 2.3}, 1, True),
    "head-on, a wall": (WALL | {"contact": "direct", "drive_frequency": 2.3}, 1, True),
    "a wall": (WALL | {"pendulum_damping": 0.1}, 1, True),
    "a wall, n = 2": (WALL | {"drive_frequency": 2.9, "static_force": 0.1}, 2, True),
    "a moving wall": (MOVING | {"drive_frequency": 2.2, "pendulum_damping": 0.05}, 1, True),
    "a wall that moves far": (MOVING | {"force_amplitude": 2.0}, 1, False),
}


def found_of(changes, n):
    return vi.periodic_motions(PAPER.replace(**changes), n)


@pytest.mark.parametrize("name", CASES)
def test_all_are_proved_and_agree_with_the_search(name):
    changes, n, everywhere = CASES[name]
    motions = found_of(changes, n)
    proof = vi.prove(motions)
    assert (proof.verdict, proof.everywhere, proof.uncovered) == ("proved", everywhere, ())
    assert len(proof.proofs) == len(motions)
    for one, motion in zip(proof.proofs, motions, strict=True):
        assert one.verdict == ("proved" if motion.admissible else "disproved")
        assert abs(one.box.center[0, 0] - motion.state[0]) < 1e-11
        if motion.admissible:
            assert one.stability == ("stable" if motion.stable else "unstable")
    assert proof.count == sum(motion.admissible for motion in motions)


def test_some_cases_have_solutions_and_some_have_motions():
    found = {name: found_of(changes, n) for name, (changes, n, _) in CASES.items()}
    assert sum(len(motions) > 0 for motions in found.values()) > 8
    assert sum(any(one.admissible for one in motions) for motions in found.values()) > 4


def test_the_paper():
    proof = solutions_proof()
    assert proof.statement.startswith("Theorem.")
    assert f"exactly {proof.count} motions: {proof.stable} asymptotically stable" in proof.statement
    assert proof.count == len(proof.motions) > 0


def test_an_interval_is_named_in_the_theorem():
    motions = vi.periodic_motions(PAPER, within=(-1.0, 1.25))
    proof = vi.prove(motions)
    assert (proof.verdict, proof.everywhere, proof.within) == ("proved", False, (-1.0, 1.25))
    assert "at an x1 in [-1.0, 1.25]" in proof.statement


def test_a_solution_that_is_left_out_is_missed():
    """Without one of the solutions it is not shown that the others are all."""
    motions = vi.periodic_motions(PAPER)
    for k in (0, 3, len(motions) - 1):
        fewer = replace(
            motions,
            motions=motions.motions[:k] + motions.motions[k + 1 :],
            boxes=np.delete(motions.boxes, k, axis=0),
        )
        proof = vi.prove(fewer)
        x = motions[k].state[0]
        assert proof.verdict == "undecided"
        assert any(part.lo - 1e-9 <= x <= part.hi + 1e-9 for part in proof.uncovered)


def test_a_solution_that_is_given_twice_counts_once():
    motions = vi.periodic_motions(PAPER)
    twice = replace(motions, motions=(motions[0], *motions), boxes=motions.boxes)
    assert vi.prove(twice).verdict == "undecided"


def test_near_a_saddle_node_the_count_is_right_or_open():
    """Two solutions come into being between these frequencies; the place is found by halving."""
    low, high = 1.65, 1.7

    def at(omega):
        return vi.periodic_motions(PAPER.replace(drive_frequency=omega))

    few, more = len(at(low)), len(at(high))
    assert more == few + 2
    while high - low > 4e-16 * high:
        middle = (low + high) / 2
        found = at(middle)
        if len(found) == few and not found.undecided:
            low = middle
        else:
            high = middle
    verdicts = []
    for away in (0.0, 1e-15, 1e-13, 1e-9, 1e-6, 1e-3):
        for omega, count in ((low - away, few), (high + away, more)):
            proof = vi.prove(at(omega))
            verdicts.append(proof.verdict)
            if proof.verdict == "proved":
                # the search is undecided on both sides of the place, within rounding
                assert len(proof.proofs) == count or away < 1e-12
            else:
                assert proof.uncovered
    assert verdicts[-6:] == ["proved"] * 6
    assert "undecided" in verdicts


def test_a_phase_that_is_open_is_named():
    """With r = 1 and an undamped body 2 without force F has a double zero where cos x1 = 0."""
    proof = vi.prove(vi.periodic_motions(PAPER.replace(restitution=1.0, pendulum_damping=0.02)))
    assert proof.verdict == "undecided"
    assert proof.uncovered
    for part in proof.uncovered:
        assert abs(np.cos(part.lo)) < 1e-9


def test_nothing_was_searched():
    system = PAPER.replace(oscillator_damping=0.0, drive_frequency=0.5, frequency_ratio=2.0)
    motions = vi.periodic_motions(system)
    assert motions.note  # body 2 swings twice in a drive period
    proof = vi.prove(motions)
    assert (proof.verdict, proof.why) == ("undecided", motions.note)
    with pytest.raises(vi.ParameterError):
        proof.save("nothing.json")


def test_an_interrupt_keeps_the_proofs_so_far(monkeypatch):
    whole, asked = isolating.proved, []

    def proved(motion):
        asked.append(motion)
        if len(asked) > 3:
            raise KeyboardInterrupt
        return whole(motion)

    monkeypatch.setattr(isolating, "proved", proved)
    with pytest.raises(vi.Interrupted) as caught:
        vi.prove(vi.periodic_motions(PAPER))
    found = caught.value.result
    assert (found.verdict, found.why, len(found.proofs)) == ("undecided", "interrupted", 3)


def certificate(tmp_path):
    path = tmp_path / "all.json"
    solutions_proof().save(path)
    return path, json.loads(path.read_text())


def refused(path, content):
    path.write_text(json.dumps(content))
    with pytest.raises(vi.ProofError):
        vi.check_proof(path)


def test_a_certificate_is_verified_anew(tmp_path):
    path, content = certificate(tmp_path)
    again = vi.check_proof(path)
    assert again.statement == solutions_proof().statement
    assert (again.count, again.stable) == (solutions_proof().count, solutions_proof().stable)
    assert len(content["cuts"]) == len(content["holds"]) + 1


def test_a_certificate_with_a_hole_is_refused(tmp_path):
    path, content = certificate(tmp_path)
    orbit = next(k for k, inner in enumerate(content["holds"]) if inner)
    hole = copy.deepcopy(content)
    del hole["cuts"][orbit], hole["holds"][orbit]  # its interval becomes part of the next one
    refused(path, hole)
    short = copy.deepcopy(content)
    short["cuts"], short["holds"] = short["cuts"][1:], short["holds"][1:]
    refused(path, short)  # the bound is not reached: not everywhere
    back = copy.deepcopy(content)
    back["cuts"][3], back["cuts"][4] = back["cuts"][4], back["cuts"][3]
    refused(path, back)


def test_a_certificate_without_one_of_its_motions_is_refused(tmp_path):
    path, content = certificate(tmp_path)
    for k in (0, 3, len(content["orbits"]) - 1):
        fewer = copy.deepcopy(content)
        del fewer["orbits"][k]
        fewer["holds"] = [[i - (i > k) for i in inner if i != k] for inner in fewer["holds"]]
        refused(path, fewer)


def test_a_certificate_that_counts_a_motion_twice_is_refused(tmp_path):
    path, content = certificate(tmp_path)
    more = copy.deepcopy(content)
    more["orbits"].append(copy.deepcopy(more["orbits"][0]))
    for place in range(len(more["holds"])):
        if more["holds"][place] == [0]:
            more["holds"][place] = [0, len(more["orbits"]) - 1]
    refused(path, more)
    more["holds"] = [inner[:1] for inner in more["holds"]]
    more["holds"][0] = [len(more["orbits"]) - 1]
    refused(path, more)


@pytest.mark.parametrize("seed", range(3))
def test_altered_certificates_are_refused(tmp_path, seed):
    """What is altered at random: a cut, a number, a box, a claim, the statement."""
    path, content = certificate(tmp_path)
    random = np.random.default_rng(seed)
    claims = content["orbits"][seed]["claims"]
    altered = []
    for change in ("omega", "verdict", "stability", "everywhere", "statement", "n", "friction"):
        other = copy.deepcopy(content)
        claims = other["orbits"][int(random.integers(len(other["orbits"])))]["claims"]
        if change == "omega":
            other["machine"]["numbers"]["omega"] = "8106479329266894p-52"  # one bit away
        elif change == "verdict":
            claims["verdict"] = {"proved": "disproved", "disproved": "proved"}[claims["verdict"]]
        elif change == "stability":
            claims["stability"] = {"stable": "unstable"}.get(claims["stability"], "stable")
        elif change == "everywhere":
            other["claims"]["everywhere"] = False
        elif change == "statement":
            other["statement"] = other["statement"].replace("exactly 8", "exactly 9")
        elif change == "n":
            other["n"] = 2
        else:
            other["machine"]["numbers"]["mu"] = "1p-3"
        assert other != content, change
        altered.append(other)
    for other in altered:
        refused(path, other)


def test_a_ball_that_holds_zero_stays_in_a_determinant():
    """`!=` of balls asks for certainty: an entry near 0 must not be dropped."""
    near, one = flint.arb(0, 1), flint.arb(1)
    columns = [[near, one], [one, one]]
    assert all_solutions.determinant(columns)(flint.arb(0)).contains(0)
    assert all_solutions.determinant(columns)(flint.arb(0)).contains(-2)


def test_the_equation_is_the_one_that_the_search_solves():
    """F in balls lies in the intervals of the search, up to its scale, at random angles."""
    from vibroimpact.single_impact.algebraic import Parameters, conditions
    from vibroimpact.single_impact.intervals import Interval

    for changes, n, _ in CASES.values():
        system = PAPER.replace(**changes)
        if system.mass_ratio == 0.0 == system.force_amplitude:
            continue  # the search has no F for a wall at rest
        posed = isolating.posed_of(vi.periodic_motions(system, n, within=(0.0, 0.1)))
        with flint.ctx.workprec(128):
            ours = all_solutions.conditions_in(posed)
            theirs = conditions(Parameters.of(system, n))
            at = np.linspace(-3.0, 3.0, 25)
            value, _ = theirs.enclose(np.zeros(25, dtype=np.int64), Interval(at, at))
            exact = np.array([float(ours.equation(flint.arb(x)).mid()) for x in at.tolist()])
        # velocities are in units of omega there: F is scaled by a power of it
        scale = np.median(value.middle / exact)
        assert scale > 0.0
        assert (np.abs(value.middle - scale * exact) < 1e-9 * np.abs(value.middle).max()).all()
