"""The scenes: structures from rest, with their exact motion (exact_scenes.py makes them)."""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

import vibroimpact as vi

SCENES = Path(__file__).parent / "scenes.json"
Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Scene:
    """A structure that starts from rest, its state after so many periods, its impacts so far."""

    name: str
    title: str
    structure: vi.Structure
    periods: int
    impacts: int
    state: tuple[tuple[str, ...], tuple[str, ...]]

    def end(self, periods: int) -> float:
        """Time after so many drive periods."""
        return periods * math.tau / self.structure.drive_frequency

    def error(self, state: Sequence[Sequence[float]]) -> float:
        """Largest deviation of (q, q') at the end, relative to max(1, |value|)."""
        worst = Decimal(0)
        for part, exact in zip(state, self.state, strict=True):
            for value, text in zip(part, exact, strict=True):
                if not math.isfinite(value):
                    return math.inf
                right = Decimal(text)
                worst = max(worst, abs(Decimal(float(value)) - right) / max(Decimal(1), abs(right)))
        return float(worst)


@dataclass(frozen=True)
class Modal:
    """The same in modal coordinates p: p'' + 2 d p' + w^2 p = Re(f e^(i omega t)).

    Stop j is met where normals[j] . p = gaps[j]; p' changes by -kicks[j] u, u = normals[j] . p'.
    """

    w: Vector
    d: Vector
    f: NDArray[np.complex128]
    omega: float
    shapes: Vector
    normals: Vector
    gaps: Vector
    kicks: Vector

    @classmethod
    def of(cls, structure: vi.Structure) -> "Modal":
        """With the modes that the structure has, exact to rounding."""
        shapes, stops = structure.shapes, structure.stops
        normals = np.array([stop.normal for stop in stops]) @ shapes
        restitutions = np.array([stop.restitution for stop in stops])
        kicks = (1.0 + restitutions)[:, None] * normals / (normals**2).sum(axis=1)[:, None]
        return cls(
            w=np.array(structure.frequencies),
            d=np.array(structure.damping_ratios) * np.array(structure.frequencies),
            f=shapes.T @ np.asarray(structure.drive_amplitude),
            omega=structure.drive_frequency,
            shapes=np.array(shapes),
            normals=normals,
            gaps=np.array([stop.gap for stop in stops]),
            kicks=kicks,
        )


@dataclass(frozen=True)
class Outcome:
    """State (q, q') at the end of a run, and its impacts; why it was given up, if it was."""

    state: Vector
    impacts: int
    ended: str = ""


class Solve(Protocol):
    """Follows a scene over so many drive periods."""

    def __call__(self, periods: int) -> Outcome:
        """Return what came of it."""
        ...


def read_scenes() -> list[Scene]:
    """Return all scenes."""
    entries: dict[str, dict[str, Any]] = json.loads(SCENES.read_text(encoding="utf-8"))
    return [_scene(name, entry) for name, entry in entries.items()]


def _scene(name: str, entry: dict[str, Any]) -> Scene:
    structure = vi.Structure(
        mass=entry["mass"],
        stiffness=entry["stiffness"],
        stops=[vi.Stop(**stop) for stop in entry["stops"]],
        damping_ratios=entry["damping_ratios"],
        drive_amplitude=[complex(*pair) for pair in entry["drive_amplitude"]],
        drive_frequency=entry["drive_frequency"],
    )
    q, v = entry["state"]
    return Scene(name, entry["title"], structure, entry["periods"], entry["impacts"], (q, v))
