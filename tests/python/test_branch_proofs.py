"""Proofs over a range of a parameter: what they cover, enclose and refuse."""

import ast
import copy
import json
from functools import cache

import numpy as np
import pytest

import altered_certificates
import repository
import sizes
import vibroimpact as vi

flint = pytest.importorskip("flint")
walking = pytest.importorskip("vibroimpact.proof.walking")

START = (0, 0.5, 0, 0)
KNOWN = {"mass_ratio": 0.6, "frequency_ratio": 2, "restitution": 0.8, "gap": 0.5}
FOLDER = repository.root() / "python" / "vibroimpact" / "proof"
TRUSTED = ("along", "tube", "parts", "special", "chain")


@cache
def branch(damping: float = 0.0, low: float = 1.5, high: float = 1.9, friction: float = 0.0):
    """The 1-1 motions of the paper's system over the drive's frequency."""
    system = vi.System(
        **KNOWN,
        drive_frequency=1.8,
        moment_amplitude=1,
        damping=(damping, damping),
        friction=friction,
    )
    motion = vi.simulate(system, initial=START, periods=600, keep=100).refine()
    return motion.follow(drive_frequency=(low, high))


@cache
def damped_proof():
    """One that is stable throughout."""
    return vi.prove(branch(0.05, 1.797, 1.803))


@cache
def gap_branch():
    """A branch of a structure over the place of its stop."""
    structure = vi.Structure(
        [[1, 0], [0, 1]],
        [[2, -1], [-1, 2]],
        [vi.Stop([0, 1], 0.3, 0.7)],
        damping_ratios=[0.05, 0.05],
        drive_amplitude=[1, 0],
        drive_frequency=1.3,
    )
    motion = vi.simulate(structure, initial=np.zeros((2, 2)), periods=600, keep=100).refine()
    return motion.follow(gap_0=(0.29, 0.31))


@cache
def gap_proof():
    """Two masses and one stop, over a short range."""
    return vi.prove(gap_branch(), within=(0.29999, 0.30001))


@cache
def neimark_sacker_proof():
    """About a Neimark-Sacker bifurcation of the undamped system."""
    value = branch().bifurcations[6].value
    return vi.prove(branch(), within=(value - 1e-8, value + 1e-8))


@cache
def short_proof():
    """Two tubes at the beginning of a branch of a structure."""
    return vi.prove(gap_branch(), max_tubes=2)


@cache
def turned_proof():
    """About a saddle-node of the undamped system, on both sides."""
    turn = branch().bifurcations[3].value
    return vi.prove(branch(), within=(turn - 1e-9, turn + 1e-8))


@cache
def doubled_proof():
    """About a period doubling of the undamped system."""
    doubling = branch().bifurcations[4].value
    return vi.prove(branch(), within=(doubling - 1e-8, doubling + 1e-8))


@cache
def grazing_proof():
    """An oscillator with one stop, up to where it does not reach it any more."""
    oscillator = vi.Structure(
        [[1]],
        [[1]],
        [vi.Stop([1], 0.3, 0.8)],
        damping_ratios=[0.05],
        drive_amplitude=[1],
        drive_frequency=2.0,
    )
    motion = vi.simulate(oscillator, initial=[[0], [0]], periods=200, keep=50).refine()
    return vi.prove(motion.follow(gap=(0.28, 0.34)), within=(0.332594, 0.3326))


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
    assert found.single
    assert found.hi - found.lo < 1e-12
    assert abs(found.lo - turn) < 1e-9
    ends = [one for one in proof.stretches if abs(one.lo - found.hi) < 1e-14]
    assert {one.stability for one in ends} == {"stable", "unstable"}
    assert {one.verdict for one in ends} == {"proved"}
    assert not proof.uncovered


def test_a_period_doubling_ends_stability():
    doubling = branch().bifurcations[4].value
    proof = doubled_proof()
    found = [one for one in proof.bifurcations if one.lo <= doubling <= one.hi]
    assert [(one.kind, one.single) for one in found] == [("period_doubling", True)]
    assert found[0].hi - found[0].lo < 1e-12
    (before,) = [one for one in proof.stretches if abs(one.hi - found[0].lo) < 1e-14]
    after = [one for one in proof.stretches if abs(one.lo - found[0].hi) < 1e-14]
    assert (before.stability, [one.stability for one in after]) == ("stable", ["unstable"])


def test_a_branch_is_proved_up_to_its_graze():
    """The steady oscillation without a stop just reaches a gap of this size."""
    proof = grazing_proof()
    graze = 1 / np.hypot(1 - 4, 2 * 0.05 * 2.0)
    (found,) = [one for one in proof.bifurcations if one.kind == "grazing"]
    assert found.single
    assert found.hi - found.lo < 1e-14
    assert abs(found.lo - graze) < 1e-12
    motions = [one for one in proof.stretches if one.verdict == "proved"]
    assert max(one.hi for one in motions) == found.lo
    assert {one.why for one in proof.stretches if one.verdict == "disproved"} == {
        "leg 1: the bodies do not approach"
    }


def test_what_cannot_be_enclosed_is_listed():
    """An impact without slip before it, on a branch with friction."""
    found = branch(0.0, 1.5, 1.9, 0.1)
    (border,) = [one.value for one in found.bifurcations if str(one.kind) == "regime_border"]
    proof = vi.prove(found, within=(border - 1e-7, border + 1e-7), max_tubes=2)
    (left,) = [one for one in proof.uncovered if "regime_border" in one.why]
    assert left.lo == left.hi == border


