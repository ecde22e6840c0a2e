"""The README's table: one motion of each kind, the error, and how many times slower peers are.

A peer is given the fastest of its runs with an error of at most ENOUGH, far more than that of
vibroimpact, or, if it has none, its most accurate one. Runs that missed something do not count, nor
do those with an error above USELESS, which had the right number of impacts by chance.
"""

from collections.abc import Sequence

from machine import load, machine
from measure import CORE, SOLVERS, Measured, Row, by_scene
from scenes import FIRST
from wording import short_error, times

ENOUGH, USELESS = 1e-8, 1e-4
COLUMNS = ("SciPy DOP853", "heyoka.py", "CVODE", "Numba")


def markdown(measured: Measured) -> str:
    """Return the table, above it where and how it was measured, below it all misses counted."""
    scenes = by_scene(measured.rows)
    rounds = max(row.rounds for row in measured.rows)
    lines = [
        f"{machine()}; load {load()} at the end; whole calls from Python, set-up included; "
        f"medians of {rounds} rounds, each ratio within one round.",
        "",
        "A peer's column: how many times slower it is in the fastest of its runs with an error of "
        f"at most {short_error(ENOUGH)}, or else in its most accurate one; in brackets that run's "
        "error. Last column: how many of a peer's runs, one for each tolerance, missed a contact "
        "or made one up, let the bodies through one another, or were given up; a dash where no "
        f"other run has an error below {short_error(USELESS)}.",
        "",
        f"| motion | error of {CORE} | " + " | ".join(COLUMNS) + " | wrong contacts |",
        "|" + "---|" * (3 + len(COLUMNS)),
    ]
    for name in FIRST:
        if name in scenes:
            lines.append("| " + " | ".join(_line(scenes[name], measured.absent)) + " |")
    return "\n".join([*lines, "", *_sums(scenes)]) + "\n"


def _line(rows: Sequence[Row], absent: dict[str, str]) -> list[str]:
    (core,) = (row for row in rows if row.solver == CORE)
    cells = [f"{core.kind}: {core.title}", short_error(core.error)]
    for peer in COLUMNS:
        cells.append(absent.get(peer) or _slower([row for row in rows if row.solver == peer]))
    counts = [count for count in _counts(rows) if count[0] in (CORE, *COLUMNS)]
    if all((wrong == tried) == (name != CORE) for name, wrong, tried in counts):
        return [*cells, "all runs of every peer"]
    found = [f"{name} {wrong} of {tried}" for name, wrong, tried in counts if wrong]
    return [*cells, ", ".join(found) or "none"]


def _slower(rows: Sequence[Row]) -> str:
    """Return the ratio and the error of the run that stands for a peer, or a dash."""
    right = [row for row in rows if not row.missed and row.error <= USELESS]
    if not right:
        return "-"
    enough = [row for row in right if row.error <= ENOUGH]
    if enough:
        best = min(enough, key=lambda row: row.ratio)
    else:
        best = min(right, key=lambda row: row.error)
    return f"{times(best.ratio)} ({short_error(best.error)})"


def _counts(rows: Sequence[Row]) -> list[tuple[str, int, int]]:
    """Return of each solver how many of its runs missed something, and how many it has."""
    runs = ((solver, [row for row in rows if row.solver == solver]) for solver in SOLVERS)
    return [
        (solver, sum(bool(row.missed) for row in mine), len(mine)) for solver, mine in runs if mine
    ]


def _sums(scenes: dict[str, list[Row]]) -> list[str]:
    """Count over all scenes, those with complete chatter, which no peer gets through, apart."""
    lines = []
    for endless, title in ((False, "without"), (True, "with")):
        chosen = [rows for rows in scenes.values() if (rows[0].impacts_expected is None) == endless]
        if chosen:
            counts = _counts([row for rows in chosen for row in rows])
            lines.append(
                f"Runs with wrong contacts, scenes {title} complete chatter ({len(chosen)}): "
                + ", ".join(f"{name} {wrong} of {tried}" for name, wrong, tried in counts)
                + "."
            )
    return lines
