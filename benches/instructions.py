"""Instructions of the hot kernels (instructions.rs), counted by valgrind, beside those committed.

    python benches/instructions.py [--update] [--margin 0.03]

A count is the difference between two runs with different numbers of repetitions, so that what
happens once drops out; the same program gives the same count. Exit code 1: a kernel costs more
than its committed count by more than the margin, or there is none of it; 2: nothing was counted.
``--update`` writes benches/instructions.json anew. The yardstick G is counted too, as a measure,
but not judged: it is no code of ours.

By another compiler than the committed counts a kernel has a wider margin (docs/performance-notes.md
says how they differ). Where the program finds other vector instructions, it is not judged; valgrind
shows it those of the machine up to AVX2 and FMA, never AVX-512.
"""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import native
from machine import cores, processor

HERE = Path(__file__).parent
COMMITTED = HERE / "instructions.json"
YARDSTICK = "yardstick G"
# Part by which a count may grow; by another compiler or C library.
MARGIN, OTHER_COMPILER = 0.03, 0.12
# A few instructions more are no change, however little a kernel does.
SLACK = 4.0
# Without them other instructions are run, and counts say nothing.
MUST_AGREE = ("target", "vector instructions", "fused operations")
# None of the user's settings: valgrind's and the C library's change what is counted.
ENVIRONMENT = {"PATH": os.environ.get("PATH", os.defpath), "LC_ALL": "C"}


# Counts only, without a model of caches and without a profile.
VALGRIND = ("valgrind", "--tool=cachegrind", "--cache-sim=no", "--cachegrind-out-file=/dev/null")


class CannotCount(Exception):
    """Why there are no counts."""


@dataclass(frozen=True)
class Kernel:
    """What is counted, as the program lists it, and the program that runs it."""

    name: str
    unit: str
    units: int
    repetitions: tuple[int, int]
    minus: str | None
    command: tuple[str, ...]


@dataclass(frozen=True)
class Row:
    """A kernel's committed count (None: there is none), the present one, and what follows."""

    name: str
    committed: float | None
    now: float | None
    verdict: str

    @property
    def failed(self) -> bool:
        """Whether this row must be seen to."""
        return self.verdict in ("more", "new", "gone")


def compare(
    committed: Mapping[str, float], now: Mapping[str, float], margin: float = MARGIN
) -> list[Row]:
    """Judge each present count, then those that are committed and were not counted."""
    rows = []
    for name in [*now, *(name for name in committed if name not in now)]:
        old, new = committed.get(name), now.get(name)
        if old is None or new is None:
            verdict = "new" if old is None else "gone"
        elif name == YARDSTICK:
            verdict = "-"
        elif new > old * (1.0 + margin) + SLACK:
            verdict = "more"
        elif new < old * (1.0 - margin) - SLACK:
            verdict = "less"
        else:
            verdict = "same"
        rows.append(Row(name, old, new, verdict))
    return rows


def differences(kernels: Sequence[Kernel], whole: Mapping[str, float]) -> dict[str, float]:
    """Subtract from a kernel's count that of the kernel it is measured against."""
    return {
        kernel.name: round(whole[kernel.name] - (whole[kernel.minus] if kernel.minus else 0.0), 1)
        for kernel in kernels
    }


def table(rows: Sequence[Row], units: Mapping[str, str]) -> str:
    """Return the rows as text."""
    lines = [f"{'kernel':44}{'per':14}{'committed':>12}{'now':>12}{'ratio':>8}  verdict"]
    for row in rows:
        ratio = f"{row.now / row.committed:8.3f}" if row.now and row.committed else f"{'':8}"
        counts = "".join(
            f"{'':12}" if count is None else f"{count:12,.1f}" for count in (row.committed, row.now)
        )
        lines.append(f"{row.name:44}{units.get(row.name, ''):14}{counts}{ratio}  {row.verdict}")
    return "\n".join(lines)


def instructions(log: str) -> int:
    """Read the number of instructions from valgrind's log.

    Raises
    ------
    CannotCount
        If there is none.
    """
    found = re.search(r"I\s+refs:\s+([\d,]+)", log)
    if found is None:
        raise CannotCount(f"valgrind gave no count:\n{log}")
    return int(found[1].replace(",", ""))


def count(kernel: Kernel) -> float:
    """Return the instructions per unit of a kernel's work."""
    low, high = kernel.repetitions
    few, many = (_run([*VALGRIND, *kernel.command, str(n)]).stderr for n in (low, high))
    return (instructions(many) - instructions(few)) / (kernel.units * (high - low))


