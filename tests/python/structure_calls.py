"""Valid calls of structures and their stops, for `valid_calls`: what a `Call` is made of."""

from typing import Any

import numpy as np

import vibroimpact as vi
from proof_calls import PROVED
from small_results import folder
from struck import REST, SETTLING, moving_run, orbit, small_diagram

_STOP = {
    "normal": "pair",
    "gap": "number",
    "restitution": "part of 1",
    "friction": "number >= 0",
    "tangent": "pair or none",
    "amplitude": "number",
    "phase": "number",
}
_STRUCTURE = {
    "stops": "stops",
    "damping": "object or none",
    "damping_ratios": "pair, number or none",
    "static_load": "pair or none",
    "drive_amplitude": "complex pair or none",
    "drive_frequency": "number >= 0",
    "phase": "number",
    "law": "law",
    "simultaneous": "a word of a list",
}
_PERIODS = {
    "periods": "whole number",
    "time": "object or none",
    "keep": "whole number or none",
}
_TIME = {"periods": "object or none", "time": "number > 0", "keep": "object or none"}
_RUN = {
    "system": "object",
    "initial": "state of a structure",
    "max_events": "whole number or none",
    "chatter_tolerance": "number > 0",
    "section_phase": "number",
    "progress": "true or false",
    "units": "object or none",
    "workers": "whole number or none",
}
_ONE = _RUN | {"sensitivity": "directions or none"}
_GRID = {
    "periods": "whole number",
    "keep": "whole number or none",
    "labels": "true or false",
    "chunk": "whole number or none",
    "client": "object or none",
    "store": "path or none",
}
_MATRICES = {"mass": "object", "stiffness": "object"}


def _saved_orbit() -> str:
    path = folder() / "saved_orbit.npz"
    orbit().save(path)
    return str(path)


