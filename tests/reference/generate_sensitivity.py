"""Writes the reference data of derivatives: tests/data/sensitivity_reference.json.

    python -m reference.regenerate sensitivity_reference.json --write     (in tests)

Derivatives of runs by every parameter and by the start, as central differences of two runs of the
reference simulator (hybrid.py, 544 bits) that differ by 2 H in one number: their error is that of
the third derivatives times H^2/6, and of the runs divided by H. Inputs are float64, written so that
reading the decimal gives the same bits. Format: tests/data/README.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from flint import arb, ctx, fmpq

from vibroimpact.reference.flight import System, exact
from vibroimpact.reference.hybrid import FINER, Run, follow, sections

NAME = "sensitivity_reference.json"
#: Half the distance of the two numbers.
H = fmpq(1, 10**25)
#: Digits of the derivatives.
DIGITS = 20
STARTS = ("x1", "v1", "x2", "v2")
PARAMETERS = (
    "mbar",
    "omega0",
    "r",
    "delta",
    "omega",
    "zeta1",
    "zeta2",
    "f1",
    "f2",
    "c1",
    "c2",
    "mu",
)
#: Parameters on the border of their range: derivatives from inside.
ONE_SIDED = {"mbar": 0, "zeta1": 0, "zeta2": 0, "mu": 0, "omega0": 0}


@dataclass(frozen=True)
class Scene:
    """A run that is differentiated."""

    name: str
    parameters: dict[str, float]
    initial: tuple[float, float, float, float] = (0.0, 0.5, 0.0, 0.0)
    phase: float = 0.0
    periods: int = 3
    contact: str = "oblique"
    law: str = "poisson"
    #: Parameters that the run is not differentiated by.
    without: tuple[str, ...] = field(default=())


_PAPER = {"mbar": 0.6, "omega0": 2.0, "r": 0.8, "delta": 0.5, "omega": 1.8, "f1": 1.0}
_DAMPED = {**_PAPER, "zeta1": 0.02, "zeta2": 0.03, "f2": 0.3, "c1": 0.1, "c2": -0.05}
SCENES: list[Scene] = []


def numbers(scene: Scene) -> dict[str, fmpq]:
    """The parameters, the phase and the start, exactly."""
    values = {name: exact(scene.parameters.get(name, 0.0)) for name in PARAMETERS}
    start = dict(zip(STARTS, map(exact, scene.initial), strict=True))
    return {**values, "phi": exact(scene.phase), **start}


def names(scene: Scene) -> list[str]:
    """What the run is differentiated by."""
    border = [name for name, end in ONE_SIDED.items() if scene.parameters.get(name, 0.0) == end]
    border += ["r"] if scene.parameters["r"] in (0.0, 1.0) else []
    border += ["omega"] if scene.parameters["omega"] == 0.0 else []
    without = {*scene.without, *border}
    return [name for name in numbers(scene) if name not in without]


def run_with(scene: Scene, changed: dict[str, fmpq], times: Callable[[System], Any]) -> Run:
    """The run with numbers changed; ``times`` makes its samples."""
    values = {**numbers(scene), **changed}
    system = System.parse({name: values[name] for name in PARAMETERS}, scene.contact)
    start = [values[name] for name in STARTS]
    return follow(system, start, times(system), phase=values["phi"], settings=FINER, law=scene.law)


def table(run: Run) -> list[arb]:
    """The last impact before any chatter, all contact events, and the sections."""
    found: list[arb] = []
    for hit in run.hits:
        found += [hit.time, hit.x1, hit.v1_pre, hit.x2, hit.v2_pre, hit.v1_post, hit.v2_post]
    for phase in run.phases:
        found += [phase.time]
    for sample in run.samples:
        found += sample
    return found


def shape(run: Run) -> tuple[Any, ...]:
    """What must be the same in both runs."""
    return [hit.regime for hit in run.hits], [phase.event for phase in run.phases]


def derivative(scene: Scene, name: str, kept: Callable[[Run], Sequence[arb]]) -> list[arb]:
    """Derivatives of what is kept of a run."""
    at = numbers(scene)[name]
    until = lambda system: sections(system, scene.periods)  # noqa: E731
    ahead, behind = (run_with(scene, {name: at + step}, until) for step in (H, -H))
    if shape(ahead) != shape(behind):
        raise ArithmeticError(f"{scene.name}: on a border in {name}")
    with ctx.workprec(FINER.precision):
        pairs = zip(kept(ahead), kept(behind), strict=True)
        return [(a - b) / arb(2 * H) for a, b in pairs]
