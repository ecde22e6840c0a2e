"""Builds the fuzz targets and runs them one after the other: `make fuzz`.

No tool beyond cargo and a C++ compiler: the stable compiler puts in the counters of covered code,
and the crate libfuzzer-sys brings the fuzzer. Ends with a table of executions; exit code 1 if a
target failed, whose input is then in fuzz/out/ and is run again by giving its file to the target's
binary (SHOW=1 prints what it stands for). The corpora stay in fuzz/out/, which is no part of the
repository: they grow again in minutes.
"""

import argparse
import os
import re
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
TARGETS = sorted(path.stem for path in (HERE / "targets").glob("*.rs"))
# Longest time of one execution, in seconds, and most memory of a target, in MB.
LIMITS = ["-timeout=10", "-rss_limit_mb=1024", "-max_len=400"]
COVERAGE = [
    "--cfg",
    "fuzzing",
    "-Cpasses=sancov-module",
    "-Cllvm-args=-sanitizer-coverage-level=4",
    "-Cllvm-args=-sanitizer-coverage-inline-8bit-counters",
    "-Cllvm-args=-sanitizer-coverage-pc-table",
]


def host() -> str:
    """The target triple of this machine: named, so that build scripts are not instrumented."""
    version = subprocess.run(["rustc", "-vV"], check=True, capture_output=True, text=True).stdout
    return re.search(r"^host: (.*)$", version, re.MULTILINE)[1]


def build(names: list[str]) -> Path:
    """Builds the targets and gives the folder of their binaries."""
    triple = host()
    command = ["cargo", "build", "--locked", "--release", "--target", triple]
    command += [f"--bin={name}" for name in names]
    environment = {**os.environ, "CARGO_ENCODED_RUSTFLAGS": "\x1f".join(COVERAGE)}
    subprocess.run(command, check=True, cwd=HERE, env=environment)
    target = Path(os.environ.get("CARGO_TARGET_DIR", HERE / "target"))
    return target / triple / "release"


def fuzz(binary: Path, out: Path, runs: int, seconds: int) -> tuple[int, int, int, bool]:
    """Runs one target: executions, their rate, peak memory in MB, whether all was well."""
    corpus = out / binary.name
    corpus.mkdir(parents=True, exist_ok=True)
    prefix = out / f"{binary.name}-"
    options = [f"-runs={runs}", f"-max_total_time={seconds}", f"-artifact_prefix={prefix}"]
    command = [binary, corpus, *LIMITS, *options, "-print_final_stats=1"]
    done = subprocess.run(command, check=False, capture_output=True, text=True, errors="replace")
    (out / f"{binary.name}.log").write_text(done.stderr)
    names = ("number_of_executed_units", "average_exec_per_sec", "peak_rss_mb")
    found = [re.search(rf"stat::{name}:\s+(\d+)", done.stderr) for name in names]
    executions, rate, memory = (int(match[1]) if match else 0 for match in found)
    return executions, rate, memory, done.returncode == 0


def main() -> int:
    """Builds, runs and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("targets", nargs="*", metavar="target", help=", ".join(TARGETS))
    parser.add_argument("--runs", type=int, default=100_000, help="executions of each target")
    parser.add_argument("--seconds", type=int, default=60, help="most time of each target")
    arguments = parser.parse_args()
    names = arguments.targets or TARGETS
    for name in names:
        if name not in TARGETS:
            parser.error(f"no target {name}; there are {', '.join(TARGETS)}")
    folder = build(names)
    out = HERE / "out"
    total, failed = 0, []
    print(f"{'target':12} {'executions':>12} {'per second':>12} {'peak MB':>8}")
    for name in names:
        executions, rate, memory, well = fuzz(folder / name, out, arguments.runs, arguments.seconds)
        total += executions
        verdict = "" if well else "  FAILED"
        print(f"{name:12} {executions:12} {rate:12} {memory:8}{verdict}", flush=True)
        if not well:
            failed.append(name)
    print(f"{'all':12} {total:12}")
    for name in failed:
        print(f"{name} failed: see {out / name}.log", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
