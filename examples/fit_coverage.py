"""How often true values lie within two standard errors of fits, over random machines; a picture.

    python examples/fit_coverage.py [machines] [path of the picture]

Each machine makes a motion at random. It is measured with 1 % noise: times of impacts (1 % of their
median interval), or x1, x1', x1'', x2 (1 % of the standard deviation). The fit starts from values
that are wrong by up to 15 or 30 %. Motions with sustained contact, or less than 15 impacts, are
drawn anew. Errors of unknowns that the record leaves open count, too: they are stated as large.
The table of docs/fitting.md is that of 200 machines.
"""

from __future__ import annotations

import math
import sys
from collections import Counter
from dataclasses import dataclass

import numpy as np
from matplotlib import pyplot

import vibroimpact as vi

PERIODS, LEAST_IMPACTS = 25, 15
KINDS = ("impact_times", "x1", "v1", "a1", "x2")
UNKNOWN = ("restitution", "friction", "gap", "pendulum_damping", "start")
COORDINATES = ("x1", "v1", "x2", "v2")
NOT_LINEAR = "fits, an error not linear"


@dataclass(frozen=True)
class Case:
    """A machine, its motion, what was measured, and where the search starts."""

    run: vi.Run
    record: vi.Record
    guess: vi.System
    initial: tuple[float, ...]


def machine(random: np.random.Generator) -> vi.System:
    """Draw a machine."""
    return vi.System(
        mass_ratio=random.uniform(0.2, 1.5),
        frequency_ratio=random.uniform(0.5, 2.5),
        restitution=random.uniform(0.4, 0.95),
        gap=random.uniform(0.05, 0.5),
        drive_frequency=random.uniform(0.7, 2.5),
        pendulum_damping=random.uniform(0.01, 0.1),
        oscillator_damping=random.uniform(0.01, 0.1),
        moment_amplitude=random.uniform(0.5, 2.0),
        force_amplitude=random.uniform(0.0, 0.5),
        friction=random.uniform(0.05, 0.4),
        phase=random.uniform(0.0, 6.0),
    )


def case(seed: int) -> Case | None:
    """Draw a measured motion; None if it is none to be fitted."""
    random = np.random.default_rng(seed)
    system = machine(random)
    start = (0.0, random.uniform(-0.5, 0.5), 0.0, random.uniform(-0.3, 0.3))
    run = vi.simulate(system, initial=start, periods=PERIODS)
    if len(run.impacts) < LEAST_IMPACTS or run.time_in_contact > 0.0:
        return None
    kind = KINDS[seed % len(KINDS)]
    if kind == "impact_times":
        noise = 0.01 * float(np.median(np.diff(run.impacts["time"])))
        record = vi.measure(run, kind, noise=noise, seed=seed)
    else:
        step = system.drive_period / 20.0
        noise = 0.01 * float(vi.measure(run, kind, sampling=step).values.std())
        record = vi.measure(run, kind, noise=noise, sampling=step, seed=seed)
    guess = system.replace(
        restitution=min(system.restitution * random.uniform(0.85, 1.15), 0.99),
        friction=system.friction * random.uniform(0.7, 1.3),
        gap=system.gap * random.uniform(0.9, 1.1),
        pendulum_damping=system.pendulum_damping * random.uniform(0.7, 1.3),
    )
    return Case(run, record, guess, (0.0, 0.9 * start[1], 0.0, 0.9 * start[3]))


def deviations(found: vi.Fit, run: vi.Run) -> np.ndarray:
    """Return how many standard errors the values found are off."""
    true = dict(zip(COORDINATES, run.initial, strict=True)) | run.system.to_dict()
    return np.array([(found.values[n] - true[n]) / found.errors[n] for n in found.names])


def fitted(machines: int, first: int = 0) -> tuple[Counter[str], dict[str, np.ndarray]]:
    """Fit so many machines; return their verdicts, and the deviations by what is said of them."""
    verdicts: Counter[str] = Counter()
    off: dict[str, list[float]] = {"fits": [], NOT_LINEAR: [], "not identifiable": []}
    seed = first
    while verdicts.total() < machines:
        drawn = case(seed)
        seed += 1
        if drawn is None:
            continue
        found = vi.fit(drawn.record, drawn.guess, unknown=UNKNOWN, initial=drawn.initial)
        verdicts[found.verdict] += 1
        if found.verdict in off:
            bent = ("is no linear one", "another motion may be the right one")
            linear = not any(text in reason for reason in found.reasons for text in bent)
            said = found.verdict if linear or found.verdict != "fits" else NOT_LINEAR
            off[said] += deviations(found, drawn.run).tolist()
    return verdicts, {verdict: np.array(each) for verdict, each in off.items()}


def main() -> None:
    """Fit, print the coverage, and draw it at all levels."""
    machines = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    path = sys.argv[2] if len(sys.argv) > 2 else "fit_coverage.png"
    verdicts, by_verdict = fitted(machines)
    off = np.concatenate([*by_verdict.values()])
    print(", ".join(f"{count} {verdict}" for verdict, count in verdicts.most_common()))
    for verdict, each in (*by_verdict.items(), ("together", off)):
        inside = np.mean(np.abs(each) <= 2.0) if len(each) else math.nan
        print(f"{verdict}: {len(each)} values, {inside:.1%} within two standard errors")
    levels = np.linspace(0.0, 3.0, 61)
    stated = [math.erf(level / math.sqrt(2.0)) for level in levels]
    colors = {"fits": "#0072B2", NOT_LINEAR: "#CC79A7", "not identifiable": "#E69F00"}
    _, ax = pyplot.subplots(figsize=(4.2, 3.8), layout="constrained")
    ax.plot([0, 1], [0, 1], color="0.6", lw=0.8)
    for verdict, each in by_verdict.items():
        seen = [float(np.mean(np.abs(each) <= level)) for level in levels if len(each)]
        ax.plot(stated[: len(seen)], seen, color=colors[verdict], label=verdict)
    two = math.erf(2.0 / math.sqrt(2.0))
    ax.plot([two], [np.mean(np.abs(off) <= 2.0)], "o", color="#D55E00", label="two standard errors")
    ax.set_xlabel("stated probability")
    ax.set_ylabel("part of the true values inside")
    ax.legend(frameon=False, loc="lower left", bbox_to_anchor=(0, 1), fontsize="small", ncols=2)
    pyplot.savefig(path, dpi=160)


if __name__ == "__main__":
    main()
