"""`vibroimpact diagram`: the long-term motion over one parameter."""

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from ..atlas import Diagram, bifurcation_diagram, orbit_label
from . import options as shared
from . import outputs
from .exit_codes import ExitCode

ABOUT = f"""\
Bifurcation diagram: simulate one motion for each value of a parameter; print
which motions occur and where runs stopped early.

{shared.UNITS}"""
MORE = """\
printed: how many values have each status (completed; restarted, a followed
state that did not fit; or why the run stopped early, exit code 3), and the ten
most frequent labels m-n.

columns of the CSV, one row per kept impact:
  (parameter)  its value, under its name in Python, e.g. drive_frequency
  x1, v1, v2   angle and velocities just before the impact
  phase        drive phase, 0 to 2 pi
  regime       frictionless, slip, reversal_approach, ...

figure: angle at impact, coloured by regime, and angle once per drive period.

example, with the system file of vibroimpact --help:
  vibroimpact diagram --system fig5b.toml --friction 0.5 \\
      --vary drive-frequency 1.5 1.6 20 --csv section.csv --plot diagram.png"""


def add(subparsers: Any) -> None:
    """Add the command."""
    command = shared.command(
        subparsers,
        "diagram",
        summary="bifurcation diagram over one parameter",
        about=ABOUT,
        more=MORE,
        needs="--vary NAME FIRST LAST COUNT",
    )
    shared.add_vary(command, axes=1)
    shared.add_system(command)
    shared.add_run(command, periods=600, keep=100)
    command.add_argument(
        "--start",
        choices=("fresh", "forward", "backward"),
        default="fresh",
        help="start each value from --initial, or from the end of its neighbour's run "
        "(default: %(default)s)",
    )
    outputs.add_outputs(
        command, "the impact section", save="write the diagram for vibroimpact.load"
    )
    shared.add_quiet(command)
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> ExitCode:
    """Sweep one parameter; after Ctrl-C write what is done, then raise Interrupted."""
    request = shared.Request.of(options)
    swept: dict[str, Any] = shared.grid(options.vary, axes=1)
    system = request.system(**{name: float(values[0]) for name, values in swept.items()})
    values = request.values(
        *("initial", "periods", "keep", "max_events", "tolerance", "section_phase", "workers")
    )
    outputs.check(options)
    result, interrupted = outputs.as_far_as_it_got(
        lambda: bifurcation_diagram(
            system, start=options.start, progress=not options.quiet, **values, **swept
        )
    )
    if options.csv:
        _write_csv(result, options.csv)
    if options.save:
        result.save(options.save)
    if options.plot:
        _plot(result, options.plot)
    outputs.print_summary(_describe(result), options)
    if interrupted is not None:
        raise interrupted
    complete = np.isin(result.status, outputs.COMPLETE).all()
    return ExitCode.DONE if complete else ExitCode.INCOMPLETE


def _write_csv(result: Diagram, path: str) -> None:
    columns = (result.impact_parameter, result.x1, result.v1, result.v2, result.phase)
    numbers = np.column_stack(columns).tolist()
    rows = (
        [*row, outputs.regime_name(regime)]
        for row, regime in zip(numbers, result.regime.tolist(), strict=True)
    )
    names = (result.parameter_name, "x1", "v1", "v2", "phase", "regime")
    outputs.write_csv(path, names, rows)


def _describe(result: Diagram) -> list[tuple[str, str]]:
    kinds, counts = np.unique(result.status, return_counts=True)
    lines = [
        (str(kind), f"{count} of {len(result)} values")
        for kind, count in zip(kinds, counts, strict=True)
    ]
    pairs, counts = np.unique(
        np.column_stack([result.m, result.n])[result.m > 0], axis=0, return_counts=True
    )
    for row in np.argsort(-counts, kind="stable")[:10]:
        m, n = pairs[row]
        lines.append((orbit_label(m, n), f"{counts[row]} values"))
    return lines


def _plot(result: Diagram, path: Path) -> None:
    from .. import plot

    with outputs.figure(path, 7.1, 2.8) as figure:
        left, right = figure.subplots(1, 2)
        plot.bifurcation(result, color="regime", ax=left)
        plot.bifurcation(result, section="stroboscopic", legend=False, ax=right)
