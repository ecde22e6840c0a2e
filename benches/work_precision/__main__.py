"""Run time against error on motions of every kind, beside other solvers.

Run as ``python benches/work_precision`` (or ``make bench``); some five minutes. Every scene has a
reference of 25 digits; a solver that is not installed is named in the tables. Written are every
point (CSV), tables, a small one for the README, and two diagrams.
"""

import argparse
import sys
from pathlib import Path

import matplotlib as mpl

sys.path.insert(0, str(Path(__file__).parents[1]))

from measure import measure
from report import write
from scenes import FIRST, read_scenes


def main(arguments: list[str] | None = None) -> None:
    """Parse the options, measure, and write the results."""
    parser = argparse.ArgumentParser(prog="work_precision", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "out")
    parser.add_argument("--scenes", nargs="+", default=(), help="names of the scenes")
    parser.add_argument("--rounds", type=int, default=11)
    parser.add_argument("--quick", action="store_true", help="a trial of all parts, no figures")
    parser.add_argument(
        "--max-seconds",
        type=float,
        default=2.0,
        help="do not tighten a method's tolerance after a run longer than this, nor repeat it",
    )
    options = parser.parse_args(arguments)
    names = options.scenes or (FIRST if options.quick else ())
    try:
        scenes = read_scenes(names)
    except KeyError as error:
        parser.error(f"no scene {error}")
    mpl.use("Agg")
    measured = measure(
        scenes,
        rounds=1 if options.quick else options.rounds,
        max_seconds=0.05 if options.quick else options.max_seconds,
    )
    write(measured, options.out)
    print((options.out / "work_precision.md").read_text(encoding="utf-8"))
    print(f"written to {options.out}")


if __name__ == "__main__":
    main()
