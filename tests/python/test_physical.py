"""From SI quantities to a System (docs/theory.md, section 1)."""

import math
import re

import hypothesis.strategies as st
import pytest
from hypothesis import given

import repository
import vibroimpact as vi
from vibroimpact._core import PARAMETERS

QUANTITIES = {
    "pendulum_mass": 1.2,
    "oscillator_mass": 2.0,
    "length": 0.5,
    "torsional_stiffness": 40.0,
    "stiffness": 50.0,
    "torsional_damping": 0.3,
    "damping": 0.4,
    "moment_amplitude": 7.0,
    "force_amplitude": 3.0,
    "static_moment": 5.0,
    "static_force": -2.0,
    "drive_frequency": 9.0,
    "gap": 0.02,
    "restitution": 0.8,
    "friction": 0.1,
}
_scale = st.floats(1e-3, 1e3)


@given(
    length=_scale,
    mass=_scale,
    stiffness=_scale,
    mass_ratio=_scale,
    frequency_ratio=_scale,
    damping=st.tuples(st.floats(0.0, 2.0), st.floats(0.0, 2.0)),
    amplitudes=st.tuples(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0)),
    loads=st.tuples(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0)),
    drive_frequency=st.floats(0.0, 9.0),
    gap=st.floats(-1.0, 1.0),
)
def test_dimensionless_numbers_survive_the_way_through_si_units(
    length,
    mass,
    stiffness,
    mass_ratio,
    frequency_ratio,
    damping,
    amplitudes,
    loads,
    drive_frequency,
    gap,
):
    # The equations of motion read backwards: M1 l^2 theta'' + C1 theta' + K1 theta = f10 cos + C10,
    # M2 X'' + C2 X' + K2 X = f20 cos + F20, each divided by its inertia, in time 1/omega_2.
    omega_2 = math.sqrt(stiffness / mass)
    inertia = mass_ratio * mass * length**2
    omega_1 = frequency_ratio * omega_2
    system = vi.System.from_physical(
        pendulum_mass=mass_ratio * mass,
        oscillator_mass=mass,
        length=length,
        torsional_stiffness=inertia * omega_1**2,
        stiffness=stiffness,
        torsional_damping=2.0 * damping[0] * omega_1 * inertia,
        damping=2.0 * damping[1] * omega_2 * mass,
        moment_amplitude=amplitudes[0] * inertia * omega_2**2,
        force_amplitude=amplitudes[1] * mass * omega_2**2 * length,
        static_moment=loads[0] * inertia * omega_2**2,
        static_force=loads[1] * mass * omega_2**2 * length,
        drive_frequency=drive_frequency * omega_2,
        gap=gap * length,
        restitution=0.8,
        friction=0.3,
        phase=0.7,
        law="paper",
    )
    assert (system.restitution, system.friction, system.phase) == (0.8, 0.3, 0.7)
    assert (system.contact, system.law) == ("oblique", "paper")
    expected = {
        "mass_ratio": mass_ratio,
        "frequency_ratio": frequency_ratio,
        "pendulum_damping": damping[0],
        "oscillator_damping": damping[1],
        "moment_amplitude": amplitudes[0],
        "force_amplitude": amplitudes[1],
        "static_moment": loads[0],
        "static_force": loads[1],
        "drive_frequency": drive_frequency,
        "gap": gap,
    }
    # A dozen roundings of half an ulp each.
    for name, value in expected.items():
        assert getattr(system, name) == pytest.approx(value, rel=3e-15, abs=1e-300), name


def test_a_free_rotor_has_no_damping_ratio():
    quantities = QUANTITIES | {"torsional_stiffness": 0.0, "torsional_damping": 0.0}
    system = vi.System.from_physical(**quantities)
    assert (system.frequency_ratio, system.pendulum_damping) == (0.0, 0.0)
    with pytest.raises(vi.ParameterError, match=r"^torsional_damping = 0\.3 .*stiffness = 0"):
        vi.System.from_physical(**quantities | {"torsional_damping": 0.3})


