"""Methods of results that need a solver: the one declared exception to the order of folders.

A result has numbers and imports nothing that computes or draws, but a user writes ``run.refine()``.
Such a method gets its function from this table; the function is imported when it is called for the
first time. The types in the signatures of such methods are in `verb_types`.
`tests/python/test_architecture.py` checks that every entry leads to a function, and that no other
module imports by name.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any, Final, Literal

Verb = Literal[
    "crossing", "curve_problem", "in_si", "motion_of", "read_basins", "refine", "write_basins"
]

VERBS: Final[dict[Verb, str]] = {
    "crossing": "orbits.regions:crossing",
    "curve_problem": "orbits.curve_problem:CurveProblem",
    "in_si": "run_in_si:RunInSI",
    "motion_of": "orbits.verdict:motion_of",
    "read_basins": "sweeps.basins.files:read_basins",
    "refine": "orbits.shooting:refine",
    "write_basins": "sweeps.basins.files:write_basins",
}


def verb(name: Verb) -> Callable[..., Any]:
    """Return the function behind a method of a result."""
    module, _, function = VERBS[name].partition(":")
    found: Callable[..., Any] = getattr(
        importlib.import_module(f".{module}", __package__), function
    )
    return found
