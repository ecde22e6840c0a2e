"""The words for the legs of a motion."""

import pytest

import vibroimpact as vi
from vibroimpact import _core


@pytest.mark.parametrize(
    "legs", [[], ["circuit", "chatter"], ["impact:frictionless:++"], ["impact:slip"], ["nonsense"]]
)
def test_bad_legs_are_refused(legs):
    with pytest.raises(vi.ParameterError, match="leg"):
        _core.Itinerary(legs, 1)


def test_legs_are_written_as_they_are_read():
    legs = [
        "impact:frictionless",
        "impact:slip:+-",
        "impact:stick_restitution:-+",
        "chatter",
        "slide+:release",
        "slide-:stop",
        "stick:slide+",
        "stick:release",
    ]
    assert _core.Itinerary(legs, 3).legs == legs
