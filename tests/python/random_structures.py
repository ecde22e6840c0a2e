"""Random structures of several families, each with a start, for comparisons with the reference."""

import random

import numpy as np

import vibroimpact as vi

Drawn = tuple[vi.Structure, list[list[float]]]


def _squares(draw: random.Random, count: int, rank: int, size: float) -> np.ndarray:
    """A sum of squares of so many rows: symmetric, semidefinite."""
    rows = np.array([[draw.gauss(0, size) for _ in range(count)] for _ in range(rank)])
    product = rows.T @ rows / count
    return (product + product.T) / 2


def _springs(draw: random.Random, count: int, held: bool) -> np.ndarray:
    """Masses in a row, in eighths: a rigid motion is one exactly."""
    stiffness = np.zeros((count, count))
    for i in range(count):
        if i:
            ends = np.zeros(count)
            ends[i - 1], ends[i] = 1, -1
            stiffness += draw.randint(1, 40) / 8 * np.outer(ends, ends)
        if held and (i == 0 or draw.random() < 0.5):
            stiffness[i, i] += draw.randint(1, 24) / 8
    return stiffness


def _damping(draw: random.Random, count: int, stiffness: np.ndarray, held: bool) -> dict:
    """None, that of modes, of the springs, or any."""
    kind = draw.choice(["none", "modes", "springs", "any", "any"])
    if kind == "any":
        size = draw.choice([0.1, 0.4, 1.0])
        return {"damping": _squares(draw, count, draw.randint(1, count), size)}
    if kind == "springs":
        return {"damping": 0.0625 * stiffness}
    if kind == "modes" and held:
        ratios = [0.0, 0.01, 0.05, 0.3, 1.0, 1.5]
        return {"damping_ratios": [draw.choice(ratios) for _ in range(count)]}
    return {}


def _normal(draw: random.Random, count: int, plain: bool) -> list[float]:
    """A coordinate against a wall, two against each other, or, if not `plain`, any."""
    row, kind = [0.0] * count, draw.random() * (0.8 if plain else 1.0)
    if kind < 0.5 or count == 1:
        row[draw.randrange(count)] = draw.choice([1.0, -1.0])
    elif kind < 0.8:
        one, other = draw.sample(range(count), 2)
        row[one], row[other] = 1.0, -1.0
    else:
        row = [draw.gauss(0, 1) for _ in range(count)]
    return row


def swinging(seed: int, *, rough: bool = False, pressed: bool = False) -> Drawn:
    """A driven structure; `rough`: with friction; `pressed`: on its stops, or starting there."""
    draw = random.Random(f"swinging {seed} {rough} {pressed}")
    count, stops = draw.randint(2 if rough else 1, 4), draw.randint(1, 3)
    held = draw.random() < 0.75
    mass = np.diag([draw.choice([0.5, 1.0, 2.0]) for _ in range(count)])
    if draw.random() < 0.6:
        mass = mass + _squares(draw, count, count, 1.0)
    stiffness = _springs(draw, count, held)
    frequency = draw.uniform(0.4, 3.0)
    some = [0.0, 0.25, -0.5, 0.125] if pressed else None
    q = [draw.choice(some) if some else draw.uniform(-0.5, 0.5) for _ in range(count)]
    still = pressed and draw.random() < 0.5
    v = [draw.choice([0, 0, 1, -1]) if still else draw.uniform(-1, 1) for _ in range(count)]
    load = np.array([draw.uniform(-1, 1) * draw.choice([0, 1, 2]) for _ in range(count)])
    made = []
    for j in range(stops):
        normal, more = _normal(draw, count, pressed), {}
        amplitude = draw.choice([0.0, 0.0, 0.25 if pressed else draw.uniform(-0.3, 0.3)])
        phase = 0.0 if pressed else draw.uniform(0, 6)
        start = float(np.dot(normal, q)) - amplitude * np.cos(phase)
        gap = start + (draw.choice([0.0, 0.25]) if pressed else draw.uniform(0, 1))
        if rough and j == 0:
            tangent = [draw.gauss(0, 1) for _ in range(count)]
            more = {"friction": draw.choice([0.1, 0.3, 0.5, 0.8]), "tangent": tangent}
        restitution = draw.choice([0, 0.2, 0.4] if pressed else [0, 0.2, 0.4, 0.6, 0.8, 1])
        made.append(vi.Stop(normal, gap, restitution, amplitude=amplitude, phase=phase, **more))
        if pressed and j == 0:
            load = load + draw.uniform(0.5, 2.5) * np.array(normal)
    rules = ["stop", "sequence"] if rough else ["stop", "sequence", "together"]
    force = [complex(draw.uniform(-1, 1), draw.uniform(-1, 1)) for _ in range(count)]
    structure = vi.Structure(
        mass,
        stiffness,
        made,
        static_load=load,
        drive_amplitude=np.array(force) * draw.choice([0.3, 1, 2]),
        drive_frequency=frequency,
        phase=draw.choice([0.0, draw.uniform(0, 6)]),
        law=draw.choice(["poisson", "newton", "energetic"]),
        simultaneous=draw.choice(rules),
        **_damping(draw, count, stiffness, held),
    )
    return structure, [q, [float(x) for x in v]]


def corner(seed: int) -> Drawn:
    """A body that falls into a corner, at the origin or elsewhere, without springs or with some."""
    draw = random.Random(f"corner {seed}")
    count = draw.randint(2, 3)
    stops = draw.randint(2, count)
    mass = np.eye(count) + (draw.random() < 0.5) * _squares(draw, count, count, 0.7)
    normals = np.eye(stops, count)
    normals += [[draw.uniform(-0.4, 0.4) for _ in range(count)] for _ in range(stops)]
    place = np.array([draw.choice([0.0, draw.uniform(-1, 1)])] * count)
    back = np.linalg.solve(mass, normals.T)
    depth = [draw.uniform(0.2, 1.5) for _ in range(stops)]
    q = place - back @ np.linalg.solve(normals @ back, depth)
    restitution = draw.choice([0.0, 0.1, 0.3, 0.5])
    structure = vi.Structure(
        mass,
        draw.choice([0.0, 0.0, 1e-6, 1.0]) * np.eye(count),
        [vi.Stop(row, float(row @ place), restitution) for row in normals],
        static_load=normals.T @ [draw.uniform(0.3, 2) for _ in range(stops)],
        drive_amplitude=np.zeros(count),
        drive_frequency=draw.uniform(1, 3),
        simultaneous=draw.choice(["sequence", "together"]),
    )
    return structure, [list(q), [draw.uniform(-0.5, 0.5) for _ in range(count)]]


FAMILIES = {
    "linear": swinging,
    "friction": lambda seed: swinging(seed, rough=True),
    "contact": lambda seed: swinging(seed, pressed=True),
    "corner": corner,
}
