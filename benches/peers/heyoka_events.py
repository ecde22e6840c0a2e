"""heyoka.py: Taylor integration with the gap as a terminal event, whose callback is the impact.

The drive is a pair of states (cos, sin), so that the equations of motion are linear: a tenth faster
here than cos(omega t) of heyoka's time. Everything but the frequency is compiled into the
integrator. The callback is one call of the impact law as machine code on the integrator's own
array (Numba, where it is installed) and asks the integration to go on, so that a run is two calls.
Event detection, and the cooldown after an impact, are heyoka's own. The options are those that
were fastest: ``fast_math`` takes off a quarter and costs no digit here.
"""

import importlib
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from .law import walk
from .outcome import Outcome, Problem, Solve, most_impacts, one_by_one, penetration

NAME = "heyoka.py"
SETTING = "terminal event, compiled impact law"
LACKS = "chatter; sustained contact"
FASTEST = {"fast_math": True, "compact_mode": False, "high_accuracy": False}
# The last is heyoka's default; 1e-12 has the same error here, since steps are short for the event's
# sake, and is faster.
TOLERANCES = (1e-6, 1e-8, 1e-10, 1e-12, 1e-14, 2.0**-52)


def missing() -> str:
    """Why this peer cannot run here; empty if it can."""
    try:
        importlib.import_module("heyoka")
    except ImportError:
        return "not installed"
    return ""


def equations(problem: Problem) -> tuple[list[Any], Any]:
    """Equations of motion and the gap; the drive frequency is the parameter 0."""
    hy = importlib.import_module("heyoka")
    p = problem.parameters
    x1, v1, x2, v2, c, s = hy.make_vars("x1", "v1", "x2", "v2", "c", "s")
    omega0, omega = p["frequency_ratio"], hy.par[0]
    first, second = -(omega0**2) * x1, -x2
    # Terms that are absent cost nothing.
    if p["pendulum_damping"]:
        first -= 2.0 * p["pendulum_damping"] * omega0 * v1
    if p["oscillator_damping"]:
        second -= 2.0 * p["oscillator_damping"] * v2
    if p["moment_amplitude"]:
        first += p["moment_amplitude"] * c
    if p["force_amplitude"]:
        second += p["force_amplitude"] * c
    motion = [(x1, v1), (v1, first), (x2, v2), (v2, second), (c, -omega * s), (s, omega * c)]
    return motion, hy.sin(x1) - x2 - p["gap"]


def compiled_impact(problem: Problem) -> Callable[..., bool]:
    """Return the impact on a state's array, in place; True if the bodies approach.

    ``record`` has room for (x1, v1, v2, phase).
    """
    p = problem.parameters
    mbar, r, mu = (p[name] for name in ("mass_ratio", "restitution", "friction"))
    law: Callable[..., Any] = walk
    wrap: Callable[[Any], Any] = _same
    try:
        numba = importlib.import_module("numba")
    except ImportError:
        pass
    else:
        wrap, law = numba.njit, numba.njit(walk)

    @wrap
    def impact(y: Any, record: Any) -> bool:
        x1, v1, v2 = y[0], y[1], y[3]
        cos = math.cos(x1)
        if v1 * cos - v2 <= 0.0:
            return False
        record[0], record[1], record[2], record[3] = x1, v1, v2, math.atan2(y[5], y[4])
        y[1], y[3] = law(mbar, r, mu, cos, math.sin(x1), v1, v2)
        return True

    example = np.array([0.5, 1.0, 0.0, 0.0, 1.0, 0.0])
    impact(example, np.empty(4))
    return impact  # type: ignore[no-any-return]


def prepare(problem: Problem, tolerance: float = 1e-12) -> Solve:
    """Return what solves the problem at given drive frequencies."""
    hy = importlib.import_module("heyoka")
    motion, gap = equations(problem)
    impact = compiled_impact(problem)
    counts = [0, 0]
    limit = [0]
    section = np.empty((1, 4))

    def strike(ta: Any, _direction: int) -> bool:
        if impact(ta.state, section[counts[0]]):
            counts[0] += 1
        else:
            counts[1] += 1
        return counts[0] + counts[1] < limit[0]

    event = hy.t_event(gap, callback=strike, direction=hy.event_direction.positive)
    phase = problem.parameters.get("phase", 0.0)
    start = np.array([*problem.initial, math.cos(phase), math.sin(phase)])
    integrator = hy.taylor_adaptive(
        motion, start, pars=[problem.frequency], t_events=[event], tol=tolerance, **FASTEST
    )

    def solve_one(omega: float, periods: int, keep: int, samples: int) -> Outcome:
        nonlocal section
        counts[:], limit[0] = (0, 0), most_impacts(periods)
        section = np.empty((limit[0] + 1, 4))
        integrator.reset_cooldowns()
        integrator.time, integrator.pars[0] = 0.0, omega
        integrator.state[:] = start
        period = 2.0 * math.pi / omega
        begin = (periods - keep) * period
        stopped = False
        if begin:
            stopped = integrator.propagate_until(begin)[0] != hy.taylor_outcome.time_limit
        first, rows = counts[0], np.empty((0, 4))
        if not stopped:
            times = np.linspace(begin, periods * period, keep * samples + 1)
            times[0] = integrator.time
            answer = integrator.propagate_grid(times)
            stopped = answer[0] != hy.taylor_outcome.time_limit
            rows = answer[-1][1:, :4]
        return Outcome(
            stroboscopic=rows,
            impact_section=section[first : counts[0]],
            impacts=counts[0],
            false_events=counts[1],
            penetration=penetration(rows, problem.parameters["gap"]),
            ended="too many contacts" if stopped else "",
        )

    return one_by_one(solve_one)


def _same(function: Any) -> Any:
    return function
