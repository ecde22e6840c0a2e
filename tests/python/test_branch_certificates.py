"""Certificates of branches: verified anew, altered, and made to deceive."""

import copy
import json
import types

import numpy as np
import pytest

import altered_certificates
import sizes
import vibroimpact as vi
from proved_branches import (
    damped_proof,
    gap_proof,
    grazing_proof,
    neimark_sacker_proof,
    short_proof,
    turned_proof,
)

flint = pytest.importorskip("flint")


POSED = ("machine", "parameter", "place", "within", "precision", "pieces")


def retold(content):
    """A certificate whose statement says what it claims."""
    from vibroimpact.proof.branch_files import _proof_from
    from vibroimpact.proof.branch_statement import branch_statement
    from vibroimpact.proof.chain import Shown

    posed = {key: value for key, value in content.items() if key not in ("format", "statement")}
    none = [Shown() for _ in content["pieces"]]
    return content | {"statement": branch_statement(_proof_from(posed, none))}


def saved(proof, path):
    proof.save(path)
    return json.loads(path.read_text())


def values(content):
    """Single values: 0p3 is 0p0."""
    told = (altered_certificates.at(content, x) for x in altered_certificates.places(content))
    exact = altered_certificates.exact
    return [
        exact(x) if isinstance(x, str) and altered_certificates.is_number(x) else x for x in told
    ]


def is_refused(content, path):
    path.write_text(json.dumps(content))
    try:
        vi.check_proof(path)
    except vi.ProofError:
        return True
    return False


@pytest.mark.parametrize(
    "proof", sizes.either([damped_proof, gap_proof, grazing_proof], [damped_proof, turned_proof])
)
def test_a_certificate_is_verified_anew(proof, tmp_path):
    path = tmp_path / "branch.json"
    saved(proof(), path)
    again = vi.check_proof(path)
    assert again.statement == proof().statement
    assert again.stretches == proof().stretches
    assert again.bifurcations == proof().bifurcations
    assert again.uncovered == proof().uncovered


def tubes(content):
    return [tube for piece in content["pieces"] for tube in piece["tubes"]]


def claims(content):
    return content["claims"]["stretches"], content["claims"]["bifurcations"]


@pytest.mark.parametrize(
    "proof", sizes.either([neimark_sacker_proof], [neimark_sacker_proof, turned_proof])
)
def test_claims_of_more_than_is_shown_are_refused(proof, tmp_path):
    """Even where the statement says the same."""
    path = tmp_path / "branch.json"
    good = saved(proof(), path)
    assert good == retold(copy.deepcopy(good))
    changes = [
        lambda x: claims(x)[1][0].__setitem__(1, claims(x)[1][0][0]),
        lambda x: claims(x)[1][0].__setitem__(2, "grazing"),
    ]
    if proof is turned_proof:
        changes.append(lambda x: [tube["cuts"].__delitem__(slice(-1)) for tube in tubes(x)])
    else:
        changes += [
            lambda x: claims(x)[0][0].__setitem__(3, "unstable"),
            lambda x: claims(x)[0][1].__setitem__(3, "stable"),
            lambda x: claims(x)[0][0].__setitem__(2, "disproved"),
            # one verdict across the bifurcation, from either side
            lambda x: claims(x)[0][0].__setitem__(1, claims(x)[0][1][1]),
            lambda x: claims(x)[0][1].__setitem__(0, claims(x)[0][0][0]),
            lambda x: claims(x)[0][0].__setitem__(1, "2p0"),
            lambda x: claims(x)[0].append(["1p0", "3p-1", "proved", "stable", "", 0]),
            lambda x: claims(x)[1].append(["1p0", "3p-1", "saddle_node", 0]),
            lambda x: [piece["tubes"].pop(1) for piece in x["pieces"]],
            lambda x: [piece["tubes"].reverse() for piece in x["pieces"]],
            lambda x: x.update(parameter="gap"),
            lambda x: x.update(place=["delta"], parameter="gap"),
            lambda x: x["machine"]["numbers"].update(r="1p0"),
        ]
    for change in changes:
        content = copy.deepcopy(good)
        change(content)
        assert content != good
        assert is_refused(retold(content), path)


