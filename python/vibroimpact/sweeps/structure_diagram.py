"""Bifurcation diagrams of structures: the long-term motion as one number of a structure varies."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._core import STATUS_NAMES
from ..arguments import count, flag, number, optional_count, positive, reject, threads, vector
from ..errors import Interrupted, StateError
from ..run_parts import read_only
from ..simulation import progress_bar
from ..stop import is_of_stops
from ..structure import Structure
from ..structure_run import StructureRun
from .structure_diagram_results import StructureDiagram

Array = NDArray[np.float64]
_KEPT = 100
# Numbers of a structure that are varied by name, beside those of its stops.
_OWN = ("drive_frequency", "phase")


def structure_diagram(
    system: Structure | Callable[..., Any],
    initial: Any,
    parameter: Mapping[str, Any],
    *,
    starts: Sequence[str],
    periods: int,
    keep: int | None,
    max_events: int | None,
    chatter_tolerance: float,
    section_phase: float,
    workers: int | None,
    progress: bool,
    not_yet: Mapping[str, Any],
) -> StructureDiagram:
    """Run the points of a diagram of structures; arguments as in ``bifurcation_diagram``.

    Raises
    ------
    ParameterError
        If an argument or one of the values is out of range; nothing has run then.
    StateError
        If an initial state does not fit.
    Interrupted
        After Ctrl-C; ``.result`` is the diagram, unreached points having the status ``pending``.
    """
    _refuse(not_yet)
    shown = flag("progress", progress)
    if len(parameter) != 1:
        reject("parameters", ", ".join(parameter) or "none", "exactly one, with its values")
    ((name, given),) = parameter.items()
    if isinstance(system, Structure) and not (name in _OWN or is_of_stops(name)):
        names = f"{', '.join(_OWN)}, gap, restitution, friction, gap_0 ..."
        reject("name of the parameter", name, f"{names}; or a function that makes the structure")
    values = vector(name, given)
    if not len(values):
        reject(name, given, "at least one value")
    structures = _made(system, name, values)
    periods = count("periods", periods, least=1)
    options: dict[str, Any] = {
        "periods": periods,
        "keep": min(_KEPT, periods) if keep is None else count("keep", keep, least=0, most=periods),
        "chatter_tolerance": positive("chatter_tolerance", chatter_tolerance),
        "section_phase": number("section_phase", section_phase),
        "workers": threads(workers),
    }
    cap = optional_count("max_events", max_events, least=1)
    if cap is not None:
        options["max_events"] = cap
    physical = structures[0]._starts(initial).reshape(-1, 2, structures[0].coordinates)
    begun = structures[0]._to_core(physical)
    _check_starts(structures, begun, name, values)
    compiled = [structure._compiled for structure in structures]
    points: list[tuple[int, Any, Any]] = []
    branches = [(start, kind) for kind in starts for start in range(len(begun))]
    stopped = False
    with progress_bar("diagram", len(branches) * len(values), "point", shown) as tell:
        for number_of_branch, (start, kind) in enumerate(branches):
            if stopped:
                points += [(0, None, None)] * len(values)
                continue
            done = _after(number_of_branch * len(values), tell)
            found, stopped = _core.structure_sweep(
                compiled, begun[start], start=kind, progress=done, **options
            )
            points += found
    runs = [
        None if core is None else StructureRun(core, structures[i % len(values)], physical[start])
        for i, ((_, core, _), (start, _)) in enumerate(
            zip(points, [each for each in branches for _ in values], strict=True)
        )
    ]
    diagram = StructureDiagram(
        name=name,
        values=read_only(np.tile(values, len(branches))),
        branch=read_only(np.repeat(np.arange(len(branches)), len(values))),
        status=read_only(np.array([STATUS_NAMES[code] for code, _, _ in points])),
        label=read_only(np.array([_label(report) for _, _, report in points])),
        m=read_only(np.array([(report and report.m) or 0 for _, _, report in points])),
        n=read_only(np.array([_impacts(report) for _, _, report in points])),
        residual=read_only(
            np.array([np.nan if report is None else report.residual for _, _, report in points])
        ),
        runs=tuple(runs),
    )
    if stopped:
        done_points = int(np.count_nonzero(diagram.status != "pending"))
        message = f"interrupted after {done_points} of {len(points)} points"
        raise Interrupted(message, diagram, holds="them")
    return diagram


def made_by(system: Any, parameter: Mapping[str, Any]) -> tuple[Any, bool]:
    """Return a system or what makes it, and whether that is a structure.

    A function has been called for its first value; the one returned does not do so again.
    """
    if isinstance(system, Structure):
        return system, True
    if not callable(system) or len(parameter) != 1:
        return system, False
    ((name, values),) = parameter.items()
    first = next(iter(np.ravel(values).tolist()), None)
    known: dict[Any, Any] = {}

    # It is called once for each value, the first included.
    @functools.wraps(system)
    def once(**value: Any) -> Any:
        return known.pop(value[name]) if value[name] in known else system(**value)

    try:
        known[first] = system(**{name: first})
    except (TypeError, ValueError):  # which is told where all values are looked at
        return system, False
    return once, isinstance(known[first], Structure)


def _refuse(not_yet: Mapping[str, Any]) -> None:
    defaults = {"labels": True, "exponents": False, "refine": 0}
    for name, value in not_yet.items():
        default = defaults.get(name)
        if type(value) is not type(default) or value != default:
            reject(name, value, f"{default}: a diagram of structures has no choice of it so far")


def _made(system: Any, name: str, values: Array) -> list[Structure]:
    if isinstance(system, Structure):
        if system.drive_frequency == 0 and name != "drive_frequency":
            reject("drive_frequency", 0.0, "a number > 0: sections are taken once per drive period")
        return [system.replace(**{name: value}) for value in values.tolist()]
    made = [system(**{name: value}) for value in values.tolist()]
    for value, structure in zip(values.tolist(), made, strict=True):
        if not isinstance(structure, Structure):
            reject(
                "system", structure, f"a function whose result is a Structure, at {name}={value}"
            )
    return made


def _check_starts(structures: list[Structure], begun: Array, name: str, values: Array) -> None:
    for structure, value in zip(structures, values.tolist(), strict=True):
        try:
            _core.simulate(structure._compiled, begun, time=0.0)
        except StateError as error:
            raise StateError(f"at {name}={value}: {error}") from None


def _after(before: int, tell: Callable[[int], object] | None) -> Callable[[int], object] | None:
    return None if tell is None else lambda done: tell(before + done)


def _label(report: Any) -> str:
    return "" if report is None else str(report.label)


def _impacts(report: Any) -> int:
    if report is None or report.n is None:
        return 0
    return int(report.n) if np.isfinite(report.n) else -1
