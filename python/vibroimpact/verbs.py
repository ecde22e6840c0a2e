"""Methods of results that solve or draw: the one declared exception to the order of folders.

A result has numbers and imports nothing that computes or draws, but a user writes ``run.refine()``
and ``run.plot()``.
Such a method gets its function from this table; the function is imported when it is called for the
first time. The types in the signatures of such methods are in `verb_types`.
`tests/python/test_architecture.py` checks that every entry leads to a function, and that no other
module imports by name.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from functools import cache
from typing import Any, Final, Literal

Verb = Literal[
    "animate",
    "crossing",
    "curve_problem",
    "draw",
    "earlier_images",
    "follow_motion",
    "html",
    "image_places",
    "in_si",
    "motion_at",
    "motion_names",
    "motion_of",
    "motions_at",
    "own_image",
    "proof_statement",
    "read_basins",
    "read_branch",
    "read_motion",
    "refine",
    "refine_structure",
    "run",
    "run_of_cell",
    "run_of_point",
    "run_of_start",
    "sensitivity",
    "simulate",
    "structure_run",
    "write_basins",
    "write_branch",
    "write_motion",
    "write_proof",
]

VERBS: Final[dict[Verb, str]] = {
    "animate": "plot.animation:animate",
    "crossing": "orbits.regions:crossing",
    "curve_problem": "orbits.curve_problem:CurveProblem",
    "draw": "plot.obvious:draw",
    "earlier_images": "orbits.mirror:earlier_images",
    "follow_motion": "orbits.branches:follow_motion",
    "html": "plot.notebook:html",
    "image_places": "orbits.mirror:image_places",
    "in_si": "run_in_si:RunInSI",
    "motion_at": "single_impact.motions:motion_at",
    "motion_names": "orbits.mirror:motion_names",
    "motion_of": "orbits.machines:motion_of",
    "motions_at": "orbits.points:motions_at",
    "own_image": "orbits.mirror:own_image",
    "proof_statement": "proof.kinds:statement",
    "read_basins": "sweeps.basins.files:read_basins",
    "read_branch": "orbits.branch_files:read_branch",
    "read_motion": "orbits.files:read_motion",
    "refine": "orbits.shooting:refine",
    "refine_structure": "orbits.structure:refine_structure",
    "run": "run:Run",
    "run_of_cell": "sweeps.cell_runs:run_of_cell",
    "run_of_point": "sweeps.cell_runs:run_of_point",
    "run_of_start": "sweeps.basins.cell_runs:run_of_start",
    "sensitivity": "sensitivity:told",
    "simulate": "simulation:simulate",
    "structure_run": "structure_run:StructureRun",
    "write_basins": "sweeps.basins.files:write_basins",
    "write_branch": "orbits.branch_files:write_branch",
    "write_motion": "orbits.files:write_motion",
    "write_proof": "proof.kinds:write_proof",
}


@cache
def verb(name: Verb) -> Callable[..., Any]:
    """Return the function behind a method of a result."""
    module, _, function = VERBS[name].partition(":")
    found: Callable[..., Any] = getattr(
        importlib.import_module(f".{module}", __package__), function
    )
    return found
