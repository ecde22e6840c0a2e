"""Experiments that decide where simulation and paper differ (docs/theory.md, section 9, E9 to E11).

Everything is computed when asked for; seeds are fixed.
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from vibroimpact import LyapunovSpectrum, Run, System, lyapunov_spectrum, simulate

from .parameters import INITIAL

START_BOX = (0.3, 1.0, 0.2, 1.0)
"""Half-widths of the box around rest from which random starts are drawn: x1, v1, x2, v2."""
STARTS = 60
START_PERIODS = 3000
HORIZONS = (600, 2000, 5000, 20000)
PERTURBATION = 1e-9
CHAOS_KEEP = 700
"""Sections kept to tell chaos: a label needs four periods, and 154-77 motions coexist with it."""
EXPONENT_PERIODS = 200_000
"""Long enough for an exponent of 8e-4 per unit time to be some forty standard errors."""
CERTAIN = 10.0
"""Standard errors above 0 from which on a largest exponent is taken for positive."""


@dataclass(frozen=True)
class Coexistence:
    """The labels reached from random starts, and the first run that got the wanted one.

    `spectrum` holds the Lyapunov exponents of the motion of that run, if chaos was wanted.
    """

    wanted: str
    labels: Counter[str]
    run: Run | None
    spectrum: LyapunovSpectrum | None = None

    @property
    def share(self) -> str:
        """How many starts reached the wanted motion, e.g. ``56 of 60``."""
        return f"{self.labels[self.wanted]} of {self.labels.total()}"

    @property
    def is_chaotic(self) -> bool:
        """Whether the largest exponent is positive beyond doubt."""
        if self.spectrum is None:
            return False
        return bool(self.spectrum.exponents[0] > CERTAIN * self.spectrum.error[0])


def random_starts(count: int = STARTS, seed: int = 0) -> NDArray[np.float64]:
    """Return initial states drawn uniformly from `START_BOX`, shape (count, 4)."""
    box = np.array(START_BOX)
    return np.random.default_rng(seed).uniform(-box, box, size=(count, 4))


def coexisting(
    system: System,
    wanted: str,
    *,
    starts: NDArray[np.float64] | None = None,
    periods: int = START_PERIODS,
    keep: int = 100,
    workers: int | None = None,
) -> Coexistence:
    """Simulate from random starts and count the motions they settle on.

    Parameters
    ----------
    system : System
        The system.
    wanted : str
        Label of the motion whose first run is returned.
    starts : array, shape (k, 4), optional
        Initial states; by default those of `random_starts`.
    periods, keep, workers
        As in `vibroimpact.simulate`.
    """
    initial = random_starts() if starts is None else starts
    runs: list[Run] = simulate(system, initial=initial, periods=periods, keep=keep, workers=workers)
    labels = [run.label for run in runs]
    first = runs[labels.index(wanted)] if wanted in labels else None
    return Coexistence(wanted, Counter(labels), first)


def coexisting_chaos(
    system: System,
    *,
    starts: NDArray[np.float64] | None = None,
    periods: int = EXPONENT_PERIODS,
    workers: int | None = None,
) -> Coexistence:
    """Look for chaos from random starts, and measure the exponents of the first that is found.

    A label rests on the growth over some thousand periods, which weak chaos and quasi-periodic
    motion hardly differ in; the exponents are measured over `periods`.
    """
    found = coexisting(system, "chaotic", starts=starts, keep=CHAOS_KEEP, workers=workers)
    if found.run is None:
        return found
    spectrum = lyapunov_spectrum(system, initial=found.run.initial, periods=periods)
    assert isinstance(spectrum, LyapunovSpectrum)  # no axes are given
    return replace(found, spectrum=spectrum)


def amplification(
    system: System, *, periods: int, initial: Sequence[float] = INITIAL
) -> NDArray[np.float64]:
    """Return the growth of a perturbation of v1(0), after each drive period, shape (periods,).

    The distance of two orbits that start `PERTURBATION` apart (largest component), divided by it.
    If one of them stops early, the array ends there.
    """
    x1, v1, x2, v2 = initial
    runs: list[Run] = simulate(
        system, initial=np.array([initial, (x1, v1 + PERTURBATION, x2, v2)]), periods=periods
    )
    rows = min(len(run.stroboscopic) for run in runs)
    distance = np.abs(runs[1].stroboscopic[:rows] - runs[0].stroboscopic[:rows]).max(axis=1)
    return np.asarray(distance / PERTURBATION)


def drive_periods(run: Run) -> int:
    """Return the length of a run in whole drive periods."""
    return round(run.final_state.time / run.system.drive_period)


def impacts_by(run: Run, horizons: tuple[int, ...] = HORIZONS) -> dict[int, int]:
    """Return how many of the kept impacts of a run fall into the first so many drive periods."""
    period = run.impacts["period"]
    return {horizon: int(np.count_nonzero(period < horizon)) for horizon in horizons}


def recurrence(system: System, *, largest: int = 1000) -> int | None:
    """Return the number of drive periods after which a motion without impacts repeats.

    That is the smallest m for which m omega0/omega and m/omega are whole numbers; None if damping
    prevents it, or if no m <= `largest` does it to rounding.

    An impact that separates with g' = -r u < 0 is never the last one of such a system: after one
    recurrence a free motion would be back at this state, which it can only reach from g > 0.
    """
    omega = Fraction(system.drive_frequency).limit_denominator(largest)
    omega0 = Fraction(system.frequency_ratio).limit_denominator(largest)
    if any(system.damping) or omega == 0:
        return None
    if (float(omega), float(omega0)) != (system.drive_frequency, system.frequency_ratio):
        return None
    periods = math.lcm((1 / omega).denominator, (omega0 / omega).denominator)
    return periods if periods <= largest else None


def longest_wait(run: Run) -> float:
    """Return the longest time between two kept contacts in drive periods, grazes included.

    The time from the last contact to the end of the run counts too; 0 without contacts.
    """
    times = np.sort(np.concatenate([run.impacts["time"], run.grazes["time"]]))
    waits = np.diff(np.append(times, run.final_state.time))
    return float(waits.max(initial=0.0)) / run.system.drive_period
