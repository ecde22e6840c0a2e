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
