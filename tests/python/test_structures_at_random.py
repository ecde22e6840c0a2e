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
#: Where bounces on several stops get lower than this, rounding decides which stop is met first, and
#: an endless sequence of impacts at one instant ends (docs/structures.md).
LOW = 1e-5


def _is_open(found: vi.Verification) -> bool:
    """Whether the reference ends where both contact and flight are motions (a Painleve point)."""
    return found.horizon.event == "stop" and "no one continuation" in found.stop_detail


def _bounces_low(run: vi.StructureRun, time: float) -> bool:
    here = np.abs(run.impacts["time"] - time) < 1e-4
    several = len(set(run.impacts["stop"][here])) > 1
    return several and bool(run.impacts["approach_velocity"][here].min() < LOW)


@pytest.mark.parametrize("family", FAMILIES)
def test_random_structures_move_as_the_reference_says(family: str) -> None:
    cases = sizes.either(5 if family == "corner" else 12, 300)
    events = whole = low = 0
    for seed in range(cases):
        structure, initial = FAMILIES[family](seed)
        run = vi.simulate(structure, initial=initial, periods=2, max_events=100)
        found = vi.verify(run, digits=6, max_precision=1024, max_events=200)
        at = found.horizon
        if at is not None and (_bounces_low(run, at.time) or _is_open(found)):
            low += 1
        else:
            assert found.stopped in UNDECIDED, f"{family} {seed}: {found}"
            assert found.horizon is None, f"{family} {seed}: {found}"
        events += len(found.impacts) + len(found.contacts)
        whole += found.stopped == "completed"
    print(f"{family}: {whole} whole runs of {cases}, {events} events; {low} left open")
    assert whole > cases / 2
    assert events > 3 * cases
