"""`vibroimpact diagram`: the long-term motion over one parameter."""

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..sweeps import Diagram, bifurcation_diagram
from ..sweeps.structure_diagram_results import StructureDiagram
from . import cells, outputs
from . import options as shared
from .engine import HELP, add_engine, engine
from .exit_codes import ExitCode

ABOUT = f"""\
Bifurcation diagram: simulate one motion for each value of a parameter; print
which motions occur and where runs stopped early.

{shared.UNITS}
{shared.SI}"""
MORE = f"""\
printed: how many values have each status, and the most frequent labels; exit
code 3 where a run stopped early.

columns of --csv, one row per kept impact:
  (parameter)       its value, under its name in Python, e.g. drive_frequency
  branch            number of the start, one for each --start
  x1, v1, v2        angle and velocities just before the impact
  phase             drive phase, 0 to 2 pi; impact_phase where the phase of
                    the drive at t = 0 is the parameter
  regime            frictionless, slip, reversal_approach, ...
  approach_velocity u just before the impact
  energy_loss       in M1 l^2 omega_2^2, or J
and of a structure in place of x1, v1, v2: stop, its number from 0; q_0 ...,
v_pre_0 ..., v_post_0 ...; and impulse_normal, impulse_tangential

columns of --points, one row per value and branch:
  (parameter), branch    as above
{cells.COLUMNS}
  contact_fraction  part of the kept time in sustained contact (no column of
                    structures)
  largest_exponent  with --exponents: per unit time
  exponent_error    its standard error

figure: angle at impact, of a wall at rest the approach velocity, or --value;
coloured by regime; and angle once per drive period. Of a structure approach
velocity, coloured by stop, and q_0 once per drive period.

{HELP}
With --refine it holds one store for each level.

example, with the system file of vibroimpact --help:
  vibroimpact diagram --system fig5b.toml --friction 0.5 \\
      --vary drive-frequency 1.5 1.6 20 --refine 2 --csv section.csv \\
      --points points.csv --plot diagram.png"""

# Columns of impacts.
_OF_SYSTEMS = ("x1", "v1", "v2", "phase", "regime", "approach_velocity", "energy_loss")
_OF_STRUCTURES = (
    *("stop", "q", "v_pre", "v_post", "phase", "regime", "approach_velocity"),
    *("impulse_normal", "impulse_tangential", "energy_loss"),
)


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
    shared.add_vary(command, what="parameter", example="drive-frequency 0.2 4 4000")
    command.add_argument(
        "--start",
        nargs="+",
        choices=("fresh", "forward", "backward"),
        default=["fresh"],
        help="start each value from --initial, or from the end of its neighbour's run; several: "
        "a branch for each (default: fresh)",
    )
    command.add_argument(
        "--refine",
        type=shared.whole,
        metavar="N",
        help="halve the steps across which the label changes, N times (default: 0)",
    )
    command.add_argument(
        "--exponents", action="store_true", help="compute the largest Lyapunov exponents"
    )
    command.add_argument(
        "--no-labels",
        action="store_true",
        help="faster: leave what is not periodic unresolved",
    )
    shared.add_system(command)
    shared.add_run(command, periods=600, keep=100)
    outputs.add_outputs(
        command, "the impact section", save="write the diagram for vibroimpact.load"
    ).add_argument("--points", metavar="FILE", help="write label and status of every value as CSV")
    command.add_argument(
        "--value",
        metavar="COLUMN",
        help="--plot: what of the impacts is drawn, a column of --csv (default: x1; of a wall at "
        "rest, and of structures, approach_velocity)",
    )
    add_engine(command)
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> ExitCode:
    """Sweep one parameter; after Ctrl-C write what is done, then raise Interrupted."""
    request = shared.Request.of(options)
    swept = shared.grid(options.vary, axes=1, names=request.names)
    system = request.system(**{name: float(values[0]) for name, values in swept.items()})
    values = request.values(
        *(
            "initial",
            "periods",
            "keep",
            "max_events",
            "chatter_tolerance",
            "section_phase",
            "refine",
        )
    )
    outputs.check(options)
    drawn = request.drawn()
    values |= {
        "start": options.start,
        "labels": not options.no_labels,
        "exponents": options.exponents,
    }
    with engine(options) as computing:
        result, interrupted = outputs.partial_on_interrupt(
            lambda: bifurcation_diagram(system, **values, **computing, **request.units, **swept)
        )
    write = outputs.Writing()
    if options.csv:
        write(_write_section, result, options.csv, options.units)
    if options.points:
        write(_write_points, result, options.points, options.units)
    if options.save:
        write(result.save, options.save)
    if options.plot:
        write(_plot, result, options.plot, drawn, request.units)
    outputs.print_summary(cells.describe(result.status, result.label), options)
    write.end()
    if interrupted is not None:
        raise interrupted
    return cells.exit_code(result.status)


def _write_section(result: Diagram | StructureDiagram, path: str, units: str | None) -> None:
    columns: dict[str, NDArray[Any]]
    counts = np.diff(result.offset)
    if isinstance(result, StructureDiagram):
        found = result.impacts
        columns = {
            name: found[name] for name in _OF_STRUCTURES if name in (found.dtype.names or ())
        }
    else:
        columns = {name: getattr(result, name) for name in _OF_SYSTEMS}
        columns = cells.in_units(result, columns, units, counts)
    if "regime" in columns:
        columns["regime"] = outputs.regime_names(columns["regime"])
    varied = {result.parameter_name: result.impact_parameter}
    first = varied | {"branch": np.repeat(result.branch, counts)}
    # What varies may have the name of a column of impacts, phase.
    names = {each: f"impact_{each}" if each in first else each for each in columns}
    outputs.write_columns(path, first | {names[each]: rows for each, rows in columns.items()})


def _write_points(result: Diagram | StructureDiagram, path: str, units: str | None) -> None:
    names = ["branch", "label", "m", "n", "residual", "status", "contact_fraction"]
    if "largest_exponent" in result.columns:
        names += ["largest_exponent", "exponent_error"]
    varied = {result.parameter_name: result.parameter}
    outputs.write_columns(path, varied | cells.columns_of(result, names, units))


def _plot(
    result: Diagram | StructureDiagram, path: Path, drawn: dict[str, Any], units: dict[str, Any]
) -> None:
    from .. import plot

    with outputs.figure(path, 7.1, 2.8) as figure:
        left, right = figure.subplots(1, 2)
        place = {}
        if isinstance(result, StructureDiagram):
            place = {"coordinate": drawn.get("coordinate", 0)}
        else:
            drawn = {"color": "regime", **drawn}
        plot.bifurcation(result, ax=left, **drawn, **units)
        plot.bifurcation(result, section="stroboscopic", legend=False, ax=right, **place, **units)