def structure_calls() -> dict[str, tuple[Any, ...]]:
    """Return function, arguments, kinds, and names in refusals, of each call by its name."""
    stop = {"normal": [1.0, 0.0], "gap": 0.5, "restitution": 0.5, "tangent": [0.0, 1.0]}
    four = vi.Structure(
        np.eye(4), np.eye(4), [vi.Stop([1, 0, 0, 0], 1.0, 0.5)], drive_frequency=1.0
    )
    simulated = {"system": four, "initial": np.full((2, 4), 0.25)}
    structure = {"mass": np.eye(2), "stiffness": np.diag([1.0, 2.0]), "stops": [vi.Stop(**stop)]}
    elastic = vi.Structure(np.eye(2), [[2, -1], [-1, 1]], [vi.Stop([0, 1], 1.0, 1.0)])
    steps = {"step": "step or none", "max_step": "step", "max_points": "whole number"}
    return {
        "nonsmooth_mode": (
            vi.nonsmooth_mode,
            {"structure": elastic, "period": (9.5, 10.5), "max_points": 3},
            {
                "structure": "object",
                "period": "range",
                "mode": "whole number",
                "stop": "whole number",
                **steps,
            },
        ),
        "StructureOrbit.trajectory": (orbit().trajectory, {"t": [0.0, 1.0]}, {"t": "times"}),
        "StructureOrbit.save": (orbit().save, {"path": folder() / "orbit.npz"}, {"path": "path"}),
        "StructureOrbit.load": (
            vi.StructureOrbit.load,
            {"path": _saved_orbit()},
            {"path": "path that is missing"},
        ),
        "StructureOrbit.follow": (
            orbit().follow,
            {"both": False, "max_points": 2, "drive_frequency": (1.9, 2.1)},
            {
                **steps,
                "both": "python's true or false",
                "direction": "a word of a list",
                "stop_at": "words of a list",
                "virtual": "python's true or false",
                "drive_frequency": "range",
            },
        ),
        "Stop": (vi.Stop, stop, _STOP),
        "Stop.replace": (vi.Stop(**stop).replace, dict(stop), _STOP),
        "Stop.from_dict": (
            vi.Stop.from_dict,
            {"fields": stop},
            {"fields": "object"},
            {"fields": "fields|parameters"},
        ),
        "Structure": (vi.Structure, structure, _STRUCTURE | _MATRICES),
        "Stop.from_json": (
            vi.Stop.from_json,
            {"text": vi.Stop(**stop).to_json()},
            {"text": "object"},
            {"text": "JSON|fields"},
        ),
        "Structure.from_modes": (
            vi.Structure.from_modes,
            {"frequencies": [1.0, 2.0], "shapes": np.eye(2), "stops": []},
            _STRUCTURE
            | {
                "frequencies": "ascending pair",
                "shapes": "rows of two",
                "modal_mass": "pair, number or none",
            },
        ),
        "Structure.replace": (
            vi.Structure(**structure).replace,
            structure | {"gap": 0.5, "restitution": 0.5, "friction": 0.25},
            _STRUCTURE
            | _MATRICES
            | {name: _STOP[name] for name in ("gap", "restitution")}
            | {"friction": "number >= 0"},
        ),
        "Structure.from_dict": (
            vi.Structure.from_dict,
            {"fields": structure},
            {"fields": "object"},
            {"fields": "fields|parameters"},
        ),
        "Structure.from_json": (
            vi.Structure.from_json,
            {"text": vi.Structure(**structure).to_json()},
            {"text": "object"},
            {"text": "JSON|fields"},
        ),
        "simulate: structure": (vi.simulate, simulated | {"periods": 2}, _ONE | _PERIODS),
        "simulate: structure, time": (vi.simulate, simulated | {"time": 2.0}, _ONE | _TIME),
        "StructureRun.trajectory": (
            moving_run().trajectory,
            {"t": [moving_run().kept_from]},
            {"t": "times", "forces": "true or false"},
        ),
        "StructureRun.integral": (
            vi.simulate(**simulated, periods=2).integral,
            {"rate": lambda times, states: states[:, 1, 0]},
            {"rate": "function"},
        ),
        "StructureRun.bounces": (
            moving_run().bounces,
            {"down_to": 1e-3, "most": 100},
            {"down_to": "number >= 0", "most": "whole number"},
        ),
        "StructureRun.resume": (
            moving_run().resume,
            {"periods": 1, "keep": 1},
            _PERIODS | {"max_events": "whole number or none", "units": "object or none"},
        ),
        "StructureDiagram.to_pandas": (
            small_diagram().to_pandas,
            {"rows": "impact"},
            {"rows": "a word of a list"},
        ),
        "StructureDiagram.run": (small_diagram().run, {"i": 1}, {"i": "index"}),
        "bifurcation_diagram: structure": (
            vi.bifurcation_diagram,
            {"system": SETTLING, "initial": REST[1], "drive_frequency": [2.0], "periods": 20},
            {
                **_RUN,
                **_GRID,
                "initial": "state of a structure",
                "drive_frequency": "axis >= 0",
                "start": "a word of a list",
                "exponents": "true or false",
                "refine": "whole number",
            },
        ),
        "sweep: structure": (
            vi.sweep,
            {"system": SETTLING, "initial": REST[1], "gap_0": [0.3], "periods": 20},
            {**_RUN, **_GRID, "gap_0": "axis", "exponents": "true or false"},
        ),
        "chart: structure": (
            vi.chart,
            {
                "system": SETTLING,
                "initial": REST[1],
                "gap": [0.3],
                "drive_frequency": [2.0],
                "periods": 20,
            },
            {**_RUN, **_GRID, "gap": "axis", "drive_frequency": "axis >= 0"}
            | {"exponents": "true, false or none"},
        ),
        "lyapunov_spectrum: structure": (
            vi.lyapunov_spectrum,
            {"system": SETTLING, "initial": REST[1], "periods": 60, "keep": 40},
            {
                **_RUN,
                "periods": "whole number > 2 or none",
                "keep": "whole number > 2 or none",
                "most": "whole number or none",
                "time": "object or none",
                **dict.fromkeys(("chunk", "client", "store"), "object or none"),
            },
        ),
        "lyapunov_spectrum: structures": (
            vi.lyapunov_spectrum,
            {"system": SETTLING, "initial": REST[1], "periods": 60, "keep": 40, "gap": [0.3]},
            {
                **_RUN,
                "periods": "whole number > 2 or none",
                "keep": "whole number > 2 or none",
                "most": "object or none",
                "time": "object or none",
                **{"chunk": "whole number or none", "client": "object or none"},
                **{"store": "path or none", "gap": "axis"},
            },
        ),
        "search_motions: structure": (
            vi.search_motions,
            {"system": SETTLING, "starts": [REST[1]], "periods": 60},
            {
                "system": "object",
                "starts": "state of a structure",
                "periods": "whole number > 2",
                "seed": "whole number",
                "workers": "whole number or none",
            },
            {"starts": "starts"},
        ),
        "StructureRun.resume: time": (
            moving_run().resume,
            {"time": 1.0},
            _TIME | {"max_events": "whole number or none", "units": "object or none"},
        ),
        "prove: structure": (vi.prove, {"motion": orbit()}, PROVED),
        "verify: structure": (
            vi.verify,
            {
                "run": vi.simulate(vi.Structure(**structure), initial=np.zeros((2, 2)), time=1),
                "max_precision": 512,
            },
            {
                "run": "object",
                "digits": "whole number",
                "max_precision": "whole number > 2",
                "max_events": "whole number",
                "progress": "true or false",
            },
        ),
    }
