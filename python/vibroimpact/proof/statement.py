"""What a proof says, in words."""

from __future__ import annotations

from typing import Any

from .result import Proof

#: Impacts, and rows of matrices, that are printed.
_MOST = 4
#: Part of a number that is lost by printing it in 17 digits.
_PRINTED = 1e-16


def statement(proof: Proof) -> str:
    """The theorem, or what is open."""
    if proof.verdict == "undecided":
        return f"Nothing is shown of the {proof.label} motion: {proof.why}."
    given = proof.certificate
    machine = _machine(given["machine"])
    count, periods = len(given["legs"]), given["m"]
    assert proof.box is not None
    if proof.verdict == "disproved":
        return (
            f"Theorem. {machine} Within {_down(proof.unique_within)} of the numbers below, no motion "
            f"repeats after {_some(periods, 'drive period')} with {_some(count, 'impact')} of the "
            f"regimes {_regimes(given)}: {proof.why}.\n{_nodes(proof)}"
        )
    parts = [
        f"Theorem. {machine} It has a motion that repeats after {_some(periods, 'drive period')} "
        f"with {_some(count, 'impact')}, and meets no stop at any other time. "
        f"Regimes: {_regimes(given)}. Just after the impacts its state is\n{_nodes(proof)}",
        f"No other solution with the same order of impacts and regimes lies within "
        f"{_down(proof.unique_within)} of these numbers.",
    ]
    if proof.stability == "stable":
        parts.append("It is asymptotically stable: all multipliers lie inside the unit circle.")
    elif proof.stability == "unstable":
        parts.append("It is unstable: a multiplier lies outside the unit circle.")
    if proof.multipliers:
        widest = max(disc.radius for disc in proof.multipliers)
        listed = ", ".join(_complex(disc.center) for disc in proof.multipliers)
        parts.append(f"Its multipliers are {listed}, each to within {_up(widest + _PRINTED * 100 * max(abs(d.center) for d in proof.multipliers))}.")
    return "\n".join(parts)


def _up(bound: float) -> str:
    """A bound in two digits, rounded up."""
    text = f"{bound:.1e}"
    return text if float(text) >= bound else f"{bound * 1.1:.1e}"


def _down(bound: float) -> str:
    """A distance in two digits, rounded down."""
    text = f"{bound:.1e}"
    return text if float(text) <= bound else f"{bound / 1.1:.1e}"


def _some(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def _complex(number: complex) -> str:
    return f"{number.real:.15g}" if number.imag == 0.0 else f"{number:.15g}"


def _number(text: str) -> str:
    """The shortest decimal of a double, or the double next to an exact number."""
    mantissa, _, exponent = text.partition("p")
    return repr(float(int(mantissa)) * 2.0 ** int(exponent)) if exponent else text


def _machine(given: dict[str, Any]) -> str:
    law = f"{given['law'].capitalize()}'s law of impact" if given["law"] != "energetic" else (
        "the energetic law of impact"
    )
    exact = "(each number is the double that is written so)"
    if given["kind"] == "two bodies":
        numbers = ", ".join(f"{name} = {_number(x)}" for name, x in given["numbers"].items())
        rests = ", the second body a wall at rest" if given["wall_rests"] else ""
        return (
            f"Consider the two bodies of section 1 with {given['contact']} contact and {law}{rests}; "
            f"{numbers} {exact}."
        )
    size, stops = len(given["mass"]), given["stops"]
    told = [f"Consider a structure of {_some(size, 'coordinate')} with {_some(len(stops), 'stop')}"]
    told.append(f"and {law}, driven at omega = {_number(given['drive_frequency'])}")
    if size <= _MOST and len(stops) <= _MOST:
        for name in ("mass", "stiffness", "damping", "damping_ratios", "static_load", "drive_amplitude"):
            if name in given:
                told.append(f"; {name} {_listed(given[name])}")
        for place, stop in enumerate(stops):
            parts = ", ".join(f"{name} {_listed(x)}" for name, x in stop.items())
            told.append(f"; stop {place}: {parts}")
        return " ".join(told).replace(" ;", ";") + f" {exact}."
    return " ".join(told) + "; matrices, loads and stops are those of the certificate."


def _listed(given: Any) -> str:
    if isinstance(given, list):
        return "[" + ", ".join(_listed(one) for one in given) + "]"
    return _number(given)


def _regimes(given: dict[str, Any]) -> str:
    several = given["machine"]["kind"] == "structure" and len(given["machine"]["stops"]) > 1
    names = [
        f"stop {stop} {regime}" if several else regime.replace("_", " in ")
        for stop, regime in given["legs"]
    ]
    if len(set(names)) == 1:
        return names[0] if len(names) == 1 else f"all {names[0]}"
    shown = names[: 3 * _MOST]
    return ", ".join(shown) + ("" if len(shown) == len(names) else ", ...")


def _nodes(proof: Proof) -> str:
    """The numbers of the box, an impact in a line."""
    assert proof.box is not None
    center, radius = proof.box.center, proof.box.radius
    width = center.shape[1]
    n = width // 2
    if proof.certificate["machine"]["kind"] == "two bodies":
        names = ["x1", "x2", "v1", "v2", "t"] if n == 2 else ["x1", "v1", "t"]
    else:
        names = [f"{part}_{i}" for part in "qv" for i in range(n)] + ["t"]
    lines = []
    for row, bound in zip(center[:_MOST], radius[:_MOST], strict=True):
        numbers = ", ".join(f"{name} = {x:.17g}" for name, x in zip(names, row, strict=True))
        lines.append(f"  {numbers}, each to within {_up(float(bound.max() + _PRINTED * abs(row).max()))}")
    if len(center) > _MOST:
        lines.append(f"  and so on, {len(center)} states in all, those of the certificate.")
    return "\n".join(lines)
