"""heyoka.py: Taylor integration of the modes; each stop is an event, whose callback is the impact.

The modes are oscillators of their own, and the drive is a pair of states, so that all equations are
linear. The callback is one call of machine code on the integrator's own array (Numba, where it is
installed). In the coordinates of the masses the events would be shorter, but modal damping couples
all of them.
"""

import importlib
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np

from structure_scenes import Modal, Outcome, Scene, Solve

NAME = "heyoka.py"
TOLERANCES = (1e-6, 1e-9, 1e-12, 2.0**-52)
FASTEST = {"fast_math": True, "high_accuracy": False}
# Without it the code of so many modes takes minutes to compile, and is no faster.
COMPACT_FROM = 8


def missing() -> str:
    """Why this peer cannot run here; empty if it can."""
    try:
        importlib.import_module("heyoka")
    except ImportError:
        return "not installed"
    return ""


def prepare(scene: Scene, tolerance: float) -> Solve:
    """Return what follows the scene."""
    hy = importlib.import_module("heyoka")
    modal = Modal.of(scene.structure)
    motion, gaps = equations(modal)
    impact = compiled_impact(modal)
    impacts = [0]

    def event(j: int) -> Any:
        def strike(ta: Any, _direction: int) -> bool:
            if impact(ta.state, j):
                impacts[0] += 1
            return impacts[0] < 100_000

        return hy.t_event(gaps[j], callback=strike, direction=hy.event_direction.positive)

    count = len(modal.w)
    start = np.zeros(2 * count + 2)
    start[-2] = 1.0
    integrator = hy.taylor_adaptive(
        motion,
        start,
        t_events=[event(j) for j in range(len(gaps))],
        tol=tolerance,
        compact_mode=count >= COMPACT_FROM,
        **FASTEST,
    )

    def solve(periods: int) -> Outcome:
        impacts[0] = 0
        integrator.reset_cooldowns()
        integrator.time = 0.0
        integrator.state[:] = start
        answer = integrator.propagate_until(scene.end(periods))[0]
        p, v = integrator.state[:count], integrator.state[count : 2 * count]
        ended = "" if answer == hy.taylor_outcome.time_limit else "too many contacts"
        return Outcome(np.array([modal.shapes @ p, modal.shapes @ v]), impacts[0], ended)

    return solve


def equations(modal: Modal) -> tuple[list[Any], list[Any]]:
    """Return the equations of motion, and the gap of each stop."""
    hy = importlib.import_module("heyoka")
    count = len(modal.w)
    names = [f"p{i}" for i in range(count)] + [f"v{i}" for i in range(count)]
    *moving, cos, sin = hy.make_vars(*names, "c", "s")
    places, rates = moving[:count], moving[count:]
    motion = list(zip(places, rates, strict=True))
    for i in range(count):
        terms = [-(modal.w[i] ** 2) * places[i], -2.0 * modal.d[i] * rates[i]]
        terms += [modal.f[i].real * cos, -modal.f[i].imag * sin]
        motion.append((rates[i], hy.sum(terms)))
    motion += [(cos, -modal.omega * sin), (sin, modal.omega * cos)]
    gaps = []
    for j, gap in enumerate(modal.gaps):
        terms = [
            float(part) * place
            for part, place in zip(modal.normals[j], places, strict=True)
            if part
        ]
        gaps.append(hy.sum([*terms, hy.expression(-float(gap))]))
    return motion, gaps


def compiled_impact(modal: Modal) -> Callable[..., bool]:
    """Return the impact on a state's array, in place; True if the bodies approach."""
    wrap: Callable[[Any], Any] = _same
    with suppress(ImportError):
        wrap = importlib.import_module("numba").njit
    normals, kicks, count = modal.normals, modal.kicks, len(modal.w)

    @wrap
    def impact(y: Any, j: int) -> bool:
        u = 0.0
        for i in range(count):
            u += normals[j, i] * y[count + i]
        if u <= 0.0:
            return False
        for i in range(count):
            y[count + i] -= kicks[j, i] * u
        return True

    impact(np.zeros(2 * count + 2), 0)
    return impact  # type: ignore[no-any-return]


def _same(function: Any) -> Any:
    return function
