"""Compare Lyapunov exponents with Floquet multipliers on the periodic motions of random systems.

A periodic motion of m drive periods T has the exponents ln|lambda|/(m T). The multipliers come from
Newton's method and one orbit, the exponents from time stepping with perturbations kept orthonormal.

    python examples/exponents_against_multipliers.py [--seed 1] [--count 1200] [--progress]

A thousand motions take some two minutes; the exit status is 1 if a mismatch remains.
"""

import argparse
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

import vibroimpact as vi
from vibroimpact.orbits.motion import reduced

Array = NDArray[np.float64]

# Drive periods before the measurement and of it. A tenth of these only aligns the perturbations.
SETTLING, MEASURED = 1500, 1000
# On its way to an orbit a motion has other exponents, which no spread would show: it is measured
# once the largest multiplier has shrunk distances by this factor, or left out where that takes more
# drive periods than the second number.
SETTLED, LONGEST = 1e-8, 200_000
# The sum of logarithms is exponent x time and something bounded: the start of a measurement, parts
# of an orbit at its end, the beat of a complex pair. In a block that is ten times as large as in
# the whole, so that one deviation makes one standard error, and several more than their sum.
STANDARD_ERRORS = 3.0
# Ratio in which a perturbation may begin along another direction rather than its own; alignment
# shrinks it by exp(-gap x time), gap between the exponents. What is left changes a sum of
# logarithms by ln(1 + ratio), 7 where nothing was gained, as for a complex pair.
MISALIGNED = 1e3
# Rounding of the derivative of a leg, as part of its norm or of 1 if that is more: flights give the
# change since their start, so that what has decayed to 1e-12 still has the rounding of 1. What it
# does to the multipliers is seen on so many products of derivatives disturbed by as much: it can be
# far more than 1e-16 of them, where legs grow and shrink by turns, or multipliers nearly meet.
LEG_ROUNDING, DISTURBED = 10.0 * np.finfo(np.float64).eps, 20
# Rounding of the logarithm of a growth over a leg, in which time stepping lets no direction shrink
# by more than exp(10) against another.
GROWTH_ROUNDING = math.exp(10.0) * LEG_ROUNDING
# A multiplier that rounding changes by this part of it is not told from 0: of it, only what it is
# at most can be compared.
COMPARABLE = 0.5
# Systems drawn for each motion wanted, at most; three of four have one.
MOST_DRAWN = 20


@dataclass
class Tally:
    """What was compared, what was not, and where the two differ."""

    motions: int = 0
    compared: int = 0
    dead: int = 0
    below_rounding: int = 0
    largest_difference: float = 0.0
    largest_share: float = 0.0
    kinds: Counter[str] = field(default_factory=Counter)
    left_out: Counter[str] = field(default_factory=Counter)
    relabelled: list[str] = field(default_factory=list)
    mismatches: list[str] = field(default_factory=list)


def draw(random: np.random.Generator) -> tuple[vi.System, tuple[float, float, float, float]]:
    """Draw a system, special values included, and a start at which the bodies are apart."""

    def one_of(*values: float) -> float:
        return float(random.choice(values))

    friction = one_of(0.0, random.uniform(0.02, 1.2))
    direct = friction == 0.0 and random.random() < 0.3
    system = vi.System(
        mass_ratio=one_of(0.0, 0.3, 0.6, *random.uniform(0.05, 3.0, 3)),
        frequency_ratio=random.uniform(0.3, 4.0),
        restitution=one_of(0.0, 0.5, 0.8, 1.0, *random.uniform(0.0, 1.0, 4)),
        gap=random.uniform(-0.1, 0.8),
        drive_frequency=random.uniform(0.3, 4.0),
        pendulum_damping=one_of(0.0, 0.01, 0.1, random.uniform(0.0, 2.0)),
        oscillator_damping=one_of(0.0, 0.01, 0.1, 1.5),
        moment_amplitude=random.uniform(0.0, 2.5),
        force_amplitude=one_of(0.0, random.uniform(0.0, 2.0)),
        friction=friction,
        contact="direct" if direct else "oblique",
        law=str(random.choice(["poisson", "newton", "energetic"])),
    )
    # Body 2 of mass ratio 0 without a force is a wall at rest if it starts so.
    return system, (-0.2, 0.5, 0.1 if system.mass_ratio else 0.0, 0.0)


def disturbed(motion: vi.PeriodicMotion) -> Array:
    """Return moduli of the multipliers, falling, with other roundings, shape (DISTURBED, k)."""
    legs = np.array(motion.itinerary.transfer(motion.system._compiled, motion.nodes))
    noise = np.random.default_rng(0).uniform(-1.0, 1.0, (DISTURBED, *legs.shape))
    norms = np.linalg.norm(legs, 2, axis=(1, 2))
    noise *= LEG_ROUNDING * np.maximum(norms, 1.0)[:, None, None]
    products = np.eye(4)
    for leg in np.swapaxes(legs + noise, 0, 1):
        products = leg @ products
    matrices = [reduced(product, motion.itinerary) for product in products]
    return np.sort(np.abs(np.linalg.eigvals(matrices)))[:, ::-1]


