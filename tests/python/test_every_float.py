"""Any numbers at all: a system is in range or refused, and what runs has no NaN.

Properties are drawn at random with a fixed seed; what fails is told as it was drawn.
"""

import pickle

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import Phase, example, given, settings

import vibroimpact as vi
from any_values import VALUES
from complete_results import assert_complete
from drawn_calls import ENDS, SIGNED, SPECIAL, execute, is_short
from systems import PAPER, ROUGH
from vibroimpact._core import PARAMETERS

# Of huge numbers, which are drawn too, and of gaps with which some cells have no start.
pytestmark = pytest.mark.filterwarnings(
    "ignore:Generating overly large repr",
    "ignore:gap = .* the tip cannot reach:UserWarning",
    "ignore:.* and no run, status overlap:UserWarning",
)

# To make it smaller takes long where a run takes long.
QUICK = settings(
    max_examples=300, derandomize=True, deadline=None, phases=(Phase.explicit, Phase.generate)
)

any_float = st.floats(-4, 4) | st.floats() | st.sampled_from(SPECIAL)
any_number = (
    any_float
    | st.integers()
    | st.fractions()
    | any_float.map(np.float64)
    | st.floats(width=16).map(np.float16)
    | st.floats(width=32).map(np.float32)
    | any_float.map(np.longdouble)
    | any_float.map(np.array)
    | st.sampled_from([*VALUES.values()])
)
any_state = st.tuples(any_float, any_float, any_float, any_float) | st.tuples(
    st.floats(-2, 2), st.floats(-2, 2), st.floats(-2, 4), st.floats(-2, 2)
)
finite = st.floats(-4, 4) | st.floats(allow_nan=False, allow_infinity=False)


# The largest numbers allowed, where they are limited.
LARGEST = {"restitution": 1.0, "drive_frequency": 1e50}


def _allowed(fields: dict) -> vi.System:
    for name in PARAMETERS:
        if name not in SIGNED:
            fields[name] = min(abs(fields[name]), LARGEST.get(name, np.inf))
    return vi.System(**fields | ({"friction": 0.0} if fields["contact"] == "direct" else {}))


allowed_systems = st.fixed_dictionaries(
    dict.fromkeys(PARAMETERS, finite)
    | {"restitution": st.floats(0, 1)}
    | {"contact": st.sampled_from(["oblique", "oblique", "direct"])}
    | {"law": st.sampled_from(["poisson", "newton", "energetic", "paper"])}
).map(_allowed)


@settings(QUICK)
@given(fields=st.fixed_dictionaries(dict.fromkeys(PARAMETERS, any_number)))
def test_a_system_of_any_numbers_is_in_range_or_refused(fields):
    try:
        system = vi.System(**fields)
    except vi.ParameterError as error:
        if not any(str(error).startswith(f"{name} =") for name in fields):
            raise
        return
    assert_complete(system)
    assert pickle.loads(pickle.dumps(system)) == system


@settings(QUICK)
@given(name=st.sampled_from([*PARAMETERS]), value=any_float)
def test_one_number_out_of_range_is_named_with_its_value(name, value):
    low = -np.inf if name in SIGNED else 0.0
    if np.isfinite(value) and low <= value <= LARGEST.get(name, np.inf):
        assert getattr(PAPER.replace(**{name: value}), name) == value
        return
    with pytest.raises(vi.ParameterError, match=f"^{name} = .* is not allowed; allowed: a"):
        PAPER.replace(**{name: value})


@settings(QUICK)
@given(allowed_systems, any_state, st.integers(1, 3), st.booleans())
def test_a_short_run_has_no_nan(system, initial, periods, resumed):
    if not is_short(system, periods):
        return
    try:
        run = vi.simulate(system, initial=initial, periods=periods, max_events=30)
        if resumed:
            run = run.resume(periods=1, max_events=60)
    except ENDS:
        return
    assert_complete(run)


def test_a_trajectory_under_the_largest_drive_frequency_has_no_nan():
    system = PAPER.replace(
        contact="direct",
        drive_frequency=LARGEST["drive_frequency"],
        damping=(0.0, 2.2),
        force_amplitude=-0.3,
        gap=1e300,
    )
    run = vi.simulate(system, initial=(0.4, 0.0, 0.4, -1.4), periods=1)
    assert_complete(run)


@settings(QUICK)
@given(
    allowed_systems,
    st.tuples(any_number, any_number, any_number),
    st.none() | st.integers(1, 30),
)
def test_an_impact_has_numbers_or_no_outcome(system, before, steps):
    x1, v1, v2 = before
    try:
        assert_complete(vi.impact(system, x1=x1, v1=v1, v2=v2, steps=steps))
    except ENDS:
        return


@pytest.mark.parametrize("law", ["poisson", "newton", "energetic", "paper"])
def test_an_impact_whose_energies_no_float_holds_has_no_outcome(law):
    fast = vi.impact(ROUGH.replace(law=law), x1=0.3, v1=[1e150, 1e160, 1e300], v2=0.0)
    assert (fast["regime"] >= 0).tolist() == [True, False, False]
    assert np.isnan(fast["v1_post"]).tolist() == [False, True, True]
    assert_complete(fast)


@settings(QUICK)
@given(starts=st.lists(any_state, min_size=1, max_size=3))
def test_several_starts_of_any_numbers_run_or_are_refused(starts):
    # A tip that turns often in a period takes as long as it is asked for.
    if any(50.0 < abs(x) < np.inf for start in starts for x in start):
        return
    try:
        runs = vi.simulate(ROUGH, initial=starts, periods=1, max_events=30)
    except ENDS:
        return
    assert_complete(runs)


@settings(QUICK)
@given(st.binary(min_size=20, max_size=120))
@example(b"")
def test_any_bytes_make_a_call_that_keeps_the_contract(data):
    name, outcome = execute(data)
    assert outcome in ("taken", "refused", "failed"), name
