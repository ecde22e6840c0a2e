"""`vibroimpact reproduce`: the paper's figures, and a verdict on each of its claims."""

import argparse
import os
from pathlib import Path
from typing import Any

from vibroimpact import Interrupted

from .command import add_command

ABOUT = """\
Draw Figs. 2 to 10 of Han, Jin & Hu (2004) from their parameters, in black and
coloured by impact regime; write index.md, which says what each shows, and
claims.md and claims.json; print the claims."""
MORE = """\
printed, one row per claim:
  figure or statement  of the paper
  paper                what the paper says
  found                what comes out
  residual             how well the motion found repeats itself, dimensionless
  verdict              reproduced, as the paper says; corrected, something else
                       from that start, but the motion of the paper exists;
                       refuted, the evidence speaks against the paper; open, it
                       does not decide
and where index.md, what each figure shows, and claims.md, what each verdict
rests on, are.

Every statement of the paper, not of figures only: vibroimpact claims.

example (all figures at full size take half a minute to a minute on two cores):
  vibroimpact reproduce --out figures --figures 6 --format png pdf"""


def add(subparsers: Any) -> None:
    """Add the command."""
    command = add_command(
        subparsers,
        "reproduce",
        summary="draw Figs. 2 to 10 of Han, Jin & Hu (2004) and judge its claims",
        about=ABOUT,
        more=MORE,
        needs="--out DIR",
    )
    command.add_argument("--out", type=Path, required=True, metavar="DIR", help="where to write")
    command.add_argument(
        "--figures", type=int, nargs="+", metavar="N", help="only these figures (default: all)"
    )
    command.add_argument(
        "--frequencies",
        type=int,
        default=4000,
        metavar="N",
        help="drive frequencies of each diagram (default: %(default)s)",
    )
    command.add_argument(
        "--format",
        nargs="+",
        default=["png"],
        metavar="NAME",
        help="png, pdf, svg (default: png)",
    )
    command.add_argument(
        "--workers",
        type=int,
        metavar="N",
        help="processes, each with its own figures (default: as many as cores)",
    )
    command.add_argument("--quiet", action="store_true", help="show no progress")
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Draw the paper's figures and print the table of claims."""
    from .. import contents
    from ..claims import table
    from ..reproduction import reproduce

    try:
        made = reproduce(
            options.out,
            formats=options.format,
            figures=options.figures,
            frequencies=options.frequencies,
            workers=options.workers if options.figures and len(options.figures) == 1 else 1,
            processes=options.workers or os.cpu_count() or 1,
            progress=not options.quiet,
        )
    except Interrupted as error:
        if error.result.claims:
            print(table(error.result.claims))
        raise
    print(table(made.claims))
    print(f"\nWhat each figure shows: {options.out / contents.NAME}")
    print(f"Verdicts with their evidence: {options.out / 'claims.md'}")
    return 0
