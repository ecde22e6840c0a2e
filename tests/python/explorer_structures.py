"""Structures of the explorer's tests, and small maps of them."""

import numpy as np

import vibroimpact as vi
from vibroimpact.explorer import compute

PAIR = vi.Structure(
    [[1, 0], [0, 2]],
    [[2, -1], [-1, 1]],
    [vi.Stop([1, -1], 0.2, 0.7), vi.Stop([0, 1], 0.5, 0.8, amplitude=0.05)],
    damping_ratios=[0.02, 0.03],
    drive_amplitude=[1, 1j],
    drive_frequency=1.2,
)
# Chatters and slides.
ROUGH = vi.Structure(
    [[1, 0], [0, 1]],
    [[1, 0.2], [0.2, 1.5]],
    [
        vi.Stop([1, 0], 0.1, 0.3, friction=0.3, tangent=[0, 1]),
        vi.Stop([-1, 0], 0.4, 0.6, friction=0.2, tangent=[0, 1]),
    ],
    damping=[[0.1, 0], [0, 0.1]],
    drive_amplitude=[1, 0.5],
    drive_frequency=1.1,
)
FREE = vi.Structure([[1.0]], [[4.0]], [vi.Stop([1], 0.1, 0.8)], damping_ratios=[0.01])
CHAIN = vi.Structure(
    np.eye(6),
    2 * np.eye(6) - np.eye(6, k=1) - np.eye(6, k=-1),
    [
        vi.Stop(side * row, 0.3 + 0.01 * i, 0.8)
        for side in (1, -1)
        for i, row in enumerate(np.eye(6))
    ],
    damping_ratios=[0.05] * 6,
    drive_amplitude=[1, 0, 0, 0, 0, 0],
    drive_frequency=1.2,
)
POINTS = np.array([0.25, 0.5, 0.75])
BEAM = vi.Structure.from_modes(
    frequencies=[9.9, 39.5, 88.8],
    shapes=np.sin(np.pi * np.outer(POINTS, [1, 2, 3])),
    modal_mass=[0.5, 0.5, 0.5],
    stops=[vi.Stop([0, 1, 0], 0.01, 0.6)],
    damping_ratios=[0.01] * 3,
    drive_amplitude=[1, 0, 0],
    drive_frequency=8,
)
EVERY = {"pair": PAIR, "rough": ROUGH, "free": FREE, "chain": CHAIN, "beam": BEAM}
REST = {name: np.zeros((2, each.coordinates)) for name, each in EVERY.items()}
SMALL = dict.fromkeys(compute.FINE, compute.Detail(columns=7, rows=4, periods=60, keep=10))


def arguments(query):
    """What a web server makes of a query."""
    pairs = (part.partition("=") for part in query.split("&"))
    return {name: [value.encode()] for name, _, value in pairs}
