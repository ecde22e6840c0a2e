"""Proofs of periodic motions, and certificates: what is shown, refused, and left open.

The reference motions and their multipliers have 25 digits, by an independent simulator
(tests/data/orbits_reference.json).
"""

import ast
import copy
import dataclasses
import json
from fractions import Fraction
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import repository
import vibroimpact as vi
from small_results import START
from struck import MIRRORED, REST, orbit
from systems import PAPER
from test_orbits import REFERENCE, reference_motion
from two_masses import structure

pytest.importorskip("flint")
FOLDER = Path(vi.__file__).parent / "proof"
#: What a proof rests on.
TRUSTED = ("formulas", "verifier", "certificate")


def is_plain(name):
    """Whether a motion has impacts alone: no chatter, no contact."""
    events = {event["event"] for event in REFERENCE[name]["events"]}
    return events == {"impact"} and REFERENCE[name]["n"] != "inf"


PLAIN = sorted(filter(is_plain, REFERENCE))


@cache
def settled():
    return vi.simulate(PAPER, initial=START, periods=600, keep=100).refine()


@cache
def proved():
    return vi.prove(settled())


def number(text):
    mantissa, exponent = text.split("p")
    return Fraction(int(mantissa)) * Fraction(2) ** int(exponent)


def holds(disc, value):
    """Whether a disc of a certificate holds a number of 25 digits."""
    re, im, by = map(number, disc)
    digits = Fraction(1, 10**24) * (1 + abs(re))
    return all(abs(x - Fraction(y)) <= by + digits for x, y in zip((re, im), value, strict=True))


def test_there_are_as_many_plain_reference_motions_as_are_said_to_be():
    assert len(PLAIN) >= 28


@pytest.mark.parametrize("name", PLAIN)
def test_reference_motion(name):
    scene = REFERENCE[name]
    proof = vi.prove(reference_motion(name))
    assert proof.verdict == "proved", proof.why
    assert proof.stability == ("stable" if scene["stable"] else "unstable")
    discs = list(proof.certificate["claims"]["discs"])
    assert len(discs) == len(scene["multipliers"])
    for value in scene["multipliers"]:
        disc = next(disc for disc in discs if holds(disc, value))
        discs.remove(disc)
    # The instants of the impacts, modulo the motion's own length.
    times = [number(centre) for centre, _ in proof.certificate["claims"]["box"]]
    width = proof.box.center.shape[1]
    known = sorted(float(event["t"]) for event in scene["events"])
    length = scene["m"] * 2 * np.pi / float(scene["params"]["omega"])
    found = sorted(float(t) % length for t in times[width - 1 :: width])
    np.testing.assert_allclose(found, known, rtol=1e-12, atol=1e-11)


def test_structures():
    slower = MIRRORED.replace(drive_frequency=1.4)
    rubbing = structure(damping_ratios=[0.05, 0.05], drive_frequency=1.3)
    several, rough = (
        vi.simulate(system, initial=REST[2], periods=600, keep=100).refine()
        for system in (slower, rubbing)
    )
    for motion in (orbit(), several, rough):
        proof = vi.prove(motion)
        assert proof.verdict == "proved", proof.why
        assert proof.stability == motion.stability
        largest = proof.multipliers[0].center
        assert abs(abs(largest) - abs(motion.multipliers[0])) < 1e-9
    assert len({leg.stop for leg in several.legs}) == 2
    regimes = {leg.regime for leg in rough.legs}
    assert {vi.Regime.SLIP, vi.Regime.REVERSAL_RESTITUTION} < regimes


def test_statement_says_what_is_shown():
    text = proved().statement
    assert "asymptotically stable" in text
    assert "delta = 0.5" in text
    center, radius = proved().box.center, proved().box.radius
    assert f"x1 = {center[0, 0]:.17g}" in text
    assert radius.max() < 1e-15
    assert 1e-3 < proved().unique_within < 0.1


