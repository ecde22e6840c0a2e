"""The reference data of tests/data as systems and initial states."""

import json
from pathlib import Path
from typing import Any

import vibroimpact as vi
from vibroimpact.system import SYMBOLS

DATA = Path(__file__).parents[1] / "data"


def reference(name: str) -> Any:
    """Return the content of a reference file; tests/data/README.md says how it was made."""
    return json.loads((DATA / name).read_text(encoding="utf-8"))


def scene_system(scene: dict[str, Any]) -> vi.System:
    """Return the system of a reference scene."""
    numbers = {SYMBOLS[symbol]: float(value) for symbol, value in scene["params"].items()}
    return vi.System(phase=float(scene["phase"]), **numbers)


def scene_initial(scene: dict[str, Any]) -> list[float]:
    """Return the initial state of a reference scene."""
    return [float(value) for value in scene["initial"]]


_OF_STOPS = ("normal", "gap", "restitution")
_NOT_FIELDS = {"initial", "periods", "times", "ending", "error", "story", "states"}
_NOT_FIELDS |= {"amplification", "by", "number", "impact", "section"}


def case_structure(case: dict[str, Any]) -> vi.Structure:
    """Return the structure of a reference case of structures."""
    values = {name: value for name, value in case.items() if name not in _NOT_FIELDS}
    stops = [
        vi.Stop(*map(stop.get, _OF_STOPS), **{k: v for k, v in stop.items() if k not in _OF_STOPS})
        for stop in values["stops"]
    ]
    drive = [complex(*pair) for pair in values.pop("drive_amplitude", [])] or None
    return vi.Structure(**(values | {"stops": stops, "drive_amplitude": drive}))
