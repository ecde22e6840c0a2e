"""Candidates of periodic motions that are wrong, for attempts at a false proof.

A candidate is the problem of a certificate: a machine, m, legs, and a box about nodes. Whether it
is a motion is judged by simulation, which shares nothing with the proof: from the first node, over
m drive periods, it must meet the same stops in the same regimes at the same times.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

import numpy as np
from flint import arb, arb_mat, ctx

import references
import vibroimpact as vi
from simulated_certificates import Problem
from vibroimpact.proof.certificate import REGIMES, exact, examine, machine_in
from vibroimpact.proof.formulas import Undecided
from vibroimpact.proof.near import near_inverse
from vibroimpact.proof.posing import legs_of, machine_in_text, nodes_of, text
from vibroimpact.proof.verifier import Orbit
from vibroimpact.system import SYMBOLS

PRECISION = 160
# Radii of boxes, in bits below the size of an unknown.
BOXES = (70, 45, 25, 14, 8)
DEPTH = 1e-9
KINDS = {
    "inadmissible with one impact": 500,
    "inadmissible with several impacts": 200,
    "hidden contact": 100,
    "wrong regime": 200,
    "wrong sequence": 200,
    "beyond a saddle-node": 100,
    "off the box": 200,
    "altered certificate": 500,
}
"""Kinds of wrong candidates, and how many of each are tried in all."""


def problem_of(motion: Any) -> Problem:
    """The problem that a motion poses, without box."""
    legs = legs_of(motion)
    assert not isinstance(legs, str)
    return {"machine": machine_in_text(motion), "m": motion.m, "legs": legs, "precision": PRECISION}


def orbit_of(problem: Problem) -> Orbit:
    """Its equations."""
    legs = tuple((stop, regime) for stop, regime in problem["legs"])
    return Orbit(machine_in(problem["machine"]), problem["m"], legs)


def newton(problem: Problem, start: Any) -> list[arb] | None:
    """The solution of the equations that Newton's method finds, or None."""
    with ctx.workprec(PRECISION):
        z = [x if isinstance(x, arb) else arb(float(x)) for x in np.ravel(start)]
        try:
            orbit = orbit_of(problem)
            for _ in range(40):
                near, width = near_inverse(orbit, z), len(z) // len(problem["legs"])
                residual, change = orbit.residual(z), arb_mat(len(z), 1)
                for k, block in enumerate(near):
                    change += block * arb_mat(width, 1, residual[k * width : (k + 1) * width])
                z = [(x - dx).mid() for x, dx in zip(z, change.entries(), strict=True)]
                if max(abs(dx).mid() for dx in change.entries()) < arb(2) ** -130:
                    return z
                if not max(abs(x) for x in z) < 1e6:
                    return None
        except (Undecided, ValueError, ZeroDivisionError, OverflowError):
            return None
    return None


def box_about(z: list[arb], bits: int) -> list[list[str]]:
    """A box about nodes."""
    with ctx.workprec(PRECISION):
        return [[text(x), f"1p{-bits}"] for x in z]


def verdict(problem: Problem, z: Any) -> str:
    """What is found in boxes about nodes: "proved" if that is found in any of them."""
    with ctx.workprec(PRECISION):
        z = [x if isinstance(x, arb) else arb(float(x)) for x in np.ravel(z)]
    found = {examine({**problem, "box": box_about(z, bits)}).verdict for bits in BOXES}
    return next(x for x in ("proved", "disproved", "undecided") if x in found)


def systems(seed: int) -> Iterator[vi.System]:
    """Random systems without friction, which periodic_motions knows."""
    random = np.random.default_rng([seed, 1])
    while True:
        yield vi.System(
            mass_ratio=random.uniform(0.2, 2.0),
            frequency_ratio=random.uniform(0.5, 3.0),
            restitution=random.uniform(0.3, 0.95),
            gap=random.uniform(0.0, 0.7),
            drive_frequency=random.uniform(0.4, 3.0),
            moment_amplitude=random.uniform(0.3, 2.5),
            force_amplitude=float(random.choice([0.0, random.uniform(0.0, 1.0)])),
            damping=(float(random.choice([0.0, 0.02, 0.1])),) * 2,
        )


