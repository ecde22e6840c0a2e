"""The end of chatter at one stop, while the structure is about to meet another."""

import numpy as np
import pytest

import vibroimpact as vi

HEIGHT, RESTITUTION = 0.1, 0.5
#: A ball that falls so far bounces to rest after this time.
FALL = np.sqrt(2 * HEIGHT)
REST = FALL * (1 + RESTITUTION) / (1 - RESTITUTION)


def ball_and_flier(before: float, coupling: float) -> vi.Structure:
    """A ball above a floor, and a mass that meets its wall so long before the ball is at rest."""
    return vi.Structure(
        np.eye(2),
        np.zeros((2, 2)),
        [vi.Stop([1, 0], 0, RESTITUTION), vi.Stop([coupling, 1], REST - before, 0.5)],
        static_load=[1, 0],
        simultaneous="sequence",
    )


@pytest.mark.parametrize("before", [1e-2, 1e-3, 1e-4, 1e-6, 1e-9, 1e-12])
def test_another_stop_is_met_before_the_end_of_chatter(before: float) -> None:
    structure = ball_and_flier(before, 0.0)
    run = vi.simulate(structure, initial=[[-HEIGHT, 0], [0, 1]], time=REST + 0.5)
    times = run.impacts["time"][run.impacts["stop"] == 1]
    assert len(times) == 1
    assert abs(times[0] - (REST - before)) < 1e-14
    # the ball does not see it, but hops below the rounding of gaps have no order
    (chatter,) = run.contacts[run.contacts["kind"] == vi.EventKind.CHATTER]
    assert abs(chatter["time"] - REST) < (1e-12 if before > 1e-7 else 1e-8)


@pytest.mark.parametrize("before", [1e-2, 1e-4, 1e-6])
def test_a_stop_that_acts_on_the_chatter_is_met_before_its_end(before: float) -> None:
    pytest.importorskip("flint")
    structure = ball_and_flier(before, 0.3)
    run = vi.simulate(structure, initial=[[-HEIGHT, 0], [0, 1]], time=REST + 0.5)
    found = vi.verify(run)
    assert found.horizon is None, found
    assert found.stopped == "completed", found
