"""`vibroimpact basins`: which initial states lead to which attractor."""

import argparse
from pathlib import Path
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray

from ..showing import counted
from ..sweeps import Basins, basins
from . import cells, outputs
from . import options as shared
from .engine import HELP, add_engine, engine
from .exit_codes import ExitCode

# Fewest cells along an axis for the measures of a boundary: distances of 1, 2 and 4 cells fit in.
MEASURED = 32
ABOUT = f"""\
Basins of attraction over a plane of initial states: the attractors are found
without being told their number, periodic ones confirmed as orbits, and every
cell of the plane is followed until it has arrived at one of them.

{shared.UNITS}
{shared.SI}"""
MORE = f"""\
printed, one row per attractor:
  attractor       its number
  label           m-n, m-inf (complete chatter), chaotic, quasi-periodic
  share           part of the cells that lead to it, of those that lead to one
  confirmed       whether it is shown to attract, and if not why
then how many cells have no attractor and why (exit code 3 for another reason
than overlap), and on planes of {MEASURED} x {MEASURED} cells or more the uncertainty
exponent and the boundary basin entropy.

columns of the CSV, one row per cell, the second coordinate running fastest:
  x1, v1, x2, v2  the two coordinates that vary; of structures q_0, v_0 ...
  attractor       number of the attractor, -1 for none
  label           its label, or the status where there is none
  status          completed; overlap, the bodies do so at the start;
                  unresolved, none was reached; or why the run stopped
  settling        drive periods until the motion is in its neighbourhood; -1
                  where it was told by its sections at the end

{HELP}
It holds one store for each pass over the cells.

example, with the system file of vibroimpact --help:
  vibroimpact basins --system fig5b.toml --friction 0.5 \\
      --drive-frequency 1.5752 --vary x1 -0.3 0.3 16 --vary v1 -1 1 16 \\
      --initial 0 0 0 0 --quiet --csv basins.csv --plot basins.png"""


def add(subparsers: Any) -> None:
    """Add the command."""
    command = shared.command(
        subparsers,
        "basins",
        summary="basins of attraction over two coordinates of the start",
        about=ABOUT,
        more=MORE,
        needs="--vary NAME FIRST LAST COUNT --vary ...",
    )
    shared.add_vary(
        command,
        what="twice: one of x1, v1, x2, v2; of a structure q-0, ..., v-0, ...",
        example="x1 -0.3 0.3 400; the first is drawn to the right",
    )
    shared.add_system(command)
    group = shared.add_run(command, periods=2000, keep=200, section=False)
    group.add_argument(
        "--scouts",
        type=shared.whole,
        metavar="N",
        help="cells searched for attractors beforehand (default: 1000)",
    )
    group.add_argument(
        "--rounds",
        type=shared.whole,
        metavar="N",
        help="how often what is left over is followed on, twice as long (default: 2)",
    )
    outputs.add_outputs(command, "the cells")
    add_engine(command)
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> ExitCode:
    """Fill the plane; after Ctrl-C write what is done, then raise Interrupted."""
    request = shared.Request.of(options)
    plane = shared.grid(options.vary, axes=2, names=request.file.machine.coordinates())
    system = request.system()
    values = request.values(
        *("max_events", "chatter_tolerance"),
        own=("periods", "keep", "scouts", "rounds"),
        initial=None,
    )
    outputs.check(options)
    with engine(options) as computing:
        result, interrupted = outputs.partial_on_interrupt(
            lambda: basins(system, **values, **computing, **request.units, **plane)
        )
    write = outputs.Writing()
    if options.csv:
        write(_write_csv, result, options.csv)
    if options.plot:
        write(_plot, result, options.plot)
    _print(result, outputs.summary_stream(options))
    write.end()
    if interrupted is not None:
        raise interrupted
    return cells.exit_code(result.status)


def _write_csv(result: Basins, path: str) -> None:
    first, second = result.axes
    columns: dict[str, NDArray[Any]] = {
        first: np.repeat(result.axes[first], len(result.axes[second])),
        second: np.tile(result.axes[second], len(result.axes[first])),
        "attractor": result.attractor.ravel(),
        "label": result.label.ravel(),
        "status": result.status.ravel(),
        "settling": result.settling.ravel(),
    }
    outputs.write_columns(path, columns)


def _print(result: Basins, stream: TextIO) -> None:
    rows = [
        (f"{number}", name, f"{share:.4g}", "yes" if found.confirmed else found.why_not)
        for number, (found, name, share) in enumerate(
            zip(result.attractors, result._names, result.shares, strict=True)
        )
    ]
    outputs.print_table([("attractor", "label", "share", "confirmed"), *rows], stream)
    for reason, number in result.reasons.items():
        print(f"{reason}: {number} of {counted(result.attractor.size, 'cell')}", file=stream)
    if result.complete and min(result.attractor.shape) >= MEASURED:
        uncertainty, entropy = result.uncertainty_exponent(), result.entropy()
        print(
            f"uncertainty exponent {uncertainty.exponent:.3f} +- {uncertainty.error:.1g}; "
            f"boundary entropy {entropy.boundary_entropy:.3f} +- {entropy.boundary_error:.1g}",
            file=stream,
        )


def _plot(result: Basins, path: Path) -> None:
    from .. import plot

    with outputs.figure(path, 7.1, 5.2) as figure:
        plot.basins(result, ax=figure.subplots())
