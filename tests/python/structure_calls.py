"""Valid calls of structures and their stops, for `valid_calls`: what a `Call` is made of."""

from typing import Any

import numpy as np

import vibroimpact as vi

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
    "damping_ratios": "pair or none",
    "static_load": "pair or none",
    "drive_amplitude": "complex pair or none",
    "drive_frequency": "number >= 0",
    "phase": "number",
    "law": "law",
    "simultaneous": "a word of a list",
}
_MATRICES = {"mass": "object", "stiffness": "object"}


def structure_calls() -> dict[str, tuple[Any, ...]]:
    """Return function, arguments, kinds, and names in refusals, of each call by its name."""
    stop = {"normal": [1.0, 0.0], "gap": 0.5, "restitution": 0.5, "tangent": [0.0, 1.0]}
    structure = {"mass": np.eye(2), "stiffness": np.diag([1.0, 2.0]), "stops": [vi.Stop(**stop)]}
    return {
        "Stop": (vi.Stop, stop, _STOP),
        "Stop.replace": (vi.Stop(**stop).replace, dict(stop), _STOP),
        "Stop.from_dict": (
            vi.Stop.from_dict,
            {"fields": stop},
            {"fields": "object"},
            {"fields": "fields|parameters"},
        ),
        "Structure": (vi.Structure, structure, _STRUCTURE | _MATRICES),
        "Structure.from_modes": (
            vi.Structure.from_modes,
            {"frequencies": [1.0, 2.0], "shapes": np.eye(2), "stops": []},
            _STRUCTURE
            | {
                "frequencies": "ascending pair",
                "shapes": "rows of two",
                "modal_mass": "pair or none",
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
