"""System files: the parameters of a machine, and how long to run it, as TOML.

[system]       names of vibroimpact.System, with `damping` for both ratios; or
[physical]     those of System.from_physical, in SI units; or
[structure]    those of vibroimpact.Structure, or of Structure.from_modes
[run]          what the commands share; flags come before it

A file that ends in .json is what `to_json` of a System or a Structure gives.
"""

import json
import re
import sys
import tomllib
import warnings
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..by_value import arguments_of
from ..errors import ParameterError
from ..hints import close_to
from ..stop import Stop
from ..structure import Structure
from ..structure_fields import drive_of_pairs
from ..system import System
from .machines import DescribedStructure, DescribedSystem, Description, naming_the_file

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
# A table of stops in place of an array of them.
_ONE_STOP = re.compile(r"^\s*\[structure\.stops\]", re.M)
_TOML_WORDS = ("true", "false", "inf", "nan")
_DAMPING = ("pendulum_damping", "oscillator_damping")


MACHINES = ("system", "physical", "structure")
# Keys that say that a structure is given by its modes.
_MODAL = ("frequencies", "shapes", "modal_mass")


@dataclass(frozen=True)
class SystemFile:
    """What a system file holds.

    Attributes
    ----------
    machine
        The machine that it describes; what flags describe where there is no file.
    run
        The [run] table.
    """

    machine: Description = field(default_factory=DescribedSystem)
    run: dict[str, Any] = field(default_factory=dict)


def read(path: Path) -> SystemFile:
    """Read a system file.

    Raises
    ------
    ParameterError
        If it cannot be read or is neither TOML nor JSON, or a table or key is unknown or missing;
        names what is allowed.
    """
    json_kind = path.suffix.lower() == ".json"
    text = ""
    try:
        text = path.read_text(encoding="utf-8")
        tables = json.loads(text) if json_kind else tomllib.loads(text)
    except OSError as error:
        raise ParameterError(f"--system {path}: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        hint = "" if json_kind else _unquoted(text) or _single_brackets(text)
        kind = "JSON" if json_kind else "TOML"
        raise ParameterError(f"{path}: not a {kind} file: {error}{hint}") from error
    if json_kind:
        return SystemFile(_of_json(path, tables))
    _check_names(f"{path}", tables, (*MACHINES, "run"))
    for name, table in tables.items():
        if not isinstance(table, dict):
            raise ParameterError(f"{path}: {name} = {table!r} is not allowed; allowed: a table")
    given = [name for name in MACHINES if name in tables]
    if len(given) > 1:
        both = " and ".join(f"[{name}]" for name in given)
        raise ParameterError(f"{path}: give one of the tables {both}, not both")
    run = tables.get("run", {})
    _check_names(f"{path}, [run]", run, RUN_KEYS)
    kinds = {"system": _system, "physical": _physical, "structure": _structure}
    name = given[0] if given else "system"
    return SystemFile(kinds[name](path, tables.get(name, {})), run)


def _of_json(path: Path, fields: Any) -> Description:
    if not isinstance(fields, dict):
        raise ParameterError(f"{path} is not allowed; allowed: an object as to_json writes it")
    if "stops" in fields:
        return _structure(path, fields)
    _check_names(f"{path}", fields, arguments_of(System)[0])
    with naming_the_file(f"{path}"):
        return DescribedSystem(made=System.from_dict(fields))


def _system(path: Path, fields: dict[str, Any]) -> Description:
    _check_names(f"{path}, [system]", fields, arguments_of(System)[0])
    return DescribedSystem(_without_shorthand(path, fields))


def _physical(path: Path, quantities: dict[str, Any]) -> Description:
    where = f"{path}, [physical]"
    names, needed = arguments_of(System.from_physical)
    _check_names(where, quantities, names)
    _check_missing(where, quantities, needed)
    return DescribedSystem(made=_machine(path, quantities))


def _structure(path: Path, table: dict[str, Any]) -> Description:
    where = f"{path}, [structure]"
    modal = not table.keys().isdisjoint(_MODAL)
    maker = Structure.from_modes if modal else Structure
    names, needed = arguments_of(maker)
    _check_names(where, table, names if modal else (*names, *_MODAL))
    _check_missing(where, table, needed)
    stops = table["stops"]
    if not isinstance(stops, list) or not all(isinstance(stop, dict) for stop in stops):
        raise ParameterError(
            f"{where}: stops = {stops!r} is not allowed; allowed: a table [[structure.stops]], in "
            "double brackets, for each stop, or stops = []"
        )
    for place, stop in enumerate(stops):
        _check_names(f"{where}, stops[{place}]", stop, arguments_of(Stop)[0])
    fields = dict(table)
    if "drive_amplitude" in fields:
        with naming_the_file(where):
            fields["drive_amplitude"] = drive_of_pairs(fields["drive_amplitude"])
    return DescribedStructure(fields, path)


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


def _single_brackets(text: str) -> str:
    """Return what to add where the stops of a structure are no array of tables."""
    if _ONE_STOP.search(text):
        return "; each stop is a table [[structure.stops]], in double brackets"
    return ""


def _check_names(where: str, table: dict[str, Any], allowed: Collection[str]) -> None:
    unknown = sorted(set(table) - set(allowed))
    if unknown:
        hint = close_to(unknown[0], allowed)
        raise ParameterError(
            f"{where}: unknown: {', '.join(unknown)}{hint or ';'} allowed: {', '.join(allowed)}"
        )


def _check_missing(where: str, table: dict[str, Any], needed: Collection[str]) -> None:
    missing = sorted(set(needed) - set(table))
    if missing:
        raise ParameterError(f"{where}: missing: {', '.join(missing)}")


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
