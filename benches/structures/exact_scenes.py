"""Makes scenes.json: the scenes with their exact motion, by the simulator in ball arithmetic.

Run as ``python benches/structures/exact_scenes.py`` (some minutes, needs python-flint). Numbers of
the scene with many stops are random, of three digits: twenty masses in a row, each on a spring of
its own and coupled to the next, each with a stop, under forces of any phase.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

SCENES = Path(__file__).parent / "scenes.json"
MASSES, SEED = 20, 2
DIGITS = 25


def two_stops() -> dict[str, Any]:
    """Two masses, of which the first moves between two stops (docs/other-peoples-systems.md)."""
    return {
        "title": "2 masses, 2 stops",
        "mass": [[1.0, 0.0], [0.0, 2.0]],
        "stiffness": [[2.0, -1.0], [-1.0, 1.0]],
        "damping_ratios": [0.02, 0.05],
        "drive_amplitude": [[0.0, 0.0], [1.0, 0.0]],
        "drive_frequency": 1.1,
        "stops": [
            {"normal": [1.0, 0.0], "gap": 0.3, "restitution": 0.8},
            {"normal": [-1.0, 0.0], "gap": 0.3, "restitution": 0.8},
        ],
        "periods": 20,
    }


def many_stops() -> dict[str, Any]:
    """As many masses in a row as stops."""
    random = np.random.default_rng(SEED)

    def draw(low: float, high: float, count: int) -> Any:
        return np.round(random.uniform(low, high, count), 3)

    masses, springs = draw(0.8, 1.2, MASSES), draw(0.4, 0.6, MASSES)
    couplings = draw(0.8, 1.2, MASSES - 1)
    stiffness = np.diag(springs)
    for i, coupling in enumerate(couplings):
        stiffness[i : i + 2, i : i + 2] += coupling * np.array([[1.0, -1.0], [-1.0, 1.0]])
    forces = np.column_stack([draw(-1.0, 1.0, MASSES), draw(-1.0, 1.0, MASSES)])
    gaps = draw(0.3, 0.6, MASSES)
    normals = np.eye(MASSES)
    return {
        "title": f"{MASSES} masses, {MASSES} stops",
        "mass": np.diag(masses).tolist(),
        "stiffness": np.round(stiffness, 3).tolist(),
        "damping_ratios": [0.02] * MASSES,
        "drive_amplitude": forces.tolist(),
        "drive_frequency": 0.9,
        "stops": [
            {"normal": normal.tolist(), "gap": float(gap), "restitution": 0.7}
            for normal, gap in zip(normals, gaps, strict=True)
        ],
        "periods": 5,
    }


def followed(scene: dict[str, Any]) -> dict[str, Any]:
    """Return the scene with its number of impacts and its last state, (q, q')."""
    from vibroimpact.reference.structure import Structure, simulate_structure

    given = {name: scene[name] for name in scene if name not in ("title", "periods")}
    rest = [[0.0] * len(scene["mass"])] * 2
    run = simulate_structure(Structure.parse(given), rest, periods=scene["periods"], precision=256)
    if run.ending != "completed" or run.proved != len(run.story):
        raise RuntimeError(f"{scene['title']}: not an enclosed motion")
    state = [[x.str(DIGITS, radius=False) for x in part] for part in run.states[-1]]
    return {**scene, "impacts": len(run.impacts), "state": state}


def main() -> None:
    """Write the scenes."""
    scenes = {"two": followed(two_stops()), "twenty": followed(many_stops())}
    SCENES.write_text(json.dumps(scenes, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
