"""Proved motions return: a run from the middle of the proof, verified by the reference in balls.

`vi.verify` bounds the error of each number of a run. After a motion's m drive periods the run is at
the proof's first impact again, within that bound and the box, times what errors grow by.
"""

import numpy as np
import pytest

import vibroimpact as vi
from small_results import START
from struck import MIRRORED, REST
from systems import PAPER

pytest.importorskip("flint")

ROUGH = PAPER.replace(friction=0.5, damping=(0.02, 0.02))
"""With slip and its reversals."""
CHAIN = MIRRORED.replace(drive_frequency=1.4)
"""Two masses between two stops."""


def proved(system, start):
    motion = vi.simulate(system, initial=start, periods=600, keep=100).refine()
    proof = vi.prove(motion)
    assert proof.verdict == "proved"
    return motion, proof


def growth(motion):
    """What a period makes of an error, with room for second order."""
    return 1000.0 * max(1.0, float(np.abs(motion.multipliers).max()))


def columns(impacts, size):
    """Velocities after the impacts and coordinates at them, in rows as the proof has nodes."""
    if "q" in (impacts.dtype.names or ()):
        return np.column_stack([impacts["q"], impacts["v_post"]])
    names = ("x1", "x2", "v1_post", "v2_post") if size == 2 else ("x1", "v1_post")
    return np.column_stack([impacts[name] for name in names])


@pytest.mark.parametrize(
    ("system", "start"),
    [(PAPER, START), (ROUGH, START), (CHAIN, REST[2])],
    ids=["without friction", "with friction", "chain"],
)
def test_the_reference_returns_to_the_box(system, start):
    motion, proof = proved(system, start)
    initial = motion.initial if system is not CHAIN else motion.sections[0]
    run = vi.simulate(system, initial=initial, periods=2 * motion.m, keep=2 * motion.m)
    checked = vi.verify(run)
    assert checked.holds
    bound = max(
        float(checked.impacts[name].max())
        for name in checked.impacts.dtype.names
        if name.startswith("error_")
    )
    center, radius = proof.box.center, proof.box.radius
    size, count = center.shape[1] // 2, len(center)
    found = columns(run.impacts, size)
    assert len(found) == 2 * count
    # the first impact of the run is some node of the proof
    away = [np.abs(found[:count] - np.roll(center, -k, 0)[:, :-1]).max() for k in range(count)]
    k = int(np.argmin(away))
    nodes = np.roll(center, -k, 0)[:, :-1]
    room = growth(motion) * (bound + float(radius.max()) + 4 * np.finfo(float).eps)
    assert np.abs(found[:count] - nodes).max() < room
    assert np.abs(found[count:] - nodes).max() < room
    assert room < 1e-10
