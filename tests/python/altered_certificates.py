"""Certificates of proofs that are altered, and whether what they then state is true.

The motion is judged by simulation, which shares nothing with the proof, and the text by reading its
numbers. How far a solution is alone is compared with the box of the problem. Multipliers and
stability that a certificate claims are compared with differences of simulated motions.
"""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np

import vibroimpact as vi
from simulated_certificates import Problem, is_motion, multipliers, number
from vibroimpact.proof.certificate import exact

ROUGHLY = 1e-3
"""How near simulated multipliers are to the stated ones, as a part of the largest coefficient."""

WORDS = {
    "stable": ["unstable", "undecided"],
    "unstable": ["stable", "undecided"],
    "proved": ["disproved", "undecided"],
    "disproved": ["proved"],
    "poisson": ["newton", "energetic", "paper"],
    "newton": ["poisson", "energetic"],
    "energetic": ["poisson", "newton"],
    "oblique": ["direct"],
    "direct": ["oblique"],
    "two bodies": ["structure"],
    "structure": ["two bodies"],
    "frictionless": ["slip +", "reversal_approach -", "slip"],
    "slip +": ["frictionless", "reversal_approach +", "stick_restitution -", "slip -", "passed"],
    "slip -": ["frictionless", "reversal_approach -", "stick_restitution +", "slip +", "slip"],
}
"""Words of a certificate, and others in their places."""


