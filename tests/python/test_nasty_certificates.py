"""Certificates that were made to deceive: what is untrue is refused, whatever a forger writes."""

import copy
import json

import numpy as np
import pytest

import vibroimpact as vi
from small_results import START
from struck import MIRRORED, REST
from systems import PAPER

pytest.importorskip("flint")

from flint import arb_mat

from vibroimpact.proof import verifier
from vibroimpact.proof.certificate import examine
from vibroimpact.proof.files import proof_from


@pytest.fixture(scope="module")
def single():
    motion = vi.simulate(PAPER, initial=START, periods=600, keep=100).refine()
    return dict(vi.prove(motion).certificate)


@pytest.fixture(scope="module")
def several():
    """A motion of a structure with two stops, which it meets one after another."""
    slower = MIRRORED.replace(drive_frequency=1.4)
    motion = vi.simulate(slower, initial=REST[2], periods=600, keep=100).refine()
    found = dict(vi.prove(motion).certificate)
    assert len(found["legs"]) > 1
    assert len({stop for stop, _ in found["legs"]}) == 2
    return found


def forged(given, change):
    """A changed certificate, with claims and statement that fit where any do."""
    content = copy.deepcopy(given)
    change(content)
    posed = {name: content[name] for name in ("machine", "m", "legs", "precision", "box")}
    try:
        found = examine(posed)
        content["statement"] = proof_from({**posed, "claims": content["claims"]}, found).statement
    except Exception:  # nothing fits
        content["statement"] = "Theorem."
    return content | {"format": "vibroimpact proof 1"}


def refused(content, path):
    """Whether a file is refused."""
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(vi.ProofError):
        vi.check_proof(path)
    return True


def put(*path, to):
    def change(content):
        for key in path[:-1]:
            content = content[key]
        content[path[-1]] = to

    return change


NUMBERS = ("machine", "numbers")
OF_TWO_BODIES = {
    "restitution below 0": put(*NUMBERS, "r", to="-1p-1"),
    "restitution above 1": put(*NUMBERS, "r", to="5p-2"),
    "friction below 0": put(*NUMBERS, "mu", to="-1p-3"),
    "mass below 0": put(*NUMBERS, "mbar", to="-1p-1"),
    "damping below 0": put(*NUMBERS, "zeta1", to="-1p-5"),
    "a drive that stands still": put(*NUMBERS, "omega", to="0p0"),
    "a drive backwards": put(*NUMBERS, "omega", to="-9p-2"),
    "another drive period": put(*NUMBERS, "omega", to="9p-3"),
    "a number of words": put(*NUMBERS, "r", to="nan"),
    "infinity": put(*NUMBERS, "r", to="infp0"),
    "no text but a number": put(*NUMBERS, "r", to=0.8),
    "a huge mantissa": put(*NUMBERS, "r", to="1" * 6000 + "p0"),
    "a huge exponent": put(*NUMBERS, "r", to="1p99999999999999999999"),
    "a tiny exponent": put("box", 0, 1, to="1p-99999999999999999999"),
    "m as a float": put("m", to=1.0),
    "m as a truth": put("m", to=True),
    "a stop as a truth": put("legs", 0, 0, to=False),
    "a stop as a float": put("legs", 0, 0, to=0.0),
    "a stop from the end": put("legs", 0, 0, to=-1),
    "no impact at all": put("legs", 0, to=[-1, "no_impact"]),
    "precision as a float": put("precision", to=128.0),
    "a box that holds several solutions": lambda content: [
        pair.__setitem__(1, "1p2") for pair in content["box"]
    ],
    "a box with a side without width": put("box", 2, 1, to="0p0"),
    "a pair of three": put("box", 0, to=["1p0", "1p0", "1p0"]),
    "a multiplier off its disc by as much as it is wide": lambda content: content["claims"][
        "discs"
    ][0].__setitem__(2, "1p-200"),
    "unstable": put("claims", "stability", to="unstable"),
    "a claim that is a word": put("claims", "discs", to="none"),
}


@pytest.mark.parametrize("name", OF_TWO_BODIES)
def test_of_two_bodies(name, single, tmp_path):
    assert refused(forged(single, OF_TWO_BODIES[name]), tmp_path / "motion.json")


def swap(content):
    content["legs"].reverse()


def without_time(content):
    """A second impact at the time of the first one: a leg of length 0."""
    width = len(content["box"]) // len(content["legs"])
    for part in (content["box"], content["claims"]["box"]):
        part[width : 2 * width] = copy.deepcopy(part[:width])


def negative(matrix):
    def change(content):
        machine = content["machine"]
        machine.pop("damping_ratios", None)
        machine.pop("damping", None)
        size = len(machine["mass"])
        rows = [["1p-4" if i == j else "0p0" for j in range(size)] for i in range(size)]
        machine["damping"] = rows
        machine[matrix] = [["-1p-4" if x == "1p-4" else x for x in row] for row in rows]

    return change


def lopsided(content):
    rows = content["machine"]["stiffness"]
    size = len(rows)
    content["machine"]["stiffness"] = [
        ["1p0" if i == j else "1p-3" if i > j else "0p0" for j in range(size)] for i in range(size)
    ]


OF_STRUCTURES = {
    "legs in another order": swap,
    "a leg without time": without_time,
    "damping that feeds": negative("damping"),
    "mass below 0": negative("mass"),
    "stiffness below 0": negative("stiffness"),
    "stiffness that is not symmetric": lopsided,
    "damping twice": put("machine", "damping", to=[["0p0"] * 2] * 2),
    "a stop too few": lambda content: content["machine"]["stops"].pop(),
    "restitution below 0": put("machine", "stops", 1, "restitution", to="-1p-1"),
    "a normal that is too short": put("machine", "stops", 0, "normal", to=["1p0"]),
    "a normal that is too long": put("machine", "stops", 0, "normal", to=["1p0"] * 5),
    "friction along the normal": lambda content: content["machine"]["stops"][0].update(
        friction="1p-2", tangent=content["machine"]["stops"][0]["normal"]
    ),
}


@pytest.mark.parametrize("name", OF_STRUCTURES)
def test_of_structures(name, several, tmp_path):
    assert refused(forged(several, OF_STRUCTURES[name]), tmp_path / "motion.json")


def test_an_entry_that_is_there_twice(single, tmp_path):
    path = tmp_path / "motion.json"
    text = json.dumps(forged(single, lambda content: None))
    path.write_text(text, encoding="utf-8")
    assert vi.check_proof(path).verdict == "proved"
    path.write_text(text.replace('"m": 1', '"m": 2, "m": 1', 1), encoding="utf-8")
    with pytest.raises(vi.ProofError, match="twice"):
        vi.check_proof(path)


@pytest.mark.parametrize("size", [0.0, 1.0, 1e300, float("nan")])
def test_nothing_rests_on_the_matrix_near_an_inverse(size, single, several, monkeypatch):
    """With any other matrix a motion is left open, and is not disproved."""

    def anything(orbit, z):
        width = len(z) // len(orbit.legs)
        random = np.random.default_rng(1)
        return [arb_mat((size * random.normal(size=(len(z), width))).tolist()) for _ in orbit.legs]

    for given in (single, several):
        posed = {name: given[name] for name in ("machine", "m", "legs", "precision", "box")}
        assert examine(posed).verdict == "proved"
        with monkeypatch.context() as patch:
            patch.setattr(verifier, "near_inverse", anything)
            assert examine(posed).verdict == "undecided"
