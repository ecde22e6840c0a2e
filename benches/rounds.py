"""Timing in rounds: each runs every job once, with G measured beside it; ratios are within one."""

import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter

from yardstick import yardstick

# A job shorter than this is repeated within its turn.
SHORTEST = 0.05


@dataclass(frozen=True)
class Timing:
    """Seconds per call and G in nanoseconds beside it, one of each per round."""

    seconds: tuple[float, ...]
    g: tuple[float, ...]


def measure(
    jobs: Mapping[str, Callable[[], object]],
    rounds: int,
    *,
    shortest: float = SHORTEST,
    clock: Callable[[], float] = perf_counter,
) -> dict[str, Timing]:
    """Time every job in every round, after one call of each that is not counted.

    By a clock of processor time other processes count less.
    """
    for job in jobs.values():
        job()
    seconds: dict[str, list[float]] = {name: [] for name in jobs}
    g: dict[str, list[float]] = {name: [] for name in jobs}
    for _ in range(rounds):
        for name, job in jobs.items():
            before = yardstick(clock=clock)
            seconds[name].append(_time(job, shortest, clock))
            g[name].append(0.5 * (before + yardstick(clock=clock)))
    return {name: Timing(tuple(seconds[name]), tuple(g[name])) for name in jobs}


def _time(job: Callable[[], object], shortest: float, clock: Callable[[], float]) -> float:
    calls, start, elapsed = 0, clock(), 0.0
    while elapsed < shortest or not calls:
        job()
        calls += 1
        elapsed = clock() - start
    return elapsed / calls


def ratios(above: Sequence[float], below: Sequence[float]) -> list[float]:
    """Quotients of the same rounds."""
    return [a / b for a, b in zip(above, below, strict=True)]


def spread(values: Sequence[float], digits: int = 3) -> str:
    """Median and range, e.g. ``3.1 (2.9 ... 3.3)``."""
    middle, low, high = (
        _short(value, digits) for value in (statistics.median(values), min(values), max(values))
    )
    return f"{middle} ({low} ... {high})"


def _short(value: float, digits: int) -> str:
    text = f"{value:.{digits}g}"
    return f"{value:,.0f}" if "e" in text or value >= 10**digits else text


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the lines of a table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return ["| " + " | ".join(line) + " |" for line in lines]
