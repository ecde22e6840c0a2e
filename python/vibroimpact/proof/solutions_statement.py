"""What a proof that motions are all says, in words."""

from __future__ import annotations

from ..showing import counted
from .solutions_result import SolutionsProof
from .statement import PRINTED, machine_sentence, up


def solutions_statement(proof: SolutionsProof) -> str:
    """The theorem, or what is open."""
    if proof.verdict == "undecided":
        return f"It is not shown that these {proof.n}-1 motions are all: {proof.why}."
    low, high = proof.within
    place = "" if proof.everywhere else f" at an x1 in [{low!r}, {high!r}]"
    told = (
        f"exactly {counted(proof.count, 'motion')}{_stabilities(proof)}. Motions that differ by a "
        "whole number of drive periods count as one. At the impact"
        if proof.count
        else "no motion."
    )
    lines = [
        f"Theorem. {machine_sentence(proof.certificate['machine'])} With one impact{place} in "
        f"{counted(proof.n, 'drive period')}, after which it repeats, it has {told}"
    ]
    for one in proof.motions:
        assert one.box is not None
        x1, bound = float(one.box.center[0, 0]), float(one.box.radius[0, 0])
        known = one.stability if one.stability != "undecided" else "stability undecided"
        lines.append(f"  x1 = {x1:.17g} to within {up(bound + PRINTED * abs(x1))}, {known}")
    others = [one for one in proof.proofs if one.verdict == "disproved"]
    if others:
        lines.append("The other solutions of the conditions of periodicity are no motions:")
    for one in others:
        assert one.box is not None
        lines.append(f"  x1 = {float(one.box.center[0, 0]):.17g}: {one.why}")
    return "\n".join(lines)


def _stabilities(proof: SolutionsProof) -> str:
    told = []
    for kind, words in (
        ("stable", "asymptotically stable"),
        ("unstable", "unstable"),
        ("undecided", "of a stability that is not shown"),
    ):
        count = sum(one.stability == kind for one in proof.motions)
        if count:
            told.append(f"{count} {words}")
    return ": " + ", ".join(told) if told else ""
