"""The System: validation, identity and round trips."""

import copy
import dataclasses
import inspect
import json
import math
import pickle
from fractions import Fraction

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given

import vibroimpact as vi
from vibroimpact._core import CONTACTS, LAWS, PARAMETERS

REQUIRED = {
    "mass_ratio": 0.6,
    "frequency_ratio": 2.0,
    "restitution": 0.8,
    "gap": 0.5,
    "drive_frequency": 1.8,
}
DEFAULTS = {
    "pendulum_damping": 0.0,
    "oscillator_damping": 0.0,
    "moment_amplitude": 0.0,
    "force_amplitude": 0.0,
    "static_moment": 0.0,
    "static_force": 0.0,
    "friction": 0.0,
    "phase": 0.0,
    "contact": "oblique",
    "law": "poisson",
}
NOT_NEGATIVE = (
    "mass_ratio",
    "frequency_ratio",
    "drive_frequency",
    "pendulum_damping",
    "oscillator_damping",
    "friction",
)

_any = st.floats(-1e3, 1e3)
_not_negative = st.floats(0.0, 1e3)
_oblique = st.fixed_dictionaries(
    dict.fromkeys(PARAMETERS, _any)
    | dict.fromkeys(NOT_NEGATIVE, _not_negative)
    | {
        "restitution": st.floats(0.0, 1.0),
        "contact": st.just("oblique"),
        "law": st.sampled_from(["poisson", "paper"]),
    }
)
_direct = _oblique.map(lambda fields: fields | {"contact": "direct", "friction": 0.0})
systems = (_oblique | _direct).map(lambda fields: vi.System(**fields))


@given(systems)
def test_every_round_trip_gives_an_equal_system(system):
    trips = [
        eval(repr(system), {"System": vi.System}),
        vi.System.from_dict(system.to_dict()),
        vi.System.from_json(system.to_json()),
        pickle.loads(pickle.dumps(system)),
        copy.copy(system),
        copy.deepcopy(system),
        system.replace(),
        dataclasses.replace(system),
    ]
    for trip in trips:
        assert trip == system
        assert hash(trip) == hash(system)
        assert trip.to_dict() == system.to_dict()


@given(systems, st.sampled_from(sorted(PARAMETERS)), st.floats(0.0, 1.0))
def test_replace_changes_one_field_only(system, name, value):
    if name == "friction" and system.contact == "direct":
        value = 0.0
    changed = system.replace(**{name: value})
    assert changed.to_dict() == system.to_dict() | {name: value}
    assert (changed == system) == (getattr(system, name) == value)


def test_signatures_have_the_defaults_of_the_core():
    for function in (vi.System, vi.System.from_physical):
        signature = inspect.signature(function).parameters
        for name, parameter in PARAMETERS.items():
            if name in signature and (function is vi.System or parameter.default is not None):
                empty = inspect.Parameter.empty
                wanted = empty if parameter.default is None else parameter.default
                assert signature[name].default == wanted
        assert signature["contact"].default == CONTACTS[0]
        assert signature["law"].default == LAWS[0]
    assert set(PARAMETERS) < set(inspect.signature(vi.System).parameters)


def test_defaults():
    assert vi.System(**REQUIRED).to_dict() == REQUIRED | DEFAULTS


def test_arguments_are_keywords_and_required():
    with pytest.raises(TypeError):
        vi.System(0.6, 2.0, 0.8, 0.5, 1.8)
    for name in REQUIRED:
        with pytest.raises(TypeError, match=name):
            vi.System(**{key: value for key, value in REQUIRED.items() if key != name})
    with pytest.raises(TypeError, match="stiffness"):
        vi.System(**REQUIRED, stiffness=1.0)


def test_a_misspelt_name_is_told_the_one_that_was_meant():
    for call in (
        lambda: vi.System(**REQUIRED, fricton=0.5),
        lambda: vi.System(**REQUIRED).replace(fricton=0.5),
        lambda: vi.System.from_physical(fricton=0.5),
    ):
        with pytest.raises(TypeError, match=r"'fricton', did you mean friction\?$"):
            call()
    with pytest.raises(TypeError, match=r"'colour'; known: mass_ratio, .*, law, damping, scales$"):
        vi.System(**REQUIRED, colour="red")
    assert list(inspect.signature(vi.System).parameters) == [
        *REQUIRED,
        *DEFAULTS,
        "damping",
        "scales",
    ]


@pytest.mark.parametrize(
    "two", [2, 2.0, np.float32(2), np.int64(2), np.array(2.0), Fraction(4, 2), np.longdouble(2)]
)
def test_numbers_become_floats(two):
    system = vi.System(**REQUIRED | {"frequency_ratio": two})
    assert type(system.frequency_ratio) is float
    assert system == vi.System(**REQUIRED)


