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
#: An endless sequence at one instant; one that ends stick at another stop; stick that begins with a
#: plastic impact where flight is a motion, too.
FOUND = {"contact": (13,), "friction": (45, 49)}
#: Gaps below so many roundings of their terms are zero to a run (docs/structures.md).
ROUNDING = 64 * np.finfo(float).eps
#: Chatter is completed to 1e-12. Of chatter that follows chatter, ever lower, digits are lost by u.
LOST = 1e-9


def _bounces_low(run: vi.StructureRun, time: float) -> bool:
    """Whether bounces on several stops are lower than the rounding of the gaps, u^2/2 g''.

    No double tells then which stop is met first.
    """
    structure = run.system
    row = run.impacts[run.impacts["time"] <= time][-1]
    loads = np.abs(structure.static_load) + np.abs(structure.drive_amplitude)
    forces = loads + np.abs(structure.stiffness) @ np.abs(row["q"])
    bent = np.abs(np.linalg.inv(structure.mass)) @ forces
    touched, level = 0, 0.0
    for stop in structure.stops:
        normal, amplitude = np.abs(stop.normal), abs(stop.amplitude)
        angle = structure.drive_frequency * row["time"] + stop.phase
        gap = stop.normal @ row["q"] - stop.gap - stop.amplitude * np.cos(angle)
        size = normal.sum() * np.abs(row["q"]).max() + abs(stop.gap) + amplitude
        if abs(gap) <= ROUNDING * size:
            touched += 1
            most = normal @ bent + amplitude * structure.drive_frequency**2
            level = max(level, 2 * most * ROUNDING * size)
    return touched > 1 and bool(row["approach_velocity"] ** 2 <= level)


def _digits_are_small(run: vi.StructureRun, found: vi.Verification) -> bool:
    """Whether all that is lost are digits of impacts lower than the tolerance has digits for."""
    if found.horizon.reason != "digits" or found.horizon.event != "impact":
        return False
    row = found.impacts[found.impacts["number"] == found.horizon.number][0]
    off = max(row["error_time"], *row["error_q"], *row["error_v_pre"], *row["error_v_post"])
    slow = run.impacts["approach_velocity"][found.horizon.number - 1] < 1e6 * LOST
    return bool(slow and off < LOST)


@pytest.mark.parametrize("family", FAMILIES)
def test_random_structures_move_as_the_reference_says(family: str) -> None:
    cases = sizes.either(5 if family == "corner" else 8, 300)
    events = whole = low = 0
    for seed in [*range(cases), *(seed for seed in FOUND.get(family, ()) if seed >= cases)]:
        structure, initial = FAMILIES[family](seed)
        run = vi.simulate(structure, initial=initial, periods=2, max_events=100)
        found = vi.verify(run, digits=6, max_precision=1024, max_events=200)
        at = found.horizon
        if at is not None and (_bounces_low(run, at.time) or _digits_are_small(run, found)):
            low += 1
        else:
            assert found.stopped in UNDECIDED, f"{family} {seed}: {found}"
            assert found.horizon is None, f"{family} {seed}: {found}"
        events += len(found.impacts) + len(found.contacts)
        whole += found.stopped == "completed"
    print(f"{family}: {whole} whole runs of {cases}, {events} events; {low} left open")
    assert whole > cases / 2
    assert events > 3 * cases
