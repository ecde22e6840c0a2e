"""Makes the reference data anew and compares them with what is committed, number by number.

    python -m reference.regenerate [FILE ...] [--only PART ...] [--write] [--workers N]

(in tests; `make reference`).

Every printed digit must be the same. The errors that a row states for itself are differences of two
computations, and depend on the last bits of the arithmetic library: a new one may be up to ten
times the committed one. Ends with status 1 if anything differs; --write replaces the files instead.
--only makes only these parts, such as one scene.
The parts of all files are shared among as many processes as there are processors, unless --workers
says otherwise; each is told when it is done, with the time it took.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import sys
import time as clock
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from . import (
    generate_contact,
    generate_orbits,
    generate_sensitivity,
    generate_structure_sensitivity,
    generate_structures,
    orbit_scenes,
    scenes,
    structure_cases,
)
from .generate import DATA, flight_cases, flight_record
from .ladder import graze_records

Row = dict[str, Any]
Named = list[tuple[str, Row]]
#: Fields that state the error of a row, and by how much they may grow.
STATED, GROWTH = ("error", "multiplier_error"), 10.0
#: Flights of one part.
FLIGHTS = 40


@dataclass(frozen=True)
class Maker:
    """What makes a file: the names of its parts, and the rows of one part with their names.

    Rows of a list are named by their number, in the order of the parts.
    """

    parts: Callable[[], Iterable[str]]
    rows: Callable[[str], Named]


def _flight_parts() -> list[str]:
    number = sum(1 for _ in flight_cases())
    return [f"{first}-{min(first + FLIGHTS, number) - 1}" for first in range(0, number, FLIGHTS)]


def _flights(part: str) -> Named:
    first, last = map(int, part.split("-"))
    cases = itertools.islice(enumerate(flight_cases()), first, last + 1)
    return [(str(number), flight_record(case)) for number, case in cases]


def _near_grazes(_: str) -> Named:
    """All in one part: each ladder goes on with the random numbers of the one before."""
    return [(str(number), row) for number, row in enumerate(graze_records())]


def _contact(name: str) -> Named:
    return [(name, generate_contact.scene_record(scenes.SCENES[name]))]


def _orbits(name: str) -> Named:
    return [(name, generate_orbits.scene_record(orbit_scenes.SCENES[name]))]


def _sensitivity(name: str) -> Named:
    return [(name, generate_sensitivity.scene_record(name))]


def _structure_sensitivity(name: str) -> Named:
    return [(name, generate_structure_sensitivity.scene_record(name))]


def _structures(name: str) -> Named:
    return [(name, generate_structures.case_record(structure_cases.CASES[name]))]


#: The makers of all generated files.
MAKERS: dict[str, Maker] = {
    "flights.json": Maker(_flight_parts, _flights),
    "near_grazes.json": Maker(lambda: ["all"], _near_grazes),
    generate_contact.NAME: Maker(lambda: scenes.SCENES, _contact),
    generate_orbits.NAME: Maker(lambda: orbit_scenes.SCENES, _orbits),
    generate_sensitivity.NAME: Maker(lambda: generate_sensitivity.SCENES, _sensitivity),
    generate_structure_sensitivity.NAME: Maker(
        lambda: generate_structure_sensitivity.SCENES, _structure_sensitivity
    ),
    generate_structures.NAME: Maker(lambda: structure_cases.CASES, _structures),
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


def make(name: str, part: str) -> tuple[Named, float]:
    """The rows of one part of a file, and the seconds that they took."""
    began = clock.perf_counter()
    return MAKERS[name].rows(part), clock.perf_counter() - began


@dataclass(frozen=True)
class Order:
    """A file with its parts, done already, on their way in other processes, or to be made here."""

    name: str
    parts: Sequence[tuple[str, Future[tuple[Named, float]] | None]]

    def rows(self) -> Iterator[tuple[str, Row]]:
        """All rows in their order; tells of each part once it is there."""
        for part, future in self.parts:
            rows, seconds = make(self.name, part) if future is None else future.result()
            print(f"  {self.name}, {part}: made in {seconds:.1f} s", flush=True)
            yield from rows


def ordered(parts: Mapping[str, Iterable[str]], pool: ProcessPoolExecutor | None) -> list[Order]:
    """The files with their parts handed to the pool, if there is one."""
    return [
        Order(
            name,
            [(part, None if pool is None else pool.submit(make, name, part)) for part in wanted],
        )
        for name, wanted in parts.items()
    ]


def compare(order: Order, *, whole: bool) -> int:
    """Print where a file differs from what its generator makes; the number of such rows."""
    name = order.name
    committed, made, wrong = read(name), set[str](), 0
    for row_name, row in order.rows():
        made.add(row_name)
        fields = differences(committed.get(row_name, {}), row)
        if fields:
            wrong += 1
            print(f"{name}, {row_name}: {', '.join(fields)} differ", flush=True)
    for row_name in committed.keys() - made if whole else ():
        wrong += 1
        print(f"{name}, {row_name}: made by no generator")
    print(f"{name}: {len(made)} rows, {wrong} differ", flush=True)
    return wrong


def write(order: Order) -> None:
    """Replace a file by what its generator makes, one row on a line."""
    rows = list(order.rows())
    if rows[0][0] == "0":
        lines = [json.dumps(row) for _, row in rows]
        begin, end = "[", "]"
    else:
        lines = [f"{json.dumps(row_name)}: {json.dumps(row)}" for row_name, row in rows]
        begin, end = "{", "}"
    (DATA / order.name).write_text(begin + "\n" + ",\n".join(lines) + f"\n{end}\n")
    print(f"{order.name}: {len(rows)} rows written", flush=True)


@contextmanager
def pool_of(workers: int) -> Iterator[ProcessPoolExecutor | None]:
    """Processes to make parts in; None for one alone, which makes them itself."""
    if workers == 1:
        yield None
        return
    pool = ProcessPoolExecutor(workers)
    try:
        yield pool
    finally:
        # where a part fails, and on Ctrl-C, the parts not yet begun are not waited for
        pool.shutdown(cancel_futures=True)


def processors() -> int:
    """Processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def main(arguments: list[str] | None = None) -> int:
    """Command line; see the module's text."""
    parser = argparse.ArgumentParser(prog="python -m reference.regenerate")
    parser.add_argument("files", nargs="*", metavar="FILE", help=", ".join(MAKERS))
    parser.add_argument("--only", nargs="+", metavar="PART", help="only these parts")
    parser.add_argument("--write", action="store_true", help="write the files anew")
    parser.add_argument("--workers", type=int, default=processors(), help="processes")
    given = parser.parse_args(arguments)
    if unknown := set(given.files) - MAKERS.keys():
        parser.error(f"no generated file {', '.join(sorted(unknown))}")
    if given.workers < 1:
        parser.error("--workers must be at least 1")
    parts = {name: [*MAKERS[name].parts()] for name in given.files or MAKERS}
    if given.only is not None:
        if given.write:
            parser.error("--only compares: a file is written as a whole")
        if unknown := set(given.only) - {part for each in parts.values() for part in each}:
            parser.error(f"no part {', '.join(sorted(unknown))}")
        chosen = {
            name: [part for part in each if part in given.only] for name, each in parts.items()
        }
        parts = {name: each for name, each in chosen.items() if each}
    began = clock.perf_counter()
    wrong = 0
    with pool_of(given.workers) as pool:
        for order in ordered(parts, pool):
            if given.write:
                write(order)
            else:
                wrong += compare(order, whole=given.only is None)
    print(f"in {clock.perf_counter() - began:.0f} s")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
