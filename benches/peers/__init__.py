"""Other ways to compute the same motions, each written as its makers would write it to be fast.

A peer is a module with NAME, SETTING (what it is), LACKS (what it does not compute), TOLERANCES
that make sense for it, missing() (why it cannot run here, or an empty text) and prepare(problem,
tolerance), which compiles what there is to compile and returns what solves the problem
(outcome.Solve); only the latter is timed. All have the corrected impact law (law.py).
"""

from types import ModuleType

from . import cvode_events, heyoka_batch, heyoka_events, numba_flights, scipy_events

PEERS: tuple[ModuleType, ...] = (
    heyoka_batch,
    heyoka_events,
    numba_flights,
    cvode_events,
    scipy_events,
)
