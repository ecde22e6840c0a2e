"""The command `vibroimpact`, with a command of its own for each kind of question.

One module for each command; `options` and `outputs` hold what they share, `system_file` reads
systems from TOML, `exit_codes` says what the command returns. Other distributions add commands by
entry points of the group ``vibroimpact.commands``. Results go to the standard output,
everything else to the standard error stream. Flags are named as in Python, with hyphens or
underscores.
"""

import argparse
import os
import re
import sys
import warnings
from collections.abc import Sequence
from importlib.metadata import entry_points
from typing import Any

from .. import __version__
from ..errors import ClusterError, ParameterError, ProofError, SimulationError, StateError
from . import (
    basins,
    chart,
    check_proof,
    diagram,
    exit_codes,
    explore,
    lyapunov,
    options,
    orbits,
    simulate,
    template,
)
from .exit_codes import ExitCode
from .hints import check_words

COMMANDS = (template, simulate, diagram, chart, orbits, basins, lyapunov, check_proof, explore)
# Entry points of this group add the commands of other distributions: a module with a function
# ``add(subparsers)``, which adds a parser and sets its default ``run`` to a function that takes the
# parsed options and returns an exit code.
GROUP = "vibroimpact.commands"
# Known commands of another distribution, for those who have not installed it.
ELSEWHERE = dict.fromkeys(("reproduce", "claims", "bench"), "han-jin-hu-2004")
_NEGATIVE_NUMBER = re.compile(r"-(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
ABOUT = f"""\
Oblique-impact vibration of two bodies: a pendulum whose tip strikes a
spring-mounted mass (Han, Jin & Hu 2004, corrected); and any linear structure
with rigid stops. Each command has its own --help: what it does, what the
columns of its files mean, and an example.

{options.UNITS}"""
MORE = f"""\
A system comes from flags (--mass-ratio 0.6 ...), or with --system from a TOML
file, or both: flags win. The file of the examples, fig5b.toml:

  [system]                # names as in Python; damping = [z1, z2] for both
  mass_ratio = 0.6
  frequency_ratio = 2.0
  restitution = 0.8
  gap = 0.5
  drive_frequency = 1.8
  moment_amplitude = 1.0

  [run]                   # optional; longer runs, of lyapunov, basins and
                          # orbits --search, have their own periods and keep
  initial = [0.0, 0.5, 0.0, 0.0]
  periods = 600
  keep = 100

[run] may also hold time, max_events, chatter_tolerance, section_phase; each
command takes what it has a use for. Instead of [system], a table [physical]
takes SI units, by the names of vibroimpact.System.from_physical; with
--units SI the options and results of a command are in SI, too. A table
[structure] describes any linear structure with rigid stops, by the names of
vibroimpact.Structure: `vibroimpact template` prints an example with comments.

{exit_codes.table()}"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code, one of `ExitCode`.

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
    if given and given[0] in ELSEWHERE and given[0] not in entry_points(group=GROUP).names:
        missing = f"{given[0]}: a command of the distribution {ELSEWHERE[given[0]]}"
        return _fail(f"{missing}, which is not installed", ExitCode.BAD_INPUT)
    parser = _parser()
    words = [_word(word) for word in given]
    check_words(parser, words)
    chosen = parser.parse_args(words)
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _warn
            code: int = chosen.run(chosen)
        sys.stdout.flush()
    except (ParameterError, StateError, ImportError) as error:
        return _fail(error, ExitCode.BAD_INPUT)
    except ProofError as error:
        return _fail(error, ExitCode.NOT_PROVED)
    except BrokenPipeError:
        # Nobody reads the output: nothing more is written, also not at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return ExitCode.NO_READER
    except ClusterError as error:
        # As after Ctrl-C, the commands have printed and written what was done by then.
        return _fail(_cut_short(error, chosen), ExitCode.FAILED)
    except (SimulationError, OSError) as error:
        return _fail(error, ExitCode.FAILED)
    except MemoryError as error:
        return _fail(f"not enough memory: {error}", ExitCode.FAILED)
    except KeyboardInterrupt as error:
        # The commands have printed and written what was done by then.
        return _fail(_cut_short(error, chosen), ExitCode.INTERRUPTED)
    return code


def _warn(message: Warning | str, *_: Any, **__: Any) -> None:
    """Show a warning as a line like that of an error."""
    print(f"vibroimpact: {message}", file=sys.stderr)


def _cut_short(error: BaseException, chosen: argparse.Namespace) -> str:
    # Without the hint at `result`, which is for Python.
    message = getattr(error, "reason", str(error)) or "interrupted"
    if getattr(chosen, "store", None) is not None:
        message += f"; the same command goes on with {chosen.store}"
    return message


def _word(word: str) -> str:
    """Return a word as argparse takes it."""
    if _NEGATIVE_NUMBER.fullmatch(word):
        # argparse takes -1e-3 for an option; with a leading blank it is a value, and float()
        # strips it.
        return f" {word}"
    if word.startswith("--"):
        # Names as in Python, too: --mass_ratio is --mass-ratio.
        flag, equals, value = word.partition("=")
        return flag.replace("_", "-") + equals + value
    return word


def _fail(error: object, code: ExitCode) -> ExitCode:
    print(f"vibroimpact: {error}", file=sys.stderr)
    return code


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="vibroimpact",
        usage="vibroimpact COMMAND [options]",
        description=ABOUT,
        epilog=MORE,
        formatter_class=options.HelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"vibroimpact {__version__}")
    # Without this the usage above would be part of the error messages of the commands.
    subparsers = parser.add_subparsers(
        title="commands", required=True, metavar="COMMAND ...", prog="vibroimpact"
    )
    for command in (*COMMANDS, *(point.load() for point in entry_points(group=GROUP))):
        command.add(subparsers)
    return parser
