"""A value that is no known name is refused alike everywhere, with the name that was meant."""

import re

import numpy as np
import pytest

import vibroimpact as vi
from systems import PAPER as SYSTEM
from two_masses import structure

START = (0.0, 0.5, 0.0, 0.0)
RUN = vi.simulate(SYSTEM, initial=START, periods=6)
RECORD = vi.measure(RUN, "x1", sampling=1.0)
STRUCTURE = structure()
MANY = vi.simulate(
    vi.Structure([[1]], [[1]], [vi.Stop([1], 1.0, 1.0)] * 5), initial=[[0], [0]], time=1
)
MOVING = vi.simulate(STRUCTURE, initial=np.zeros((2, 2)), periods=3)


@pytest.mark.parametrize(("name", "meant"), [("gapp", "gap"), ("omega", "drive_frequency")])
def test_what_a_run_cannot_be_differentiated_by_is_answered_by_what_it_can(name, meant):
    with pytest.raises(vi.ParameterError, match=f"did you mean {meant}\\?"):
        RUN.sensitivity(name)


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("gpa", "gap"),
        ("omega", "drive_frequency"),
        ("x1", "q_0"),
        ("q", "q_0"),
        ("gap_00", "gap_0"),
        ("mass", r"mass\[0, 0\]"),
        ("stifness[0, 1]", r"stiffness\[0, 1\]"),
    ],
)
def test_the_same_of_a_structure(name, meant):
    with pytest.raises(vi.ParameterError, match=f", did you mean {meant}\\? allowed: drive_freq"):
        MOVING.sensitivity(name)


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("damping", "pendulum_damping or oscillator_damping"),
        ("dampng", "pendulum_damping or oscillator_damping"),
        ("zeta", "pendulum_damping or oscillator_damping"),
        ("freq", "frequency_ratio or drive_frequency"),
        ("amplitude", "moment_amplitude or force_amplitude"),
    ],
)
def test_a_part_of_several_names_is_answered_by_all_of_them(name, meant):
    for call in (
        lambda: RUN.sensitivity(name),
        lambda: vi.gradient(first, SYSTEM, name, initial=START, periods=3),
        lambda: vi.sweep(SYSTEM, initial=START, **{name: [1.0]}),
    ):
        with pytest.raises(vi.ParameterError, match=f", did you mean {meant}\\? "):
            call()


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: MOVING.sensitivity("gap_7"), "did you mean gap_0 or gap_1? allowed: that of one"),
        (lambda: MOVING.sensitivity("q_2"), "did you mean q_0 or q_1? allowed: that of one of 2"),
        (lambda: MOVING.sensitivity("freq"), "did you mean drive_frequency?"),
        (lambda: MOVING.sensitivity("restit"), "did you mean restitution?"),
        (lambda: MOVING.sensitivity(k={"gap_7": 1.0}), "did you mean gap_0 or gap_1?"),
        (lambda: MOVING.sensitivity(k={"freq": 1.0}), "did you mean drive_frequency?"),
        (lambda: MANY.sensitivity("gap_7"), "did you mean one of gap_0 ... gap_4?"),
    ],
)
def test_a_place_that_is_none_is_answered_by_those_that_are(call, said):
    with pytest.raises(vi.ParameterError, match=re.escape(said)):
        call()


def test_a_name_that_this_structure_lacks_is_told_once():
    said = "_0 = 0.0 is not allowed; allowed: a stop with friction > 0, however small"
    for name in ("friction", "friction_0"):
        with pytest.raises(vi.ParameterError, match=f"^friction{said}"):
            MOVING.sensitivity(name)
    undriven = vi.Structure([[1]], [[1]], [vi.Stop([1], 1.0, 1.0)])
    still = vi.simulate(undriven, initial=[[0], [0]], time=1)
    for name in ("phase", "drive_frequency"):
        said = f"^names = '{name}' is not allowed; allowed: another name with drive_frequency = 0"
        with pytest.raises(vi.ParameterError, match=said):
            still.sensitivity(name)


@pytest.mark.parametrize(
    ("name", "value"), [("spring", {"stiffness": [[1.0]]}), ("k", (abs, 2.0)), ("names", ["gap"])]
)
def test_a_system_has_names_and_no_directions(name, value):
    said = f'{name} = {value!r} is not allowed; allowed: names alone, such as "gap": directions'
    with pytest.raises(vi.ParameterError, match=f"^{re.escape(said)} by keyword are for a Struc"):
        RUN.sensitivity("gap", **{name: value})


def first(run):
    """When the first impact comes."""
    return run.impacts["time"][0]


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: RUN.sensitivity("gpa"), "names = 'gpa' is not allowed, did you mean gap?"),
        (
            lambda: MOVING.sensitivity("gpa"),
            "names = 'gpa' is not allowed, did you mean gap?",
        ),
        (
            lambda: vi.gradient(first, SYSTEM, "gpa", initial=START, periods=3),
            "names = 'gpa' is not allowed, did you mean gap?",
        ),
        (
            lambda: vi.gradient(
                first,
                lambda gap: SYSTEM.replace(gap=gap),
                {"gap": 0.5, "q_0": 0.0},
                initial=START,
                periods=3,
            ),
            "names = 'q_0' is not allowed; allowed: coordinates x1, v1, x2, v2",
        ),
        (
            lambda: vi.fit(RECORD, SYSTEM, initial=START, unknown="gpa"),
            "unknown = 'gpa' is not allowed, did you mean gap?",
        ),
        (
            lambda: vi.fit(
                vi.Record("q_0", RECORD.times, RECORD.values), SYSTEM, initial=START, unknown="gap"
            ),
            "record.kind = 'q_0' is not allowed",
        ),
        (lambda: vi.measure(RUN, "xx1"), "what = 'xx1' is not allowed, did you mean x1?"),
        (lambda: RUN.sensitivity("zzz"), "names = 'zzz' is not allowed; allowed: mass_ratio, "),
        (
            lambda: RUN.sensitivity("mass"),
            "names = 'mass' is not allowed; a vibroimpact.Structure takes masses, springs and "
            "stops of your own, as matrices. allowed: mass_ratio, ",
        ),
    ],
)
def test_a_value_that_is_no_name_is_refused_alike_everywhere(call, said):
    with pytest.raises(vi.ParameterError, match=f"^{re.escape(said)}"):
        call()


def test_a_number_of_ones_own_is_led_to_what_differentiates_by_it():
    with pytest.raises(vi.ParameterError, match=r"by vibroimpact\.gradient, with a function of it"):
        RUN.sensitivity("mass")

    def made(mass):
        return STRUCTURE.replace(mass=mass * np.array(STRUCTURE.mass))

    with pytest.raises(vi.ParameterError, match=r"name=\(function, value\): a function of it"):
        MOVING.sensitivity("payload")
    # Both ways that the errors name are ways.
    assert MOVING.sensitivity(payload=(made, 1.0)).names == ("payload",)
    value, slope = vi.gradient(
        first, lambda width: SYSTEM.replace(gap=width), {"width": 0.5}, initial=START, periods=3
    )
    assert value == RUN.impacts["time"][0]
    # Differences of the function are exact to rounding over their step.
    assert slope[0] == pytest.approx(RUN.sensitivity("gap").impacts.time[0, 0], rel=1e-9)
