"""Random structures against the reference simulator, event by event, by ``vi.verify``."""

import numpy as np
import pytest

import sizes
import vibroimpact as vi
from random_structures import FAMILIES

pytest.importorskip("flint")

#: What the reference cannot go on from, or what no precision decides: all that comes before is
#: compared. Others, as another sequence of events, are errors.
UNDECIDED = {"completed", "undecided", "precision_cap", "event_cap", "unproved"}
#: An endless sequence at one instant; one that ends stick at another stop.
FOUND = {"contact": (13,), "friction": (45,)}
#: Gaps below so many roundings of their terms are zero to a run (docs/structures.md).
ROUNDING = 64 * np.finfo(float).eps


def _bounces_low(run: vi.StructureRun, time: float) -> bool:
    """Whether bounces on several stops are lower than the rounding of the gaps, u^2/2 g''.

    No double tells then which stop is met first.
    """
    structure = run.system
    here = run.impacts["time"] <= time
    row = run.impacts[here][-1]
    mass, stiffness = (np.array(m) for m in (structure.mass, structure.stiffness))
    loads = np.abs(structure.static_load) + np.abs(structure.drive_amplitude)
    most = np.abs(np.linalg.inv(mass)) @ (loads + np.abs(stiffness) @ np.abs(row["q"]))
    touched = 0
    level = np.inf
    for stop in structure.stops:
        normal = np.array(stop.normal)
        angle = structure.drive_frequency * row["time"] + stop.phase
        gap = normal @ row["q"] - stop.gap - stop.amplitude * np.cos(angle)
        terms = np.abs(normal) @ np.abs(row["q"]) + abs(stop.gap) + abs(stop.amplitude)
        if abs(gap) <= ROUNDING * terms:
            touched += 1
            turns = abs(stop.amplitude) * structure.drive_frequency**2
            level = min(level, 2 * ROUNDING * terms * (np.abs(normal) @ most + turns))
    return touched > 1 and bool(row["approach_velocity"] ** 2 <= level)


@pytest.mark.parametrize("family", FAMILIES)
def test_random_structures_move_as_the_reference_says(family: str) -> None:
    cases = sizes.either(5 if family == "corner" else 12, 300)
    events = whole = low = 0
    for seed in [*range(cases), *(seed for seed in FOUND.get(family, ()) if seed >= cases)]:
        structure, initial = FAMILIES[family](seed)
        run = vi.simulate(structure, initial=initial, periods=2, max_events=100)
        found = vi.verify(run, digits=6, max_precision=1024, max_events=200)
        at = found.horizon
        if at is not None and _bounces_low(run, at.time):
            low += 1
        else:
            assert found.stopped in UNDECIDED, f"{family} {seed}: {found}"
            assert found.horizon is None, f"{family} {seed}: {found}"
        events += len(found.impacts) + len(found.contacts)
        whole += found.stopped == "completed"
    print(f"{family}: {whole} whole runs of {cases}, {events} events; {low} left open")
    assert whole > cases / 2
    assert events > 3 * cases
