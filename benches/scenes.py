"""Motions with high-precision reference states, one or more of each kind, as benchmark problems.

The files hold, per scene, the parameters under their symbols in docs/theory.md section 1, the
initial state (x1, x1', x2, x2'), the impacts and the state at the end of each drive period, as
decimal strings (tests/data/README.md says how they were made). Forcing is cos(omega t + phase).
"""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any

from peers.outcome import Problem
from vibroimpact.system import SYMBOLS

DATA = Path(__file__).parents[1] / "tests" / "data"

# Which scenes show which kind of motion, in words, and the files they stand in. The first of each
# kind stands for it where there is room for one.
KINDS = {
    "periodic": {
        "fig5a": "Fig. 5(a), 1-1",
        "fig6a": "Fig. 6(a), 1-2 after chaos",
        "fig9_1": "Fig. 9(1), 1-3, damped",
        "fig9_4": "Fig. 9(4), 154-77, friction",
    },
    "chaotic": {"fig9_2": "Fig. 9(2), friction"},
    "grazing": {
        "graze_1e-4": "contact 1e-4 deep",
        "graze_1e-8": "contact 1e-8 deep",
        "graze_below_1e-8": "missed by 1e-8",
    },
    "chattering": {
        "fig7c_omega_0.45": "Fig. 7(c), frequency 0.45",
        "restitution_0.95": "restitution 0.95",
    },
    "sustained contact": {"fig7c_omega_0.25": "Fig. 7(c), frequency 0.25"},
    "stick-slip": {
        "friction_stick_slip": "friction 0.3",
        "stick_slip_mu_0.9": "friction 0.9",
    },
}
FIRST = tuple(next(iter(members)) for members in KINDS.values())
FILES = ("paper_scenes.json", "bench_scenes.json", "contact_reference.json")


@dataclass(frozen=True)
class Scene:
    """One motion: the problem, reference states, and when it has impacts.

    ``title`` says in words which one of its kind it is. ``impact_periods`` is the drive period of
    each impact, None where chatter has infinitely many.
    """

    name: str
    kind: str
    title: str
    problem: Problem
    states: tuple[tuple[str, ...], ...]
    impact_periods: tuple[int, ...] | None

    @property
    def periods(self) -> int:
        """Drive periods for which there are reference states."""
        return len(self.states)

    def impacts(self, periods: int) -> int | None:
        """Number of impacts in the first ``periods`` drive periods; None: infinitely many."""
        if self.impact_periods is None:
            return None
        return sum(period < periods for period in self.impact_periods)

    def error(self, periods: int, state: Sequence[float]) -> float:
        """Largest deviation of a component after so many periods, relative to max(1, |value|).

        The difference is taken in decimal arithmetic, so that the reference's digits count.
        Infinite for a state that is not finite.
        """
        worst = Decimal(0)
        for value, text in zip(state, self.states[periods - 1], strict=True):
            if not math.isfinite(value):
                return math.inf
            exact = Decimal(text)
            worst = max(worst, abs(Decimal(value) - exact) / max(Decimal(1), abs(exact)))
        return float(worst)


def read_scenes(names: Sequence[str] = ()) -> list[Scene]:
    """Return the named scenes, by default those of KINDS in its order.

    Raises
    ------
    KeyError
        If there is no scene of that name.
    """
    entries: dict[str, dict[str, Any]] = {}
    for file in FILES:
        entries |= json.loads((DATA / file).read_text(encoding="utf-8"))
    kinds = {name: kind for kind, members in KINDS.items() for name in members}
    return [_scene(name, kinds.get(name, "periodic"), entries[name]) for name in names or kinds]


def _scene(name: str, kind: str, entry: dict[str, Any]) -> Scene:
    x1, v1, x2, v2 = (float(value) for value in entry["initial"])
    numbers = {SYMBOLS[key]: float(text) for key, text in entry["params"].items()}
    impacts = entry.get("impacts")
    return Scene(
        name=name,
        kind=kind,
        title=KINDS.get(kind, {}).get(name, name),
        problem=Problem({**numbers, "phase": float(entry["phase"])}, (x1, v1, x2, v2)),
        states=tuple(tuple(row) for row in entry["stroboscopic"]),
        impact_periods=None if impacts is None else tuple(impact["period"] for impact in impacts),
    )
