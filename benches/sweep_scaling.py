"""What a cell of a sweep costs, and how much faster two threads are than one.

    python benches/sweep_scaling.py [--rounds 5] [--workers 2]

Times of one thread and of several alternate; each ratio is of one round. The unit of cost is the
plain run: simulating so many drive periods and looking for a return at their end.
"""

import argparse
import os
import platform
import statistics
import time
from collections.abc import Callable

import numpy as np

import vibroimpact as vi

START = (0.0, 0.5, 0.0, 0.0)
PERIODS = 400


def paper(**others: float) -> vi.System:
    """Return a system of the paper's section 4."""
    fixed = {"mass_ratio": 0.6, "frequency_ratio": 2.0, "restitution": 0.8, "gap": 0.5}
    return vi.System(**fixed, **{"drive_frequency": 1.5, "moment_amplitude": 1.0, **others})


def diagram(system: vi.System, points: int, **options: bool) -> Callable[[int], object]:
    """Return a diagram over the drive frequency as a function of the number of threads."""
    frequencies = np.linspace(0.2, 4.0, points)
    return lambda workers: vi.bifurcation_diagram(
        system,
        initial=START,
        periods=PERIODS,
        workers=workers,
        drive_frequency=frequencies,
        **options,
    )


def chart(system: vi.System, side: int) -> Callable[[int], object]:
    """Return a chart of labels and exponents as a function of the number of threads."""
    return lambda workers: vi.chart(
        system,
        initial=START,
        periods=PERIODS,
        workers=workers,
        drive_frequency=np.linspace(0.2, 4.0, side),
        moment_amplitude=np.linspace(0.1, 2.0, side),
    )


def spectra(system: vi.System, points: int) -> Callable[[int], object]:
    """Return spectra over the drive frequency as a function of the number of threads."""
    return lambda workers: vi.lyapunov_spectrum(
        system,
        initial=START,
        periods=2 * PERIODS,
        keep=PERIODS,
        workers=workers,
        drive_frequency=np.linspace(0.2, 4.0, points),
    )


def basins(system: vi.System, side: int) -> Callable[[int], object]:
    """Return basins of the coexisting motions as a function of the number of threads."""
    return lambda workers: vi.basins(
        system, workers=workers, x1=np.linspace(-0.5, 0.5, side), v1=np.linspace(-1.0, 1.0, side)
    )


def measure(
    compute: Callable[[int], object], workers: int, rounds: int
) -> list[tuple[float, float]]:
    """Return the times of one thread and of several, in so many rounds."""
    times = []
    for _ in range(rounds):
        pair = []
        for threads in (1, workers):
            start = time.perf_counter()
            compute(threads)
            pair.append(time.perf_counter() - start)
        times.append((pair[0], pair[1]))
    return times


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    rubbing = paper(friction=0.5)
    cases = [
        ("diagram, no labels", diagram(paper(), 2000, labels=False), 2000),
        ("diagram, labels", diagram(paper(), 800), 800),
        ("chart, labels and exponents", chart(paper(), 28), 784),
        ("chart with friction", chart(rubbing, 28), 784),
        ("spectra, four exponents", spectra(rubbing, 800), 800),
        ("basins of 4-5 and 6-7", basins(rubbing.replace(drive_frequency=1.5752), 40), 1600),
    ]
    load = os.getloadavg()[0]
    print(f"{platform.machine()}, {os.cpu_count()} cores, load {load:.1f} at the start")
    print(f"medians of {options.rounds} rounds; a plain run is {PERIODS} drive periods")
    print(f"{'case':30} {'ms per cell':>12} {'plain runs':>11} {'speed-up':>9} {'range':>13}")
    plain = None
    for name, compute, cells in cases:
        times = measure(compute, options.workers, options.rounds)
        cell = 1e3 * statistics.median(one for one, _ in times) / cells
        plain = plain or cell
        gains = [one / several for one, several in times]
        span = f"{min(gains):.2f} ... {max(gains):.2f}"
        gain = statistics.median(gains)
        print(f"{name:30} {cell:12.3f} {cell / plain:11.1f} {gain:9.2f} {span:>13}")


if __name__ == "__main__":
    main()