@pytest.mark.parametrize("value", [0.0, -1.0])
@pytest.mark.parametrize("name", ["pendulum_mass", "oscillator_mass", "length", "stiffness"])
def test_scales_must_be_positive(name, value):
    with pytest.raises(vi.ParameterError, match=rf"^{name} = {value} .*> 0$"):
        vi.System.from_physical(**QUANTITIES | {name: value})


@pytest.mark.parametrize(
    "name", ["torsional_stiffness", "torsional_damping", "damping", "drive_frequency"]
)
def test_what_must_not_be_negative(name):
    with pytest.raises(vi.ParameterError, match=rf"^{name} = -1.0 .*>= 0$"):
        vi.System.from_physical(**QUANTITIES | {name: -1.0})


@pytest.mark.parametrize("value", [math.nan, math.inf, "1", None])
@pytest.mark.parametrize("name", sorted(QUANTITIES))
def test_what_is_no_finite_number_is_named_in_physical_words(name, value):
    with pytest.raises(vi.ParameterError, match=rf"^{name} = "):
        vi.System.from_physical(**QUANTITIES | {name: value})


def test_a_gap_that_the_tip_cannot_cross_is_warned_of():
    wide = QUANTITIES | {"gap": 20.0}
    said = r"^gap = 20\.0 m is larger than length = 0\.5 m: the tip cannot reach body 2 .* metres$"
    with pytest.warns(UserWarning, match=said) as caught:
        system = vi.System.from_physical(**wide)
    assert [warning.filename for warning in caught] == [__file__]
    # Nothing else warns: neither what has no such bound, nor a change of what is there.
    vi.System.from_physical(**QUANTITIES | {"gap": 0.5})
    vi.System.from_physical(**QUANTITIES | {"gap": -20.0})
    vi.System.from_physical(**wide | {"contact": "direct", "friction": 0.0})
    # A preload that compresses the spring by 19.8 m brings body 2 within reach.
    vi.System.from_physical(**wide | {"static_force": -19.8 * QUANTITIES["stiffness"]})
    assert system.replace(gap=21.0, units="SI").gap == 42.0
    assert vi.System.from_json(system.to_json()) == system


def test_ratios_beyond_a_float_are_parameter_errors():
    for length in (1e-200, 1e200):
        with pytest.raises(vi.ParameterError):
            vi.System.from_physical(**QUANTITIES | {"length": length})


README = (repository.root() / "README.md").read_text(encoding="utf-8")
FORMULAS = dict(re.findall(r"^\| `(\w+)` \| [^|]+ \| `([^`]+)` \|", README, re.M))
SYMBOLS = {
    "M1": "pendulum_mass",
    "M2": "oscillator_mass",
    "l": "length",
    "K1": "torsional_stiffness",
    "K2": "stiffness",
    "C1": "torsional_damping",
    "C2": "damping",
    "f10": "moment_amplitude",
    "f20": "force_amplitude",
    "C10": "static_moment",
    "F20": "static_force",
    "Omega": "drive_frequency",
    "Delta": "gap",
}


def test_the_readme_has_a_formula_for_every_parameter_that_is_no_pure_number():
    assert {*FORMULAS} == {*PARAMETERS} - {"restitution", "friction", "phase"}


@pytest.mark.parametrize("name", FORMULAS)
def test_the_formulas_of_the_readme_are_those_of_from_physical(name):
    names = {symbol: QUANTITIES[quantity] for symbol, quantity in SYMBOLS.items()}
    names |= {"sqrt": math.sqrt, "omega_2": math.sqrt(names["K2"] / names["M2"])}
    # A blank is a product, as in print.
    text = re.sub(r"(?<=[\w)]) (?=[\w(])", "*", FORMULAS[name]).replace("^", "**")
    system = vi.System.from_physical(**QUANTITIES)
    assert eval(text, names) == pytest.approx(getattr(system, name), rel=1e-14)