def references_proved() -> list[Any]:
    """The motions of the reference orbits, without chatter and contact."""
    found = []
    for orbit in references.reference("orbits_reference.json").values():
        values = {SYMBOLS[name]: float(x) for name, x in orbit["params"].items()}
        system = vi.System(
            **values, phase=float(orbit["phase"]), contact=orbit["contact"], law=orbit["law"]
        )
        if not isinstance(orbit["n"], int) or orbit["n"] == 0:
            continue
        start = [float(x) for x in orbit["stroboscopic"][0]]
        try:
            motion = vi.periodic_motion(system, initial=start, periods=orbit["m"])
        except vi.SimulationError:
            continue
        if isinstance(motion, vi.PeriodicMotion) and not isinstance(legs_of(motion), str):
            found.append(motion)
    return found


def of_structures(count: int, seed: int = 4) -> list[Any]:
    """Motions of random structures: friction, moving stops, damping matrices."""
    random, found = np.random.default_rng(seed), []
    while len(found) < count:
        n, stops = int(random.integers(1, 4)), []
        rows = random.normal(size=(2, n, n))
        mass, stiffness = (np.eye(n) + (0.3 * x.T @ x + (0.3 * x.T @ x).T) / 2 for x in rows)
        for _ in range(int(random.integers(1, 3))):
            more: dict[str, Any] = {}
            if n > 1 and random.random() < 0.5:
                more = {"friction": 0.3, "tangent": random.normal(size=n)}
            if random.random() < 0.3:
                more |= {"amplitude": 0.05, "phase": 1.0}
            stops.append(vi.Stop(random.normal(size=n), random.uniform(0.1, 0.5), 0.6, **more))
        matrix = random.random() < 0.5
        structure = vi.Structure(
            mass,
            stiffness,
            stops,
            **({"damping": 0.1 * mass} if matrix else {"damping_ratios": [0.05] * n}),
            drive_amplitude=random.normal(size=n),
            drive_frequency=random.uniform(0.5, 3.0),
        )
        motion = vi.simulate(structure, initial=np.zeros((2, n)), periods=500, keep=60).refine()
        if isinstance(motion, vi.StructureOrbit) and not isinstance(legs_of(motion), str):
            found.append(motion)
    return found


def one_impact(seed: int) -> Iterator[tuple[Problem, Any]]:
    """Solutions with one impact that are no motion."""
    for k, system in enumerate(systems(seed)):
        for motion in vi.periodic_motions(system, n=1 + k % 2):
            if not motion.admissible and motion.legs:
                yield problem_of(motion), nodes_of(motion)


def several_impacts(seed: int) -> Iterator[tuple[Problem, Any]]:
    """Solutions of Newton's method with two or three impacts, from anywhere."""
    random = np.random.default_rng([seed, 2])
    for system in systems(seed):
        base = next((x for x in vi.periodic_motions(system, n=1) if x.legs), None)
        if base is None:
            continue
        for _ in range(8):
            count = int(random.integers(2, 4))
            problem = problem_of(base) | {"legs": [[0, "frictionless"]] * count}
            problem["m"] = int(random.integers(1, 3))
            x1 = random.uniform(-1.0, 1.2, count)
            v = random.normal(size=(2, count))
            t = np.sort(random.uniform(0.0, problem["m"] * system.drive_period, count))
            start = np.column_stack([x1, np.sin(x1) - system.gap, *v, t])
            if (z := newton(problem, start)) is not None:
                yield problem, z


def humps(problem: Problem, z: list[arb], other: int | None = None) -> list[arb]:
    """Highest values of a gap inside flights; of another stop, of all flights."""
    orbit, found = orbit_of(problem), []
    machine = orbit.machine
    stop = machine.stops[other or 0]
    for flight in orbit.flights(z):
        pieces = 400
        duration = flight.duration.mid()
        step, w = machine.flow(duration / pieces), flight.start
        rates: list[arb] = []
        for i in range(pieces + 1):
            rates.append(stop.gap(w.entries(), 1).mid())
            if i > 2 and rates[-2] > 0 and not rates[-1] > 0:
                low, high = duration * (i - 1) / pieces, duration * i / pieces
                for _ in range(90):
                    middle = ((low + high) / 2).mid()
                    rising = stop.gap((machine.flow(middle) * flight.start).entries(), 1).mid() > 0
                    low, high = (middle, high) if rising else (low, middle)
                found.append(stop.gap((machine.flow(low.mid()) * flight.start).entries()).mid())
            w = arb_mat(w.nrows(), 1, [x.mid() for x in (step * w).entries()])
    return found


