"""Run time against error on the paper's motions, beside SciPy's ``solve_ivp`` with events.

Run as ``python benches/work_precision`` (or ``make bench``); some ten minutes.
"""

import argparse
from pathlib import Path

import matplotlib as mpl

from measure import measure
from report import write
from scenes import REFERENCE, read_scenes


def main() -> None:
    """Parse the options, measure, and write the results."""
    parser = argparse.ArgumentParser(prog="work_precision", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "out")
    parser.add_argument("--reference", type=Path, default=REFERENCE)
    parser.add_argument("--scenes", nargs="+", help="names of the scenes (default: all)")
    parser.add_argument("--periods", type=int, default=25, choices=range(1, 26), metavar="1...25")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument(
        "--max-seconds",
        type=float,
        default=2.0,
        help="do not tighten a method's tolerance after a run longer than this",
    )
    options = parser.parse_args()

    scenes = read_scenes(options.reference)
    if options.scenes:
        scenes = [scene for scene in scenes if scene.name in options.scenes]
    if not scenes:
        parser.error("no scene of that name")
    mpl.use("Agg")
    rows = measure(
        scenes,
        periods=options.periods,
        rounds=options.rounds,
        max_seconds=options.max_seconds,
    )
    write(rows, options.out, periods=options.periods)
    print((options.out / "work_precision.md").read_text(encoding="utf-8"))
    print(f"written to {options.out}")


if __name__ == "__main__":
    main()
