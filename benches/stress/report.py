"""What a run writes: plots, every row as CSV, and the tables of docs/stress.md."""

import csv
import math
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

import vibroimpact as vi
from exact import ALLOWED, EPS, Outcome
from ranges import Range

Row = dict[str, Any]
DOTS_PER_INCH = 130


def draw(path: Path, plot: Callable[[Axes], None]) -> None:
    """Write one plot."""
    with vi.plot.publication_style():
        figure = Figure(figsize=(5.2, 3.2), layout="constrained")
        plot(figure.add_subplot())
        figure.savefig(path, dpi=DOTS_PER_INCH)


def write_rows(path: Path, rows: Sequence[Row]) -> None:
    """Write rows as CSV; a case as the objects that make it again."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, names)
        writer.writeheader()
        writer.writerows(rows)


def range_line(chosen: Range, rows: Sequence[Row]) -> str:
    """One line of the table of ranges."""
    inside = [row for row in rows if row["inside"]]
    count = Counter(row["outcome"] for row in inside)
    beyond = Counter(row["outcome"] for row in rows if not row["inside"])
    low, high = max(chosen.low, chosen.holds[0]), min(chosen.high, chosen.holds[1])
    cells = [
        chosen.name,
        f"{chosen.low:g} ... {chosen.high:g}",
        f"{low:g} ... {high:g}",
        *(str(count[outcome]) for outcome in Outcome),
        f"{_largest(inside, 'units'):.2g}",
        f"{_largest(inside, 'best'):.2g}",
        f"{beyond[Outcome.WRONG]} of {beyond.total()}",
    ]
    return f"| {' | '.join(cells)} |"


HEADER = (
    "| quantity | tried | holds | "
    + " | ".join(outcome.value for outcome in Outcome)
    + " | largest error | all directions | wrong beyond |\n"
    + "|---|---|---|"
    + 8 * "---|"
)


def _largest(rows: Sequence[Row], key: str) -> float:
    """Of the errors; `best` with the growth of all directions where it was needed."""
    found = [
        row["conditioned"] if key == "best" and math.isfinite(row["conditioned"]) else row["units"]
        for row in rows
        if row["outcome"] in (Outcome.WITHIN, Outcome.ILL_CONDITIONED, Outcome.WRONG)
    ]
    return max(found, default=math.nan)


def drift_lines(rows: Sequence[Row]) -> list[str]:
    """The energy after all impacts, by motion."""
    last = {row["motion"]: row for row in rows}
    worst = {name: max(abs(row["drift"]) for row in rows if row["motion"] == name) for name in last}
    return [
        f"| {name} | {row['impacts']:,} | {row['drift']:.1e} | {worst[name]:.1e} "
        f"| {abs(row['drift']) / (EPS * math.sqrt(row['impacts'])):.2g} |"
        for name, row in last.items()
    ]


def orbit_lines(rows: Sequence[Row]) -> list[str]:
    """The largest distance, by motion and by what it is measured from."""
    last = {(row["motion"], row["from"]): row for row in rows}
    return [
        f"| {name} | {kind} | {row['period']:,} | {row['error']:.1e} "
        f"| {row['error'] / ALLOWED:.2g} |"
        for (name, kind), row in last.items()
    ]
