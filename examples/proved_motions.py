"""Prove motions drawn from charts of random systems and structures, and count what is shown.

Charts of two parameters are swept; in each the motions of a few cells are refined and given to
`vibroimpact.prove`. Motions with chatter, with sustained contact or without impacts are counted
apart: of those nothing is claimed. Times are those of the processor.

    python examples/proved_motions.py [--seed 1] [--systems 1000] [--structures 300] [--progress]

The exit status is 1 if fewer than 95 % are proved, if one that was computed as a motion is
disproved, or if a computed multiplier lies far from its disc.
"""

import argparse
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

import vibroimpact as vi
from vibroimpact.orbits.motion import reduced

Motion = vi.PeriodicMotion | vi.StructureOrbit
Drawn = tuple[vi.System | vi.Structure, dict[str, list[float]], NDArray[np.float64]]

# Drive periods of each run of a chart, and kept; motions taken of one chart; charts drawn at most
# for each motion that is wanted.
PERIODS, KEEP, OF_A_CHART, MOST_CHARTS = 800, 60, 4, 10
# Rounding of the derivative of a leg as a part of its size, as in exponents_against_multipliers.py,
# and so many products of disturbed derivatives.
LEG_ROUNDING, DISTURBED = 10.0 * np.finfo(np.float64).eps, 20
# Of what such roundings do to a multiplier, the nodes' own errors may do some times as much.
FAR = 1e3
WANTED = 0.95


@dataclass
class Tally:
    """What was shown of the motions of a kind of machine."""

    motions: int = 0
    charts: int = 0
    verdicts: Counter[str] = field(default_factory=Counter)
    reasons: Counter[str] = field(default_factory=Counter)
    kinds: Counter[str] = field(default_factory=Counter)
    left_out: Counter[str] = field(default_factory=Counter)
    seconds: list[float] = field(default_factory=list)
    shares: list[float] = field(default_factory=list)
    distances: list[float] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)


def system_at_random(random: np.random.Generator) -> Drawn:
    """Draw a system, with or without constant loads, two axes of a chart, and a start."""

    def one_of(*values: float) -> float:
        return float(random.choice(values))

    direct = random.random() < 0.25
    system = vi.System(
        mass_ratio=one_of(0.0, 0.0, 0.3, 0.6, random.uniform(0.05, 3.0), random.uniform(0.05, 3.0)),
        frequency_ratio=random.uniform(0.3, 4.0),
        restitution=random.uniform(0.2, 0.97),
        gap=random.uniform(-0.1, 0.8),
        drive_frequency=1.0,
        pendulum_damping=one_of(0.0, 0.01, 0.1, random.uniform(0.0, 0.5)),
        oscillator_damping=one_of(0.0, 0.01, 0.1, 0.5),
        moment_amplitude=1.0,
        force_amplitude=one_of(0.0, 0.0, random.uniform(0.0, 2.0)),
        static_moment=one_of(0.0, 0.0, random.uniform(-0.5, 0.5)),
        static_force=one_of(0.0, 0.0, 0.0, random.uniform(-0.5, 0.5)),
        friction=0.0
        if direct
        else one_of(0.0, random.uniform(0.02, 1.2), random.uniform(0.02, 1.2)),
        contact="direct" if direct else "oblique",
        law=str(random.choice(["poisson", "newton", "energetic"])),
    )
    frequency, moment = random.uniform(0.3, 3.5), random.uniform(0.3, 2.0)
    axes = {
        "drive_frequency": [frequency * (1.0 + 0.15 * i) for i in range(4)],
        "moment_amplitude": [moment * (1.0 + 0.3 * i) for i in range(3)],
    }
    # A wall (mass ratio 0) without a force is at rest if it starts so.
    x2 = 0.0 if system.mass_ratio else system.static_force
    v2 = 0.1 if system.mass_ratio else 0.0
    x1 = min(-0.2, np.arcsin(np.clip(x2 + system.gap, -0.9, 0.9)) - 0.1)
    return system, axes, np.array([x1, 0.5, x2, v2])


