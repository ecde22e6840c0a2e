"""Fuzz the Python entry points, guided by the coverage of the package's Python code (atheris).

    python fuzz/python_entry.py [--runs N]

Each execution makes a system, a start and arguments of any numbers and calls one public function:
what comes back is a result without NaN or one of the package's errors. Prints executions and
memory; needs ``pip install atheris``.
"""

import argparse
import json
import math
import resource
import sys
from pathlib import Path

import atheris

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "python"))
with atheris.instrument_imports(include=["vibroimpact"]):
    import vibroimpact as vi
    from vibroimpact.system import NUMERIC_RANGES

from every_input import NOT_NEGATIVE, REFUSALS, SPECIAL, assert_no_nan, is_short

# Bytes of the longest input: every number takes nine.
LONGEST = 400
LOOKS = 10


class Draw:
    """Arguments from bytes."""

    def __init__(self, data: bytes) -> None:
        self.provider = atheris.FuzzedDataProvider(data)

    def number(self) -> object:
        """Return a number of any kind, sometimes none."""
        kind = self.provider.ConsumeIntInRange(0, 15)
        if kind == 0:
            return SPECIAL[self.provider.ConsumeIntInRange(0, len(SPECIAL) - 1)]
        if kind == 1:
            return self.provider.ConsumeFloat()
        if kind == 2:
            return self.provider.ConsumeInt(4)
        if kind == 3:
            return self.provider.ConsumeUnicode(3)
        return self.provider.ConsumeFloatInRange(-4.0, 4.0)

    def floating(self) -> float:
        """Return a finite float."""
        value = self.number()
        return float(value) if isinstance(value, float) and math.isfinite(value) else 0.5

    def system(self) -> vi.System:
        """Return a system, as a rule one in range."""
        if self.provider.ConsumeIntInRange(0, 7) == 0:
            return vi.System(**{name: self.number() for name in NUMERIC_RANGES})
        fields = {name: self.floating() for name in NUMERIC_RANGES}
        fields |= {name: abs(fields[name]) for name in NOT_NEGATIVE}
        fields["restitution"] = abs(math.fmod(fields["restitution"], 1.0))
        laws = ("poisson", "newton", "energetic", "paper")
        return vi.System(**fields, law=laws[self.provider.ConsumeIntInRange(0, 3)])


def one(data: bytes) -> None:
    """One execution."""
    draw = Draw(data)
    try:
        system = draw.system()
        choice = draw.provider.ConsumeIntInRange(0, 3)
        if choice == 0:
            steps = draw.provider.ConsumeIntInRange(0, 30) or None
            before = {name: draw.number() for name in ("x1", "v1", "v2")}
            row = vi.impact(system, **before, steps=steps)
            assert row["regime"] < 0 or math.isfinite(row["v1_post"]), row
        elif choice == 1:
            assert vi.System.from_json(system.to_json()) == system
            assert system.replace(**{"gap": draw.number()}).drive_period > 0
        else:
            periods = draw.provider.ConsumeIntInRange(0, 2)
            initial = [draw.floating() for _ in range(4)]
            if is_short(system, periods) and max(map(abs, initial)) < 10:
                run = vi.simulate(system, initial=initial, periods=periods, max_events=20)
                assert_no_nan(run)
    except REFUSALS:
        pass


def main() -> None:
    """Run, and print what was run at the end and on the way."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=100_000)
    runs = parser.parse_args().runs
    done = 0

    def counted(data: bytes) -> None:
        nonlocal done
        one(data)
        done += 1
        if done % (runs // LOOKS) == 0:
            megabytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
            print(json.dumps({"executions": done, "megabytes": megabytes}), flush=True)

    limits = [f"-max_len={LONGEST}", "-timeout=30", "-len_control=0"]
    atheris.Setup([sys.argv[0], f"-runs={runs}", *limits], counted)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