def test_the_theorem_on_the_page_is_the_one_that_is_shown():
    page = (repository.root() / "docs" / "proofs.md").read_text(encoding="utf-8")
    quoted = page[page.index("> **Theorem.**") :].partition("\n\n")[0].splitlines()
    printed = " ".join(" ".join(line[1:] for line in quoted).split())
    assert printed == " ".join(proved().statement.replace("Theorem.", "**Theorem.**", 1).split())


def test_numbers_of_the_result_are_bounds_of_those_of_the_certificate():
    claims, proof = proved().certificate["claims"], proved()
    box = zip(claims["box"], proof.box.center.flat, proof.box.radius.flat, strict=True)
    for (centre, by), middle, radius in box:
        assert abs(number(centre) - Fraction(middle)) + number(by) <= Fraction(radius)
    given = zip(proved().certificate["box"], proof.box.center.flat, strict=True)
    for (centre, by), middle in given:
        away = abs(number(centre) - Fraction(middle))
        assert away + Fraction(proof.unique_within) <= number(by)


def test_a_saved_certificate_is_proved_anew(tmp_path):
    path = tmp_path / "motion.json"
    proved().save(path)
    again = vi.check_proof(path)
    assert again.statement == proved().statement
    assert again.certificate == proved().certificate
    assert again.multipliers == proved().multipliers


def changes():
    """Alterations of a certificate by what they change."""

    def with_(path, value):
        def change(content):
            for key in path[:-1]:
                content = content[key]
            content[path[-1]] = value(content[path[-1]]) if callable(value) else value

        return change

    def more(text):  # larger by a part in 2^30
        mantissa, exponent = text.split("p")
        return f"{(int(mantissa) << 31) + 2 * int(mantissa)}p{int(exponent) - 31}"

    def less(text):
        mantissa, exponent = text.split("p")
        return f"{(int(mantissa) << 31) * 9 // 10}p{int(exponent) - 31 - 8}"

    numbers = ("machine", "numbers")
    return {
        "not a certificate": lambda content: content.clear(),
        "format": with_(("format",), "vibroimpact proof 0"),
        "a number of the system": with_((*numbers, "r"), more),
        "sign": with_((*numbers, "delta"), lambda text: f"-{text}"),
        "an exponent beyond all": with_((*numbers, "zeta1"), "1p999999999999"),
        "text in place of a number": with_((*numbers, "r"), "0.8"),
        "null": with_((*numbers, "r"), None),
        "a number too many": with_((*numbers, "drag"), "1p0"),
        "a number too few": lambda content: content["machine"]["numbers"].pop("mu"),
        "law that is none": with_(("machine", "law"), "paper"),
        "kind": with_(("machine", "kind"), "structure"),
        "contact": with_(("machine", "contact"), "direct"),
        "wall": with_(("machine", "wall_rests"), True),
        "a word for true": with_(("machine", "wall_rests"), "false"),
        "periods": with_(("m",), 2),
        "periods that are no number": with_(("m",), "1"),
        "regime": with_(("legs", 0, 1), "slip +"),
        "stop": with_(("legs", 0, 0), 1),
        "no legs": with_(("legs",), []),
        "precision": with_(("precision",), 20),
        "precision without end": with_(("precision",), 10**9),
        "box moved": with_(("box", 0, 0), lambda text: f"-{text}"),
        "box without width": with_(("box", 0, 1), "0p0"),
        "box of negative width": with_(("box", 0, 1), "-1p-20"),
        "box too wide": with_(("box", 0, 1), "1p0"),
        "verdict": with_(("claims", "verdict"), "disproved"),
        "stability": with_(("claims", "stability"), "unstable"),
        "claimed radius": with_(("claims", "box", 0, 1), less),
        "claimed radius of a disc": with_(("claims", "discs", 0, 2), less),
        "a disc less": lambda content: content["claims"]["discs"].pop(),
        "statement": with_(("statement",), lambda text: text.replace("stable", "super-stable")),
        "entry too many": with_(("note",), "without friction"),
    }


