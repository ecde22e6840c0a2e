"""The paper's named motions as benchmark problems, with their 25-digit reference states.

The file holds, per scene, the parameters under their symbols in docs/theory.md section 1, the
initial state (x1, x1', x2, x2'), the impacts of the first 25 drive periods and the state at the
end of each of them, all as decimal strings. Forcing is cos(omega t), from t = 0.
"""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

REFERENCE = Path(__file__).parents[2] / "tests" / "data" / "paper_scenes.json"

State = tuple[float, float, float, float]

KEYWORDS = {
    "mbar": "mass_ratio",
    "omega0": "frequency_ratio",
    "r": "restitution",
    "delta": "gap",
    "zeta1": "pendulum_damping",
    "zeta2": "oscillator_damping",
    "f1": "moment_amplitude",
    "f2": "force_amplitude",
    "omega": "drive_frequency",
    "mu": "friction",
}


@dataclass(frozen=True)
class Scene:
    """One motion: parameters by code name, initial state, reference states and impact counts."""

    name: str
    parameters: dict[str, float]
    initial: State
    states: tuple[tuple[str, ...], ...]
    impact_periods: tuple[int, ...]
    amplification: tuple[float, ...]

    @property
    def drive_period(self) -> float:
        """2 pi / omega."""
        return 2.0 * math.pi / self.parameters["drive_frequency"]

    def impacts(self, periods: int) -> int:
        """Number of impacts in the first ``periods`` drive periods."""
        return sum(period < periods for period in self.impact_periods)

    def error(self, periods: int, state: Sequence[float]) -> float:
        """Largest deviation of a component after so many periods, relative to max(1, |value|).

        The difference is taken in decimal arithmetic, so that the reference's digits count.
        """
        worst = Decimal(0)
        for value, text in zip(state, self.states[periods - 1], strict=True):
            if not math.isfinite(value):
                return math.inf
            exact = Decimal(text)
            worst = max(worst, abs(Decimal(value) - exact) / max(Decimal(1), abs(exact)))
        return float(worst)


def read_scenes(path: Path = REFERENCE) -> list[Scene]:
    """Every scene of the reference file, in its order."""
    scenes = []
    for name, entry in json.loads(path.read_text(encoding="utf-8")).items():
        x1, v1, x2, v2 = (float(value) for value in entry["initial"])
        scenes.append(
            Scene(
                name=name,
                parameters={KEYWORDS[key]: float(text) for key, text in entry["params"].items()},
                initial=(x1, v1, x2, v2),
                states=tuple(tuple(row) for row in entry["stroboscopic"]),
                impact_periods=tuple(impact["period"] for impact in entry["impacts"]),
                amplification=tuple(float(text) for text in entry["amplification"]),
            )
        )
    return scenes
