"""Arguments that commands share, and what they and the system file ask for together."""

import argparse
import functools
import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np

from .._core import CHATTER_TOLERANCE, CONTACTS, LAWS, PARAMETERS, Parameter
from ..errors import ParameterError
from ..hints import close_to
from ..structure_fields import CHOICES
from .machines import FLAGS, DescribedStructure, DescribedSystem
from .system_file import SystemFile, read

UNITS = """\
All quantities are dimensionless: time in 1/omega_2, length in the pendulum's
length l, mass in M1, angles in radians (notation page). omega_2 is the
natural frequency of body 2; a drive period is 2 pi/(drive frequency). A
structure has the units of its file."""
SI = """\

With --units SI, for a system file with a table [physical], they are in SI:
parameters are the quantities of [physical] by name and unit, states are in
rad, rad/s, m, m/s, times in s, and so is what is printed and written.
Residuals and errors of states stay dimensionless."""

HelpFormatter = functools.partial(argparse.RawDescriptionHelpFormatter, max_help_position=28)
_RANGE = ("NAME", "FIRST", "LAST", "COUNT")


def whole(text: str) -> int:
    """Return the whole number that a word is: 600, 1e3, 600.0."""
    try:
        return int(text)
    except ValueError:
        pass
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not value.is_integer():
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number")
    return int(value)


def command(
    subparsers: Any, name: str, *, summary: str, about: str, more: str, needs: str = ""
) -> Any:
    """Add a command: a line for the list, what it does, and what follows its options.

    `needs` are its required arguments, for a usage that does not list them all.
    """
    return subparsers.add_parser(
        name,
        help=summary,
        usage=f"vibroimpact {name} {needs} [options]".replace("  ", " "),
        description=about,
        epilog=more,
        formatter_class=HelpFormatter,
    )


def add_system(command: argparse.ArgumentParser, *, units: bool = True) -> None:
    """Add the system file, a flag for every parameter, and the initial state; and units."""
    group = command.add_argument_group(
        "system", "of two bodies from flags or a file, a structure from a file; flags win"
    )
    group.add_argument(
        "--system",
        type=Path,
        metavar="FILE.toml",
        help="system file, of a structure too; see vibroimpact --help; or the .json of to_json",
    )
    for name, parameter in PARAMETERS.items():
        group.add_argument(_flag(name), type=float, metavar="X", help=_explained(parameter))
    for name, what, choices in (("contact", "geometry", CONTACTS), ("law", "impact law", LAWS)):
        text = f"{what}: {', '.join(choices)} (default: {choices[0]})"
        group.add_argument(_flag(name), help=text)
    rules = ", ".join(CHOICES["simultaneous"])
    text = f"of a structure, stops met at one instant: {rules} (default: stop)"
    group.add_argument("--simultaneous", metavar="RULE", help=text)
    group.add_argument(
        "--set",
        nargs=2,
        action="append",
        metavar=("NAME", "X"),
        help="a number by the name that --vary has for it, e.g. gap-0 0.3 of a structure",
    )
    group.add_argument(
        "--initial",
        type=float,
        nargs="+",
        metavar="X",
        help="state at t = 0: X1 V1 X2 V2, angle, its rate, displacement, its rate; of a "
        "structure all coordinates, then all velocities",
    )
    if units:
        group.add_argument(
            "--units", choices=("SI",), help="numbers in SI, for a file with [physical]"
        )


def add_run(
    command: argparse.ArgumentParser,
    *,
    periods: int | None,
    keep: int | None,
    section: bool = True,
) -> argparse._ArgumentGroup:
    """Add length and limits of each run, with the defaults that its command has."""
    group = command.add_argument_group("run")
    length: Any = group
    if periods is None:
        length = group.add_mutually_exclusive_group()
        length.add_argument("--time", type=float, metavar="T", help="time, without drive period")
    length.add_argument(
        "--periods", type=whole, metavar="N", help=_counted("drive periods", periods)
    )
    text = _counted("keep the last K periods", f"{keep}, or all of fewer" if keep else "all")
    group.add_argument("--keep", type=whole, metavar="K", help=text)
    add_limits(group, section=section)
    return group


def add_limits(group: argparse._ArgumentGroup, *, section: bool) -> None:
    """Add the limits of a run, and the phase of its stroboscopic section if it has one."""
    group.add_argument(
        "--max-events", type=whole, metavar="N", help="stop a run after N events (default: 10^7)"
    )
    group.add_argument(
        "--chatter-tolerance",
        type=float,
        metavar="X",
        help="absolute, on time and state where chatter is completed "
        f"(default: {CHATTER_TOLERANCE})",
    )
    if section:
        group.add_argument(
            "--section-phase",
            type=float,
            metavar="X",
            help="drive phase of the stroboscopic section after that of t = 0, radians "
            "(default: 0)",
        )


def add_vary(
    command: argparse.ArgumentParser, *, what: str, example: str, required: bool = True
) -> None:
    """Add the flag of what varies: `what` it is and how often, and an example."""
    command.add_argument(
        "--vary",
        nargs=4,
        action="append",
        required=required,
        metavar=_RANGE,
        help=f"{what} and its equally spaced values, LAST included, e.g. {example}",
    )


