"""One quick valid call of everything about curves of restitution; see `valid_calls`."""

from typing import Any

import vibroimpact as vi

TABLE = vi.RestitutionTable([0.1, 1.0], [0.9, 0.5])
POWER_LAW = vi.RestitutionPowerLaw(0.9, 0.1)


def restitution_calls() -> dict[str, tuple[Any, ...]]:
    """Return the calls by name: function, arguments, kinds, and what refusals call arguments."""
    calls: dict[str, tuple[Any, ...]] = {
        "RestitutionTable": (
            vi.RestitutionTable,
            {"speeds": [0.1, 1.0], "values": [0.9, 0.5]},
            {"speeds": "axis", "values": "axis"},
        ),
        "RestitutionPowerLaw": (
            vi.RestitutionPowerLaw,
            {"r_low": 0.9, "least_speed": 0.1, "exponent": 0.25},
            {"r_low": "part of 1", "least_speed": "number > 0", "exponent": "part of 1"},
        ),
    }
    for curve in (TABLE, POWER_LAW):
        kind = type(curve)
        for name, given, words in (
            ("fields", curve.to_dict(), "fields|parameters"),
            ("text", curve.to_json(), "JSON|fields"),
        ):
            maker = "from_dict" if name == "fields" else "from_json"
            calls[f"{kind.__name__}.{maker}"] = (
                getattr(kind, maker),
                {name: given},
                {name: "object"},
                {name: words},
            )
    return calls
