"""The legs of a motion, their conditions and the enums of both."""

import copy
import pickle

import pytest

import vibroimpact as vi
from vibroimpact import _core
from vibroimpact._core import (
    Border,
    BorderKind,
    Condition,
    EvidenceKind,
    Leg,
    LegEnd,
    LegKind,
    Regime,
    WhyUndecided,
)


@pytest.mark.parametrize("legs", [[], [Leg.CIRCUIT, Leg.CHATTER]])
def test_bad_sequences_are_refused(legs):
    with pytest.raises(vi.ParameterError, match="leg"):
        _core.Itinerary(legs, 1)


@pytest.mark.parametrize(
    "text", ["", "impact:frictionless:++", "impact:slip", "impact:slip:+", "stick:stop", "nonsense"]
)
def test_bad_texts_of_legs_are_refused(text):
    with pytest.raises(vi.ParameterError, match="leg"):
        Leg.from_text(text)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Leg.impact(Regime.SLIP),
        lambda: Leg.impact(Regime.SLIP, 1, 2),
        lambda: Leg.impact(Regime.FRICTIONLESS, 1, 1),
        lambda: Leg.impact(1, 1, 1),
        lambda: Leg.slide(0, LegEnd.STOP),
        lambda: Leg.slide(1, LegEnd.SLIDE_POSITIVE),
        lambda: Leg.stick(LegEnd.STOP),
        lambda: Leg.stick("release"),
        lambda: Condition("flight", 0),
    ],
)
def test_bad_legs_and_conditions_are_refused(make):
    with pytest.raises(vi.ParameterError):
        make()


LEGS = {
    "impact:frictionless": Leg.impact(Regime.FRICTIONLESS),
    "impact:slip:+-": Leg.impact(Regime.SLIP, 1, -1),
    "impact:stick_restitution:-+": Leg.impact(Regime.STICK_RESTITUTION, -1, 1),
    "chatter": Leg.CHATTER,
    "circuit": Leg.CIRCUIT,
    "slide+:release": Leg.slide(1, LegEnd.RELEASE),
    "slide-:stop": Leg.slide(-1, LegEnd.STOP),
    "stick:slide+": Leg.stick(LegEnd.SLIDE_POSITIVE),
    "stick:release": Leg.stick(LegEnd.RELEASE),
}


@pytest.mark.parametrize("text", LEGS)
def test_legs_are_written_as_they_are_read(text):
    leg = LEGS[text]
    assert str(leg) == text
    assert repr(leg) == f"<Leg {text}>"
    for same in (Leg.from_text(text), pickle.loads(pickle.dumps(leg)), copy.copy(leg)):
        assert same == leg
        assert hash(same) == hash(leg)
        fields = ("kind", "regime", "direction", "side", "end")
        assert [getattr(same, name) for name in fields] == [getattr(leg, name) for name in fields]
    assert [other for other in LEGS.values() if other == leg] == [leg]


def test_legs_say_what_they_are():
    impact, slide = LEGS["impact:slip:+-"], LEGS["slide-:stop"]
    assert (impact.kind, impact.regime, impact.end) == (LegKind.IMPACT, Regime.SLIP, None)
    assert (impact.direction, impact.side) == (1, -1)
    assert (slide.kind, slide.regime, slide.end) == (LegKind.SLIDE, None, LegEnd.STOP)
    assert (slide.direction, slide.side) == (-1, 0)
    assert LEGS["stick:slide+"].end is LegEnd.SLIDE_POSITIVE
    assert LEGS["impact:frictionless"].direction == 0


@pytest.mark.parametrize(
    "enum", [Regime, LegKind, LegEnd, Border, BorderKind, EvidenceKind, WhyUndecided]
)
def test_enums_of_the_core_are_enums(enum):
    assert enum.__module__ == "vibroimpact._core"
    assert enum.__doc__
    for member in enum:
        assert pickle.loads(pickle.dumps(member)) is member
        assert enum(member.value) is member


def test_regimes_have_the_names_and_numbers_of_the_records():
    assert [regime.name.lower() for regime in Regime] == [
        *("frictionless", "slip", "reversal_approach", "reversal_restitution"),
        *("stick_approach", "stick_restitution"),
    ]
    assert list(Regime) == [0, 1, 2, 3, 4, 5]
    assert vi.Regime is Regime


@pytest.mark.parametrize("border", Border)
def test_a_condition_is_a_border_of_a_leg(border):
    condition = Condition(border, 3)
    assert (condition.border, condition.leg) == (border, 3)
    assert str(condition) == f"{condition.kind}: {border}, leg 3"
    assert pickle.loads(pickle.dumps(condition)) == condition
    assert len({condition, Condition(border, 3), Condition(border, 4)}) == 2


def test_an_itinerary_gives_its_legs_back():
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
    legs = [Leg.from_text(text) for text in legs]
    itinerary = _core.Itinerary(legs, 3)
    assert itinerary.legs == legs
    assert pickle.loads(pickle.dumps(itinerary)).legs == legs