def add_quiet(command: argparse.ArgumentParser) -> None:
    """Add threads and progress, where nothing is kept in a store."""
    command.add_argument("--workers", type=whole, metavar="N", help="threads (default: all cores)")
    command.add_argument("--quiet", action="store_true", help="show no progress")


def grid(
    vary: Sequence[Sequence[str]], *, axes: int, names: Collection[str] = tuple(PARAMETERS)
) -> dict[str, Any]:
    """Return the values of what varies by name, in the order given: so many of `names`."""
    if len(vary) != axes:
        raise ParameterError(f"--vary is given {len(vary)} times; allowed: {axes}")
    values: dict[str, Any] = {}
    for word, *words in vary:
        name = chosen_name("--vary", word, names)
        if name in values:
            raise ParameterError(f"--vary {word}: given twice")
        try:
            first, last, count = float(words[0]), float(words[1]), whole(words[2])
        except (ValueError, argparse.ArgumentTypeError) as error:
            raise ParameterError(f"--vary {word} {' '.join(words)}: {error}") from error
        if count < 1:
            raise ParameterError(
                f"--vary {word}: COUNT = {count} is not allowed; allowed: an integer >= 1"
            )
        if not (np.isfinite(first) and np.isfinite(last)):
            raise ParameterError(f"--vary {word} {' '.join(words)}: allowed: finite numbers")
        values[name] = np.linspace(first, last, count)
    return values


def chosen_name(flag: str, word: str, names: Collection[str] = tuple(PARAMETERS)) -> str:
    """Return the name in Python from the word given for it."""
    name = word.replace("-", "_")
    if name not in names:
        hint = close_to(name, names).replace("_", "-").removeprefix(", ")
        known = ", ".join(names).replace("_", "-")
        raise ParameterError(f"{flag} {word}: {hint}{' ' if hint else ''}allowed are {known}")
    return name


@dataclass(frozen=True)
class Request:
    """What flags and system file ask for together; a flag comes before the file."""

    options: argparse.Namespace
    file: SystemFile

    @classmethod
    def of(cls, options: argparse.Namespace) -> Self:
        """Read the system file, if there is one."""
        return cls(options, SystemFile() if options.system is None else read(options.system))

    @property
    def units(self) -> dict[str, Any]:
        """The argument ``units`` of the Python functions, where it is given."""
        given = getattr(self.options, "units", None)
        return {} if given is None else {"units": given}

    @property
    def names(self) -> tuple[str, ...]:
        """What can be varied: parameters, numbers of a structure, or quantities in SI."""
        return self.file.machine.names(self.units)

    def drawn(self, columns: Collection[str] | None = None) -> dict[str, Any]:
        """Return what --value asks a figure to show: a column of impacts, or one of `columns`."""
        word = self.options.value
        if word is None:
            return {}
        if self.options.plot is None:
            raise ParameterError("--value goes with --plot only")
        known = {
            name: asked
            for name, asked in self.file.machine.impact_values().items()
            if columns is None or asked["value"] in columns
        }
        return known[chosen_name("--value", word, known)]

    def need_two_bodies(self, what: str) -> None:
        """Refuse a structure where ``what`` knows systems of two bodies only."""
        machine = self.file.machine
        if isinstance(machine, DescribedStructure):
            raise ParameterError(f"{what} is not for structures; allowed: {DescribedSystem.what}")

    def system(self, **unless_given: float) -> Any:
        """Return the System or Structure; `unless_given` are values for what varies anyway."""
        flags = {name: getattr(self.options, name) for name in FLAGS}
        flags = {name: value for name, value in flags.items() if value is not None}
        for word, text in self.options.set or ():
            name = chosen_name("--set", word, self.names)
            if name in flags:
                raise ParameterError(f"--set {word}: given twice")
            try:
                flags[name] = float(text)
            except ValueError as error:
                raise ParameterError(f"--set {word} {text}: {error}") from error
        return self.file.machine.machine(flags, unless_given, self.units)

    def values(self, *names: str, own: Collection[str] = (), **defaults: Any) -> dict[str, Any]:
        """Return the options of a run by name, without those that are not given.

        `names` have no default here; `defaults` gives defaults by name. The options in `own` are
        read from flags only, because in [run] the same name has another meaning.
        """
        machine = self.file.machine
        flags = {name: value for name, value in vars(self.options).items() if value is not None}
        if "initial" in flags:
            flags["initial"] = machine.start(flags["initial"])
        found = defaults | {name: self.file.run[name] for name in self._from_file()} | flags
        values = {name: found[name] for name in (*names, *defaults) if name in found}
        if "initial" in names and "initial" not in values:
            raise ParameterError(
                f"initial is missing: give {machine.how_to_start} in the table [run] of the "
                "system file"
            )
        return values | {name: flags[name] for name in own if name in flags}

    def _from_file(self) -> list[str]:
        """Names in [run], without another length of the run than the flags give."""
        replaced: set[str] = set()
        if getattr(self.options, "time", None) is not None:
            replaced = {"periods", "keep"}
        elif getattr(self.options, "periods", None) is not None:
            replaced = {"time"}
        return [name for name in self.file.run if name not in replaced]


def _flag(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _explained(parameter: Parameter) -> str:
    text = f"{parameter.meaning}: {parameter.allowed}"
    return text if parameter.default is None else f"{text} (default: {parameter.default:g})"


def _counted(text: str, default: object) -> str:
    return text if default is None else f"{text} (default: {default})"