def beside_a_graze(seed: int, depth: float) -> Iterator[tuple[Problem, Any]]:
    """Motions whose gap rises to `depth` between impacts: at a second stop, or past a graze."""
    random = np.random.default_rng([seed, 3])
    for k, system in enumerate(systems(seed)):
        if k % 2:
            n = int(random.integers(1, 4))
            springs = np.diag(random.uniform(0.5, 4.0, n)) + 0.2
            first = vi.Stop(random.normal(size=n), 0.2, 0.7)
            structure = vi.Structure(
                np.diag(random.uniform(0.5, 2.0, n)),
                springs,
                [first, vi.Stop(random.normal(size=n), 1e3, 0.7)],
                damping_ratios=[0.05] * n,
                drive_amplitude=random.normal(size=n),
                drive_frequency=random.uniform(0.5, 2.5),
            )
            start = np.zeros((2, n))
            motion = vi.simulate(structure, initial=start, periods=500, keep=60).refine()
            if not isinstance(motion, vi.StructureOrbit) or isinstance(legs_of(motion), str):
                continue
            problem = problem_of(motion)
            if (z := newton(problem, nodes_of(motion))) is None:
                continue
            with ctx.workprec(PRECISION):
                inner = humps(problem, z, 1)
                if not inner:
                    continue
                # its gap is normal . q - 1000
                gap = arb(1000) + max(inner) - arb(depth)
                problem["machine"]["stops"][1]["gap"] = text(gap.mid())
            yield problem, z
            continue
        for motion in vi.periodic_motions(system, n=1):
            # a solution whose gap nearly touches 0 between impacts, or just crosses it
            near = motion.legs and abs(motion.max_gap) < 0.2 and motion.approach_velocity > 0
            if near and (found := _at_height(motion, depth)):
                yield found


def _at_height(motion: Any, depth: float) -> tuple[Problem, Any] | None:
    """The solution whose highest hump is as high as `depth`, by the secant method in omega."""
    problem, z = problem_of(motion), nodes_of(motion)
    omega = arb(motion.system.drive_frequency)
    with ctx.workprec(PRECISION):
        values, heights = [omega, omega * (1 + arb(2) ** -12)], []
        for i in range(16):
            problem["machine"]["numbers"]["omega"] = text(values[i].mid())
            solved = newton(problem, z)
            if solved is None or not (inner := humps(problem, solved)):
                return None
            z = solved
            heights.append(max(inner) - arb(depth))
            if abs(heights[-1]) < arb(2) ** -60:
                return problem, z
            if i:
                slope = (heights[i] - heights[i - 1]) / (values[i] - values[i - 1])
                values.append((values[i] - heights[i] / slope).mid())
                if not abs(values[-1] - omega) < 0.2 * omega:
                    return None
    return None


def wrong_regime(seed: int, motions: list[Any]) -> Iterator[tuple[Problem, Any]]:
    """Motions with one leg of another regime: solved anew where that goes, else as they are."""
    random = np.random.default_rng([seed, 4])
    while True:
        motion = motions[random.integers(len(motions))]
        problem, nodes = problem_of(motion), nodes_of(motion)
        k = random.integers(len(problem["legs"]))
        stop, regime = problem["legs"][k]
        other = str(random.choice([x for x in REGIMES if x != regime]))
        problem["legs"] = [*problem["legs"][:k], [stop, other], *problem["legs"][k + 1 :]]
        z = newton(problem, nodes) if random.random() < 0.7 else None
        yield problem, nodes if z is None else z


def wrong_sequence(seed: int, motions: list[Any]) -> Iterator[tuple[Problem, Any]]:
    """Motions with legs permuted, dropped or doubled, or another m."""
    random = np.random.default_rng([seed, 5])
    while True:
        motion = motions[random.integers(len(motions))]
        problem, nodes = problem_of(motion), nodes_of(motion)
        count, what = len(nodes), random.integers(4)
        if what < 3 and count == 1:
            what = 3
        chosen = list(range(count))
        if what == 0:
            chosen = list(random.permutation(count))
        elif what == 1:
            chosen.pop(random.integers(count))
        elif what == 2:
            chosen.insert(0, chosen[random.integers(count)])
        else:
            problem["m"] += int(random.choice([-1, 1, 2])) if problem["m"] > 1 else 1
        legs = problem["legs"]
        places = chosen if random.random() < 0.5 else list(range(len(chosen)))
        problem["legs"] = [list(legs[i]) for i in chosen]
        start = nodes[[min(i, count - 1) for i in places]]
        z = newton(problem, start) if random.random() < 0.7 else None
        yield problem, start if z is None else z


