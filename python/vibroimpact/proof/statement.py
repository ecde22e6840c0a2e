"""What the proof of a motion says, in words."""

from __future__ import annotations

import re
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from ..showing import counted
from .certificate import exact
from .result import Disc, Proof
from .verifier import CIRCUIT

#: Impacts, and rows of matrices, that are printed.
_MOST = 4
#: Part of a number that is lost by printing it in 17 digits, and in 15.
PRINTED, _SHORTER = 1e-16, 1e-14
#: In the place of a number that is none.
VARIES = "varies"
_OF_STRUCTURE = (
    *("mass", "stiffness", "damping", "damping_ratios", "static_load", "drive_amplitude"),
    *("drive_frequency", "phase"),
)
_OF_STOP = ("normal", "tangent", "gap", "restitution", "friction", "amplitude", "phase")


def motion_statement(proof: Proof) -> str:
    """The theorem, or what is open."""
    if proof.verdict == "undecided":
        return f"Nothing is shown of the {proof.label} motion: {proof.why}."
    given, within = proof.certificate, _down(proof.unique_within)
    machine = machine_sentence(given["machine"])
    count = counted(len(given["legs"]), "impact")
    periods = counted(given["m"], "drive period")
    if proof.verdict == "disproved":
        none = (
            f"Within {within} of the numbers below no motion repeats after {periods} with {count}"
        )
        why = (
            f"their conditions have one solution there, and it is none. {_begun(proof.why)}"
            if proof.solved
            else "their conditions have no solution there"
        )
        return f"Theorem. {machine} {none} and regimes {_regimes(given)}: {why}.\n{_nodes(proof)}."
    if given["legs"][0][1] == CIRCUIT[1]:
        parts = [
            f"Theorem. {machine} It has a motion that repeats after {periods} and meets no stop. "
            f"At t = 0 its state is\n{_nodes(proof)}.",
            f"No other motion without impacts lies within {within} of these numbers.",
        ]
    else:
        parts = [
            f"Theorem. {machine} It has a motion that repeats after {periods} with {count}, and "
            f"meets no stop at any other time. Regimes: {_regimes(given)}. Just after the impacts "
            f"its state is\n{_nodes(proof)}.",
            "No other solution with the same order of impacts and regimes lies within "
            f"{within} of these numbers.",
        ]
    if proof.stability == "stable":
        parts.append("It is asymptotically stable: all multipliers lie inside the unit circle.")
    elif proof.stability == "unstable":
        parts.append("It is unstable: a multiplier lies outside the unit circle.")
    if proof.multipliers:
        parts.append(_multipliers(proof))
    return "\n".join(parts)


def _begun(sentence: str) -> str:
    return sentence[:1].upper() + sentence[1:]


def _complex(disc: Disc) -> str:
    center = disc.center
    return f"{center.real if abs(center.imag) <= disc.radius else center:.15g}"


def _multipliers(proof: Proof) -> str:
    largest = max(abs(disc.center) for disc in proof.multipliers)
    # an imaginary part that may be 0 is not printed: twice the radius
    within = 2 * max(disc.radius for disc in proof.multipliers) + _SHORTER * largest
    listed = ", ".join(map(_complex, proof.multipliers))
    return f"Its multipliers are {listed}, each to within {up(within)}."


def up(bound: float) -> str:
    """A bound in two digits, rounded up."""
    text = f"{bound:.1e}"
    return text if float(text) >= bound else f"{bound * 1.1:.1e}"


def _down(bound: float) -> str:
    """A distance in two digits, rounded down."""
    text = f"{bound:.1e}"
    return text if float(text) <= bound else f"{bound / 1.1:.1e}"


def _number(text: str) -> str:
    """The shortest decimal of a double; another number as the certificate has it."""
    if text == VARIES:
        return text
    number = exact(text)
    value = Fraction(int(number.p), int(number.q))
    return repr(float(value)) if Fraction(float(value)) == value else text


def _equation(name: str, text: str) -> str:
    return f"{name} {text}" if text == VARIES else f"{name} = {_number(text)}"


def machine_sentence(given: Mapping[str, Any]) -> str:
    """Which machine a theorem is about."""
    law = "the energetic law" if given["law"] == "energetic" else f"{given['law'].title()}'s law"
    if given["kind"] == "two bodies":
        numbers = ", ".join(_equation(name, x) for name, x in given["numbers"].items())
        rests = ", the second body a wall at rest" if given["wall_rests"] else ""
        return (
            f"Consider vibroimpact's System (its page on theory) with {given['contact']} contact "
            f"and {law} of impact{rests}; {numbers} {_exact(numbers)}."
        )
    size, stops = len(given["mass"]), given["stops"]
    told = (
        f"Consider vibroimpact's Structure (its page on structures) with "
        f"{counted(size, 'coordinate')}, {counted(len(stops), 'stop')} and {law} of impact"
    )
    if max(size, len(stops)) > _MOST:
        return f"{told}; matrices, loads and stops are those of the certificate."
    parts = [f"{name} {_listed(given[name])}" for name in _OF_STRUCTURE if name in given]
    for place, stop in enumerate(stops):
        parts.append(
            f"stop {place}: " + ", ".join(f"{name} {_listed(stop[name])}" for name in _OF_STOP)
        )
    return f"{told}; {'; '.join(parts)} {_exact(str(parts))}."


def _exact(numbers: str) -> str:
    """What is meant by the numbers."""
    also = "; 3p-2 is 3/4" if re.search(r"\dp", numbers) else ""
    return f"(each number is the double that is written so{also})"


def _listed(given: Any) -> str:
    if isinstance(given, list):
        return "[" + ", ".join(_listed(one) for one in given) + "]"
    return _number(given)


def _regimes(given: Mapping[str, Any]) -> str:
    several = given["machine"]["kind"] == "structure" and len(given["machine"]["stops"]) > 1
    names = [
        _in_words(regime) + (f" at stop {stop}" if several else "")
        for stop, regime in given["legs"]
    ]
    if len(set(names)) == 1:
        return names[0] if len(names) == 1 else f"all {names[0]}"
    shown = names[: 3 * _MOST]
    return ", ".join(shown) + ("" if len(shown) == len(names) else ", ...")


def _in_words(regime: str) -> str:
    """A regime; s is the slip velocity before the impact."""
    words = regime.replace("_", " in ")
    return words.replace(" +", " (s > 0)").replace(" -", " (s < 0)")


def _nodes(proof: Proof) -> str:
    """The numbers of the box, an impact in a line."""
    assert proof.box is not None
    center, radius = proof.box.center, proof.box.radius
    n = center.shape[1] // 2
    if proof.certificate["machine"]["kind"] == "two bodies":
        names = ["x1", "x2", "v1", "v2", "t"] if n == 2 else ["x1", "v1", "t"]
    else:
        names = [f"{part}_{i}" for part in "qv" for i in range(n)] + ["t"]
    lines = []
    for row, bound in zip(center[:_MOST], radius[:_MOST], strict=True):
        numbers = ", ".join(f"{name} = {x:.17g}" for name, x in zip(names, row, strict=True))
        within = up(float(bound.max() + PRINTED * abs(row).max()))
        lines.append(f"  {numbers}, each to within {within}")
    if len(center) > _MOST:
        lines.append(f"  and so on, {len(center)} states in all, those of the certificate")
    return "\n".join(lines)