def places(content: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Where in a certificate the single values stand."""
    if isinstance(content, (dict, list)):
        items = content.items() if isinstance(content, dict) else enumerate(content)
        return [place for key, value in items for place in places(value, (*path, key))]
    return [path]


def at(content: Any, path: tuple[Any, ...]) -> Any:
    """What stands at a place."""
    for key in path:
        content = content[key]
    return content


def changed(text: str, random: np.random.Generator) -> str:
    """Another number: its last bits, sign, size, or 0."""
    mantissa, exponent = (int(part) for part in text.split("p"))
    what = random.integers(6)
    if what <= 2:
        by = max(1, abs(mantissa) >> int(random.integers(1, 110)))
        return f"{mantissa + int(random.choice([-1, 1])) * by}p{exponent}"
    if what == 3:
        return f"{-mantissa}p{exponent}"
    if what == 4:
        return f"{mantissa}p{exponent + int(random.choice([-1, 1, 3]))}"
    return "0p0"


def altered(content: Problem, random: np.random.Generator) -> tuple[Problem, str]:
    """A certificate with something changed, and what."""
    made = copy.deepcopy(content)
    what = str(random.choice(["value", "value", "value", "rows", "legs", "claims", "box", "extra"]))
    machine, legs, width = made["machine"], made["legs"], len(made["box"]) // len(made["legs"])
    if what == "rows":
        which = made[("box", "claims")[random.integers(2)]]
        rows = which["box"] if isinstance(which, dict) else which
        i, j = random.integers(len(rows), size=2)
        rows[i], rows[j] = rows[j], rows[i]
    elif what == "legs":
        k, how = int(random.integers(len(legs))), random.integers(5)
        if how == 0:
            made["m"] += 1
        elif how == 1:
            legs[k][0] += 1
        elif how == 2:
            del legs[k]
            del made["box"][k * width : (k + 1) * width]
            del made["claims"]["box"][k * width : (k + 1) * width]
        elif how == 3:  # each impact one place on
            legs.append(legs.pop(0))
        else:  # the same motion twice
            made |= {"m": 2 * made["m"], "legs": 2 * legs, "box": 2 * made["box"]}
            made["claims"]["box"] *= 2
    elif what == "claims":
        discs, how = made["claims"]["discs"], random.integers(4)
        if how == 0:
            made["claims"]["stability"] = str(random.choice(["stable", "unstable", "undecided"]))
        elif discs and how == 1:
            discs.pop(random.integers(len(discs)))
        elif discs and how == 2:
            discs[random.integers(len(discs))][2] = "1p-300"
        else:
            made["claims"]["box"][random.integers(len(made["box"]))][1] = "1p-400"
    elif what == "box":  # moved, wider or narrower, all of it or one number
        places = range(len(made["box"])) if random.random() < 0.5 else [0]
        part, scale = random.uniform(-0.9, 0.9), 2.0 ** int(random.integers(-3, 4))
        for k in places:
            centre, radius = map(exact, made["box"][k])
            wide = radius * round(scale * 8) / 8
            centre += radius * round(part * 1024) / 1024
            made["box"][k] = [dyadic(centre), dyadic(wide)]
    elif what == "extra":
        how = random.integers(3)
        if how == 0 and machine["kind"] == "two bodies":
            machine["numbers"]["drag"] = "1p0"
        elif how == 0:
            machine["damping_ratios"] = ["1p-3"] * len(machine["mass"])
            machine["damping"] = machine.get("damping", machine["stiffness"])
        elif how == 1:
            machine["note"] = "without friction"
        elif machine["kind"] == "structure":
            machine["mass"] = [["0p0" for _ in row] for row in machine["mass"]]
        else:
            machine["numbers"]["omega"] = "0p0"
    else:
        some = places_of_values(made)
        path = some[random.integers(len(some))]
        owner, value = at(made, path[:-1]), at(made, path)
        if isinstance(value, bool):
            owner[path[-1]] = not value
        elif isinstance(value, int):
            owner[path[-1]] = value + int(random.choice([-1, 1, 64]))
        elif isinstance(value, str) and value.lstrip("-")[:1].isdigit() and "p" in value:
            owner[path[-1]] = changed(value, random)
        elif value in WORDS:
            owner[path[-1]] = str(random.choice(WORDS[value]))
        else:
            owner[path[-1]] = str(value)[:-1]
        what = f"value {'/'.join(map(str, path))}: {value} -> {owner[path[-1]]}"[:120]
    return made, what


def places_of_values(content: Problem) -> list[tuple[Any, ...]]:
    """Places, each part of a certificate as often as the others."""
    every = places(content)
    by_part: dict[Any, list[tuple[Any, ...]]] = {}
    for path in every:
        by_part.setdefault(path[:2] if path[0] in ("machine", "claims") else path[0], []).append(
            path
        )
    most = max(map(len, by_part.values()))
    return [path for part in by_part.values() for path in part * max(1, most // len(part))]


def dyadic(fraction: Any) -> str:
    """A dyadic fraction as certificates write it."""
    return f"{int(fraction.p)}p-{int(fraction.q).bit_length() - 1}"


def accepted(content: Problem, path: Path) -> vi.Proof | None:
    """The proof that a file is found to be, None where it is refused."""
    path.write_text(json.dumps(content), encoding="utf-8")
    try:
        return vi.check_proof(path)
    except vi.ProofError:
        return None


def untruth(content: Problem, proof: vi.Proof) -> str:
    """What an accepted certificate states that is not so; "" if all of it holds."""
    assert proof.box is not None
    machine = content["machine"]
    nodes = proof.box.center
    for text in [text for text in flat(machine) if isinstance(text, str) and is_number(text)]:
        value = number(text)
        if exact(text) != exact(dyadic_of(value)):
            return f"{text} is printed as {value!r}, which it is not"
    if machine["kind"] == "two bodies" and len(machine["numbers"]) != 13:
        return "numbers that belong to nothing"
    if {"damping", "damping_ratios"} <= set(machine):
        return "two kinds of damping"
    if "note" in machine:
        return "a note"
    if not _alone(content, proof):
        return "it is not shown to be alone so far about the printed numbers"
    confirmed = is_motion(content, nodes)
    if proof.verdict == "disproved":
        return "there is a motion" if confirmed else ""
    if not confirmed:
        return "simulation finds another motion"
    return _other_multipliers(content, proof)


def _other_multipliers(content: Problem, proof: vi.Proof) -> str:
    """What is wrong with the multipliers and the stability that an accepted certificate claims."""
    assert proof.box is not None
    found = multipliers(content, proof.box.center)
    if proof.multipliers:
        stated = [disc.center for disc in proof.multipliers]
        if len(stated) != len(found):
            return "another number of multipliers"
        # coefficients, since a double multiplier is known to half of the digits
        own, others = np.poly(found), np.poly(stated)
        if np.abs(own - others).max() > ROUGHLY * np.abs(own).max():
            return f"multipliers {stated}, and simulation gives {found.tolist()}"
    largest = np.abs(found).max()
    if proof.stability == "stable" and largest > 1.0 + ROUGHLY * largest:
        return "it is unstable"
    if proof.stability == "unstable" and largest < 1.0 - ROUGHLY:
        return "it is stable"
    return ""


def is_number(text: str) -> bool:
    """Whether a text is an exact number."""
    mantissa, _, exponent = text.partition("p")
    return mantissa.lstrip("-").isdigit() and exponent.lstrip("-").isdigit()


def flat(content: Any) -> list[Any]:
    """All single values."""
    return [at(content, path) for path in places(content)]


def dyadic_of(value: float) -> str:
    """A double as certificates write it."""
    numerator, denominator = value.as_integer_ratio()
    return f"{numerator}p-{denominator.bit_length() - 1}"


def _alone(content: Problem, proof: vi.Proof) -> bool:
    """Whether the ball of uniqueness about the stated numbers lies in the box of the problem."""
    assert proof.box is not None
    for centre, (middle, radius) in zip(proof.box.center.ravel(), content["box"], strict=True):
        away = abs(exact(dyadic_of(float(centre))) - exact(middle))
        if away + exact(dyadic_of(proof.unique_within)) > exact(radius):
            return False
    return True
