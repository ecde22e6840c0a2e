"""From what is shown of a branch to a proof."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from flint import arb, ctx

from ..errors import ProofError
from ..system import SYMBOLS
from .branch_result import BranchProof, ProvedBifurcation, ProvedStretch, Unproved
from .certificate import exact
from .chain import Shown, examine_chain, summary
from .files import text
from .formulas import Undecided
from .parts import Slice
from .verifier import CIRCUIT, PASSED

#: Entries of a piece.
_OF_PIECE = {"m", "label", "legs", "tubes", "open"}
#: Ends of a claimed range are so many doubles inside what is found: another version of the
#: arithmetic may round more.
_ROOM = 2
#: Claims of where a bifurcation is are wider than what is found by no more than so many times its
#: width, and so many doubles.
_WIDER = 8
#: The Ctrl-C that ends a proof with what is verified so far.
_PATIENCE = 2
#: How near, as a part of its value, a computed bifurcation is to the one that is enclosed.
_NEAR = 1e-6
_NOTHING = "no tube reaches these values"
#: Numbers of a structure that can be a parameter, and of one of its stops.
_NUMBERS, _OF_STOP = ("drive_frequency", "phase"), ("gap", "restitution", "friction")


def branch_proof_of(
    posed: dict[str, Any], known: Sequence[tuple[str, float, str]], interrupts: int
) -> tuple[BranchProof, int]:
    """The proof that is found; those of the known bifurcations that are not shown are open.

    Ctrl-C is counted: the first one begins a piece anew, the next one ends with what is verified.
    """
    found = list[Shown]()
    for piece in posed["pieces"]:
        told = list[list[Slice]]()
        while interrupts < _PATIENCE:
            told.clear()
            try:
                for some in _examined(posed, piece):
                    told.append(some)
                break
            except KeyboardInterrupt:
                interrupts += 1
        else:
            piece["tubes"] = piece["tubes"][: len(told)]
            piece["open"] = [[*posed["within"], "interrupted before it was verified"]]
        found.append(_summary(told))
    stretches = _stretches(found, posed["within"], _ROOM)
    bifurcations = _bifurcations(found, posed["within"], _ROOM)
    for kind, value, label in known:
        near = _NEAR * abs(value)
        # without a piece nothing of the range is shown, which is said of all of it
        if posed["pieces"] and not any(
            kind == one.kind and one.lo - near <= value <= one.hi + near for one, _ in bifurcations
        ):
            row = [text(value), text(value), f"{kind} near {value:.9g}, which is not enclosed"]
            alike = [piece for piece in posed["pieces"] if piece["label"] == label]
            (alike or posed["pieces"])[0]["open"].append(row)
    claims = {
        "stretches": [
            [text(x.lo), text(x.hi), x.verdict, x.stability, x.why, piece] for x, piece in stretches
        ],
        "bifurcations": [[text(x.lo), text(x.hi), x.kind, piece] for x, piece in bifurcations],
    }
    return _proof_from({**posed, "claims": claims}, found), interrupts


def _examined(posed: Mapping[str, Any], piece: Mapping[str, Any]) -> Iterator[list[Slice]]:
    """What is shown of the tubes of a piece, if it has any."""
    if set(piece) != _OF_PIECE or any(len(row) != 3 for row in piece["open"]):
        raise ProofError("a piece of another kind")
    if piece["tubes"] and piece["label"] != label_of(piece):
        raise ProofError("a label that is another one's")
    if piece["tubes"]:
        machine, place, precision = (posed[name] for name in ("machine", "place", "precision"))
        try:
            yield from examine_chain(machine, place, piece, precision)
        except Undecided as reason:
            raise ProofError(f"nothing is shown: {reason}") from reason


def _found(posed: Mapping[str, Any]) -> list[Shown]:
    """What is shown of each piece."""
    return [_summary(_examined(posed, piece)) for piece in posed["pieces"]]


def _summary(told: Iterable[list[Slice]]) -> Shown:
    """What is shown of the tubes of a piece."""
    slices = [x for some in told for x in some]
    return summary(slices) if slices else Shown()


def _rounded(x: arb, way: float, steps: int = 0) -> float:
    """A double not below (way inf) or above (-inf) an exact number, and so many further on."""
    with ctx.workprec(4096):
        near = float(x.mid())
        there = arb(near) >= x if way > 0 else arb(near) <= x
    for _ in range(steps + (not there)):
        near = float(np.nextafter(near, way))
    return near


def _range(given: Sequence[str]) -> tuple[float, float]:
    low, high = (float(arb(exact(x))) for x in given)
    if not -np.inf < low <= high < np.inf:
        raise ProofError("an empty range, or one without an end")
    return low, high


def _stretches(
    found: Sequence[Shown], within: Sequence[str], room: int
) -> list[tuple[ProvedStretch, int]]:
    """Stretches of all pieces inside a range, each narrower by so many doubles at its ends."""
    (low, high), kept = _range(within), []
    for piece, shown in enumerate(found):
        for begin, end, verdict, steady, why in shown.stretches:
            lo, hi = _rounded(begin, np.inf, room), _rounded(end, -np.inf, room)
            lo, hi = max(low, lo), min(high, hi)
            if lo < hi:
                told = {"verdict": verdict, "stability": steady, "why": why}
                kept.append((ProvedStretch(lo=lo, hi=hi, label="", **told), piece))
    return kept


def _bifurcations(
    found: Sequence[Shown], within: Sequence[str], room: int
) -> list[tuple[ProvedBifurcation, int]]:
    """Those of all pieces that may lie in a range, each wider by so many doubles at its ends."""
    (low, high), kept = _range(within), []
    for piece, shown in enumerate(found):
        for begin, end, kind in shown.events:
            lo, hi = _rounded(begin, -np.inf, room), _rounded(end, np.inf, room)
            if low <= hi and lo <= high:
                kept.append((ProvedBifurcation(kind=kind, lo=lo, hi=hi, label=""), piece))
    return kept


def _proof_from(certificate: dict[str, Any], found: Sequence[Shown]) -> BranchProof:
    """The proof that a certificate is, whose claims are shown."""
    pieces, claims = certificate["pieces"], certificate["claims"]
    labels = [piece["label"] for piece in pieces]
    low, high = _range(certificate["within"])
    stretches, bifurcations = list[ProvedStretch](), list[ProvedBifurcation]()
    left = list[Unproved]()
    for lo, hi, verdict, steady, why, piece in claims["stretches"]:
        first, last = _range([lo, hi])
        told = {"verdict": verdict, "stability": steady, "why": why, "label": labels[piece]}
        stretches.append(ProvedStretch(lo=first, hi=last, **told))
    for lo, hi, kind, piece in claims["bifurcations"]:
        first, last = _range([lo, hi])
        told = {"kind": kind, "label": labels[piece]}
        bifurcations.append(ProvedBifurcation(lo=first, hi=last, **told))
    for label, piece, shown in zip(labels, pieces, found, strict=True):
        for lo, hi, why in sorted([*_open(piece, shown, low, high)]):
            if lo <= high and hi >= low:
                ends = {"lo": max(lo, low), "hi": min(hi, high)}
                left.append(Unproved(label=label, why=why, **ends))
    reach = low
    every = [(x.lo, x.hi) for some in (stretches, bifurcations, left) for x in some]
    for lo, hi in sorted(every):
        if lo > reach:
            left.append(Unproved(lo=reach, hi=lo, label="", why=_NOTHING))
        reach = max(reach, hi)
    if reach < high:
        left.append(Unproved(lo=reach, hi=high, label="", why=_NOTHING))
    return BranchProof(
        verdict="proved" if stretches and not left else "undecided",
        parameter=certificate["parameter"],
        stretches=tuple(stretches),
        bifurcations=tuple(bifurcations),
        uncovered=tuple(left),
        certificate=certificate if stretches else {},
    )


def _open(
    piece: Mapping[str, Any], shown: Shown, low: float, high: float
) -> Iterator[tuple[float, float, str]]:
    """What is left open of a piece: where it ends inside a range, too, if it is a motion there."""
    rows = [(*_range(row[:2]), str(row[2])) for row in piece["open"]]
    yield from rows
    for a, b, why in shown.open:
        yield _rounded(a, -np.inf, _ROOM), _rounded(b, np.inf, _ROOM), why
    for one, sense in zip(shown.ends, (-1, 1), strict=False):
        place = one.first if sense < 0 else one.last
        lo, hi = _rounded(place, -np.inf, _ROOM), _rounded(place, np.inf, _ROOM)
        told = any(a <= hi and lo <= b for a, b, _ in rows)
        if one.verdict == "disproved" or told or hi <= low or lo >= high:
            continue
        ahead = one.rises * sense
        yield low if ahead <= 0 else lo, high if ahead >= 0 else hi, "the tubes end"


def verified_branch(posed: dict[str, Any], claims: Mapping[str, Any]) -> BranchProof:
    """Verify a problem and what is claimed of it anew.

    Raises
    ------
    ProofError, KeyError, TypeError, ValueError : it is damaged, or claims what is not shown
    """
    if posed["parameter"] not in names_of(posed["machine"], posed["place"]):
        raise ProofError("a parameter of another name")
    found = _found(posed)
    proof = _proof_from({**posed, "claims": claims}, found)
    if not proof.stretches:
        raise ProofError("nothing is shown")
    # stretches of some doubles may be lost in rounding
    least = len(_stretches(found, posed["within"], _WIDER))
    every = _bifurcations(found, posed["within"], 0)
    if len(proof.stretches) < least or len(proof.bifurcations) < len(every):
        raise ProofError("it leaves out what is shown")
    # each claim is held against what is left after that of the one before: none is made twice
    shown, there = iter(_stretches(found, posed["within"], 0)), iter(every)
    for one, row in zip(proof.stretches, claims["stretches"], strict=True):
        if not any(_is_part(one, other) and row[5] == place for other, place in shown):
            raise ProofError("it claims more than is shown")
    for event, row in zip(proof.bifurcations, claims["bifurcations"], strict=True):
        if not any(_holds(event, other) and row[3] == place for other, place in there):
            raise ProofError("it claims more than is shown")
    return proof


def _is_part(one: ProvedStretch, shown: ProvedStretch) -> bool:
    same = replace(one, lo=0.0, hi=0.0, label="") == replace(shown, lo=0.0, hi=0.0)
    return same and shown.lo <= one.lo and one.hi <= shown.hi


def _holds(one: ProvedBifurcation, shown: ProvedBifurcation) -> bool:
    width = shown.hi - shown.lo + np.spacing(max(abs(shown.lo), abs(shown.hi)))
    least, most = shown.lo - _WIDER * width, shown.hi + _WIDER * width
    return one.kind == shown.kind and least <= one.lo <= shown.lo and shown.hi <= one.hi <= most


def label_of(piece: Mapping[str, Any]) -> str:
    """The m-n of a piece; where a flight is cut, and the end of one period, are no impacts."""
    passed = (PASSED, CIRCUIT[1])
    return f"{piece['m']}-{sum(regime not in passed for _, regime in piece['legs'])}"


def names_of(machine: Mapping[str, Any], place: Sequence[Any]) -> set[str]:
    """The names of the parameter at a place in a certificate; that of the only stop has two."""
    if machine["kind"] == "two bodies":
        # a wall at rest has no mass and no drive, whatever the value
        fixed = {"mbar", "f2"} if machine["wall_rests"] else set()
        return {SYMBOLS[x] for x in place[:1] if len(place) == 1 and x in set(SYMBOLS) - fixed}
    if len(place) == 1:
        return {x for x in _NUMBERS if x == place[0]}
    if len(place) != 3 or place[0] != "stops" or type(place[1]) is not int:
        return set()
    known = 0 <= place[1] < len(machine["stops"]) and place[2] in _OF_STOP
    alone = {str(place[2])} if len(machine["stops"]) == 1 else set()
    return {f"{place[2]}_{place[1]}"} | alone if known else set()
