"""Makes the reference data anew and compares them with what is committed, number by number.

    python -m reference.regenerate [FILE ...] [--write]    (in tests/; `make reference`)

Every printed digit must be the same. The errors that a row states for itself are differences of two
computations, and depend on the last bits of the arithmetic library: a new one may be up to ten
times the committed one. Ends with status 1 if anything differs; --write replaces the files instead.
"""

from __future__ import annotations

import argparse
import json
import sys
import time as clock
from collections.abc import Callable, Iterator
from typing import Any

from . import generate_contact, generate_orbits
from .generate import DATA, flight_cases, flight_record
from .ladder import graze_records

Row = dict[str, Any]
#: Fields that state the error of a row, and by how much they may grow.
STATED, GROWTH = ("error", "multiplier_error"), 10.0


def _flights() -> Iterator[tuple[str, Row]]:
    for number, case in enumerate(flight_cases()):
        yield str(number), flight_record(case)


def _near_grazes() -> Iterator[tuple[str, Row]]:
    for number, row in enumerate(graze_records()):
        yield str(number), row


def _contact() -> Iterator[tuple[str, Row]]:
    for name, scene in generate_contact.SCENES.items():
        yield name, generate_contact.scene_record(scene)


def _orbits() -> Iterator[tuple[str, Row]]:
    for name, scene in generate_orbits.SCENES.items():
        yield name, generate_orbits.scene_record(scene)


#: What makes the rows of each file, with their names; those of a list are named by their number.
MAKERS: dict[str, Callable[[], Iterator[tuple[str, Row]]]] = {
    "flights.json": _flights,
    "near_grazes.json": _near_grazes,
    generate_contact.NAME: _contact,
    generate_orbits.NAME: _orbits,
}


def read(name: str) -> dict[str, Row]:
    """The rows of a committed file by their names."""
    data = json.loads((DATA / name).read_text())
    rows: dict[str, Row] = data if isinstance(data, dict) else {}
    return rows or {str(number): row for number, row in enumerate(data)}


def differences(committed: Row, made: Row) -> list[str]:
    """Fields that are not the same in a committed row and in one made anew."""
    wrong = list(committed.keys() ^ made.keys())
    for key in committed.keys() & made.keys():
        old, new = committed[key], made[key]
        if key in STATED:
            same = float(new) <= GROWTH * float(old)
        else:
            # as JSON, in which a tuple is a list
            same = json.loads(json.dumps(new)) == old
        if not same:
            wrong.append(key)
    return sorted(wrong)


def compare(name: str) -> int:
    """Print where a file differs from what its generator makes; the number of such rows."""
    committed, made, wrong = read(name), set[str](), 0
    began = clock.perf_counter()
    for row_name, row in MAKERS[name]():
        made.add(row_name)
        fields = differences(committed.get(row_name, {}), row)
        if fields:
            wrong += 1
            print(f"{name}, {row_name}: {', '.join(fields)} differ", flush=True)
    for row_name in committed.keys() - made:
        wrong += 1
        print(f"{name}, {row_name}: made by no generator")
    seconds = clock.perf_counter() - began
    print(f"{name}: {len(committed)} rows, {wrong} differ, {seconds:.0f} s", flush=True)
    return wrong


def write(name: str) -> None:
    """Replace a file by what its generator makes, one row on a line."""
    rows = list(MAKERS[name]())
    if rows[0][0] == "0":
        lines = [json.dumps(row) for _, row in rows]
        begin, end = "[", "]"
    else:
        lines = [f"{json.dumps(row_name)}: {json.dumps(row)}" for row_name, row in rows]
        begin, end = "{", "}"
    (DATA / name).write_text(begin + "\n" + ",\n".join(lines) + f"\n{end}\n")
    print(f"{name}: {len(rows)} rows written", flush=True)


def main(arguments: list[str] | None = None) -> int:
    """Command line; see the module's text."""
    parser = argparse.ArgumentParser(prog="python -m reference.regenerate")
    parser.add_argument("files", nargs="*", metavar="FILE", help=", ".join(MAKERS))
    parser.add_argument("--write", action="store_true", help="write the files anew")
    given = parser.parse_args(arguments)
    if unknown := set(given.files) - MAKERS.keys():
        parser.error(f"no generated file {', '.join(sorted(unknown))}")
    names = given.files or list(MAKERS)
    if given.write:
        for name in names:
            write(name)
        return 0
    return int(sum([compare(name) for name in names]) > 0)


if __name__ == "__main__":
    sys.exit(main())
