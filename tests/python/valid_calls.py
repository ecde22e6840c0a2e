"""One quick valid call of every public function and method, with the kind of each argument.

They are so small that thousands take seconds: a few drive periods, one or two points, few cells.
The kinds are those of `any_values.TAKES`.
"""

import inspect
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import vibroimpact as vi
from fitting_calls import fitting_calls
from proof_calls import proof_calls
from restitution_calls import restitution_calls
from small_results import START, branch, folder, grid_basins, motion, motions, region, run, saddle
from structure_calls import structure_calls
from systems import PAPER, ROUGH
from vibroimpact._core import PARAMETERS


@dataclass(frozen=True)
class Call:
    """A function, arguments that it takes, and the kind of every argument that it knows."""

    function: Callable[..., Any]
    arguments: dict[str, Any]
    kinds: dict[str, str]
    # What a refusal calls an argument where that is not the argument's own name, as a pattern.
    called: dict[str, str] = field(default_factory=dict)

    def __call__(self, **changes: Any) -> Any:
        """Call it, with some arguments changed."""
        return self.function(**self.arguments | changes)


_SYSTEM = {
    "system": "object",
    "initial": "state",
    "max_events": "whole number or none",
    "chatter_tolerance": "number > 0",
}
_LAST_OF_RUN = {
    "section_phase": "number",
    "progress": "true or false",
    "units": "object or none",
    "workers": "whole number or none",
    "sensitivity": "directions or none",
}
_ENGINE = {
    "progress": "true or false",
    "workers": "whole number or none",
    "chunk": "whole number or none",
    "client": "object or none",
    "store": "path or none",
}
_CELLS = {
    **_SYSTEM,
    **_ENGINE,
    "periods": "whole number",
    "keep": "whole number or none",
    "section_phase": "number",
    "labels": "true or false",
    "exponents": "true or false",
}
_FIELDS = {
    **dict.fromkeys(PARAMETERS, "number >= 0"),
    **dict.fromkeys(("gap", "moment_amplitude", "force_amplitude", "phase"), "number"),
    **dict.fromkeys(("static_moment", "static_force"), "number"),
    "restitution": "part of 1",
    "contact": "a word of a list",
    "law": "law",
}
_STEPS = {
    "step": "step",
    "max_step": "step",
    "max_points": "whole number",
}
_PLANE = {"drive_frequency": (1.7, 1.9), "gap": (0.4, 0.6)}
_RANGES = {"drive_frequency": "range", "gap": "range around 0.5"}
_PHYSICAL = {
    **dict.fromkeys(("pendulum_mass", "oscillator_mass", "length", "stiffness"), "number > 0"),
    **dict.fromkeys(("torsional_stiffness", "torsional_damping", "damping"), "number >= 0"),
}


def _path(name: str) -> Path:
    return folder() / f"{name}.npz"


def _saved(result: Any, **arguments: Any) -> None:
    """Save and look whether it is there; nothing is kept."""
    result.save(**arguments)
    path = Path(os.fsdecode(os.fspath(arguments["path"])))
    assert path.stat().st_size > 0
    path.unlink()


