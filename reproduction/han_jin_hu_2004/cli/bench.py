"""`vibroimpact bench`: how fast and how accurate the package is on this machine.

Three of the paper's motions are simulated. Time is that of a drive period, transients included.
Accuracy is measured on what the run itself must satisfy: a periodic motion, with or without
chatter, must end where Newton's method finds the motion it has settled on; a chaotic one, which has
no such end, must account for its energy (docs/theory.md, section 7).
"""

import argparse
import csv
import io
import math
import os
import platform
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vibroimpact import (
    NotFound,
    ParameterError,
    Run,
    SimulationError,
    System,
    __version__,
    simulate,
)

from ..parameters import INITIAL, KEEP, LOW_EXAMPLES, MOTIONS, PERIODS, TRANSITIONS
from ..whole_file import whole_file
from .command import add_command

ABOUT = """\
A short self-check: how fast and how accurate the package is on this machine.
Simulates three motions of Han, Jin & Hu (2004) on one thread, and one of them
from many starts on all threads."""
MORE = """\
columns, printed and of the CSV:
  scene            what is simulated
  label            the motion m-n it comes to
  impacts          per drive period, on average
  time             microseconds per drive period, the median of five rounds
                   (CSV: microseconds)
  error            dimensionless: of a periodic motion the distance of its run
                   from the motion itself, found by Newton's method, as part of
                   its size; of a chaotic one the energy that no work explains,
                   as part of all works
  allowed          what the error may be; above it the exit code is 1

The last line says how much faster all threads are than one.

example:
  vibroimpact bench --seconds 0.1 --csv bench.csv"""

ROUNDS = 5
# Drive periods after which the periodic scenes have settled to rounding.
SETTLING = 3000
# Chatter is completed to 1e-12; the sum of roundings over the impacts of an orbit comes on top.
SETTLED = 1e-10
# Rounding in works and energies is some 1e-13 of all works (vibroimpact.EnergyAudit).
BALANCED = 1e-11
STARTS = 64
NAMES = ("scene", "label", "impacts", "time", "error", "allowed")


@dataclass(frozen=True)
class _Scene:
    name: str
    system: System
    error: Callable[[Run], float]
    allowed: float


def add(subparsers: Any) -> None:
    """Add the command."""
    command = add_command(
        subparsers, "bench", summary="speed and accuracy on this machine", about=ABOUT, more=MORE
    )
    command.add_argument(
        "--seconds",
        type=float,
        default=1.0,
        metavar="X",
        help="time for each scene (default: %(default)s)",
    )
    command.add_argument("--workers", type=int, metavar="N", help="threads (default: all cores)")
    command.add_argument("--csv", type=Path, metavar="FILE", help="write the table as CSV, too")
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Time the scenes and judge their errors."""
    if not 0.0 < options.seconds < math.inf:
        raise ParameterError(
            f"--seconds = {options.seconds} is not allowed; allowed: a finite number > 0"
        )
    print(_machine())
    scenes = _scenes()
    rows = [_measure(scene, options.seconds) for scene in scenes]
    if options.csv is not None:
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows([NAMES, *rows])
        with whole_file(options.csv) as file:
            file.write(text.getvalue().encode())
    printed = [
        (name, label, f"{impacts:.2f}", f"{spent:.3g} us", f"{error:.1e}", f"{allowed:.0e}")
        for name, label, impacts, spent, error, allowed in rows
    ]
    table = [NAMES, *printed]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    for row in table:
        print("  ".join(map(str.ljust, row, widths)).rstrip())
    print(f"all threads: {_gain(scenes[0], options.workers):.2f} times as fast")
    wrong = [row[0] for row in rows if not row[4] <= row[5]]
    if wrong:
        raise SimulationError(f"less accurate than it should be: {', '.join(wrong)}")
    return 0


def _scenes() -> tuple[_Scene, ...]:
    systems = {motion.id: motion.system for motion in MOTIONS}
    systems |= {transition.id: transition.system for transition in TRANSITIONS}
    chatter = systems["7c"].replace(drive_frequency=LOW_EXAMPLES[0])
    return (
        _Scene("periodic, Fig. 5(b)", systems["5b"], _unsettled, SETTLED),
        _Scene("chaotic, Fig. 9(2)", systems["9(2)"], _unbalanced, BALANCED),
        _Scene("chatter, as in Fig. 7(c)", chatter, _unsettled, SETTLED),
    )


def _measure(scene: _Scene, seconds: float) -> tuple[str, str, float, float, float, float]:
    run = simulate(scene.system, initial=INITIAL, periods=PERIODS, keep=KEEP)
    rounds = [_time(scene.system, seconds / ROUNDS) for _ in range(ROUNDS)]
    return (
        scene.name,
        run.label,
        run.impact_count / PERIODS,
        1e6 * float(np.median(rounds)),
        scene.error(run),
        scene.allowed,
    )


def _time(system: System, seconds: float) -> float:
    """Return the seconds that a drive period takes, from runs that together take so long."""
    runs, started, spent = 0, time.perf_counter(), 0.0
    while runs == 0 or spent < seconds:
        simulate(system, initial=INITIAL, periods=PERIODS, keep=0)
        runs, spent = runs + 1, time.perf_counter() - started
    return spent / (runs * PERIODS)


def _unsettled(run: Run) -> float:
    """Return how far a run ends from the motion it has settled on, as part of its size."""
    run = run.resume(periods=SETTLING, keep=100)
    motion = run.refine()
    if isinstance(motion, NotFound):
        raise SimulationError(f"no motion {run.label} found: {motion.reason}")
    away = np.abs(motion.sections - np.array(run.final_state.state)).max(axis=1).min()
    return float(away / np.abs(motion.sections).max())


def _unbalanced(run: Run) -> float:
    """Return the energy that no work explains, as part of all works."""
    audit = run.energy_audit()
    return abs(audit.residual) / audit.total


def _gain(scene: _Scene, workers: int | None) -> float:
    """Return how much faster many starts are on all threads than on one."""
    starts = np.tile(INITIAL, (STARTS, 1))
    spent = []
    for threads in (1, workers):
        started = time.perf_counter()
        simulate(scene.system, initial=starts, periods=PERIODS, keep=0, workers=threads)
        spent.append(time.perf_counter() - started)
    return spent[0] / spent[1]


def _machine() -> str:
    """Name version, processor, cores and system."""
    return (
        f"vibroimpact {__version__}, Python {platform.python_version()}; {_processor()}, "
        f"{os.cpu_count()} cores; {platform.system()} {platform.release()}"
    )


def _processor() -> str:
    """Name the processor; the standard library knows it on some systems only."""
    if sys.platform == "linux":
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
        return next(names, platform.machine())
    return platform.processor() or platform.machine()
