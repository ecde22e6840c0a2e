"""Proofs over a range of a parameter: what they cover, enclose and refuse."""

import json
from functools import cache

import pytest

import sizes
import vibroimpact as vi

pytest.importorskip("flint")

START = (0, 0.5, 0, 0)
KNOWN = [("saddle_node", 3), ("period_doubling", 4), ("neimark_sacker", 6)]


@cache
def branch(damping: float = 0.0, low: float = 1.5, high: float = 1.9) -> vi.Branch:
    """The 1-1 motions of the paper's system over the drive's frequency."""
    damped = {"pendulum_damping": damping, "oscillator_damping": damping}
    known = {"mass_ratio": 0.6, "frequency_ratio": 2, "restitution": 0.8, "gap": 0.5}
    system = vi.System(**known, drive_frequency=1.8, moment_amplitude=1, **damped)
    motion = vi.simulate(system, initial=START, periods=600, keep=100).refine()
    return motion.follow(drive_frequency=(low, high))


@cache
def damped_proof() -> vi.BranchProof:
    """One that is stable throughout."""
    return vi.prove(branch(0.05, 1.797, 1.803))


def test_a_damped_branch_is_stable_over_all_of_a_range():
    proof = damped_proof()
    (stretch,) = proof.stretches
    assert (stretch.lo, stretch.hi) == (1.797, 1.803)
    assert (stretch.verdict, stretch.stability) == ("proved", "stable")
    assert proof.bifurcations == proof.uncovered == ()
    assert "there is exactly one" in proof.statement


@pytest.mark.parametrize(("kind", "place"), sizes.either(KNOWN[-1:], KNOWN))
def test_bifurcations_are_enclosed(kind, place):
    known = branch().bifurcations[place]
    assert str(known.kind) == kind
    around = (known.value - 1e-6, known.value + 1e-6)
    proof = vi.prove(branch(), within=around, max_tubes=200)
    found = [one for one in proof.bifurcations if one.kind == kind]
    assert any(one.lo - 1e-12 <= known.value <= one.hi + 1e-12 for one in found)
    assert all(one.hi - one.lo < 1e-6 for one in found)


def test_a_cap_leaves_the_rest_uncovered():
    proof = vi.prove(branch(0.05, 1.797, 1.803), max_tubes=1)
    assert any("max_tubes" in one.why for one in proof.uncovered)
    assert max(one.hi for one in proof.uncovered) == 1.803


def test_a_branch_of_a_structure():
    stop = vi.Stop([1], 0.2, 0.8)
    structure = vi.Structure(
        [[1]], [[1]], [stop], drive_amplitude=[1], drive_frequency=1.4, damping_ratios=[0.05]
    )
    motion = vi.simulate(structure, initial=[[0], [0]], periods=600, keep=100).refine()
    for name, value in (("drive_frequency", 1.4), ("gap_0", 0.2)):
        found = motion.follow(**{name: (value - 0.005, value + 0.005)})
        proof = vi.prove(found)
        assert proof.stretches
        assert {one.stability for one in proof.stretches} == {"stable"}
        assert not proof.uncovered


def test_certificates_are_verified_anew_and_altered_ones_fail(tmp_path):
    path = tmp_path / "branch.json"
    proof = damped_proof()
    proof.save(path)
    again = vi.check_proof(path)
    assert (again.stretches, again.uncovered) == (proof.stretches, proof.uncovered)
    good = json.loads(path.read_text())

    def altered(change):
        content = json.loads(json.dumps(good))
        change(content)
        path.write_text(json.dumps(content))
        with pytest.raises(vi.ProofError):
            vi.check_proof(path)

    tubes = good["pieces"][0]["tubes"]
    assert len(tubes) > 3
    altered(lambda x: x["pieces"][0]["tubes"].pop(2))  # two tubes that do not meet
    altered(lambda x: x["pieces"][0]["tubes"].reverse())
    altered(lambda x: x["pieces"][0]["tubes"][1]["line"][0].__setitem__(0, "1p0"))
    altered(lambda x: x["pieces"][0]["tubes"][1].update(half="1p0"))
    altered(lambda x: x["pieces"][0]["tubes"][1].update(until="1p-60"))
    altered(lambda x: x["pieces"][0]["tubes"].pop())  # the claim is then of more
    altered(lambda x: x["machine"]["numbers"].update(r="1p0"))
    altered(lambda x: x["claims"]["stretches"][0].__setitem__(3, "unstable"))
    altered(lambda x: x["claims"]["stretches"][0].__setitem__(1, "2p0"))
    altered(lambda x: x["claims"]["bifurcations"].append(["1p0", "2p0", "saddle_node", 0]))
    altered(lambda x: x.update(parameter="gap"))
    altered(lambda x: x.update(statement="Theorem."))


@pytest.mark.parametrize("within", [(1.0, 2.0), (1.8, 1.8), 1.8, (float("nan"), 1.8)])
def test_bad_ranges_are_refused(within):
    with pytest.raises(vi.ParameterError, match="within"):
        vi.prove(branch(0.05, 1.797, 1.803), within=within)