def test_negative_zero_is_zero():
    system = vi.System(**REQUIRED, phase=-0.0)
    assert math.copysign(1.0, system.phase) == 1.0


@pytest.mark.parametrize("name", sorted(PARAMETERS))
@pytest.mark.parametrize(
    "value",
    ["1.0", None, True, 1j, [1.0], np.array([1.0]), math.nan, math.inf, -math.inf, 10**400],
    ids=lambda value: str(value)[:9],
)
def test_what_is_no_finite_number_is_rejected(name, value):
    with pytest.raises(vi.ParameterError) as caught:
        vi.System(**REQUIRED | {name: value})
    message = str(caught.value)
    # Of a number of four hundred digits the first ones.
    assert message.startswith(f"{name} = {value!r} "[:200])
    assert len(message) < 300
    assert message.endswith(PARAMETERS[name].allowed)


@pytest.mark.parametrize(
    ("name", "value"),
    [(name, -5e-324) for name in NOT_NEGATIVE]
    + [("restitution", -5e-324), ("restitution", math.nextafter(1.0, 2.0))],
)
def test_range_borders_and_their_words(name, value):
    with pytest.raises(vi.ParameterError) as caught:
        vi.System(**REQUIRED | {name: value})
    message = str(caught.value)
    assert message.startswith(f"{name} = ")
    assert message.endswith(PARAMETERS[name].allowed)
    assert float(message.split()[2]) == value
    inside = 1.0 if value > 1.0 else 0.0
    assert getattr(vi.System(**REQUIRED | {name: inside}), name) == inside


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({"contact": "head-on"}, "contact"),
        ({"contact": None}, "contact"),
        ({"law": "Poisson"}, "law"),
        ({"law": 1}, "law"),
        ({"contact": "direct", "friction": 0.1}, "friction"),
        ({"damping": 0.1}, "damping"),
        ({"damping": (0.1,)}, "damping"),
        ({"damping": (0.1, -0.1)}, "oscillator_damping"),
        ({"damping": (0.1, 0.2), "pendulum_damping": 0.3}, "damping"),
    ],
    ids=str,
)
def test_other_bad_parameters_are_named(changes, name):
    with pytest.raises(vi.ParameterError, match=f"^{name} = "):
        vi.System(**REQUIRED | changes)


def test_parameter_error_is_a_value_error():
    with pytest.raises(ValueError, match="restitution"):
        vi.System(**REQUIRED | {"restitution": 2.0})


def test_damping_is_a_shorthand_for_both():
    system = vi.System(**REQUIRED, damping=(0.1, 0.2))
    assert system == vi.System(**REQUIRED, pendulum_damping=0.1, oscillator_damping=0.2)
    assert system.damping == (0.1, 0.2)
    assert system.replace(damping=(0.3, 0.4)).damping == (0.3, 0.4)
    assert system.replace(oscillator_damping=0.5).damping == (0.1, 0.5)
    assert "damping" not in {field.name for field in dataclasses.fields(system)}


def test_systems_are_immutable():
    system = vi.System(**REQUIRED)
    with pytest.raises(dataclasses.FrozenInstanceError):
        system.gap = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        del system.gap
    with pytest.raises(dataclasses.FrozenInstanceError):
        system.damping = (0.1, 0.1)


def test_drive_period():
    assert vi.System(**REQUIRED).drive_period == 2.0 * math.pi / 1.8
    assert vi.System(**REQUIRED | {"drive_frequency": 0}).drive_period == math.inf


def test_dict_and_json_name_what_is_wrong():
    fields = vi.System(**REQUIRED).to_dict()
    with pytest.raises(vi.ParameterError, match=r"unknown.*colour$"):
        vi.System.from_dict(fields | {"colour": 1})
    with pytest.raises(vi.ParameterError, match=r"unknown.*fricton, did you mean friction\?$"):
        vi.System.from_dict(fields | {"fricton": 1})
    del fields["gap"]
    with pytest.raises(vi.ParameterError, match=r"missing.*gap"):
        vi.System.from_dict(fields)
    with pytest.raises(vi.ParameterError, match="fields = 3"):
        vi.System.from_dict(3)
    for text in ("{", "3", '{"gap": 1}', json.dumps(REQUIRED | {"gap": math.nan})):
        with pytest.raises(vi.ParameterError):
            vi.System.from_json(text)
    with pytest.raises(vi.ParameterError, match="not the JSON"):
        vi.System.from_json(None)


def test_optional_fields_may_be_left_out_of_a_dict():
    assert vi.System.from_dict(REQUIRED) == vi.System(**REQUIRED)
