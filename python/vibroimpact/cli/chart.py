"""`vibroimpact chart`: label and largest Lyapunov exponent over two parameters."""

import argparse
from pathlib import Path
from typing import Any

from ..sweeps import Chart, chart
from . import cells, outputs
from . import options as shared
from .engine import HELP, add_engine, engine
from .exit_codes import ExitCode

ABOUT = f"""\
Two-parameter chart: for each cell of a grid the label of the motion that a run
from --initial settles on, and its largest Lyapunov exponent.

{shared.UNITS}
{shared.SI}"""
MORE = f"""\
printed: how many cells have each status, and the most frequent labels; exit
code 3 where a run stopped early.

columns of the CSV, one row per cell, the second parameter running fastest:
  (parameter)       the two values, under their names in Python
{cells.COLUMNS}
  contact_fraction  part of the kept time in sustained contact
  largest_exponent  per unit time; -inf where perturbations die out at once
  exponent_error    its standard error; 0 where it follows from multipliers

figure: the labels by colour, and the largest exponents.

{HELP}

example, with the system file of vibroimpact --help:
  vibroimpact chart --system fig5b.toml --vary drive-frequency 1.4 2 12 \\
      --vary moment-amplitude 0.8 1.2 8 --periods 300 --quiet \\
      --csv chart.csv --plot chart.png"""


def add(subparsers: Any) -> None:
    """Add the command."""
    command = shared.command(
        subparsers,
        "chart",
        summary="label and Lyapunov exponent over two parameters",
        about=ABOUT,
        more=MORE,
        needs="--vary NAME FIRST LAST COUNT --vary ...",
    )
    shared.add_vary(
        command,
        what="twice: parameter",
        example="drive-frequency 0.2 4 400; the first is drawn to the right",
    )
    command.add_argument(
        "--no-exponents", action="store_true", help="faster: compute the labels only"
    )
    command.add_argument(
        "--no-labels",
        action="store_true",
        help="still faster: what is not periodic is unresolved, and has no exponent",
    )
    shared.add_system(command)
    shared.add_run(command, periods=400, keep=100)
    outputs.add_outputs(command, "the cells", save="write the chart for vibroimpact.load")
    add_engine(command)
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> ExitCode:
    """Fill the grid; after Ctrl-C write what is done, then raise Interrupted."""
    request = shared.Request.of(options)
    swept = shared.grid(options.vary, axes=2, names=request.names)
    system = request.system(**{name: float(values[0]) for name, values in swept.items()})
    values = request.values(
        *("initial", "periods", "keep", "max_events", "chatter_tolerance", "section_phase")
    )
    outputs.check(options)
    with engine(options) as computing:
        result, interrupted = outputs.partial_on_interrupt(
            lambda: chart(
                system,
                labels=not options.no_labels,
                exponents=not (options.no_exponents or options.no_labels),
                **values,
                **computing,
                **request.units,
                **swept,
            )
        )
    write = outputs.Writing()
    if options.csv:
        write(_write_csv, result, options.csv, options.units)
    if options.save:
        write(result.save, options.save)
    if options.plot:
        write(_plot, result, options.plot)
    outputs.print_summary(cells.describe(result.status, result.label), options)
    write.end()
    if interrupted is not None:
        raise interrupted
    return cells.exit_code(result.status)


def _write_csv(result: Chart, path: str, units: str | None) -> None:
    names = ["label", "m", "n", "residual", "status", "contact_fraction"]
    if "largest_exponent" in result.columns:
        names += ["largest_exponent", "exponent_error"]
    axes = result.columns.grid.values(0, len(result))
    outputs.write_columns(path, axes | cells.columns_of(result, names, units))


def _plot(result: Chart, path: Path) -> None:
    from .. import plot

    exponents = "largest_exponent" in result.columns
    with outputs.figure(path, 7.1, 3.4 if exponents else 5.0) as figure:
        if not exponents:
            plot.chart(result, ax=figure.subplots())
            return
        left, right = figure.subplots(1, 2)
        plot.chart(result, ax=left)
        plot.chart(result, color="exponent", ax=right)
