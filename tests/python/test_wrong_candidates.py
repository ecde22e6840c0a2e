"""No wrong motion is proved: attempts of eight kinds, and controls that are right."""

import itertools
import json
from collections import Counter

import numpy as np
import pytest

import sizes
import vibroimpact as vi

pytest.importorskip("flint")

import altered_certificates
import simulated_certificates
import wrong_candidates
from vibroimpact.proof.certificate import examine
from vibroimpact.proof.files import proof_from
from wrong_candidates import DEPTH, KINDS

# Of all candidates, what is tried of a kind unless all are.
QUICK = {
    "inadmissible with one impact": 40,
    "inadmissible with several impacts": 6,
    "hidden contact": 10,
    "wrong regime": 40,
    "wrong sequence": 20,
    "beyond a saddle-node": 2,
    "off the box": 30,
    "altered certificate": 100,
}


def count(kind):
    return sizes.either(QUICK[kind], KINDS[kind])


@pytest.fixture(scope="module")
def motions():
    found = wrong_candidates.references_proved() + wrong_candidates.of_structures(10)
    assert len(found) == 40
    return found


@pytest.fixture(scope="module")
def proofs(motions):
    found = [vi.prove(motion) for motion in motions]
    assert all(proof.verdict == "proved" for proof in found)
    return found


def none_is_proved(kind, candidates):
    """Try candidates until so many are wrong; those that are right after all must be proved."""
    verdicts: Counter[str] = Counter()
    for problem, z in candidates:
        verdict = wrong_candidates.verdict(problem, z)
        if simulated_certificates.is_motion(problem, z):
            assert verdict == "proved", problem
            continue
        assert verdict != "proved", problem
        verdicts[verdict] += 1
        if verdicts.total() == count(kind):
            break
    print(kind, dict(verdicts))
    return verdicts


def test_solutions_with_one_impact_that_are_no_motion():
    verdicts = none_is_proved("inadmissible with one impact", wrong_candidates.one_impact(1))
    assert verdicts["disproved"] > 0.9 * verdicts.total()


def test_solutions_with_several_impacts_that_are_no_motion():
    kind = "inadmissible with several impacts"
    assert none_is_proved(kind, wrong_candidates.several_impacts(1))["disproved"] > 0


def test_a_contact_of_depth_1e_9_is_seen():
    kind = "hidden contact"
    verdicts = none_is_proved(kind, wrong_candidates.beside_a_graze(1, DEPTH))
    assert verdicts["disproved"] > 0.9 * verdicts.total()


def test_a_clearance_of_1e_9_is_enough():
    # The control: the same motions, just before the contact.
    some = wrong_candidates.beside_a_graze(1, -DEPTH)
    for problem, z in itertools.islice(some, count("hidden contact")):
        if simulated_certificates.is_motion(problem, z):
            assert wrong_candidates.verdict(problem, z) == "proved"


def test_motions_with_another_regime(motions):
    none_is_proved("wrong regime", wrong_candidates.wrong_regime(1, motions))


def test_motions_with_another_sequence(motions):
    none_is_proved("wrong sequence", wrong_candidates.wrong_sequence(1, motions))


def test_nothing_is_left_beyond_a_saddle_node():
    kind, verdicts = "beyond a saddle-node", Counter()
    for beyond, z, before, near in itertools.islice(
        wrong_candidates.beyond_saddle_nodes(1), count("beyond a saddle-node")
    ):
        # before it there is one (Newton's method from the saddle-node itself may go astray)
        assert wrong_candidates.newton(before, near) is not None
        verdicts[wrong_candidates.verdict(beyond, z)] += 1
    print(kind, dict(verdicts))
    assert not verdicts["proved"]


def test_boxes_without_the_solution(proofs):
    certificates = [dict(proof.certificate) for proof in proofs]
    verdicts: Counter[str] = Counter()
    some = wrong_candidates.off_the_box(1, certificates)
    for problem, _ in itertools.islice(some, count("off the box")):
        verdicts[examine(problem).verdict] += 1
    print("off the box", dict(verdicts))
    assert not verdicts["proved"]


@pytest.fixture(scope="module")
def certificates(proofs, tmp_path_factory):
    path = tmp_path_factory.mktemp("proofs") / "proof.json"
    refuted = [
        motion
        for system in itertools.islice(wrong_candidates.systems(3), 3)
        for motion in vi.periodic_motions(system, n=1)
        if motion.legs and not motion.admissible
    ]
    found = []
    for proof in [*proofs, *map(vi.prove, refuted[:4])]:
        proof.save(path)
        found.append(json.loads(path.read_text(encoding="utf-8")))
    return found


def test_an_altered_certificate_fails_or_states_what_is_so(certificates, tmp_path):
    random, verdicts = np.random.default_rng(3), Counter()
    path = tmp_path / "altered.json"
    while verdicts["refused"] + verdicts["accepted"] < count("altered certificate"):
        given = certificates[random.integers(len(certificates))]
        content, what = altered_certificates.altered(given, random)
        proof = altered_certificates.accepted(content, path)
        if proof is None and fitting_statement(content):
            proof = altered_certificates.accepted(content, path)
        verdicts["refused" if proof is None else "accepted"] += 1
        assert proof is None or not altered_certificates.untruth(content, proof), what
    print("altered certificate", dict(verdicts))
    assert min(verdicts.values()) > 0


def fitting_statement(content):
    """Give an altered certificate the statement that goes with it, as a forger would."""
    posed = {name: content[name] for name in ("machine", "m", "legs", "precision", "box")}
    try:
        found = examine(posed)
        if found.verdict == "undecided":
            return False
        content["statement"] = proof_from({**posed, "claims": content["claims"]}, found).statement
    except Exception:  # it is damaged
        return False
    return True


def test_a_motion_passed_twice_is_not_another_one(proofs):
    proof = next(proof for proof in proofs if proof.label == "1-1")
    twice = dict(proof.certificate)
    problem = {"machine": twice["machine"], "m": 2, "legs": 2 * list(twice["legs"])}
    nodes = np.vstack([proof.box.center] * 2)
    nodes[1, -1] += (
        2.0 * np.pi / simulated_certificates.number(twice["machine"]["numbers"]["omega"])
    )
    problem["precision"] = wrong_candidates.PRECISION
    z = wrong_candidates.newton(problem, nodes)
    assert z is not None
    found = examine({**problem, "box": wrong_candidates.box_about(z, 60)})
    assert (found.verdict, found.why) == ("undecided", "it may repeat earlier")


@pytest.mark.parametrize(
    ("name", "value", "why"),
    [
        ("precision", 10**9, "precision"),
        ("box", [["1p0", "1p-999999999999"]], "exponent"),
        ("machine", {"numbers": {}}, "damaged"),
    ],
)
def test_sizes_that_no_proof_has_are_refused_at_once(name, value, why, certificates, tmp_path):
    content = {**certificates[0], name: value}
    path = tmp_path / "large.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(vi.ProofError, match=why):
        vi.check_proof(path)