def structure_at_random(random: np.random.Generator) -> Drawn:
    """Draw a structure with stops, at rest or moving, with friction or without."""
    count, stops = int(random.integers(1, 5)), int(random.integers(1, 4))

    def spread(size: float) -> NDArray[np.float64]:
        rows = size * random.normal(size=(count, count))
        product = rows.T @ rows
        return np.asarray((product + product.T) / 2.0)

    mass, stiffness = np.eye(count) + spread(0.4), np.eye(count) + spread(1.0)
    if random.random() < 0.5:
        damping = {"damping": spread(0.25) + 0.02 * np.eye(count)}
    else:
        damping = {"damping_ratios": random.uniform(0.01, 0.2, count)}
    made = []
    for _ in range(stops):
        more = {}
        if count > 1 and random.random() < 0.4:
            more = {"friction": random.uniform(0.05, 0.6), "tangent": random.normal(size=count)}
        if random.random() < 0.3:
            more |= {"amplitude": random.uniform(0.02, 0.1), "phase": random.uniform(0.0, 6.0)}
        gap, restitution = random.uniform(0.15, 0.6), random.uniform(0.2, 0.95)
        made.append(vi.Stop(random.normal(size=count), gap, restitution, **more))
    structure = vi.Structure(
        mass,
        stiffness,
        made,
        **damping,
        static_load=random.normal(size=count) * random.choice([0.0, 0.1]),
        drive_amplitude=random.normal(size=count) + 1j * random.normal(size=count),
        drive_frequency=1.0,
        law=str(random.choice(["poisson", "newton", "energetic"])),
    )
    frequency, restitution = random.uniform(0.4, 3.0), random.uniform(0.2, 0.8)
    axes = {
        "drive_frequency": [frequency * (1.0 + 0.15 * i) for i in range(4)],
        "restitution_0": [restitution * (1.0 + 0.1 * i) for i in range(3)],
    }
    return structure, axes, np.zeros((2, count))


def rounding(motion: Motion) -> NDArray[np.float64]:
    """What rounding of the legs' derivatives does to each multiplier of a motion of two bodies."""
    assert isinstance(motion, vi.PeriodicMotion)
    legs = np.array(motion.itinerary.transfer(motion.system._compiled, motion.nodes))
    noise = np.random.default_rng(0).uniform(-1.0, 1.0, (DISTURBED, *legs.shape))
    noise *= LEG_ROUNDING * np.maximum(np.linalg.norm(legs, 2, axis=(1, 2)), 1.0)[:, None, None]
    products = np.broadcast_to(np.eye(4), (DISTURBED, 4, 4))
    for leg in np.swapaxes(legs + noise, 0, 1):
        products = leg @ products
    shifts = np.zeros(len(motion.multipliers))
    for values in np.linalg.eigvals([reduced(x, motion.itinerary) for x in products]):
        shifts = np.maximum(shifts, np.abs(values - motion.multipliers[:, None]).min(axis=1))
    return shifts


def compare(motion: Motion, proof: vi.Proof, tally: Tally) -> None:
    """Compare computed multipliers with their discs."""
    discs = list(proof.multipliers)
    bounds = rounding(motion) if isinstance(motion, vi.PeriodicMotion) else None
    for i, computed in enumerate(motion.multipliers):
        nearest = min(discs, key=lambda disc: abs(disc.center - computed))
        discs.remove(nearest)
        outside = max(0.0, abs(nearest.center - computed) - nearest.radius)
        tally.distances.append(outside / max(1.0, abs(motion.multipliers[0])))
        if bounds is not None:
            tally.shares.append(outside / max(bounds[i], LEG_ROUNDING * abs(computed)))
            if tally.shares[-1] > FAR:
                tally.wrong.append(f"multiplier {computed:.12g}, {outside:.2g} outside its disc")


def kinds(motion: Motion) -> set[str]:
    """Say in words which cases of the theory a motion passes."""
    system = motion.system
    found = {str(leg.regime.name).lower() for leg in motion.legs} | {system.law}
    if isinstance(system, vi.System):
        found |= {system.contact, "constant load"} if system.static_moment else {system.contact}
        if system.mass_ratio == 0.0:
            found.add("wall at rest" if motion.wall_at_rest else "wall that moves")
    else:
        found |= {"moving stop"} if any(stop.amplitude for stop in system.stops) else set()
        found.add("damping matrix" if system.damping_ratios is None else "damping ratios")
        found.add(f"{len(system.mass)} coordinates")
    return found


