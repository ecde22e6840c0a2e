"""System files: the parameters of a system, and how long to run it, as TOML.

[system]       names of vibroimpact.System, with `damping` for both ratios; or
[physical]     those of System.from_physical, in SI units
[run]          what the commands share; flags come before it
"""

import inspect
import re
import sys
import tomllib
import warnings
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..arguments import close_to
from ..errors import ParameterError
from ..system import System

RUN_KEYS = (
    "initial",
    "periods",
    "time",
    "keep",
    "max_events",
    "chatter_tolerance",
    "section_phase",
)
# A word after an equals sign, and the words that have a meaning in TOML.
_BARE_WORD = re.compile(r"^\s*([\w-]+)\s*=\s*([A-Za-z][\w-]*)\s*(?:#.*)?$", re.M)
_TOML_WORDS = ("true", "false", "inf", "nan")
_DAMPING = ("pendulum_damping", "oscillator_damping")


@dataclass(frozen=True)
class SystemFile:
    """What a system file holds.

    Attributes
    ----------
    fields
        Fields of System by name, perhaps not all.
    physical
        The system of a [physical] table, else None.
    run
        The [run] table.
    """

    fields: dict[str, Any] = field(default_factory=dict)
    physical: System | None = None
    run: dict[str, Any] = field(default_factory=dict)


def read(path: Path) -> SystemFile:
    """Read a system file.

    Raises
    ------
    ParameterError
        If it cannot be read or is not TOML, or a table or key is unknown or missing; names what is
        allowed.
    """
    text = ""
    try:
        text = path.read_text(encoding="utf-8")
        tables = tomllib.loads(text)
    except OSError as error:
        raise ParameterError(f"--system {path}: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ParameterError(f"{path}: not a TOML file: {error}{_unquoted(text)}") from error
    _check_names(f"{path}", tables, ("system", "physical", "run"))
    for name, table in tables.items():
        if not isinstance(table, dict):
            raise ParameterError(f"{path}: {name} = {table!r} is not allowed; allowed: a table")
    if "system" in tables and "physical" in tables:
        raise ParameterError(f"{path}: give one of the tables [system] and [physical], not both")
    run = tables.get("run", {})
    _check_names(f"{path}, [run]", run, RUN_KEYS)
    if "physical" in tables:
        physical = tables["physical"]
        _check_names(f"{path}, [physical]", physical, _keywords(System.from_physical))
        missing = _required(System.from_physical) - set(physical)
        if missing:
            raise ParameterError(f"{path}, [physical]: missing: {', '.join(sorted(missing))}")
        return SystemFile(physical=_machine(path, physical), run=run)
    fields = tables.get("system", {})
    _check_names(f"{path}, [system]", fields, _keywords(System))
    return SystemFile(fields=_without_shorthand(path, fields), run=run)


def _machine(path: Path, quantities: dict[str, Any]) -> System:
    """Return the system of a table [physical]; a warning is a line like that of an error."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        system = System.from_physical(**quantities)
    for warning in said:
        print(f"vibroimpact: {path}: {warning.message}", file=sys.stderr)
    return system


def _unquoted(text: str) -> str:
    """Return what to add about the first word that stands without quotes in a file, if one does."""
    for key, word in _BARE_WORD.findall(text):
        if word not in _TOML_WORDS:
            return f'; text needs quotes: {key} = "{word}"'
    return ""


def _check_names(where: str, table: dict[str, Any], allowed: Collection[str]) -> None:
    unknown = sorted(set(table) - set(allowed))
    if unknown:
        hint = close_to(unknown[0], allowed)
        raise ParameterError(
            f"{where}: unknown: {', '.join(unknown)}{hint or ';'} allowed: {', '.join(allowed)}"
        )


def _keywords(function: Callable[..., Any]) -> tuple[str, ...]:
    return tuple(inspect.signature(function).parameters)


def _required(function: Callable[..., Any]) -> set[str]:
    parameters = inspect.signature(function).parameters.items()
    return {name for name, item in parameters if item.default is inspect.Parameter.empty}


def _without_shorthand(path: Path, fields: dict[str, Any]) -> dict[str, Any]:
    """Write `damping` out, so that a flag can override one of the two ratios."""
    if "damping" not in fields:
        return fields
    pair = fields["damping"]
    alone = not set(_DAMPING) & set(fields)
    if not (alone and isinstance(pair, list) and len(pair) == 2):
        raise ParameterError(
            f"{path}, [system]: damping = {pair!r} is not allowed; allowed: "
            f"a pair [{', '.join(_DAMPING)}], without these two names beside it"
        )
    rest = {name: value for name, value in fields.items() if name != "damping"}
    return rest | dict(zip(_DAMPING, pair, strict=True))
