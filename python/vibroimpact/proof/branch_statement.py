"""What the proof of a branch says, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..showing import counted
from .branch_result import BranchProof
from .chain import changed
from .statement import VARIES, machine_sentence

#: Stretches and bifurcations that are printed.
_MOST = 20
_KINDS = {
    "saddle_node": "extremum of the parameter (saddle-node)",
    "period_doubling": "point with a multiplier -1 (period doubling)",
    "neimark_sacker": "point with two conjugate multipliers on the unit circle (Neimark-Sacker)",
    "grazing": "point on the border of a flight's conditions (grazing)",
    "regime_border": "point on the border of a regime of an impact",
}


def branch_statement(proof: BranchProof) -> str:
    """The theorem, or what is open."""
    if not proof.stretches:
        reasons = "; ".join(dict.fromkeys(one.why for one in proof.uncovered))
        return f"Nothing is shown of the branch over {proof.parameter}: {reasons}."
    name, claims = proof.parameter, proof.certificate["claims"]
    curves = [k for k, piece in enumerate(proof.certificate["pieces"]) if piece["tubes"]]
    among = "" if len(curves) == 1 else ", which may be parts of one"
    parts = [
        f"Theorem. {machine_sentence(_fixed(proof.certificate))} Let {name} vary. Solutions of the "
        f"conditions of periodicity form {counted(len(curves), 'smooth curve')}{among}, and the "
        "tubes of the certificate hold no other one with the same order of impacts and regimes."
    ]
    for one, row in list(zip(proof.stretches, claims["stretches"], strict=True))[:_MOST]:
        told = {
            "stable": "is a motion, and it is asymptotically stable",
            "unstable": "is a motion, and it is unstable",
            "undecided": "is a motion; whether it is stable is open",
        }[one.stability]
        if one.verdict == "disproved":
            told = f"is no motion: {one.why}"
        parts.append(
            f"For every {name} in [{one.lo!r}, {one.hi!r}] there is exactly one {one.label} "
            f"solution on this part of {_curve(row, curves)}; it {told}."
        )
    for found, row in list(zip(proof.bifurcations, claims["bifurcations"], strict=True))[:_MOST]:
        parts.append(
            f"An arc of {_curve(row, curves)}, of {found.label} solutions, has exactly one "
            f"{_KINDS[found.kind]}; there {name} lies between {found.lo!r} and {found.hi!r}."
        )
    more = max(0, len(proof.stretches) - _MOST) + max(0, len(proof.bifurcations) - _MOST)
    if more:
        parts.append(f"And {more} more, which the certificate lists.")
    return "\n".join(parts)


def _fixed(certificate: Mapping[str, Any]) -> Mapping[str, Any]:
    """The machine, in which the number that varies has no value."""
    machine: Mapping[str, Any] = certificate["machine"]
    of_numbers = [] if machine["kind"] == "structure" else ["numbers"]
    fixed: Mapping[str, Any] = changed(machine, [*of_numbers, *certificate["place"]], VARIES)
    return fixed


def _curve(row: Sequence[Any], curves: Sequence[int]) -> str:
    """Which curve a claim is about."""
    return "the curve" if len(curves) == 1 else f"curve {curves.index(row[-1]) + 1}"
