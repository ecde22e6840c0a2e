"""G, the cost of one scalar evaluation of gap and gap rate: the unit in which costs are given."""

import ctypes
from collections.abc import Callable
from pathlib import Path
from time import perf_counter

import native

EVALUATIONS = 100_000
# Advance of time from one evaluation to the next; any value that is no simple part of a period.
STEP = 0.0731


def yardstick(evaluations: int = EVALUATIONS, clock: Callable[[], float] = perf_counter) -> float:
    """Return G in nanoseconds by this clock, measured now over so many evaluations."""
    kernel = native.load(Path(__file__).with_suffix(".c")).yardstick
    kernel.argtypes, kernel.restype = (ctypes.c_long, ctypes.c_double), ctypes.c_double
    kernel(1_000, STEP)
    start = clock()
    kernel(evaluations, STEP)
    return (clock() - start) / evaluations * 1e9


if __name__ == "__main__":
    print(f"G = {min(yardstick() for _ in range(5)):.1f} ns")