@pytest.mark.parametrize("what", changes())
def test_an_altered_certificate_is_refused(what, tmp_path):
    path = tmp_path / "motion.json"
    proved().save(path)
    content = json.loads(path.read_text())
    before = copy.deepcopy(content)
    changes()[what](content)
    assert content != before
    path.write_text(json.dumps(content))
    with pytest.raises(vi.ProofError):
        vi.check_proof(path)


def forged(what):
    """A certificate that claims what is not so, with the statement that goes with it."""
    from vibroimpact.proof.certificate import examine
    from vibroimpact.proof.files import proof_from

    content = copy.deepcopy(dict(proved().certificate))
    found, claims = examine(content), content["claims"]
    if what == "a disc elsewhere":  # as wide as before
        claims["discs"][0][0] = f"-{claims['discs'][0][0]}".replace("--", "")
    elif what == "a disc beside the multiplier":
        mantissa, exponent = claims["discs"][2][0].split("p")
        claims["discs"][2][0] = f"{(int(mantissa) << 40) * 1001 // 1000}p{int(exponent) - 40}"
    elif what == "a disc twice":
        claims["discs"][1] = claims["discs"][0]
    elif what == "stability":
        claims["stability"] = "unstable"
        found = dataclasses.replace(found, stability="unstable")
    elif what == "alone within more":  # a wider box, in which Krawczyk's operator does not contract
        for pair in content["box"]:
            mantissa, exponent = pair[1].split("p")
            pair[1] = f"{mantissa}p{int(exponent) + 8}"
    proof = proof_from(content, found)
    text = proof.statement
    if what == "alone within more, in words":
        text = text.replace("lies within 6.5e-03", "lies within 6.5e-02")
        assert text != proof.statement
    return {"format": "vibroimpact proof 1", **content, "statement": text}


FORGERIES = ["a disc elsewhere", "a disc beside the multiplier", "a disc twice", "stability"]
FORGERIES += ["alone within more", "alone within more, in words"]


@pytest.mark.parametrize("what", FORGERIES)
def test_a_false_claim_is_refused_whatever_the_statement_says(what, tmp_path):
    path = tmp_path / "motion.json"
    path.write_text(json.dumps(forged(what)))
    with pytest.raises(vi.ProofError, match=r"more than is shown|nothing is shown|its statement"):
        vi.check_proof(path)


def test_a_certificate_that_is_written_so_is_accepted(tmp_path):
    path = tmp_path / "motion.json"
    path.write_text(json.dumps(forged("nothing")))
    assert vi.check_proof(path).statement == proved().statement


@pytest.mark.parametrize("text", ["", "[]", "null", "{", "1", '"proof"', "\x00"])
def test_what_is_no_certificate_is_refused(text, tmp_path):
    path = tmp_path / "motion.json"
    path.write_text(text)
    with pytest.raises(vi.ProofError):
        vi.check_proof(path)


def test_the_same_motion_twice_is_no_longer_one(tmp_path):
    path = tmp_path / "motion.json"
    proved().save(path)
    content = json.loads(path.read_text())
    content["m"] *= 2
    content["legs"] *= 2
    period = 2 * np.pi / PAPER.drive_frequency
    box = copy.deepcopy(content["box"])
    numerator, denominator = (float(number(box[-1][0])) + period).as_integer_ratio()
    box[-1][0] = f"{numerator}p{1 - denominator.bit_length()}"
    content["box"] += box
    for pair in content["box"]:
        pair[1] = "1p-20"
    path.write_text(json.dumps(content))
    with pytest.raises(vi.ProofError, match="repeat earlier"):
        vi.check_proof(path)


def test_solutions_that_are_no_motion_are_disproved():
    found = vi.periodic_motions(PAPER.replace(drive_frequency=1.1), 2)
    wrong = [motion for motion in found if not motion.admissible]
    assert wrong
    for motion in wrong:
        proof = vi.prove(motion)
        assert proof.verdict == "disproved"
        assert proof.why
        assert proof.solved
        assert "no motion" in proof.statement
        assert "one solution there, and it is none. Leg 1: " in proof.statement
        assert proof.statement.endswith(".")


