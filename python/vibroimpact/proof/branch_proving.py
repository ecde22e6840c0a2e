"""The search for the certificate of a branch; chain.py judges it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from flint import ctx
from numpy.typing import NDArray

from ..made import MadeStructure, MadeSystem
from ..orbits.branch import Branch, Piece
from ..orbits.kinds import BifurcationKind
from ..restitution import need_constants
from ..system import SYMBOLS, System
from .branch_files import branch_proof_of
from .branch_result import BranchProof
from .certificate import exact
from .chain import family_of
from .files import text
from .formulas import Undecided
from .posing import AnyMotion, legs_of, machine_in_text, nodes_of
from .touching import cut_flights
from .tube import Family
from .walking import walk

Array = NDArray[np.float64]

#: Bits; a branch is looked at in tubes, not in points.
_PRECISION = 96
#: Two points are the same to this part of their size.
_SAME = 1e-6


class Tubes:
    """Counts tubes: at most so many, and shows them."""

    def __init__(self, most: int, bar: Any) -> None:
        self.most, self.bar, self.count = most, bar, 0

    def one(self) -> None:
        """One more."""
        self.count += 1
        if self.bar is not None:
            self.bar.update(1)


def proved_branch(
    branch: Branch, within: tuple[float, float], tubes: Tubes
) -> tuple[BranchProof, bool]:
    """What can be shown of a branch in a range of its parameter; whether Ctrl-C ended it."""
    name, pieces, interrupted = branch.parameter, [], False
    first = branch.pieces[0].motion(0)
    need_constants(first.system, "proofs of branches")
    machine, place = machine_in_text(first), _place(branch)
    known = [
        (str(one.kind), float(one.value), str(one.motion.label))
        for one in branch.bifurcations
        if within[0] <= one.value <= within[1] and one.kind != BifurcationKind.NEUTRAL_SADDLE
    ]
    for parts in _joined(branch, within):
        motion = parts[0].motion(0)
        legs = place if isinstance(place, str) else _legs(parts[0])
        for points in _visits(_points(parts), within):
            posed = _posed(motion)
            pieces.append(posed)
            if isinstance(legs, str):
                posed["open"] = [_open(points, legs)]
                continue
            for some, visited in _cut(machine, place, posed | {"legs": legs}, points):
                if posed["legs"]:
                    posed = _posed(motion)
                    pieces.append(posed)
                posed["legs"] = some
                why = "interrupted" if interrupted else ""
                try:
                    family = family_of(machine, place, posed)
                    values = [value for _, value, label in known if label == posed["label"]]
                    why = why or _walked(family, visited, within, values, posed, tubes)
                except KeyboardInterrupt:
                    why, interrupted = "interrupted", True
                if why:
                    posed["open"] = [_open(_beyond(visited, posed["tubes"]), why)]
    whole = {
        "machine": machine,
        "parameter": name,
        "place": [] if isinstance(place, str) else place,
        "within": [text(x) for x in within],
        "precision": _PRECISION,
        "pieces": pieces,
    }
    proof, interrupts = branch_proof_of(whole, known, int(interrupted))
    return proof, interrupts > 0


def _posed(motion: AnyMotion) -> dict[str, Any]:
    """A piece without tubes."""
    return {"m": motion.m, "label": motion.label, "legs": [], "tubes": [], "open": []}


def _cut(
    machine: dict[str, Any], place: Any, posed: dict[str, Any], points: Array
) -> list[tuple[list[Any], Array]]:
    """Points and their legs: at an end at which a flight touches a stop it is cut there."""
    found, rest, legs = list[tuple[list[Any], Array]](), points, posed["legs"]
    with ctx.workprec(_PRECISION):
        family = family_of(machine, place, posed)
        for sense in (-1, 1):
            cut = cut_flights(family, rest[::sense]) if len(rest) > 1 else None
            if cut is not None:
                found.append((cut[0], cut[1][::sense]))
                kept = len(rest) - len(cut[1]) + 1
                rest = (rest[::sense][:kept])[::sense]
    if len(rest) > 1:
        found.insert(0, (legs, rest))
    return found


def _walked(
    family: Family,
    points: Array,
    within: tuple[float, float],
    events: list[float],
    posed: dict[str, Any],
    tubes: Tubes,
) -> str:
    """Fill a piece with tubes; why it ends before the last point, if it does."""
    with ctx.workprec(_PRECISION):
        try:
            for step in walk(family, points, within, events):
                posed["tubes"].append(step.posed())
                tubes.one()
                if tubes.count >= tubes.most:
                    return f"max_tubes = {tubes.most} is reached"
        except Undecided as reason:
            return str(reason)
    return ""


def _open(points: Array, why: str) -> list[str]:
    """The range of points, and what is said of it."""
    return [text(float(points[:, -1].min())), text(float(points[:, -1].max())), why]


def _beyond(points: Array, tubes: list[dict[str, Any]]) -> Array:
    """The middle of the last tube, and the points ahead of it."""
    if not tubes:
        return points
    middle, ahead = (np.array([float(exact(x)) for x in tubes[-1]["line"][k]]) for k in (0, 1))
    nearest = int(np.argmin(np.linalg.norm(points - middle, axis=1)))
    behind = (points[nearest] - middle) @ ahead < 0.0
    rest: Array = np.vstack([middle, points[nearest + int(behind) :]])
    return rest


def _place(branch: Branch) -> list[Any] | str:
    """Where the parameter stands in a certificate, or why there is no proof over it."""
    system, name = branch.pieces[0].system, branch.parameter
    if isinstance(system, MadeSystem | MadeStructure) and name in system._numbers:
        return f"a function makes the system of {name}: branches over such a number are not proved"
    if isinstance(system, System):
        return [next(symbol for symbol, known in SYMBOLS.items() if known == name)]
    if match := re.fullmatch(r"(gap|restitution|friction)(?:_(\d+))?", name):
        if match[2] is None and len(system.stops) != 1:
            return f"{name} is a number of several stops: branches over such are not proved"
        return ["stops", int(match[2] or 0), match[1]]
    if name in ("drive_frequency", "phase"):
        return [name]
    return f"branches over {name} are not proved"


def _joined(branch: Branch, within: tuple[float, float]) -> list[list[Piece]]:
    """Pieces in a range; those of one sequence of legs that go on from one to the next together."""
    groups: list[list[Piece]] = []
    low, high = within
    for piece in branch.pieces:
        if len(piece.values) < 2:
            continue
        # near a saddle-node the branch goes beyond its points
        beyond = np.abs(np.diff(piece.values)).max()
        if piece.values.min() - beyond > high or piece.values.max() + beyond < low:
            continue
        before = groups[-1][-1] if groups else None
        if before is not None and _goes_on(before, piece):
            groups[-1].append(piece)
        else:
            groups.append([piece])
    return groups


def _goes_on(before: Piece, piece: Piece) -> bool:
    if before.nodes.shape[1:] != piece.nodes.shape[1:] or before.values[-1] != piece.values[0]:
        return False
    if before.itinerary.legs != piece.itinerary.legs or _legs(before) != _legs(piece):
        return False
    last, first = before.nodes[-1], piece.nodes[0]
    return bool(np.abs(last - first).max() <= _SAME * np.abs(first).max())


def _legs(piece: Piece) -> list[list[Any]] | str:
    """The legs of a piece; at its ends there may be no direction of slip."""
    return legs_of(piece.motion(len(piece.values) // 2), free=True)


def _points(parts: Sequence[Piece]) -> Array:
    """Nodes and values along pieces; their times do not jump where they pass a drive period."""
    rows: list[Array] = []
    for part in parts:
        for k, value in enumerate(part.values.tolist()):
            motion = part.motion(k)
            nodes = nodes_of(motion)
            if rows:
                period = motion.system.drive_period
                last = rows[-1][nodes.shape[1] - 1]
                nodes[:, -1] += period * round((last - nodes[0, -1]) / period)
            rows.append(np.array([*nodes.ravel(), value]))
    return np.array(rows)


def _visits(points: Array, within: tuple[float, float]) -> list[Array]:
    """Points from just before a range to just after it, for each time that they pass it."""
    low, high = within
    moved = np.abs(np.diff(points, axis=0)).max(axis=1) > 0.0  # the same point is told once
    points = points[np.concatenate([[True], moved])]
    values = points[:, -1]
    least, most = np.minimum(values[1:], values[:-1]), np.maximum(values[1:], values[:-1])
    # near a saddle-node the branch goes beyond both points
    rises = np.sign(np.diff(values))
    for turn in np.flatnonzero(rises[1:] != rises[:-1]) + 1:
        more = np.abs(np.diff(values[turn - 1 : turn + 2])).max()
        least[turn - 1 : turn + 1] -= more
        most[turn - 1 : turn + 1] += more
    steps = np.flatnonzero((least <= high) & (most >= low))
    runs = np.split(steps, np.flatnonzero(np.diff(steps) > 1) + 1)
    return [points[run[0] : run[-1] + 2] for run in runs if len(run)]
