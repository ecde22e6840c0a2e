"""Writes the reference data of derivatives: tests/data/sensitivity_reference.json.

    python -m reference.regenerate sensitivity_reference.json --write     (in tests)

Derivatives of runs by every parameter and by the start, as central differences of two runs of the
reference simulator (hybrid.py, 544 bits) that differ by 2 H in one number: their error is that of
the third derivatives times H^2/6, and that of the runs divided by H. At the end of the range of
restitution and friction, 0, they are one-sided differences of fourth order with a larger step, so
that bounces can be told from contact. Inputs are float64, written so that reading the decimal gives
the same bits. Format: tests/data/README.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from flint import arb, ctx, fmpq

from vibroimpact.reference.flight import System, exact
from vibroimpact.reference.hybrid import FINER, Run, follow, sections

NAME = "sensitivity_reference.json"
#: Half the distance of the two numbers, and the digits that are left.
H = fmpq(1, 10**25)
DIGITS = 20
#: Of one-sided differences: the step, and the weights of what lies 0, 1, ... steps ahead, in 1/12.
ASIDE = fmpq(1, 10**7)
WEIGHTS = (-25, 48, -36, 16, -3)
STARTS = ("x1", "v1", "x2", "v2")
#: Parameters that may not be negative: at 0 there is no second run.
POSITIVE = ("mbar", "omega0", "r", "omega", "zeta1", "zeta2", "mu")
PARAMETERS = (*POSITIVE, "delta", "f1", "f2", "c1", "c2")
#: Those of which a motion with contact has a one-sided derivative at 0.
ONE_SIDED = ("r", "mu")
#: What is told of an impact.
IMPACT = ("time", "x1", "v1_pre", "x2", "v2_pre", "v1_post", "v2_post")


@dataclass(frozen=True)
class Scene:
    """A run, and up to which impact it is told."""

    parameters: dict[str, float]
    periods: int = 3
    phase: float = 0.0
    contact: str = "oblique"
    law: str = "poisson"
    initial: tuple[float, float, float, float] = (0.0, 0.5, 0.0, 0.0)
    impacts: int | None = field(default=None)
    one_sided: bool = False

    def numbers(self) -> dict[str, fmpq]:
        """The parameters, the phase and the start, exactly."""
        values = {name: exact(self.parameters.get(name, 0.0)) for name in PARAMETERS}
        start = dict(zip(STARTS, map(exact, self.initial), strict=True))
        return {**values, "phi": exact(self.phase), **start}

    def names(self) -> list[str]:
        """What the run is differentiated by: at the end of its range only if that is asked for."""
        numbers = self.numbers()
        ends = ONE_SIDED if self.one_sided else ()
        inside = [name for name in numbers if name not in POSITIVE or numbers[name] > 0]
        names = [name for name in numbers if name in inside or name in ends]
        return [name for name in names if not (name == "mu" and self.contact == "direct")]

    def run(self, changed: dict[str, fmpq]) -> Run:
        """The run with numbers changed."""
        values = {**self.numbers(), **changed}
        system = System.parse({name: values[name] for name in PARAMETERS}, self.contact)
        start = [values[name] for name in STARTS]
        times: Callable[[], Sequence[arb]] = sections(system, self.periods)
        return follow(system, start, times, phase=values["phi"], settings=FINER, law=self.law)


_PAPER = {"mbar": 0.6, "omega0": 2.0, "r": 0.8, "delta": 0.5, "omega": 1.8, "f1": 1.0}
_DAMPED = {**_PAPER, "zeta1": 0.02, "zeta2": 0.03, "f2": 0.3, "c1": 0.1, "c2": -0.05}
_LOW = {**_DAMPED, "r": 0.3, "f2": 0.8}
_STICKY = {
    **{"mbar": 0.6, "omega0": 2.0, "r": 0.3, "delta": 0.5, "omega": 0.25, "mu": 0.3},
    **{"zeta1": 0.1, "zeta2": 0.1, "f1": 3.0, "f2": 1.5},
}
_WALL = {"mbar": 0.0, "omega0": 1.1, "r": 0.7, "delta": 0.1, "omega": 0.9, "f1": 1.0, "zeta1": 0.05}
SCENES: dict[str, Scene] = {
    "frictionless": Scene(_DAMPED, phase=0.3, periods=4),
    "undamped": Scene(_PAPER),
    "resonance": Scene({**_DAMPED, "zeta1": 0.0, "omega": 2.0}),
    "overdamped": Scene({**_DAMPED, "zeta1": 1.0, "zeta2": 1.7, "delta": 0.1}),
    "slip and reversal": Scene({**_DAMPED, "mu": 0.3}, periods=4),
    "stick": Scene({**_DAMPED, "mu": 1.4, "omega": 1.3, "delta": 0.7, "f1": 2.0}),
    "newton": Scene({**_DAMPED, "mu": 0.8, "omega": 2.2}, law="newton"),
    "energetic": Scene({**_DAMPED, "mu": 0.8, "omega": 2.2}, law="energetic"),
    "direct": Scene(_DAMPED, contact="direct"),
    "moving wall": Scene({**_DAMPED, "mbar": 0.0, "mu": 0.2}),
    "wall at rest": Scene(_WALL, contact="direct", initial=(0.0, 0.5, 0.0, 0.0)),
    "chatter": Scene({**_LOW, "omega": 0.6}, periods=1, impacts=8),
    "chatter with friction": Scene({**_LOW, "omega": 0.5, "mu": 0.4}, periods=1, impacts=8),
    "chatter and stick": Scene(_STICKY, periods=1, impacts=4),
    "plastic": Scene({**_DAMPED, "r": 0.0, "mu": 0.5, "omega": 1.1}),
    "few bounces": Scene({**_LOW, "r": 1e-2, "omega": 0.6}, periods=1, impacts=2),
    "few bounces with friction": Scene(
        {**_LOW, "r": 1e-4, "omega": 0.5, "mu": 0.4}, periods=1, impacts=2
    ),
    "few bounces and stick": Scene({**_STICKY, "r": 1e-6}, periods=1, impacts=1),
    "hardly a bounce": Scene({**_LOW, "r": 1e-9, "omega": 0.6, "mu": 0.2}, periods=1, impacts=1),
    "no bounce": Scene({**_LOW, "r": 0.0, "omega": 0.6}, periods=1, impacts=1, one_sided=True),
    "no bounce and stick": Scene({**_STICKY, "r": 0.0}, periods=1, impacts=1, one_sided=True),
    "no friction": Scene({**_LOW, "omega": 0.5}, periods=1, impacts=1, one_sided=True),
}


def told(run: Run, impacts: int | None) -> tuple[list[arb], list[arb]]:
    """The last of so many impacts, and the last section."""
    hit = run.hits[:impacts][-1]
    names = ("time", "x1", "v1_pre", "x2", "v2_pre", "v1_post", "v2_post")
    return [getattr(hit, name) for name in names], list(run.samples[-1])


def kinds(run: Run, impacts: int | None) -> tuple[list[str], list[str]]:
    """What two runs must have alike to be differentiated."""
    return [hit.regime for hit in run.hits[:impacts]], [phase.event for phase in run.phases]


def steps(scene: Scene, by: str) -> list[tuple[fmpq, fmpq]]:
    """By how much a number is changed, and the weights of what comes of it."""
    if by in ONE_SIDED and scene.numbers()[by] == 0:
        return [(ASIDE * k, fmpq(weight, 12) / ASIDE) for k, weight in enumerate(WEIGHTS)]
    return [(H, 1 / (2 * H)), (-H, -1 / (2 * H))]


def scene_record(name: str) -> dict[str, Any]:
    """One scene of the file."""
    scene = SCENES[name]
    most, numbers = scene.impacts, scene.numbers()
    at_impact: dict[str, list[str]] = {row: [] for row in IMPACT}
    at_section: dict[str, list[str]] = {row: [] for row in STARTS}
    met = scene.run({})
    for by in scene.names():
        runs = [(scene.run({by: numbers[by] + step}), weight) for step, weight in steps(scene, by)]
        # A little restitution or friction gives bounces, and impacts, another name.
        alike = (kinds(run, most) == kinds(met, most) for run, _ in runs)
        if len(runs) == 2 and not all(alike):
            raise ArithmeticError(f"{name} lies on a border in {by}")
        with ctx.workprec(FINER.precision):
            for part, rows in enumerate((at_impact, at_section)):
                terms = [[x * arb(weight) for x in told(run, most)[part]] for run, weight in runs]
                for row, column in zip(rows.values(), zip(*terms, strict=True), strict=True):
                    slope = sum(column, arb(0))
                    small = abs(slope) < arb(10) ** -DIGITS
                    row.append("0" if small else slope.str(DIGITS, radius=False))
    return {
        "params": {key: repr(value) for key, value in scene.parameters.items()},
        "contact": scene.contact,
        "law": scene.law,
        "initial": [repr(float(value)) for value in scene.initial],
        "phase": repr(scene.phase),
        "periods": scene.periods,
        "by": scene.names(),
        "regimes": kinds(met, most)[0],
        "impact": at_impact,
        "section": at_section,
    }
