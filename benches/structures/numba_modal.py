"""A Numba script: the modes in closed form, all gaps scanned in equal steps, Newton's method.

What somebody writes who knows that flights are closed forms and wants speed: the whole run in one
compiled function. A stop is met where its gap is positive at a sample. What rises and falls again
within one step is not seen. Underdamped modes off resonance only.
"""

import importlib
from functools import cache
from typing import Any

import numpy as np

from structure_scenes import Modal, Outcome, Scene, Solve

NAME = "Numba"
# There is no tolerance: the step of the scan stands here, in units of 1/(highest frequency).
TOLERANCES = (1.0, 0.3, 0.1)


def missing() -> str:
    """Why this peer cannot run here; empty if it can."""
    try:
        importlib.import_module("numba")
    except ImportError:
        return "not installed"
    return ""


@cache
def _compiled() -> Any:
    """Compile, once per process."""
    numba = importlib.import_module("numba")
    njit = numba.njit(fastmath=True, error_model="numpy")

    @njit
    def at(modes, flight, omega, psi, t, p, v):  # type: ignore[no-untyped-def]
        """Modal coordinates and velocities at time t of a flight."""
        cos, sin = np.cos(omega * t + psi), np.sin(omega * t + psi)
        for i in range(modes.shape[0]):
            wd, d, re, im = modes[i, 0], modes[i, 1], modes[i, 2], modes[i, 3]
            a, b = flight[i, 0], flight[i, 1]
            e, c, s = np.exp(-d * t), np.cos(wd * t), np.sin(wd * t)
            x = e * (a * c + b * s)
            p[i] = x + re * cos - im * sin
            v[i] = e * wd * (b * c - a * s) - d * x - omega * (re * sin + im * cos)

    @njit
    def begin(modes, omega, psi, p, v, flight):  # type: ignore[no-untyped-def]
        """Constants of the flight from a state."""
        cos, sin = np.cos(psi), np.sin(psi)
        for i in range(modes.shape[0]):
            wd, d, re, im = modes[i, 0], modes[i, 1], modes[i, 2], modes[i, 3]
            a = p[i] - (re * cos - im * sin)
            flight[i, 0] = a
            flight[i, 1] = (v[i] + omega * (re * sin + im * cos) + d * a) / wd

    @njit
    def gap(normals, gaps, j, p):  # type: ignore[no-untyped-def]
        g = -gaps[j]
        for i in range(p.shape[0]):
            g += normals[j, i] * p[i]
        return g

    @njit
    def run(modes, omega, normals, gaps, kicks, step, end, most):  # type: ignore[no-untyped-def]
        count, stops = modes.shape[0], gaps.shape[0]
        p, v = np.zeros(count), np.zeros(count)
        near, rate = np.zeros(count), np.zeros(count)
        flight = np.zeros((count, 2))
        period = 2.0 * np.pi / omega
        start, impacts = 0.0, 0
        while True:
            psi = omega * (start % period)
            begin(modes, omega, psi, p, v, flight)
            t, met, first = 0.0, -1, 0.0
            while met < 0 and t < end - start:
                after = min(t + step, end - start)
                at(modes, flight, omega, psi, after, near, rate)
                first = after
                for j in range(stops):
                    if gap(normals, gaps, j, near) > 0.0:
                        # Newton's method in the bracket, bisection where it leaves.
                        low, high, tau = t, after, 0.5 * (t + after)
                        for _ in range(100):
                            at(modes, flight, omega, psi, tau, p, v)
                            value, slope = gap(normals, gaps, j, p), 0.0
                            for i in range(count):
                                slope += normals[j, i] * v[i]
                            if value > 0.0:
                                high = tau
                            else:
                                low = tau
                            new = tau - value / slope if slope > 0.0 else low - 1.0
                            if not low <= new <= high:
                                new = 0.5 * (low + high)
                            if abs(new - tau) <= 4e-16 * (1.0 + tau):
                                tau = new
                                break
                            tau = new
                        if tau < first or met < 0:
                            first, met = tau, j
                t = after
            at(modes, flight, omega, psi, first, p, v)
            if met < 0:
                return p, v, impacts, True
            start += first
            u = 0.0
            for i in range(count):
                u += normals[met, i] * v[i]
            if u > 0.0:
                for i in range(count):
                    v[i] -= kicks[met, i] * u
                impacts += 1
            if impacts >= most:
                return p, v, impacts, False

    return run


def prepare(scene: Scene, tolerance: float) -> Solve:
    """Return what follows the scene."""
    run = _compiled()
    modal = Modal.of(scene.structure)
    steady = modal.f / (modal.w**2 - modal.omega**2 + 2j * modal.d * modal.omega)
    damped = np.sqrt(modal.w**2 - modal.d**2)
    modes = np.column_stack([damped, modal.d, steady.real, steady.imag])
    step = tolerance / max(modal.w.max(), modal.omega)

    def solve(periods: int) -> Outcome:
        p, v, impacts, finished = run(
            modes,
            modal.omega,
            modal.normals,
            modal.gaps,
            modal.kicks,
            step,
            scene.end(periods),
            100_000,
        )
        state = np.array([modal.shapes @ p, modal.shapes @ v])
        return Outcome(state, impacts, "" if finished else "too many contacts")

    # Compiled for these types now, outside of what is timed.
    solve(1)
    return solve