def compare(motion: vi.PeriodicMotion, spectrum: vi.LyapunovSpectrum, tally: Tally) -> str:
    """Compare all exponents of a motion; return what does not agree, "" if all does."""
    sizes = np.sort(np.abs(motion.multipliers))[::-1]
    rounding = np.abs(disturbed(motion) - sizes).max(axis=0)
    measured = spectrum.exponents[: len(sizes)]
    if np.isnan(measured).any() or not np.isnan(spectrum.exponents[len(sizes) :]).all():
        return f"{len(sizes)} multipliers"
    orbit = motion.m * motion.system.drive_period
    with np.errstate(divide="ignore", invalid="ignore"):
        exact = np.log(sizes) / orbit
        gaps = np.abs(exact[:, None] - exact)
        # -inf and -inf, two that have died out, do not mix either.
        gaps[np.isnan(gaps)] = math.inf
        np.fill_diagonal(gaps, math.inf)
        most = np.log(sizes + rounding) / orbit
        part = np.where(sizes > 0.0, rounding / sizes, math.inf)
    # The measurement is nine times as long as the alignment before it.
    mixed = np.log1p(MISALIGNED * np.exp(-gaps.min(axis=1) * spectrum.time / 9.0))
    bound = STANDARD_ERRORS * spectrum.error[: len(sizes)] + mixed / spectrum.time
    bound += GROWTH_ROUNDING * len(motion.legs) / orbit
    wrong = []
    for i, exponent in enumerate(measured):
        if part[i] < COMPARABLE:
            allowed = bound[i] - math.log1p(-part[i]) / orbit
            difference = abs(exponent - exact[i])
            tally.compared += 1
            tally.largest_difference = max(tally.largest_difference, difference)
            tally.largest_share = max(tally.largest_share, difference / allowed)
            agrees = difference <= allowed
        else:
            tally.dead += int(exponent == -math.inf)
            tally.below_rounding += int(exponent > -math.inf)
            allowed = bound[i]
            agrees = exponent <= most[i] + allowed
        if not agrees:
            wrong.append(f"{exponent:.8g} for ln|lambda|/(m T) = {exact[i]:.8g} +- {allowed:.2g}")
    return "; ".join(wrong)


def kinds(motion: vi.PeriodicMotion) -> set[str]:
    """Say in words which cases of the theory a motion passes."""
    system = motion.system
    found = {
        str(leg.kind) if leg.regime is None else leg.regime.name.lower() for leg in motion.legs
    }
    if system.mass_ratio == 0.0:
        found.add("wall")
    if found - {"circuit"}:
        found |= {system.contact, system.law} | (
            {"plastic"} if system.restitution == 0.0 else set()
        )
    return found


def examine(system: vi.System, initial: Sequence[float], tally: Tally) -> None:
    """Find the motion of a system both ways, if it is periodic, and compare."""
    run = vi.simulate(system, initial=initial, periods=SETTLING, keep=100)
    if run.stop_reason not in ("completed", "rest"):
        tally.left_out[run.stop_reason] += 1
        return
    motion = run.refine()
    if not isinstance(motion, vi.PeriodicMotion):
        tally.left_out[run.label if run.period.m is None else "not refined"] += 1
        return
    largest = float(np.abs(motion.multipliers).max())
    with np.errstate(divide="ignore"):
        settling = motion.m * math.log(SETTLED) / np.log(largest)
    if largest >= 1.0 or settling > LONGEST:
        tally.left_out["too slow to settle"] += 1
        return
    tally.motions += 1
    tally.kinds.update(kinds(motion))
    periods = max(SETTLING, math.ceil(settling)) + MEASURED
    try:
        spectrum = vi.lyapunov_spectrum(system, initial=initial, periods=periods, keep=MEASURED)
        assert isinstance(spectrum, vi.LyapunovSpectrum)
        wrong = compare(motion, spectrum, tally)
        if spectrum.label != motion.label:
            # No mismatch: the exponents say whether it is another motion, or a label that is wrong.
            tally.relabelled.append(f"{motion.label} as {spectrum.label}\n    {system!r}")
    except vi.SimulationError as error:
        wrong = str(error)
    if wrong:
        tally.mismatches.append(f"{motion.label}: {wrong}\n    {system!r}")


def listed(counts: Counter[str]) -> str:
    """Counts in words, largest first."""
    return ", ".join(f"{name} {count}" for name, count in counts.most_common()) or "none"


def main(arguments: Sequence[str] | None = None) -> int:
    """Print what was compared and every mismatch; return 1 if there is one."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seed", type=int, default=1, help="of the random systems; default 1")
    parser.add_argument("--count", type=int, default=1200, help="motions to compare; default 1200")
    parser.add_argument("--progress", action="store_true", help="show a progress bar")
    given = parser.parse_args(arguments)
    if given.seed < 0 or given.count < 1:
        parser.error("--seed must be at least 0, --count at least 1")
    tally = Tally()
    bar = tqdm(total=given.count, disable=not given.progress)
    for number in range(MOST_DRAWN * given.count):
        system, initial = draw(np.random.default_rng([given.seed, number]))
        examine(system, initial, tally)
        bar.update(tally.motions - bar.n)
        if tally.motions == given.count:
            break
    bar.close()
    print(f"seed {given.seed}: {tally.motions} periodic motions of {number + 1} systems")
    print(f"  passing: {listed(tally.kinds)}")
    print(f"  left out: {listed(tally.left_out)}")
    print(
        f"{tally.compared} exponents compared: largest difference "
        f"{tally.largest_difference:.2g}, at most {tally.largest_share:.2g} of its bound"
    )
    print(
        f"{tally.dead + tally.below_rounding} multipliers are 0 to rounding: {tally.dead} of the "
        f"exponents are -inf, {tally.below_rounding} finite"
    )
    for found, what in (
        (tally.relabelled, "labelled otherwise once settled"),
        (tally.mismatches, "with a mismatch"),
    ):
        print(f"{len(found)} motions {what}")
        for text in found:
            print(f"  {text}")
    return min(len(tally.mismatches), 1)


if __name__ == "__main__":
    raise SystemExit(main())
