"""The command `vibroimpact`: reproduce the paper, simulate one motion, sweep one parameter.

Exit codes: 0 done, 1 a computation failed, 2 bad input, 130 interrupted with Ctrl-C. Results go to
the standard output, everything else to the standard error stream. Parameter names are those of
`vibroimpact.System` with hyphens.
"""

import argparse
import os
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from . import __version__, commands
from .errors import ParameterError, SimulationError, StateError
from .system import NUMERIC_RANGES

_NEGATIVE_NUMBER = re.compile(r"-(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_EPILOG = "All quantities are dimensionless; the model and the names are explained in docs/."


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments without the program's name; those of the process by default.

    Raises
    ------
    SystemExit
        From argparse: code 0 after ``--help`` and ``--version``, 2 for arguments it cannot parse.
    """
    given = sys.argv[1:] if argv is None else argv
    # argparse takes -1e-3 for an option; with a leading blank it is a value, and float() strips it.
    words = [f" {word}" if _NEGATIVE_NUMBER.fullmatch(word) else word for word in given]
    options = _parser().parse_args(words)
    try:
        options.run(options)
        sys.stdout.flush()
    except (ParameterError, StateError) as error:
        return _fail(error, 2)
    except BrokenPipeError:
        # The reader of a pipe has gone, as in `| head`: nothing is left to say, also not at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except OSError as error:
        return _fail(error, 2)
    except SimulationError as error:
        return _fail(error, 1)
    except KeyboardInterrupt as error:
        # The commands have printed and written what was done by then.
        return _fail(str(error).partition("; .result")[0] or "interrupted", 130)
    return 0


def _fail(error: object, code: int) -> int:
    print(f"vibroimpact: {error}", file=sys.stderr)
    return code


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="vibroimpact",
        description="Oblique-impact vibration of two bodies.",
        epilog=_EPILOG,
    )
    parser.add_argument("--version", action="version", version=f"vibroimpact {__version__}")
    subparsers = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    _add_reproduce(subparsers)
    _add_simulate(subparsers)
    _add_diagram(subparsers)
    return parser


def _add_reproduce(subparsers: Any) -> None:
    command = subparsers.add_parser(
        "reproduce",
        help="draw Figs. 2 to 10 of Han, Jin & Hu (2004) and judge its claims",
        description="Draw Figs. 2 to 10 of Han, Jin & Hu (2004) from their parameters, in black "
        "and coloured by impact regime; write claims.md and claims.json; print the claims.",
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
    _add_common(command)
    command.set_defaults(run=commands.reproduce)


def _add_simulate(subparsers: Any) -> None:
    command = subparsers.add_parser(
        "simulate",
        help="simulate one motion and name it",
        description="Simulate one motion; print its label m-n (m drive periods, n impacts per "
        "orbit) with the evidence for it.",
        epilog=_EPILOG,
    )
    _add_system(command)
    length = command.add_mutually_exclusive_group(required=True)
    length.add_argument("--periods", type=int, metavar="N", help="drive periods")
    length.add_argument("--time", type=float, metavar="T", help="time, for a constant load")
    command.add_argument("--keep", type=int, metavar="K", help="keep the last K periods only")
    _add_outputs(command, "the kept impacts")
    command.set_defaults(run=commands.simulate)


def _add_diagram(subparsers: Any) -> None:
    command = subparsers.add_parser(
        "diagram",
        help="sweep one parameter: bifurcation diagram",
        description="Simulate one motion for each value of a parameter; print which motions occur "
        "and where runs stopped early.",
        epilog=_EPILOG,
    )
    _add_system(command)
    command.add_argument(
        "--vary",
        nargs=4,
        required=True,
        metavar=("NAME", "FIRST", "LAST", "COUNT"),
        help="parameter and its equally spaced values, e.g. drive-frequency 0.2 4 4000",
    )
    command.add_argument(
        "--periods", type=int, default=600, metavar="N", help="drive periods (default: %(default)s)"
    )
    command.add_argument(
        "--keep",
        type=int,
        default=100,
        metavar="K",
        help="last periods kept (default: %(default)s)",
    )
    command.add_argument(
        "--start",
        choices=("fresh", "forward", "backward"),
        default="fresh",
        help="start each value from --initial, or from the end of its neighbour's run "
        "(default: %(default)s)",
    )
    _add_outputs(command, "the impact section")
    _add_common(command)
    command.set_defaults(run=commands.diagram)


def _add_system(command: argparse.ArgumentParser) -> None:
    group = command.add_argument_group("system")
    for name, allowed in NUMERIC_RANGES.items():
        group.add_argument(f"--{name.replace('_', '-')}", type=float, metavar="X", help=allowed)
    group.add_argument("--contact", help="oblique (default) or direct")
    group.add_argument("--law", help="impact law: poisson (default), newton, energetic, paper")
    command.add_argument(
        "--initial",
        type=float,
        nargs=4,
        required=True,
        metavar=("X1", "V1", "X2", "V2"),
        help="state at t = 0",
    )


def _add_outputs(command: argparse.ArgumentParser, rows: str) -> None:
    group = command.add_argument_group("output")
    group.add_argument("--csv", metavar="FILE", help=f"write {rows} as CSV; - for standard output")
    group.add_argument("--save", type=Path, metavar="FILE", help="write everything as .npz")
    group.add_argument("--plot", type=Path, metavar="FILE", help="draw a figure: .png, .pdf, .svg")


def _add_common(command: argparse.ArgumentParser) -> None:
    command.add_argument("--workers", type=int, metavar="N", help="threads (default: all cores)")
    command.add_argument("--quiet", action="store_true", help="show no progress")
