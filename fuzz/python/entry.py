"""Fuzz the public Python functions, guided by the coverage of the package's Python code (atheris).

    python fuzz/python/entry.py [--runs N] [--seconds S] [--report FILE] [--seed S] [--unguided]

Each execution draws a function and its arguments from bytes (tests/python/drawn_calls.py): what
comes is a typed error or a result whose numbers are numbers. An execution may take so many seconds
of processor time; then it is interrupted as by Ctrl-C, which it must hear. The compiled core is not
instrumented: its panics, hangs and NaN are found, but do not guide. Needs ``pip install atheris``,
but for ``--unguided``: then the bytes are random, and an execution costs a fraction. Findings do
not stop it; each kind is printed once, with its bytes, and the exit code is 1.
"""

import argparse
import collections
import json
import os
import random
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "python"))

# Bytes of the longest input: a number takes at most nine.
LONGEST = 200
# Executions after which memory counts as warmed up, and between looks at it.
WARM, LOOK = 5_000, 1_000
# Seconds after which one that does not hear the interrupt is a hang.
HANGS = 120


class Record:
    """What was executed, what came of it, and how much memory it took."""

    def __init__(self, options: argparse.Namespace, execute: Callable[[bytes], Any]) -> None:
        self.runs, self.seconds, self.report = options.runs, options.seconds, options.report
        self.execute, self.guided = execute, not options.unguided
        self.counts: dict[str, collections.Counter[str]] = collections.defaultdict(
            collections.Counter
        )
        self.findings: dict[str, str] = {}
        self.slow: collections.Counter[str] = collections.Counter()
        self.done, self.warm, self.most = 0, 0, 0
        self.began = time.monotonic()

    def one(self, data: bytes) -> None:
        """Execute once."""
        signal.setitimer(signal.ITIMER_VIRTUAL, self.seconds)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                name, outcome = self.execute(data)
            self.counts[name][outcome] += 1
        except KeyboardInterrupt:
            self.slow[data.hex()] += 1
        except BaseException as error:
            self.found(data, error)
        finally:
            signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        self.done += 1
        if self.done % LOOK == 0:
            self.look()

    def found(self, data: bytes, error: BaseException) -> None:
        """Tell of a finding, once for each place."""
        last = traceback.extract_tb(error.__traceback__)[-1]
        kind = f"{type(error).__name__} at {Path(last.filename).name}:{last.lineno}"
        if kind not in self.findings:
            self.findings[kind] = data.hex()
            print(f"FOUND {kind}: {error!r:.300} from {data.hex()}", flush=True)

    def look(self) -> None:
        """Look at the memory, and write the report."""
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        resident = pages * os.sysconf("SC_PAGE_SIZE") // 2**20
        if self.done == WARM:
            self.warm = resident
        self.most = max(self.most, resident)
        told = {
            "executions": self.done,
            "seconds": round(time.monotonic() - self.began),
            "functions": sum(1 for _ in self.counts),
            "guided": self.guided,
            "outcomes": sum(self.counts.values(), collections.Counter()),
            "interrupted": sum(self.slow.values()),
            "findings": len(self.findings),
            "megabytes": resident,
            "megabytes when warm": self.warm,
        }
        if self.done % (10 * LOOK) == 0 or self.done >= self.runs:
            print(json.dumps(told), flush=True)
        if self.report is not None:
            more = {"counts": self.counts, "found": self.findings, "slow": [*self.slow]}
            self.report.write_text(json.dumps(told | more, indent=1), encoding="utf-8")
        if self.done >= self.runs:
            os._exit(bool(self.findings))


def interrupt(number: int, frame: FrameType | None) -> None:
    """Come like Ctrl-C."""
    raise KeyboardInterrupt


def main() -> None:
    """Run, and print what was run at the end and on the way."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=100_000)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--report", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--unguided", action="store_true")
    options = parser.parse_args()
    signal.signal(signal.SIGVTALRM, interrupt)
    if options.unguided:
        from drawn_calls import calls, execute

        calls()  # what is common to all of them
        record, draw = Record(options, execute), random.Random(options.seed)
        while True:
            record.one(draw.randbytes(draw.randrange(LONGEST)))
    import atheris

    with atheris.instrument_imports(include=["vibroimpact"]):
        from drawn_calls import calls, execute
    calls()
    record = Record(options, execute)
    limits = [f"-max_len={LONGEST}", f"-timeout={HANGS}", "-len_control=0", "-rss_limit_mb=4096"]
    limits += [f"-report_slow_units={HANGS}", f"-artifact_prefix={tempfile.gettempdir()}/"]
    # More than are wanted: those of libFuzzer itself count, too.
    runs = [f"-runs={2 * options.runs}", f"-seed={options.seed}"]
    atheris.Setup([sys.argv[0], *runs, *limits], record.one)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