def examine(motion: Motion, tally: Tally) -> None:
    """Prove a motion, and count."""
    tally.motions += 1
    tally.kinds.update(kinds(motion))
    start = time.process_time()
    proof = vi.prove(motion)
    tally.seconds.append(time.process_time() - start)
    told = proof.stability if proof.verdict == "proved" else ""
    tally.verdicts[f"{proof.verdict} {told}".strip()] += 1
    if proof.verdict != "proved":
        tally.reasons[f"{proof.verdict}: {proof.why}"] += 1
    elif proof.why or proof.stability == "undecided":
        tally.reasons[f"proved, {proof.why or 'stability open'} ({motion.stability})"] += 1
    refuted = proof.verdict == "disproved" and motion.admissible
    opposite = {"stable": "unstable", "unstable": "stable"}.get(motion.stability)
    if refuted or (proof.verdict == "proved" and proof.stability == opposite):
        tally.wrong.append(f"{motion!r}: {proof!r}\n    {motion.system!r}")
    if proof.multipliers:
        compare(motion, proof, tally)


def sample(
    draw: Callable[[np.random.Generator], Drawn], count: int, seed: int, progress: bool
) -> Tally:
    """Draw charts until so many motions have been given to `prove`."""
    tally = Tally()
    for number in range(MOST_CHARTS * count):
        random = np.random.default_rng([seed, number])
        system, axes, initial = draw(random)
        try:
            chart = vi.chart(
                system, initial=initial, periods=PERIODS, keep=KEEP, exponents=False, **axes
            )
        except vi.ParameterError as error:  # a start that is no state, of a drawn system
            tally.left_out[f"no chart: {str(error)[:40]}"] += 1
            continue
        tally.charts += 1
        cells = [cell for cell in np.ndindex(chart.label.shape) if chart.m[cell] > 0]
        random.shuffle(cells)
        for cell in cells[:OF_A_CHART]:
            motion = chart.run(*cell).refine()
            if not isinstance(motion, Motion):
                tally.left_out["not refined"] += 1
            elif not motion.legs or any(leg.regime is None for leg in motion.legs):
                tally.left_out["chatter, sustained contact or no impact"] += 1
            else:
                examine(motion, tally)
            if tally.motions == count:
                return tally
        if progress:
            print(f"{tally.motions} of {count}: {listed(tally.verdicts)}", flush=True)
    return tally


def listed(counts: Counter[str]) -> str:
    """Counts in words, largest first."""
    return ", ".join(f"{name} {count}" for name, count in counts.most_common()) or "none"


def report(name: str, tally: Tally) -> bool:
    """Print what was shown; return whether it is as it should be."""
    shown = sum(n for verdict, n in tally.verdicts.items() if verdict.startswith("proved"))
    print(f"{name}: {tally.motions} motions of {tally.charts} charts, proved {shown}")
    print(f"  verdicts: {listed(tally.verdicts)}")
    print(f"  passing: {listed(tally.kinds)}")
    print(f"  left out: {listed(tally.left_out)}")
    for reason, count in tally.reasons.most_common():
        print(f"  {count} x {reason}")
    if tally.seconds:
        middle, most = np.percentile(tally.seconds, [50, 95])
        print(
            f"  seconds: median {middle:.3f}, 95 % below {most:.3f}, worst {max(tally.seconds):.3f}"
        )
    if tally.distances:
        print(
            f"  {len(tally.distances)} multipliers; worst distance of a computed one from its disc "
            f"{max(tally.distances):.2g} of the largest or of 1"
        )
    if tally.shares:
        print(f"    in units of what rounding does to it: worst {max(tally.shares):.2g}")
    for text in tally.wrong:
        print(f"  WRONG: {text}")
    return shown >= WANTED * tally.motions and not tally.wrong


def main(arguments: Sequence[str] | None = None) -> int:
    """Prove, count and print; return 1 if something is not as it should be."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seed", type=int, default=1, help="of the charts; default 1")
    parser.add_argument("--systems", type=int, default=1000, help="motions of two bodies")
    parser.add_argument("--structures", type=int, default=300, help="motions of structures")
    parser.add_argument("--progress", action="store_true", help="print what is done so far")
    given = parser.parse_args(arguments)
    if min(given.seed, given.systems, given.structures) < 0:
        parser.error("numbers must be at least 0")
    good = True
    for name, draw, count in (
        ("two bodies", system_at_random, given.systems),
        ("structures", structure_at_random, given.structures),
    ):
        if count:
            good &= report(name, sample(draw, count, given.seed, given.progress))
    return 0 if good else 1


if __name__ == "__main__":
    raise SystemExit(main())