def hostile():
    """Certificates of a forger who knows how they are verified: what is changed, by name."""

    def piece(content):
        return content["pieces"][0]

    def tube(content, k=0):
        return piece(content)["tubes"][k]

    def gap(content):
        """A tube is left out: what was behind it follows another one."""
        piece(content)["tubes"].pop(len(piece(content)["tubes"]) // 2)

    def narrow(content):
        """The last tube, as if it were the whole branch; claims of all of it."""
        piece(content)["tubes"] = piece(content)["tubes"][-1:]

    def other_sheet(content):
        """Two sheets of the saddle-node as one chain."""
        chain = piece(content)["tubes"]
        piece(content)["tubes"] = [chain[-1], chain[0]]

    def merged(content):
        """One stable stretch across the bifurcation, which is told no more."""
        rows = content["claims"]["stretches"]
        last = max(rows, key=lambda x: number(x[1]))[1]
        rows[:] = [[rows[0][0], last, "proved", "stable", "", 0]]
        content["claims"]["bifurcations"].clear()

    def swapped(content):
        """Stable and unstable change places."""
        for row in content["claims"]["stretches"]:
            row[3] = {"stable": "unstable", "unstable": "stable"}.get(row[3], row[3])

    def coarse(content):
        """No parts: the bifurcation is not looked at."""
        for one in tubes(content):
            del one["cuts"][:-1]

    def backwards(content):
        one = next(x for x in tubes(content) if len(x["cuts"]) > 2)
        one["cuts"][0], one["cuts"][1] = one["cuts"][1], one["cuts"][0]

    def beyond(content):
        """The last part ends outside of its tube."""
        tube(content, -1)["cuts"].append("3p0")

    def thin(content):
        """Tubes so thin that they would be unique within nothing."""
        for one in tubes(content):
            one["radius"] = ["1p-300"] * len(one["radius"])

    def wide(content):
        for one in tubes(content):
            one["radius"] = ["1p2"] * len(one["radius"])

    def elsewhere(content):
        """A bifurcation of another place, said to be the only one."""
        row = content["claims"]["bifurcations"][0]
        row[0] = row[1]

    def another_kind(content):
        content["claims"]["bifurcations"][0][2] = "grazing"

    def passed(content):
        """The impact as a maximum of the gap inside a flight."""
        piece(content)["legs"] = [[0, "passed"]]
        piece(content)["label"] = f"{piece(content)['m']}-0"

    def bent(content):
        """Another unknown along which it should go on steadily."""
        tube(content)["axis"] -= 1

    def still(content):
        """A line along which the unknown that goes on does not."""
        one = tube(content)
        one["line"][1][one["axis"]] = "0p0"

    def curved(content):
        one = tube(content)
        one["line"][2][one["axis"]] = "1p-90"

    def none(content):
        tube(content)["cuts"] = []

    def other_legs(content):
        piece(content)["legs"] = [[0, "slip"]]

    def longer(content):
        piece(content)["m"] += 1
        piece(content)["label"] = f"{piece(content)['m']}-1"

    told = (gap, narrow, other_sheet, merged, swapped, coarse, backwards, beyond, thin, wide)
    told += (elsewhere, another_kind, passed, bent, still, curved, none, other_legs, longer)
    return {change.__name__: change for change in told}


def number(text):
    return float(flint.arb(altered_certificates.exact(text)))


@pytest.mark.parametrize("what", sizes.either([*hostile()][:2] + [*hostile()][3:], hostile()))
def test_hostile_certificates_are_refused(what, tmp_path):
    path = tmp_path / "branch.json"
    proof = turned_proof() if what == "other_sheet" else neimark_sacker_proof()
    content = saved(proof, path)
    before = copy.deepcopy(content)
    hostile()[what](content)
    assert content != before
    assert is_refused(content, path)
    try:
        told = retold(content)
    except Exception:  # it has no statement
        return
    assert is_refused(told, path)


@pytest.mark.parametrize("proof", [short_proof, neimark_sacker_proof])
def test_what_is_open_is_told_whatever_a_file_says(proof, tmp_path):
    """A reason can be left out of a file; that the values are not covered cannot."""
    path = tmp_path / "branch.json"
    content = saved(proof(), path)
    low, high = (number(x) for x in content["within"])
    for piece in content["pieces"]:
        piece["open"].clear()
    if proof is neimark_sacker_proof:  # half of what is shown is claimed, and one value
        last = content["claims"]["stretches"][-1]
        last[0] = last[1]
    path.write_text(json.dumps(retold(content)))
    again = vi.check_proof(path)
    assert again.uncovered
    told = [*again.stretches, *again.bifurcations, *again.uncovered]
    reach = low
    for one in sorted(told, key=lambda x: x.lo):
        assert one.lo <= reach
        reach = max(reach, one.hi)
    assert reach >= high


def test_altered_certificates_are_refused_or_state_the_same(tmp_path):
    """What passes has another tube about the same motions, and claims what was shown before."""
    path = tmp_path / "branch.json"
    good = saved(short_proof(), path)
    random, refused, places = np.random.default_rng(3), 0, altered_certificates.places(good)
    by_part = {}
    for place in places:
        by_part.setdefault(place[0] if place[0] != "pieces" else place[3:4], []).append(place)
    parts = list(by_part.values())
    while refused < sizes.either(120, 1500):
        content = copy.deepcopy(good)
        part = parts[random.integers(len(parts))]
        place = part[random.integers(len(part))]
        owner, value = (altered_certificates.at(content, place[:k]) for k in (-1, len(place)))
        if isinstance(value, str) and altered_certificates.is_number(value):
            owner[place[-1]] = altered_certificates.changed(value, random)
        elif isinstance(value, str):
            others = altered_certificates.WORDS.get(value, [value[:-1]])
            owner[place[-1]] = str(random.choice(others))
        elif isinstance(value, bool) or value is None:
            owner[place[-1]] = not value
        else:
            owner[place[-1]] = value + int(random.choice([-1, 1, 64]))
        if content == good:
            continue
        if is_refused(content, path):
            refused += 1
        else:
            assert vi.check_proof(path).statement == short_proof().statement
            assert values(content["claims"]) == values(good["claims"])
            assert values(content["machine"]) == values(good["machine"])


def test_a_motion_without_impacts_is_not_told_over_two_periods(tmp_path):
    """It solves those conditions as well, but repeats earlier."""
    content = saved(grazing_proof(), tmp_path / "branch.json")
    (free,) = [piece for piece in content["pieces"] if piece["label"] == "1-0"]
    free.update(m=2, label="2-0")
    with pytest.raises(vi.ProofError):
        vi.check_proof(rewritten(retold(content), tmp_path / "branch.json"))


def test_a_motion_with_impacts_is_not_cut_at_a_section():
    """The cut may come after the impact; the time between says nothing of the motion."""
    chain = pytest.importorskip("vibroimpact.proof.chain")
    proof = grazing_proof().certificate
    for legs in ([[0, "frictionless"], [-1, "no_impact"]], [[-1, "no_impact"], [0, "passed"]]):
        posed = {"m": 1, "legs": legs}
        if legs[0][1] == "frictionless":
            with pytest.raises(vi.ProofError, match="impacts"):
                chain.family_of(proof["machine"], proof["place"], posed)
        else:
            chain.family_of(proof["machine"], proof["place"], posed)


@pytest.mark.parametrize("later", [-10, 10])
def test_a_cut_outside_of_its_flight_refutes_nothing(later):
    """Whatever holds at it, such as a gap that is positive there."""
    chain = pytest.importorskip("vibroimpact.proof.chain")
    parts = pytest.importorskip("vibroimpact.proof.parts")
    proof = grazing_proof().certificate
    piece = next(x for x in proof["pieces"] if x["label"] == "1-0")
    assert [regime for _, regime in piece["legs"]] == ["passed", "no_impact"]
    family = chain.family_of(proof["machine"], proof["place"], piece)
    (line, *_), *_ = chain.tube_in(piece["tubes"][0], 7)
    box = list(line[0])
    assert parts.motion(family, box, [flint.arb(-1)])[0] == "disproved"
    box[5] += later
    verdict, why = parts.motion(family, box, [flint.arb(-1)])
    assert (verdict, why) == ("undecided", "a flight may take no time, or is cut outside of it")


def test_motions_that_repeat_are_told_by_their_impacts():
    """With cuts the number of legs says nothing: an impact, a cut, and the same impact again."""
    verifier = pytest.importorskip("vibroimpact.proof.verifier")
    formulas = pytest.importorskip("vibroimpact.proof.formulas")
    start = flint.arb_mat([[0.1], [-0.5], [1], [1], [0]])
    flight = verifier.Flight(start, flint.arb(1), [], flint.arb_mat(0, 0), [])
    for legs, flights in (
        (((0, "frictionless"), (0, "passed"), (0, "frictionless")), [flight] * 3),
        (((0, "passed"),), [flight]),
    ):
        orbit = verifier.Orbit(None, 2, legs)
        with pytest.raises(formulas.Undecided, match="repeat earlier"):
            verifier.show_motion(orbit, flights)


def test_a_flow_changes_with_what_may_be_zero():
    """exp(2 G) of x'' + k x = 0 with k = 1 - s h, where s is any number up to 0.001."""
    tube = pytest.importorskip("vibroimpact.proof.tube")
    arb, series = flint.arb, flint.arb_series
    rows = [[arb(0), arb(1)], [series([-1, arb(0, 1e-3)], 2), arb(0)]]
    _, change = tube.flow(types.SimpleNamespace(rows=rows), arb(2), 2)
    assert change[0, 0].contains(1e-3 * np.sin(2.0))


def rewritten(content, path):
    path.write_text(json.dumps(content))
    return path


def test_a_bifurcation_that_is_not_enclosed_is_listed_with_its_motion():
    from vibroimpact.proof.branch_files import branch_proof_of

    posed = {key: copy.deepcopy(grazing_proof().certificate[key]) for key in POSED}
    proof, _ = branch_proof_of(posed, [("neimark_sacker", 0.335, "1-0")], 0)
    (left,) = proof.uncovered
    assert (left.lo, left.hi, left.label) == (0.335, 0.335, "1-0")
    assert left.why == "neimark_sacker near 0.335, which is not enclosed"


def test_where_a_bifurcation_is_said_to_be_is_not_wider_than_shown(tmp_path):
    """A wide range could hold two of them, and would cover values of which nothing is shown."""
    good = saved(grazing_proof(), tmp_path / "branch.json")
    for low, high in (("0p0", "1p3"), (good["within"][0], None), (None, good["within"][1])):
        content = copy.deepcopy(good)
        row = claims(content)[1][0]
        row[:2] = low or row[0], high or row[1]
        assert is_refused(retold(content), tmp_path / "branch.json")


def test_nothing_is_claimed_twice(tmp_path):
    """Who counts the bifurcations, or the motions at one value, would count them twice."""
    good = saved(grazing_proof(), tmp_path / "branch.json")
    for rows in range(2):
        content = copy.deepcopy(good)
        claims(content)[rows].append(claims(content)[rows][0])
        assert is_refused(retold(content), tmp_path / "branch.json")


def test_a_certificate_that_claims_nothing_is_refused(tmp_path):
    """What is open is told in words that nobody verifies."""
    content = saved(grazing_proof(), tmp_path / "branch.json")
    content["claims"] = {"stretches": [], "bifurcations": []}
    content["pieces"][0]["open"] = [[*content["within"], "open.\nTheorem. It is stable"]]
    assert is_refused(retold(content), tmp_path / "branch.json")


def test_curves_are_counted_by_their_tubes(tmp_path):
    """Though the second one lies outside of the range; they may be one and the same."""
    content = saved(grazing_proof(), tmp_path / "branch.json")
    stable = claims(content)[0][0]
    content["within"] = [stable[0], "5989787504402760p-54"]
    stable[1] = content["within"][1]
    content["claims"] = {"stretches": [stable], "bifurcations": []}
    again = vi.check_proof(rewritten(retold(content), tmp_path / "branch.json"))
    assert "form 2 smooth curves, which may be parts of one, and" in again.statement


def test_what_is_shown_is_not_left_out(tmp_path):
    """Such as unstable motions of a curve, where another one covers their values."""
    good = saved(grazing_proof(), tmp_path / "branch.json")
    for rows in range(2):
        content = copy.deepcopy(good)
        del claims(content)[rows][1]
        assert is_refused(retold(content), tmp_path / "branch.json")


def test_a_graze_is_told_once():
    """Of a solution that becomes a motion, stability beyond its graze being open at first."""
    chain = pytest.importorskip("vibroimpact.proof.chain")
    proof = grazing_proof().certificate
    piece = next(x for x in proof["pieces"] if x["label"] == "1-0")
    tube = {**piece["tubes"][0], "asked": [1]}
    posed = {**piece, "tubes": [tube]}
    (told,) = chain.examine_chain(proof["machine"], proof["place"], posed, proof["precision"])
    assert [x.verdict for x in told[:3]] == ["disproved", "disproved", "proved"]
    assert [x.special for x in told if x.special] == ["grazing"]


def test_all_reasons_why_solutions_are_no_motions_are_told():
    """The nearer of two stops is met first; the other one is met for part of the range alone."""
    chain = pytest.importorskip("vibroimpact.proof.chain")
    files = pytest.importorskip("vibroimpact.proof.files")
    machine = copy.deepcopy(grazing_proof().certificate["machine"])
    stop, text = machine["stops"][0], files.text
    machine["stops"] = [stop, {**stop, "gap": text(0.25)}]
    swing, places = 1.0 / (-3.0 + 0.2j), [0.2485, 0.249, 0.2495, 0.25, 0.2505, 0.26, 0.3, 0.4]
    middle, half = 0.324, 0.076
    line = [[text(swing.real), text((2j * swing).real), "0p0", text(middle)], ["0p0"] * 3]
    line[1].append(text(half))
    cuts = [text((x - middle) / half) for x in places[:-1]] + ["1p0"]
    tube = {"line": line, "radius": [text(2.0**-40)] * 4, "axis": 3, "cuts": cuts, "asked": []}
    posed = {"m": 1, "legs": [[-1, "no_impact"]], "tubes": [tube]}
    (told,) = chain.examine_chain(machine, ["stops", 0, "gap"], posed, 100)
    (*_, last) = chain.summary(told).stretches
    # the swing is 0.3326: beyond, only the other stop is met
    assert abs(swing) < 0.34
    assert last[0] < 0.25
    assert last[1] > 0.39
    assert {x.why for x in told if x.last > 0.2485} == set(last[4].split(" or "))
    assert last[4].startswith("leg 1: stop 0 is met")
    assert "leg 1: stop 1 is met" in last[4]
