"""Numbers, systems and states of every kind, and what must hold of a run of them."""

import decimal
import fractions
import math

import hypothesis.strategies as st
import numpy as np

import vibroimpact as vi
from vibroimpact.system import NUMERIC_RANGES

# The documented errors of what a caller gives, and of a computation that left the range of numbers.
REFUSALS = (vi.ParameterError, vi.StateError, vi.SimulationError)
NOT_NEGATIVE = (
    "mass_ratio",
    "frequency_ratio",
    "drive_frequency",
    "pendulum_damping",
    "oscillator_damping",
    "friction",
)
SPECIAL = (0.0, -0.0, 1.0, -1.0, 5e-324, 2.2e-308, 1e-160, 1e-16, 1e16, 1e154, 1.7e308)

any_float = (
    st.floats(-4, 4) | st.floats(allow_nan=True, allow_infinity=True) | st.sampled_from(SPECIAL)
)
any_number = (
    any_float
    | st.integers()
    | st.fractions()
    | st.just(fractions.Fraction(10**400))
    | st.just(decimal.Decimal("NaN"))
    | any_float.map(np.float64)
    | st.floats(width=16).map(np.float16)
    | st.floats(width=32).map(np.float32)
    | any_float.map(np.longdouble)
    | any_float.map(np.array)
    | st.sampled_from([True, None, "1", 1j, math])
)
any_state = st.tuples(any_float, any_float, any_float, any_float) | st.tuples(
    st.floats(-2, 2), st.floats(-2, 2), st.floats(-2, 4), st.floats(-2, 2)
)


def _allowed(fields):
    for name in NOT_NEGATIVE:
        fields[name] = abs(fields[name])
    if fields["restitution"] > 1:
        fields["restitution"] %= 1
    fields["restitution"] = abs(fields["restitution"])
    if fields["contact"] == "direct":
        fields["friction"] = 0.0
    return vi.System(**fields)


_finite = (
    st.floats(-4, 4)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.sampled_from(SPECIAL)
    | st.floats(0, 4)
)
allowed_systems = st.fixed_dictionaries(
    dict.fromkeys(NUMERIC_RANGES, _finite)
    | {"restitution": st.floats(0, 1)}
    | {"contact": st.sampled_from(["oblique", "oblique", "direct"])}
    | {"law": st.sampled_from(["poisson", "newton", "energetic", "paper"])}
).map(_allowed)


def is_short(system: vi.System, periods: int) -> bool:
    """Whether so many drive periods are few turns, and times of decay, of both bodies."""
    first = system.frequency_ratio * (1 + 2 * system.pendulum_damping)
    second = 1 + 2 * system.oscillator_damping
    speed = abs(system.moment_amplitude) + abs(system.force_amplitude)
    return periods * system.drive_period * (first + second + speed) < 1e3


def assert_no_nan(run: vi.Run) -> None:
    """Check all numbers of a run, and of what it can be asked, but for its energies."""
    end = run.final_state
    assert np.isfinite([*end.state, end.time, end.time_in_period]).all(), run
    for table in (run.impacts, run.grazes, run.contacts, run.events):
        for name in table.dtype.names:
            assert np.isfinite(table[name]).all(), (run, name)
    assert np.isfinite(run.stroboscopic).all(), run
    assert math.isfinite(run.time_in_contact)
    times = np.linspace(run.kept_from, end.time, 5)
    assert np.isfinite(run.trajectory(np.clip(times, run.kept_from, end.time))).all(), run
    assert run.label