@cache
def calls() -> dict[str, Call]:
    """Return the calls by name; what stands behind a colon tells calls of one function apart."""
    fields = dict.fromkeys(PARAMETERS, 0.25) | {"drive_frequency": 1.8, "gap": 0.5}
    start = {"system": ROUGH, "initial": START}
    two = {"system": PAPER, "n": 1, "within": (0.3, 0.4)}
    grow = {"length": 0.01, "spacing": 0.01, "max_points": 2, "settle": 16}
    few = {"periods": 8, "keep": 8, "scouts": 1, "rounds": 0, "x1": [0.0], "v1": [0.1]}
    measured = start | {"periods": 20, "keep": 20}
    others = structure_calls() | proof_calls() | restitution_calls()
    calls = {
        "System": Call(
            vi.System,
            fields,
            _FIELDS | {"damping": "pair or none", "scales": "object or none"},
            {"damping": ".*damping"},
        ),
        "System: damping": Call(
            vi.System,
            {k: v for k, v in fields.items() if "damping" not in k} | {"damping": (0.1, 0.1)},
            _FIELDS | {"damping": "pair or none", "scales": "object or none"},
            {"damping": ".*damping"},
        ),
        "System.replace": Call(PAPER.replace, dict(fields), _FIELDS),
        "System.from_dict": Call(
            vi.System.from_dict,
            {"fields": PAPER.to_dict()},
            {"fields": "object"},
            {"fields": "fields|parameters"},
        ),
        "System.from_json": Call(
            vi.System.from_json,
            {"text": PAPER.to_json()},
            {"text": "object"},
            {"text": "JSON|fields"},
        ),
        "System.from_physical": Call(
            vi.System.from_physical,
            dict.fromkeys(_PHYSICAL, 0.5) | {"gap": 0.5, "restitution": 0.8, "drive_frequency": 2},
            _PHYSICAL
            | {
                name: kind
                for name, kind in _FIELDS.items()
                if name
                not in (
                    "mass_ratio",
                    "frequency_ratio",
                    "pendulum_damping",
                    "oscillator_damping",
                )
            },
        ),
        **{name: Call(*call) for name, call in others.items()},
        "simulate": Call(
            vi.simulate,
            start | {"periods": 2},
            {
                **_SYSTEM,
                "initial": "state or states",
                "periods": "whole number",
                "time": "object or none",
                "keep": "whole number or none",
                **_LAST_OF_RUN,
            },
        ),
        "simulate: time": Call(
            vi.simulate,
            start | {"time": 2.0, "max_events": 100},
            {
                **_SYSTEM,
                "initial": "state or states",
                "periods": "object or none",
                "time": "number > 0",
                "keep": "object or none",
                **_LAST_OF_RUN,
            },
        ),
        "Run.trajectory": Call(
            run().trajectory, {"t": [0.0, 1.0]}, {"t": "times", "forces": "true or false"}
        ),
        "Sensitivity.trajectory": Call(
            run().sensitivity("gap").trajectory, {"t": [0.0, 1.0]}, {"t": "times"}
        ),
        "gradient": Call(
            vi.gradient,
            start | {"function": lambda run: run.final_state.v1, "names": ["gap"], "periods": 2},
            {
                "function": "function",
                **_SYSTEM,
                "names": "names",
                "periods": "whole number",
                "time": "object or none",
                "keep": "whole number or none",
                "section_phase": "number",
            },
        ),
        "Run.bounces": Call(
            run().bounces,
            {"down_to": 1e-3, "most": 100},
            {"down_to": "number >= 0", "most": "whole number"},
        ),
        "Run.resume": Call(
            run().resume,
            {"periods": 1, "keep": 1},
            {
                "periods": "whole number",
                "time": "object or none",
                "keep": "whole number or none",
                "max_events": "whole number or none",
                "units": "object or none",
            },
        ),
        "Run.resume: time": Call(
            run().resume,
            {"time": 1.0, "max_events": 100},
            {
                "periods": "object or none",
                "time": "number > 0",
                "keep": "object or none",
                "max_events": "whole number or none",
                "units": "object or none",
            },
        ),
        "impact": Call(
            vi.impact,
            {"system": ROUGH, "x1": 0.3, "v1": 1.0, "v2": 0.1, "steps": 3},
            dict.fromkeys(("x1", "v1", "v2"), "numbers")
            | {"system": "object", "steps": "whole number or none"},
        ),
        "impact_regimes": Call(
            vi.impact_regimes,
            {"system": ROUGH, "x1": [0.1], "velocity_ratio": [0.1]},
            {
                "system": "object",
                **dict.fromkeys(("x1", "velocity_ratio"), "axis or none"),
                "steps": "whole number or none",
                "approach_velocity": "number > 0 or none",
            },
        ),
        "impact_agreement": Call(
            vi.impact_agreement,
            {"system": ROUGH, "steps": (2, 3), "cells": 2},
            {"system": "object", "steps": "whole numbers", "cells": "whole number"}
            | {"approach_velocity": "number > 0 or none"},
        ),
        "bifurcation_diagram": Call(
            vi.bifurcation_diagram,
            start | {"periods": 2, "drive_frequency": [1.5]},
            {
                **_CELLS,
                "initial": "state or some states",
                "start": "a word of a list",
                "refine": "whole number",
                "drive_frequency": "axis >= 0",
            },
        ),
        "sweep": Call(
            vi.sweep,
            start | {"periods": 2, "gap": [0.5], "v1": [0.5]},
            _CELLS | {"gap": "axis", "v1": "axis of starts"},
        ),
        "chart": Call(
            vi.chart,
            start | {"periods": 2, "exponents": False, "gap": [0.5], "friction": [0.1]},
            {
                **_CELLS,
                "exponents": "true, false or none",
                "gap": "axis",
                "friction": "axis >= 0",
            },
        ),
        "basins": Call(
            vi.basins,
            {"system": PAPER, **few},
            {
                **_SYSTEM,
                **_ENGINE,
                "periods": "whole number > 2",
                "keep": "whole number > 2 or none",
                "scouts": "whole number",
                "rounds": "whole number",
                "progress": "python's true or false",
                "x1": "axis of starts",
                "v1": "axis of starts",
            },
        ),
        "lyapunov_spectrum": Call(
            vi.lyapunov_spectrum,
            measured,
            {
                **_SYSTEM,
                **_ENGINE,
                "gap": "axis",
                "periods": "whole number > 2 or none",
                "keep": "whole number > 2 or none",
                "time": "object or none",
                "most": "object or none",
                **dict.fromkeys(("chunk", "client", "store"), "object or none"),
            },
        ),
        "lyapunov_spectrum: time": Call(
            vi.lyapunov_spectrum,
            {"system": ROUGH.replace(drive_frequency=0.0), "initial": START, "time": 2.0}
            | {"max_events": 2000},
            {
                **_SYSTEM,
                **_ENGINE,
                **dict.fromkeys(("periods", "keep"), "object or none"),
                "time": "number > 0",
                "most": "object or none",
                **dict.fromkeys(("chunk", "client", "store"), "object or none"),
            },
            {"periods": "time", "keep": "time"},
        ),
        "lyapunov_spectrum: grid": Call(
            vi.lyapunov_spectrum,
            measured | {"gap": [0.5]},
            {
                **_SYSTEM,
                **_ENGINE,
                "periods": "whole number > 2 or none",
                "keep": "whole number > 2 or none",
                "time": "object or none",
                "most": "object or none",
                "gap": "axis",
            },
        ),
        "periodic_motion": Call(
            vi.periodic_motion,
            {"system": PAPER, "initial": START, "periods": 1},
            {"system": "object", "initial": "state", "periods": "whole number"},
        ),
        "periodic_motions": Call(
            vi.periodic_motions,
            two,
            {"system": "object", "n": "whole number", "within": "range or none"},
        ),
        "motion_map": Call(
            vi.motion_map,
            two | {"gap": [0.5], "drive_frequency": [1.8]},
            {
                "system": "object",
                "n": "whole number",
                "within": "range or none",
                "gap": "axis",
                "drive_frequency": "axis >= 0",
            },
        ),
        "MotionMap.at": Call(motions().at, {"gap": 0.5}, {"gap": "grid value"}),
        "MotionMap.motion": Call(motions().motion, {"row": 0}, {"row": "index"}),
        "MotionMap.parameter": Call(
            motions().parameter, {"name": "gap"}, {"name": "a word of a list"}
        ),
        "search_motions": Call(
            vi.search_motions,
            {"system": PAPER, "starts": 2, "periods": 8},
            {
                "system": "object",
                "starts": "states or a number",
                "periods": "whole number > 2",
                "seed": "whole number",
                "workers": "whole number or none",
            },
        ),
        "follow_motion": Call(
            vi.follow_motion,
            {"motion": motion(), "both": False, "max_points": 2, "drive_frequency": (1.75, 1.85)},
            {
                **_STEPS,
                "motion": "object",
                "system": "object or none",
                "both": "python's true or false",
                "direction": "a word of a list",
                "step": "step or none",
                "stop_at": "words of a list",
                "virtual": "python's true or false",
                "drive_frequency": "range",
            },
        ),
        "switch_branch": Call(
            vi.switch_branch,
            {"bifurcation": branch().bifurcations[0], "max_points": 2}
            | {"drive_frequency": (1.50, 1.52)},
            {
                **_STEPS,
                "bifurcation": "object",
                "system": "object or none",
                "both": "python's true or false",
                "direction": "a word of a list",
                "step": "step or none",
                "stop_at": "words of a list",
                "drive_frequency": "range",
            },
        ),
        "bifurcation_curve": Call(
            vi.bifurcation_curve,
            {"bifurcation": branch().bifurcations[0], "max_points": 2}
            | {"drive_frequency": (1.50, 1.52), "gap": (0.4, 0.6)},
            {**_STEPS, **_RANGES, "bifurcation": "object", "system": "object or none"},
        ),
        "stability_region": Call(
            vi.stability_region,
            {"motion": motion(), "max_points": 2, **_PLANE},
            {**_STEPS, **_RANGES, "motion": "object", "system": "object or none"},
        ),
        "unstable_manifold": Call(
            vi.unstable_manifold,
            {"motion": saddle(), **grow},
            {
                "motion": "object",
                **dict.fromkeys(("length", "spacing", "max_angle", "offset"), "number > 0"),
                "section_phase": "phase",
                "max_points": "whole number",
                "settle": "whole number > 2",
            },
        ),
        "StabilityRegion.sheets": Call(
            region().sheets, {"values": [[1.8, 0.5]]}, {"values": "rows of two"}
        ),
        "StabilityRegion.crossings": Call(region().crossings, {"gap": 0.5}, {"gap": "number"}),
        "PeriodicMotion.trajectory": Call(motion().trajectory, {"t": [0.0, 1.0]}, {"t": "times"}),
        "Branch.of_kind": Call(
            branch().of_kind, {"kind": "period_doubling"}, {"kind": "a word of a list"}
        ),
        "Basins.entropy": Call(grid_basins().entropy, {"box": 2}, {"box": "whole number"}),
        "Basins.uncertainty_exponent": Call(
            grid_basins().uncertainty_exponent, {"steps": [1, 2]}, {"steps": "steps or none"}
        ),
        **{name: Call(*call) for name, call in fitting_calls().items()},
        "verify": Call(
            vi.verify,
            {"run": vi.simulate(ROUGH, initial=START, periods=1), "max_precision": 512},
            {
                "run": "object",
                "digits": "whole number",
                "max_precision": "whole number > 2",
                "max_events": "whole number",
                "progress": "true or false",
            },
        ),
        "Branch.at": Call(
            branch().at,
            {"drive_frequency": float(branch().values[1])},
            {"drive_frequency": "value of a branch"},
        ),
        "PeriodicMotion.follow": Call(
            motion().follow,
            {"both": False, "max_points": 2, "drive_frequency": (1.75, 1.85)},
            {
                **_STEPS,
                "both": "python's true or false",
                "direction": "a word of a list",
                "step": "step or none",
                "stop_at": "words of a list",
                "virtual": "python's true or false",
                "drive_frequency": "range",
            },
        ),
        "Diagram.to_pandas": Call(
            vi.Diagram.load(_path("diagram")).to_pandas,
            {"rows": "impact"},
            {"rows": "a word of a list"},
        ),
        "load": Call(vi.load, {"path": _path("run")}, {"path": "path that is missing"}),
    }
    grids = (vi.Sweep, vi.Chart, vi.Diagram, vi.StructureDiagram, vi.LyapunovSweep)
    names = {vi.PeriodicMotion: "motion", vi.LyapunovSpectrum: "spectrum", vi.Branch: "branch"}
    names[vi.StructureRun] = "structure_run"
    for result in (vi.Run, vi.Basins, *grids, *names):
        name = getattr(result, "kind", names.get(result, result.__name__.lower()))
        path = {"path": _path(name)}
        calls[f"{result.__name__}.load"] = Call(result.load, path, {"path": "path that is missing"})
        saved = result.load(**path)
        calls[f"{result.__name__}.save"] = Call(
            saved.save, {"path": folder() / "saved.npz"}, {"path": "path"}
        )
    return calls


def public_callables() -> Iterator[tuple[str, Callable[..., Any]]]:
    """Give every public function of the package, and methods of its classes that take arguments."""
    for name in vi.__all__:
        found = getattr(vi, name)
        if inspect.isfunction(found):
            yield name, found
        if not inspect.isclass(found) or issubclass(found, BaseException | int):
            continue
        curves = (vi.RestitutionTable, vi.RestitutionPowerLaw)
        if found in (vi.System, vi.Stop, vi.Structure, vi.Record, *curves):
            yield name, found
        for method in dir(found):
            function = inspect.getattr_static(found, method)
            function = getattr(function, "__func__", function)
            if method.startswith("_") or not inspect.isfunction(function):
                continue
            own = function.__module__.startswith("vibroimpact")
            if own and len(inspect.signature(function).parameters) > 1:
                yield f"{name}.{method}", function
