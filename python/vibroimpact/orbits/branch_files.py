"""A branch in a file: its pieces as they are; the motions of its bifurcations are judged anew."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _core, archive
from .._core import Border, Condition, Leg, StopCondition, StopLeg
from ..continuation.names import OwnTest, PathEnd
from ..errors import ParameterError
from ..made import Made
from ..structure import Structure
from ..structure_motion import StructureOrbit
from ..system import System
from .bifurcation import Bifurcation
from .branch import Branch, Piece
from .kinds import BifurcationKind, BranchEnd, Branching, Test
from .machines import motion_of
from .motion import PeriodicMotion
from .structure_piece import StructurePiece

# The kinds of names that tests and ends have, by the name of their class: two of them share words.
_TESTS: Mapping[str, Any] = {
    "Condition": Condition,
    "StopCondition": StopCondition,
    "BifurcationKind": BifurcationKind,
    "OwnTest": OwnTest,
}
_ENDS: Mapping[str, Any] = {
    "PathEnd": PathEnd,
    "BifurcationKind": BifurcationKind,
}


def write_branch(path: str | os.PathLike[str], branch: Branch) -> None:
    """Write a branch to ``path`` (.npz); the file appears complete or not at all.

    Raises
    ------
    ParameterError
        If its parameter is a number of a function that makes the system: no file holds a function.
    """
    if any(isinstance(piece.system, Made) for piece in branch.pieces):
        raise ParameterError(
            f"a branch over {branch.parameter}, a number of a function that makes the system, is "
            "not allowed; allowed: a branch over a parameter of the system: a file holds no "
            "function. Its motions can be saved, and to_pandas() gives its points"
        )
    arrays: dict[str, NDArray[Any]] = {
        "found_numbers": np.array(
            [(each.value, each.test_value, each.motion.error) for each in branch.bifurcations]
        ).reshape(-1, 3)
    }
    for number, piece in enumerate(branch.pieces):
        arrays |= {
            f"piece_{number}_values": piece.values,
            f"piece_{number}_nodes": piece.nodes,
            f"piece_{number}_multipliers": piece.multipliers,
        }
    for number, found in enumerate(branch.bifurcations):
        arrays[f"found_{number}_nodes"] = found.motion.nodes
        if found.other is not None:
            arrays[f"found_{number}_other"] = found.other
    systems: list[Any] = [piece.system for piece in branch.pieces]
    of_structures = any(isinstance(system, Structure) for system in systems)
    metadata = {
        "parameter": branch.parameter,
        "machine": "structure" if of_structures else "system",
        "ends": [_named(end) for end in branch.ends],
        "why_not": list(branch.why_not),
        "pieces": [
            {"system": _fields(piece.system), "legs": _legs(piece.itinerary)}
            for piece in branch.pieces
        ],
        "bifurcations": [
            {
                "kind": str(found.kind),
                "test": _named(found.test),
                "goes_on": [str(leg) for leg in found.goes_on],
                "branching": found.branching and str(found.branching),
                "system": _fields(found.motion.system),
                "legs": _legs(found.motion),
            }
            for found in branch.bifurcations
        ],
    }
    archive.write(path, "branch", metadata, arrays)


def read_branch(path: str | os.PathLike[str]) -> Branch:
    """Read what ``write_branch`` has written.

    Raises
    ------
    ValueError
        If the file is damaged, foreign, or holds something else.
    """
    return archive.read(path, {"branch": branch_from_parts})


def branch_from_parts(metadata: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> Branch:
    """Build a branch from the content of an archive."""
    parameter = metadata["parameter"]
    machine = _MACHINES[metadata.get("machine", "system")]
    pieces = tuple(
        machine.piece(
            system=machine.system(part["system"]),
            parameter=parameter,
            itinerary=machine.itinerary(part["legs"]),
            values=arrays[f"piece_{number}_values"],
            nodes=arrays[f"piece_{number}_nodes"],
            multipliers=arrays[f"piece_{number}_multipliers"],
        )
        for number, part in enumerate(metadata["pieces"])
    )
    bifurcations = tuple(
        Bifurcation(
            kind=BifurcationKind(part["kind"]),
            parameter=parameter,
            value=value,
            motion=machine.motion(
                machine.system(part["system"]),
                machine.itinerary(part["legs"]),
                arrays[f"found_{number}_nodes"],
                error,
            ),
            test=_meant(_TESTS, part["test"]),
            test_value=test_value,
            goes_on=tuple(machine.leg(leg) for leg in part["goes_on"]),
            # Files of earlier versions do not have these two.
            branching=Branching(part["branching"]) if part.get("branching") else None,
            other=arrays.get(f"found_{number}_other"),
        )
        for number, (part, (value, test_value, error)) in enumerate(
            zip(metadata["bifurcations"], arrays["found_numbers"].tolist(), strict=True)
        )
    )
    first, last = (_meant(_ENDS, end) for end in metadata["ends"])
    at_first, at_last = map(str, metadata["why_not"])
    return Branch(
        parameter=parameter,
        pieces=pieces,
        bifurcations=bifurcations,
        ends=(first, last),
        why_not=(at_first, at_last),
    )


def _named(name: Test | BranchEnd) -> list[Any]:
    if isinstance(name, Condition):
        return ["Condition", str(name.border), name.leg]
    if isinstance(name, StopCondition):
        return ["StopCondition", str(name.border), name.leg, name.stop]
    return [type(name).__name__, str(name)]


def _meant(known: Mapping[str, Any], name: list[Any]) -> Any:
    if name[0] in ("Condition", "StopCondition"):
        return known[name[0]](Border(name[1]), *name[2:])
    return known[name[0]](name[1])


def _legs(held: Any) -> dict[str, Any]:
    """Return the parts of an itinerary, or of that of a motion."""
    motion = isinstance(held, PeriodicMotion | StructureOrbit)
    parts = {
        "legs": [str(leg) for leg in held.legs],
        "periods": held.m if motion else held.periods,
        "clocks": list(held.clocks),
    }
    if isinstance(held, PeriodicMotion | _core.Itinerary):
        parts["wall_at_rest"] = held.wall_at_rest
    return parts


class _Machine(NamedTuple):
    """How the parts of a branch of one kind of machine are read."""

    piece: Any
    system: Callable[[Any], Any]
    itinerary: Callable[[dict[str, Any]], Any]
    leg: Callable[[str], Any]
    motion: Callable[[Any, Any, NDArray[Any], float], Any]


def _fields(system: System | Structure) -> Any:
    """Return the fields of a system as JSON has them."""
    return json.loads(system.to_json()) if isinstance(system, Structure) else system.to_dict()


def _itinerary(part: dict[str, Any]) -> _core.Itinerary:
    legs = [Leg.from_text(leg) for leg in part["legs"]]
    return _core.Itinerary(legs, part["periods"], part["clocks"], part["wall_at_rest"])


def _structure_itinerary(part: dict[str, Any]) -> _core.StructureItinerary:
    legs = [StopLeg.from_text(leg) for leg in part["legs"]]
    return _core.StructureItinerary(legs, part["periods"], part["clocks"])


_MACHINES: Mapping[str, _Machine] = {
    "system": _Machine(
        Piece,
        System.from_dict,
        _itinerary,
        Leg.from_text,
        lambda system, legs, nodes, error: motion_of(system, legs, nodes, error=error, whole=True),
    ),
    "structure": _Machine(
        StructurePiece,
        lambda fields: Structure.from_json(json.dumps(fields)),
        _structure_itinerary,
        StopLeg.from_text,
        lambda system, legs, nodes, _: motion_of(system, legs, nodes, whole=True),
    ),
}
