"""Compare labels of random structures with what becomes of their motions in 20,000 periods.

The truth uses no label of a short run: a motion is periodic if the last sections of a run of 20,600
drive periods return to 1e-9, or if Newton's method finds a stable orbit on which the run lies or
which it approaches; chaotic, or neither, by the exponents over the first and the last 10,000 of
20,000 further periods. Motions on which these do not agree, which have no exponents, or which look
chaotic over the first 2,000 of these periods and end periodic are left out. What differs is
printed.

    python examples/labels_of_structures.py [--count 400] [--seed 0]

A hundred structures take two minutes.
"""

import argparse
from collections import Counter

import numpy as np
from numpy.typing import NDArray

import vibroimpact as vi

# Drive periods of the runs that are labelled, those kept of them, and of the long ones.
PERIODS, KEPT = 600, 100
HALF, LONG = 10_600, 20_600
# ln of the growth beyond shear that is certain, as for labels.
CERTAIN = 8.0


def drawn(seed: int, number: int) -> vi.Structure:
    """Return a chain of two to four masses, one of which meets a stop or two, or its neighbour."""
    draw = np.random.default_rng([2026, seed, number])
    count = int(draw.integers(2, 5))
    masses, springs = draw.uniform(0.5, 2, count), draw.uniform(0.5, 3, count + 1)
    if draw.random() < 0.5:
        springs[-1] = 0
    stiffness = np.diag(springs[:-1] + springs[1:])
    stiffness -= np.diag(springs[1:-1], 1) + np.diag(springs[1:-1], -1)
    ratio = 10 ** draw.uniform(-2.5, -1) if draw.random() < 0.7 else 0.0
    rubs, two = draw.random() < 0.3, draw.random() < 0.5
    unit = np.eye(count)
    place = int(draw.integers(count))
    restitution, gap = draw.uniform(0.3, 0.95), draw.uniform(0, 0.5)
    friction = draw.uniform(0.05, 0.6) if rubs else 0.0
    rub = {"friction": friction, "tangent": unit[(place + 1) % count]} if rubs else {}
    stops = [vi.Stop(unit[place], gap, restitution, **rub)]
    if two and draw.random() < 0.5:
        other = gap if draw.random() < 0.5 else draw.uniform(0.05, 0.5)
        stops.append(vi.Stop(-unit[place], other, restitution, **rub))
    elif two:
        first = int(draw.integers(count - 1))
        if rubs:
            stops.append(vi.Stop(-unit[place], gap, restitution, **rub))
        else:
            between = unit[first] - unit[first + 1]
            stops.append(vi.Stop(between, draw.uniform(0.05, 0.5), draw.uniform(0.3, 0.95)))
    structure = vi.Structure(
        np.diag(masses),
        stiffness,
        stops,
        damping_ratios=ratio,
        drive_amplitude=unit[int(draw.integers(count))],
        drive_frequency=1.0,
        simultaneous="sequence",
    )
    frequency = draw.uniform(0.3, 1.6) * structure.frequencies[int(draw.integers(count))]
    return structure.replace(drive_frequency=max(frequency, 0.2))


def period(sections: NDArray[np.float64]) -> int:
    """Return the number of periods after which the last sections return, or 0."""
    rows = sections.reshape(len(sections), -1)
    small = max(1e-9 * np.ptp(rows, axis=0).max(), 1e-12 * abs(rows).max())
    for m in range(1, len(rows) // 4 + 1):
        near = abs(rows[-1] - rows[-1 - m]).max() <= small
        if near and abs(rows[-3 * m :] - rows[-4 * m : -m]).max() <= small:
            return m
    return 0


def state(run: vi.StructureRun) -> NDArray[np.float64]:
    """Return the state at the end of a run."""
    return np.array([run.final_state.q, run.final_state.v])


def tendency(structure: vi.Structure, start: NDArray[np.float64], periods: int) -> str:
    """Return whether perturbations grow, shrink, or neither is certain."""
    spectrum = vi.lyapunov_spectrum(structure, initial=start, periods=periods, most=1)
    grown = float(spectrum.exponents[0]) * spectrum.time
    error = float(spectrum.error[0]) * spectrum.time
    shear = np.log(periods)
    if abs(grown) > shear + CERTAIN and abs(grown) - 2 * error > shear:
        return "chaotic" if grown > 0 else "periodic"
    return "quasi-periodic"


def truth(structure: vi.Structure) -> tuple[str, int]:
    """Return the kind of the motion from rest, "" if it is not certain, and its drive periods."""
    rest = np.zeros((2, structure.coordinates))
    runs = [
        vi.simulate(structure, initial=rest, periods=periods, keep=keep)
        for periods, keep in ((PERIODS, 1), (HALF, 1), (LONG, 8_000))
    ]
    try:
        if runs[-1].stop_reason != "completed":
            return "", 0
        m = period(runs[-1].stroboscopic)
        motion = runs[-1].refine()
        if motion and motion.stable:
            # Turns about a weakly attracting orbit may return to 1e-9 sooner than it closes.
            m = motion.m
        if m:
            early = tendency(structure, state(runs[0]), 2_000)
            return ("", 0) if early == "chaotic" else ("periodic", m)
        halves = {tendency(structure, state(run), 10_000) for run in runs[:2]}
    except (vi.SimulationError, vi.StateError):
        return "", 0
    return (halves.pop(), 0) if len(halves) == 1 else ("", 0)


def main() -> None:
    """Count, and print what differs."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=400)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    counts: Counter[str] = Counter()
    for number in range(options.count):
        structure = drawn(options.seed, number)
        kind, m = truth(structure)
        if not kind:
            counts["left out"] += 1
            continue
        rest = np.zeros((2, structure.coordinates))
        run = vi.simulate(structure, initial=rest, periods=PERIODS, keep=KEPT)
        found = "periodic" if run.period.m else run.label
        if found == kind and (run.period.m or 0) == m:
            counts["right"] += 1
            continue
        counts["unresolved" if found == "unresolved" else "wrong"] += 1
        counts["exchanged"] += {found, kind} == {"periodic", "chaotic"}
        print(f"{number}: {run.label}, {run.period.evidence}; in the long run {kind} {m or ''}")
    print(", ".join(f"{what} {count}" for what, count in counts.items()))


if __name__ == "__main__":
    main()