def test_a_box_without_a_solution_is_told_from_one_without_a_motion():
    from vibroimpact.proof.certificate import examine
    from vibroimpact.proof.files import proof_of

    given = dict(proved().certificate)
    center, radius = map(number, given["box"][0])
    away = center + radius * Fraction(3, 4)
    shift = away.denominator.bit_length() - 1
    small = [[x, f"1p-{30}"] for x, _ in given["box"]]
    small[0][0] = f"{away.numerator}p-{shift}"
    problem = {name: given[name] for name in ("machine", "m", "legs", "precision")}
    proof = proof_of(problem | {"box": small}, examine(problem | {"box": small}))
    assert (proof.verdict, proof.solved) == ("disproved", False)
    assert "have no solution there" in proof.statement


@pytest.mark.parametrize(("shift", "verdict"), [(-1e-9, "disproved"), (1e-9, "proved")])
def test_a_hidden_contact_is_found(shift, verdict):
    """One more stop on the other side, by 1e-9 within the reach of the motion or out of it."""
    from vibroimpact.proof.certificate import examine
    from vibroimpact.proof.files import text

    motion = orbit()
    times = np.linspace(0, motion.m * motion.system.drive_period, 20001)
    reach = float(-motion.trajectory(times)[:, 0].min())
    problem = copy.deepcopy({**vi.prove(motion).certificate})
    stop = dict(problem["machine"]["stops"][0])
    problem["machine"]["stops"].append({**stop, "normal": ["-1p0"], "gap": text(reach + shift)})
    found = examine(problem)
    assert found.verdict == verdict
    if shift < 0:
        assert "stop 1 is met" in found.why


@pytest.mark.parametrize(
    ("name", "why"),
    [("7c_0.25", "chatter"), ("plastic", "contact")],
)
def test_what_is_left_open_says_why(name, why):
    proof = vi.prove(reference_motion(name))
    assert proof.verdict == "undecided"
    assert why in proof.why
    assert proof.box is None
    with pytest.raises(vi.ParameterError, match="undecided"):
        proof.save("motion.json")


@pytest.mark.parametrize("contact", ["oblique", "direct"])
def test_a_motion_without_impacts(contact, tmp_path):
    system = PAPER.replace(
        gap=4.0, damping=(0.05, 0.05), force_amplitude=0.3, phase=0.4, contact=contact
    )
    motion = vi.simulate(system, initial=START, periods=600, keep=100).refine()
    proof = vi.prove(motion)
    assert (proof.verdict, proof.label, proof.stability) == ("proved", "1-0", "stable")
    assert "no stop. At t = 0" in proof.statement
    # The steady state of each oscillator, and exp(lambda T) of each root of its equation.
    omega = system.drive_frequency
    roots = []
    for place, (own, zeta, load) in enumerate(((2.0, 0.05, 1.0), (1.0, 0.05, 0.3))):
        steady = load * np.exp(0.4j) / (own**2 - omega**2 + 2j * zeta * own * omega)
        close = {"rtol": 0, "atol": 1e-13}
        np.testing.assert_allclose(proof.box.center[0, place], steady.real, **close)
        np.testing.assert_allclose(
            proof.box.center[0, 2 + place], (1j * omega * steady).real, **close
        )
        root = own * (-zeta + 1j * np.sqrt(1 - zeta**2))
        roots += [np.exp(x * system.drive_period) for x in (root, root.conjugate())]
    for root in roots:
        assert sum(abs(disc.center - root) < 1e-13 for disc in proof.multipliers) == 1
    proof.save(tmp_path / "free.json")
    assert vi.check_proof(tmp_path / "free.json").statement == proof.statement