def read_kernels(program: str) -> list[Kernel]:
    """Return what the program can run, and the yardstick."""
    listed = json.loads(_run([program, "--list"]).stdout)
    kernels = [
        Kernel(**{**given, "repetitions": tuple(given["repetitions"])}, command=(program, name))
        for given in listed
        for name in [given["name"]]
    ]
    yardstick = str(native.program(HERE / "yardstick.c"))
    return [*kernels, Kernel(YARDSTICK, "evaluation", 1, (1000, 11000), None, (yardstick,))]


def build() -> str:
    """Compile the kernels and return the program's path."""
    command = ["cargo", "bench", "--no-run", "--locked", "--bench", "instructions"]
    done = subprocess.run(
        [*command, "--message-format=json-render-diagnostics"],
        cwd=HERE.parent,
        stdout=subprocess.PIPE,
        text=True,
        check=False,
    )
    if done.returncode:
        raise CannotCount("the kernels could not be compiled")
    messages = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    paths = [m["executable"] for m in messages if m.get("target", {}).get("name") == "instructions"]
    return str(paths[-1])


def read_conditions(program: str) -> dict[str, str]:
    """Return what counts depend on: compiler, target, C library, instructions under valgrind."""
    rustc = _run(["rustc", "-vV"]).stdout
    seen = json.loads(_run(["valgrind", "-q", "--tool=none", program, "--conditions"]).stdout)
    return {
        "rustc": _after("release: ", rustc),
        "target": _after("host: ", rustc),
        "C library": os.confstr("CS_GNU_LIBC_VERSION") or "unknown",
        "vector instructions": seen["vector"],
        "fused operations": "yes" if seen["fused"] else "no",
    }


def _after(label: str, text: str) -> str:
    found = re.search(f"{label}(.+)", text)
    return found[1] if found else "unknown"


def _run(command: Sequence[str]) -> subprocess.CompletedProcess[str]:
    environment = None if command[0] == "rustc" else ENVIRONMENT
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    if done.returncode:
        raise CannotCount(f"{' '.join(command)}: exit code {done.returncode}\n{done.stderr}")
    return done


def main(arguments: list[str] | None = None) -> int:
    """Count, compare and print, or write the counts; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--update", action="store_true", help="write the committed counts anew")
    parser.add_argument("--margin", type=float, help="part by which a count may grow")
    options = parser.parse_args(arguments)
    if shutil.which("valgrind") is None:
        print("valgrind is needed (Debian: apt-get install valgrind)", file=sys.stderr)
        return 2
    try:
        program = build()
        conditions = read_conditions(program)
        kernels = read_kernels(program)
        with ThreadPoolExecutor(cores()) as pool:
            whole = dict(zip((k.name for k in kernels), pool.map(count, kernels), strict=True))
    except (CannotCount, OSError) as error:
        print(error, file=sys.stderr)
        return 2
    now = differences(kernels, whole)
    if options.update:
        text = json.dumps({"conditions": conditions, "counts": now}, indent=1)
        COMMITTED.write_text(text + "\n", encoding="utf-8")
    committed = json.loads(COMMITTED.read_text(encoding="utf-8"))
    return report(committed, conditions, now, {k.name: k.unit for k in kernels}, options.margin)


def report(
    committed: Mapping[str, Any],
    conditions: Mapping[str, str],
    now: Mapping[str, float],
    units: Mapping[str, str],
    margin: float | None = None,
) -> int:
    """Print the table with what it stands on; returns the exit code."""
    then = committed["conditions"]
    print(f"counted on {processor()}: {_listed(conditions)}")
    changed = [name for name in conditions if conditions[name] != then.get(name)]
    if changed:
        print(f"the committed counts: {_listed(then)}")
    if margin is None:
        margin = OTHER_COMPILER if changed else MARGIN
    rows = compare(committed["counts"], now, margin)
    print(table(rows, units))
    if set(changed) & set(MUST_AGREE):
        print("not judged: these are other instructions than those of the committed counts")
        return 0
    failed = [row.name for row in rows if row.failed]
    saved = [row.name for row in rows if row.verdict == "less"]
    if failed:
        print(f"cost more by over {margin:.0%}, or only on one side: {', '.join(failed)}")
    if saved:
        print(f"cost less by over {margin:.0%}: {', '.join(saved)}")
    if failed or saved:
        print("if that is meant: make instructions-update")
    return 1 if failed else 0


def _listed(conditions: Mapping[str, str]) -> str:
    return ", ".join(f"{name} {value}" for name, value in conditions.items())


if __name__ == "__main__":
    sys.exit(main())