def test_a_neimark_sacker_bifurcation_is_enclosed():
    known, proof = branch().bifurcations[6], neimark_sacker_proof()
    assert str(known.kind) == "neimark_sacker"
    (found,) = proof.bifurcations
    assert (found.kind, found.single) == ("neimark_sacker", True)
    assert found.lo - 1e-12 <= known.value <= found.hi + 1e-12
    assert found.hi - found.lo < 1e-12
    assert [one.stability for one in proof.stretches] == ["stable", "unstable"]
    assert not proof.uncovered


@pytest.mark.skipif(not sizes.THOROUGH, reason="a long branch")
def test_a_border_between_regimes_is_a_zero_of_its_condition():
    """Slip that goes on, and slip that reverses: both sequences are proved up to the border."""
    found = branch(0.0, 1.5, 2.5, 0.1)
    border = next(x.value for x in found.bifurcations if abs(x.value - 2.38089) < 1e-4)
    proof = vi.prove(found, within=(border - 1e-5, border + 1e-5))
    assert [(x.kind, x.single) for x in proof.bifurcations] == [("regime_border", True)] * 2
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


@pytest.mark.skipif(not sizes.THOROUGH, reason="a longer range")
def test_longer_ranges():
    (stretch,) = vi.prove(branch(0.05, 1.75, 1.85)).stretches
    assert (stretch.lo, stretch.hi, stretch.stability) == (1.75, 1.85, "stable")
    proof = vi.prove(branch(0.0, 1.75, 1.85))
    assert [x.kind for x in proof.bifurcations] == ["neimark_sacker"]


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


def test_an_interrupt_in_the_end_loses_nothing(monkeypatch):
    from vibroimpact.proof import branch_files

    whole, asked = branch_files.examine_chain, []

    def examine_chain(*arguments):
        asked.append(arguments)
        if len(asked) == 1:
            raise KeyboardInterrupt
        return whole(*arguments)

    monkeypatch.setattr(branch_files, "examine_chain", examine_chain)
    with pytest.raises(vi.Interrupted) as caught:
        vi.prove(gap_branch(), within=(0.29999, 0.30001))
    assert caught.value.result.stretches == gap_proof().stretches


@pytest.mark.parametrize("within", [(1.0, 2.0), (1.8, 1.8), 1.8, (float("nan"), 1.8)])
def test_bad_ranges_are_refused(within):
    with pytest.raises(vi.ParameterError, match="within"):
        vi.prove(branch(0.05, 1.797, 1.803), within=within)


def test_only_a_branch_has_a_range():
    motion = branch(0.05, 1.797, 1.803).pieces[0].motion(0)
    with pytest.raises(vi.ParameterError, match="within"):
        vi.prove(motion, within=(1.0, 2.0))


# Certificates.


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


@pytest.mark.parametrize("proof", [damped_proof, gap_proof, turned_proof])
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
        lambda x: claims(x)[1][0].__setitem__(3, not claims(x)[1][0][3]),
        lambda x: claims(x)[1][0].__setitem__(1, claims(x)[1][0][0]),
        lambda x: claims(x)[1][0].__setitem__(2, "change_of_stability"),
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
            lambda x: claims(x)[1].append(["1p0", "3p-1", "saddle_node", True, 0]),
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
        piece(content)["tubes"] = [*chain[:2], *chain[-2:]]

    def merged(content):
        """One stable stretch across the bifurcation, which is told no more."""
        rows = content["claims"]["stretches"]
        rows[:] = [
            [rows[0][0], max(rows, key=lambda x: number(x[1]))[1], "proved", "stable", "", 0]
        ]
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
        mantissa, exponent = tube(content, -1)["half"].split("p")
        tube(content, -1)["cuts"].append(f"{3 * int(mantissa)}p{exponent}")

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

    def touching(content):
        """A touch in no flight, and one at a time that is none."""
        tube(content)["touches"] = [[0, 0, "1p0", "0p0"]]

    def none(content):
        tube(content)["cuts"] = []

    def other_legs(content):
        piece(content)["legs"] = [[0, "slip"]]

    def longer(content):
        piece(content)["m"] += 1
        piece(content)["label"] = f"{piece(content)['m']}-1"

    return {
        x.__name__: x for x in list(locals().values()) if callable(x) and x not in (piece, tube)
    }


def number(text):
    return float(flint.arb(altered_certificates.exact(text)))


@pytest.mark.parametrize("what", hostile())
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
    if proof is neimark_sacker_proof:  # half of what is shown is claimed
        content["claims"]["stretches"].pop()
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


# What it rests on.


def lines_of_code(name):
    """Lines of a file without blank ones, comments and docstrings."""
    text = (FOLDER / f"{name}.py").read_text()
    told = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            first = node.body[0]
            if ast.get_docstring(node) is not None:
                told |= set(range(first.lineno, first.end_lineno + 1))
    lines = enumerate(text.splitlines(), 1)
    return sum(bool(x.split("#")[0].strip()) for k, x in lines if k not in told)


def test_what_a_proof_of_a_branch_rests_on_can_be_read():
    assert 300 < sum(map(lines_of_code, TRUSTED)) <= 600


def test_the_verifier_of_branches_uses_nothing_else():
    # Of `near` any matrix is right.
    own = {f".{name}" for name in (*TRUSTED, "formulas", "verifier", "certificate", "near")}
    allowed = own | {".", "..errors", "..system", "flint", "__future__", "typing", "copy"}
    allowed |= {"collections.abc", "contextlib", "dataclasses", "functools", "itertools", "math"}
    for name in TRUSTED:
        for node in ast.walk(ast.parse((FOLDER / f"{name}.py").read_text())):
            if isinstance(node, ast.Import):
                assert {alias.name for alias in node.names} <= allowed
            if isinstance(node, ast.ImportFrom):
                assert "." * node.level + (node.module or "") in allowed
