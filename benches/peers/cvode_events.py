"""SUNDIALS CVODE with rootfinding at contact, in C (cvode_events.c).

scikit-sundae brings the libraries. Its own interface calls Python at every evaluation, which costs
ten times the rest; the C driver is what the makers of CVODE would write.
"""

import ctypes
import importlib
from functools import cache
from pathlib import Path

import numpy as np

import native

from .outcome import Outcome, Problem, Solve, most_impacts, one_by_one, penetration

NAME = "CVODE"
SETTING = "Adams, functional iteration, C"
LACKS = "two crossings within one step; chatter; sustained contact"
TOLERANCES = tuple(10.0**-digits for digits in range(4, 14))
NUMBERS = ("mbar", "r", "mu", "delta", "stiffness", "d1", "d2", "f1", "f2", "omega", "phase")
LIBRARIES = ("core", "nvecserial", "cvode")


class Parameters(ctypes.Structure):
    """The system, in the order of the C source."""

    _fields_ = [
        *((name, ctypes.c_double) for name in NUMBERS),
        ("evaluations", ctypes.c_long),
    ]


@cache
def _driver() -> ctypes.CDLL:
    """Load the libraries of the wheel, then what is linked against them."""
    package = importlib.import_module("sksundae.cvode")
    wheel = Path(package.__file__ or "").parents[2]
    for name in LIBRARIES:
        found = [*wheel.glob(f"scikit_sundae.libs/libsundials_{name}-*")]
        found += wheel.glob(f"sksundae/.dylibs/libsundials_{name}.*")
        if not found:
            raise ImportError(f"no libsundials_{name} in the wheel of scikit-sundae")
        ctypes.CDLL(str(found[0]), mode=ctypes.RTLD_GLOBAL)
    return native.load(Path(__file__).with_suffix(".c"))


def missing() -> str:
    """Why this peer cannot run here; empty if it can."""
    try:
        _driver()
    except ImportError as error:
        return "not installed" if "sksundae" in str(error) else str(error)
    except OSError as error:
        return str(error)
    return ""


def prepare(problem: Problem, tolerance: float = 1e-12) -> Solve:
    """Return what solves the problem at given drive frequencies."""
    run = _driver().cvode_run
    numbers = np.ctypeslib.ndpointer(np.float64, flags="C_CONTIGUOUS")
    counters = np.ctypeslib.ndpointer(np.int_, flags="C_CONTIGUOUS")
    pointer = ctypes.POINTER(Parameters)
    integers = (ctypes.c_int, ctypes.c_int, ctypes.c_int, ctypes.c_long)
    run.argtypes = (pointer, numbers, ctypes.c_double, *integers, numbers, numbers, counters)
    p = problem.parameters
    initial = np.array(problem.initial)

    def solve_one(omega: float, periods: int, keep: int, samples: int) -> Outcome:
        system = Parameters(
            p["mass_ratio"],
            p["restitution"],
            p["friction"],
            p["gap"],
            p["frequency_ratio"] ** 2,
            2.0 * p["pendulum_damping"] * p["frequency_ratio"],
            2.0 * p["oscillator_damping"],
            p["moment_amplitude"],
            p["force_amplitude"],
            omega,
            p.get("phase", 0.0),
        )
        most = most_impacts(periods)
        rows, impacts = np.empty((keep * samples, 4)), np.empty((most, 4))
        counts = np.zeros(3, np.int_)
        asked = (tolerance, periods, keep, samples, most)
        status = run(ctypes.byref(system), initial, *asked, rows, impacts, counts)
        section = impacts[: counts[2]]
        section[:, 3] = np.mod(omega * section[:, 3] + system.phase, 2.0 * np.pi)
        ended = "too many contacts" if status == 1 else f"CVODE's error {status}" if status else ""
        return Outcome(
            stroboscopic=rows,
            impact_section=section,
            impacts=int(counts[0]),
            false_events=int(counts[1]),
            penetration=0.0 if ended else penetration(rows, p["gap"]),
            evaluations=system.evaluations,
            ended=ended,
        )

    return one_by_one(solve_one)