def test_a_free_motion_that_would_pass_a_stop_is_none():
    from vibroimpact.proof.certificate import examine

    system = PAPER.replace(gap=2.0, damping=(0.05, 0.05))
    motion = vi.simulate(system, initial=START, periods=600, keep=100).refine()
    given = copy.deepcopy(dict(vi.prove(motion).certificate))
    given["machine"]["numbers"]["delta"] = "1p-2"
    found = examine(given)
    assert (found.verdict, found.solved) == ("disproved", True)
    assert "stop 0 is met" in found.why
    # At resonance without damping there is none.
    given["machine"]["numbers"] |= {
        "delta": "2p0",
        "zeta1": "0p0",
        "omega0": "9p-3",
        "omega": "9p-3",
    }
    found = examine(given)
    assert (found.verdict, found.solved) == ("disproved", False)
    given["m"] = 2
    with pytest.raises(vi.ProofError):
        examine(given)


def test_a_free_motion_of_a_structure():
    system = vi.Structure(
        [[1]],
        [[1]],
        [vi.Stop([1], 3.0, 0.8)],
        damping_ratios=[0.05],
        drive_amplitude=[1],
        drive_frequency=2.0,
        phase=0.3,
    )
    proof = vi.prove(vi.simulate(system, initial=[[0], [0]], periods=200, keep=50).refine())
    assert (proof.verdict, proof.label, proof.stability) == ("proved", "1-0", "stable")


LIGHT = {"mass_ratio": 0.0, "gap": 0.68, "friction": 1.1}
AT_REST = {"frequency_ratio": 0.69, "restitution": 0.83, "drive_frequency": 1.26}
AT_REST |= {"damping": (0.01, 0.01), "moment_amplitude": 1.54}
DRIVEN = {"frequency_ratio": 1.8, "restitution": 0.28, "drive_frequency": 2.3}
DRIVEN |= {"damping": (0.0, 0.5), "moment_amplitude": 1.53, "force_amplitude": 0.16}


@pytest.mark.parametrize("law", ["poisson", "newton", "energetic"])
@pytest.mark.parametrize("wall", [AT_REST, DRIVEN], ids=["at rest", "driven"])
def test_a_tip_that_sticks_to_a_body_without_mass(wall, law):
    """No impulse changes a velocity any more: du/dP = 0 is no divisor."""
    system = vi.System(**LIGHT, **wall, law=law)
    motion = vi.simulate(system, initial=(-0.2, 0.5, 0, 0), periods=600, keep=60).refine()
    assert {leg.regime for leg in motion.legs} == {vi.Regime.STICK_RESTITUTION}
    proof = vi.prove(motion)
    assert (proof.verdict, proof.stability) == ("proved", "stable")
    assert abs(proof.box.center[0, 1 if wall is AT_REST else 2]) < 1e-30  # x1' = 0


def test_the_law_of_the_paper_is_left_open():
    motion = vi.simulate(PAPER.replace(law="paper"), initial=START, periods=600, keep=100).refine()
    assert "law" in vi.prove(motion).why


def test_only_motions_are_proved():
    with pytest.raises(vi.ParameterError, match="motion"):
        vi.prove(PAPER)


# What a proof rests on.


def test_what_a_proof_rests_on_can_be_read():
    lines = sum(len((FOLDER / f"{name}.py").read_text().splitlines()) for name in TRUSTED)
    assert 100 < lines <= 600


def test_what_a_proof_rests_on_uses_nothing_else():
    # Of `near` any matrix is right, which another test shows.
    allowed = {f".{name}" for name in (*TRUSTED, "near")} | {".", "..errors", "flint"}
    allowed |= {"__future__", "collections.abc", "dataclasses", "math", "typing"}
    for name in TRUSTED:
        for node in ast.walk(ast.parse((FOLDER / f"{name}.py").read_text())):
            if isinstance(node, ast.Import):
                assert {alias.name for alias in node.names} <= allowed
            if isinstance(node, ast.ImportFrom):
                assert "." * node.level + (node.module or "") in allowed