def beyond_saddle_nodes(seed: int) -> Iterator[tuple[Problem, Any, Problem, Any]]:
    """Problems 1e-9 beyond a saddle-node in omega, and before it, with nodes of each."""
    for system in systems(seed):
        few, many = system.drive_frequency, system.drive_frequency * 1.02
        counts = [len(_solutions(system, x)) for x in (few, many)]
        if abs(counts[0] - counts[1]) != 2:
            continue
        if counts[0] > counts[1]:
            few, many = many, few
        while abs(many - few) > 1e-5:
            middle = 0.5 * (few + many)
            if len(_solutions(system, middle)) == min(counts):
                few = middle
            else:
                many = middle
        if found := _fold(system, few, many):
            yield found


def _solutions(system: vi.System, omega: float) -> list[vi.PeriodicMotion]:
    within = (-1.5, 1.5)
    found = vi.periodic_motions(system.replace(drive_frequency=omega), n=1, within=within)
    return [motion for motion in found if motion.legs]


def _fold(system: vi.System, few: float, many: float) -> tuple[Problem, Any, Problem, Any] | None:
    """The fold by the squared distance of its two solutions, which is linear in omega there."""
    inner = _solutions(system, many)
    pairs = [(a, b) for a in inner for b in inner if a is not b]
    if not pairs:
        return None
    pair = min(pairs, key=lambda two: abs(two[0].state[0] - two[1].state[0]))
    problem = problem_of(pair[0])
    with ctx.workprec(PRECISION):
        omega = arb(many)
        other = (omega + (omega - few)).mid()
        starts: list[Any] = [nodes_of(motion) for motion in pair]
        fold, first = None, None
        for _ in range(4):
            squares = []
            for value in (other, omega):
                problem["machine"]["numbers"]["omega"] = text(value)
                solved = [newton(problem, start) for start in starts]
                if solved[0] is None or solved[1] is None:
                    return None
                one, two = solved
                squares.append((one[0] - two[0]) ** 2)
                if squares[-1] < arb(2) ** -100:
                    return None
            starts, first = [one, two], squares[1] if first is None else first
            fold = omega - squares[1] * (other - omega) / (squares[0] - squares[1])
            # as far again, a tenth of the way
            other, omega = (fold + (other - fold) / 16).mid(), (fold + (omega - fold) / 16).mid()
        assert fold is not None
        if not squares[1] < first / 1000:  # 1/16 a step: the two meet here
            return None
        sign = 1 if omega > fold else -1
        sides = []
        for away in (-sign, sign):
            problem["machine"]["numbers"]["omega"] = text((fold + away * arb(DEPTH)).mid())
            sides.append(copy.deepcopy(problem))
        z = [((x + y) / 2).mid() for x, y in zip(*starts, strict=True)]
    return sides[0], z, sides[1], starts[0]


def off_the_box(seed: int, certificates: list[Problem]) -> Iterator[tuple[Problem, Any]]:
    """Boxes, inside those that are proved, which the solution is not in."""
    random = np.random.default_rng([seed, 6])
    while True:
        given = certificates[random.integers(len(certificates))]
        with ctx.workprec(int(given["precision"])):
            z = [arb(exact(x)) for x, _ in given["claims"]["box"]]
            widths = [arb(exact(r)) for _, r in given["box"]]
            part = arb(2) ** -int(random.integers(4, 60))
            moved = random.random(len(z)) < 0.3
            moved[random.integers(len(z))] = True
            by = [arb(1) + arb(10) ** -int(random.integers(0, 9)) for _ in z]
            signs = random.choice([-1, 1], len(z))
            box = [
                [text((x + int(s) * m * part * r).mid() if yes else x), text((part * r).mid())]
                for x, r, m, s, yes in zip(z, widths, by, signs, moved, strict=True)
            ]
        yield {**copy.deepcopy(given), "box": box}, [float(x) for x in z]
