"""Public functions with every kind of argument: refused with a typed error, or a result.

What no function may do, whatever it is given: panic, raise another error than its documented ones,
or return NaN where it does not say so.
"""

import contextlib
import copy
import datetime
import decimal
import fractions
import math
import pickle
from concurrent.futures import ThreadPoolExecutor

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import Phase, given, settings

import vibroimpact as vi
from every_input import (
    REFUSALS,
    allowed_systems,
    any_number,
    any_state,
    assert_no_nan,
    is_short,
)
from vibroimpact.system import NUMERIC_RANGES

START = (0.0, 0.5, 0.0, 0.0)
FIELDS = {
    "mass_ratio": 0.6,
    "frequency_ratio": 2.0,
    "restitution": 0.8,
    "gap": 0.5,
    "drive_frequency": 1.8,
    "moment_amplitude": 1.0,
}
SYSTEM = vi.System(**FIELDS)
ROUGH = SYSTEM.replace(friction=0.5)
MOTION = vi.simulate(SYSTEM, initial=START, periods=300, keep=100).refine()
RUN = vi.simulate(ROUGH, initial=START, periods=5)
BETWEEN = [RUN.kept_from, RUN.final_state.time / 3, RUN.final_state.time]

# What fails is told as it was drawn: to make it smaller takes long where a run takes long.
QUICK = settings(
    max_examples=300, derandomize=True, deadline=None, phases=(Phase.explicit, Phase.generate)
)

WRONG = {
    "nan": math.nan,
    "inf": math.inf,
    "-inf": -math.inf,
    "-0": -0.0,
    "subnormal": 5e-324,
    "huge": 1.7e308,
    "minus": -1.0,
    "whole": 2,
    "huge integer": 10**400,
    "bool": True,
    "complex": 1j,
    "text": "1.0",
    "bytes": b"\x00",
    "none": None,
    "object": object(),
    "dict": {"x1": 1.0},
    "set": {1.0, 2.0},
    "type": float,
    "function": len,
    "date": datetime.date(2004, 1, 1),
    "decimal": decimal.Decimal("0.5"),
    "decimal nan": decimal.Decimal("NaN"),
    "fraction": fractions.Fraction(1, 2),
    "float16": np.float16(0.5),
    "longdouble": np.longdouble("0.5"),
    "longdouble beyond": np.longdouble("1e4000"),
    "0-d": np.array(0.5),
    "0-d object": np.array(None, dtype=object),
    "empty": np.array([]),
    "empty rows": np.empty((0, 4)),
    "empty columns": np.empty((4, 0)),
    "row": np.array([0.1, 0.2, 0.3, 0.4]),
    "float16 row": np.array([0.1, 0.2, 0.3, 0.4], np.float16),
    "integers": np.array([0, 1], np.int8),
    "unsigned": np.array([2**64 - 1, 0], np.uint64),
    "bools": np.array([True, False]),
    "complex row": np.array([1j, 2.0]),
    "objects": np.array([0.5, None], dtype=object),
    "texts": np.array(["a", "b"]),
    "dates": np.array(["2004-01-01"], "M8[D]"),
    "records": np.zeros(2, [("x1", float), ("v1", float)]),
    "nan row": np.array([0.0, math.nan, 0.0, 0.0]),
    "inf row": np.array([0.0, math.inf, 0.0, 0.0]),
    "ragged": [[0.0], [0.0, 1.0]],
    "deep": np.zeros((2, 2, 2, 4)),
    "masked": np.ma.masked_array([0.5, 0.6], [True, False]),
    "surrogate": "\udc80",
    "zero byte": "a\x00b",
}

# A path is refused by what it is handed to.
REFUSED_BY_NAME = {"store": (*REFUSALS, ValueError, OSError)}
# One quick valid call of each function: its arguments are replaced one by one.
CALLS = {
    "System": (vi.System, FIELDS | {"damping": (0.1, 0.1), "contact": "oblique", "law": "newton"}),
    "System.from_physical": (
        vi.System.from_physical,
        {
            "pendulum_mass": 0.6,
            "oscillator_mass": 1.0,
            "length": 1.0,
            "torsional_stiffness": 2.4,
            "stiffness": 1.0,
            "gap": 0.5,
            "restitution": 0.8,
            "drive_frequency": 1.8,
            "torsional_damping": 0.1,
            "damping": 0.1,
            "moment_amplitude": 0.6,
            "force_amplitude": 0.1,
            "friction": 0.1,
            "phase": 0.1,
        },
    ),
    "System.from_dict": (vi.System.from_dict, {"fields": FIELDS}),
    "System.from_json": (vi.System.from_json, {"text": SYSTEM.to_json()}),
    "System.replace": (SYSTEM.replace, dict.fromkeys(NUMERIC_RANGES, 0.25)),
    "simulate": (
        vi.simulate,
        {
            "system": ROUGH,
            "initial": START,
            "periods": 3,
            "keep": 2,
            "max_events": 100,
            "tolerance": 1e-9,
            "section_phase": 0.5,
            "workers": 1,
        },
    ),
    "simulate for a time": (vi.simulate, {"system": ROUGH, "initial": START, "time": 3.0}),
    "Run.trajectory": (RUN.trajectory, {"t": BETWEEN, "forces": True}),
    "Run.resume": (RUN.resume, {"periods": 2, "keep": 1, "max_events": 100}),
    "Run.resume for a time": (RUN.resume, {"time": 2.0}),
    "impact": (vi.impact, {"system": ROUGH, "x1": 0.3, "v1": 1.0, "v2": 0.1, "steps": 20}),
    "impact_regimes": (
        vi.impact_regimes,
        {"system": ROUGH, "x1": [0.1, 0.2], "velocity_ratio": [0.1, 0.2], "steps": 20},
    ),
    "impact_agreement": (vi.impact_agreement, {"system": ROUGH, "steps": (30, 60), "cells": 3}),
    "bifurcation_diagram": (
        vi.bifurcation_diagram,
        {
            "system": ROUGH,
            "initial": START,
            "periods": 3,
            "keep": 2,
            "start": "forward",
            "labels": True,
            "exponents": False,
            "refine": 0,
            "max_events": 100,
            "tolerance": 1e-9,
            "section_phase": 0.5,
            "progress": False,
            "workers": 1,
            "chunk": 1,
            "client": None,
            "store": None,
            "drive_frequency": [1.5, 1.6],
        },
    ),
    "sweep": (
        vi.sweep,
        {"system": ROUGH, "initial": START, "periods": 3, "exponents": True, "gap": [0.5, 0.6]},
    ),
    "chart": (
        vi.chart,
        {"system": ROUGH, "initial": START, "periods": 3, "gap": [0.5], "friction": [0.1]},
    ),
    "basins": (
        vi.basins,
        {
            "system": ROUGH,
            "initial": START,
            "periods": 20,
            "keep": 10,
            "scouts": 3,
            "rounds": 1,
            "max_events": 1000,
            "tolerance": 1e-9,
            "x1": [0.0, 0.1],
            "v1": [0.0, 0.1],
        },
    ),
    "lyapunov_spectrum": (
        vi.lyapunov_spectrum,
        {"system": ROUGH, "initial": START, "periods": 20, "keep": 20, "tolerance": 1e-9},
    ),
    "lyapunov_spectrum over a grid": (
        vi.lyapunov_spectrum,
        {"system": ROUGH, "initial": START, "periods": 20, "keep": 20, "gap": [0.5, 0.6]},
    ),
    "periodic_motion": (vi.periodic_motion, {"system": SYSTEM, "initial": START, "periods": 1}),
    "periodic_motions": (vi.periodic_motions, {"system": SYSTEM, "n": 1, "within": (1.7, 1.8)}),
    "motion_map": (
        vi.motion_map,
        {"system": SYSTEM, "n": 1, "gap": [0.5], "drive_frequency": [1.8]},
    ),
    "search_motions": (
        vi.search_motions,
        {"system": SYSTEM, "starts": 2, "periods": 20, "seed": 1, "workers": 1},
    ),
    "follow_motion": (
        vi.follow_motion,
        {
            "motion": MOTION,
            "both": False,
            "direction": 1,
            "step": 0.01,
            "max_step": 0.02,
            "max_points": 3,
            "virtual": False,
            "drive_frequency": (1.75, 1.85),
        },
    ),
    "unstable_manifold": (
        vi.unstable_manifold,
        {"motion": MOTION, "length": 0.1, "spacing": 0.05, "max_points": 10, "settle": 10},
    ),
    "stability_region": (
        vi.stability_region,
        {"motion": MOTION, "max_points": 3, "drive_frequency": (1.7, 1.9), "gap": (0.4, 0.6)},
    ),
}


@pytest.mark.parametrize(
    ("name", "argument"),
    [(name, argument) for name, (_, valid) in CALLS.items() for argument in valid],
)
def test_a_wrong_argument_is_refused_by_name_or_taken(name, argument, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # some of the texts are paths of stores
    function, valid = CALLS[name]
    refused = 0
    for what, wrong in WRONG.items():
        try:
            function(**valid | {argument: copy.copy(wrong)})
        except REFUSED_BY_NAME.get(argument, REFUSALS) as error:
            refused += len(str(error)) > 0
        except Exception as error:
            pytest.fail(f"{name}({argument} = {what}): {error!r}")
    # Of a flag anything may be asked whether it is true.
    assert refused > 0 or argument == "progress"


def test_a_valid_call_is_not_refused():
    for name, (function, arguments) in CALLS.items():
        with contextlib.suppress(vi.ParameterError):
            function(**arguments)
            continue
        # A stable motion has no unstable manifold.
        assert name == "unstable_manifold"


@settings(QUICK)
@given(fields=st.fixed_dictionaries(dict.fromkeys(NUMERIC_RANGES, any_number)))
def test_a_system_of_any_numbers_is_in_range_or_refused(fields):
    try:
        system = vi.System(**fields)
    except vi.ParameterError as error:
        if not any(name in str(error) for name in fields):
            raise
        return
    values = [getattr(system, name) for name in NUMERIC_RANGES]
    assert np.isfinite(values).all()
    assert 0 <= system.restitution <= 1
    for again in (vi.System.from_json(system.to_json()), pickle.loads(pickle.dumps(system))):
        assert again == system


@settings(QUICK)
@given(allowed_systems, any_state, st.integers(1, 3), st.booleans())
def test_a_short_run_has_no_nan(system, initial, periods, resumed):
    # Beyond, sections and trajectories overflow: the test below.
    if not is_short(system, periods) or system.drive_frequency > 1e50:
        return
    try:
        run = vi.simulate(system, initial=initial, periods=periods, max_events=30)
        if resumed:
            run = run.resume(periods=1, max_events=60)
    except REFUSALS:
        return
    assert_no_nan(run)


@pytest.mark.xfail(strict=True, reason="powers of the drive frequency leave the range of float64")
def test_a_trajectory_under_a_huge_drive_frequency_has_no_nan():
    system = vi.System(**FIELDS | {"drive_frequency": 1e145, "contact": "direct"}).replace(
        damping=(0.0, 2.2), force_amplitude=-0.3, gap=1e300
    )
    assert_no_nan(vi.simulate(system, initial=(0.4, 0.0, 0.4, -1.4), periods=1))


@settings(QUICK)
@given(allowed_systems, st.tuples(any_number, any_number, any_number), st.integers(0, 30))
def test_an_impact_has_numbers_or_no_outcome(system, before, steps):
    x1, v1, v2 = before
    try:
        row = vi.impact(system, x1=x1, v1=v1, v2=v2, steps=steps or None)
    except REFUSALS:
        return
    after = [row[name] for name in row.dtype.names[3:] if name not in ("regime",)]
    if row["regime"] < 0:
        assert np.isnan([a for a in after if a is not row["approach_velocity"]]).any()
    else:
        assert np.isfinite(after).all(), row


ARRAYS = {
    "list": lambda a: a.tolist(),
    "float32": lambda a: a.astype(np.float32),
    "longdouble": lambda a: a.astype(np.longdouble),
    "other endian": lambda a: a.astype(">f8"),
    "Fortran": np.asfortranarray,
    "every second": lambda a: np.repeat(a, 2, axis=0)[::2],
    "backwards": lambda a: np.ascontiguousarray(a[::-1])[::-1],
    "transposed": lambda a: np.ascontiguousarray(a.T).T,
    "unaligned": lambda a: np.frombuffer(b"x" + a.tobytes(), np.uint8)[1:].view(a.dtype),
    "view of records": lambda a: a.copy().view(type("Mine", (np.ndarray,), {})),
}


@pytest.mark.parametrize("form", ARRAYS)
def test_the_form_of_an_array_changes_no_bit(form):
    # Numbers that float32 holds too.
    x1 = np.array([0.25, 0.5, -0.125, 0.0])
    states = np.array([[0.0, 0.5, 0.0, 0.0], [0.25, -0.5, 0.125, 0.5]])
    made = ARRAYS[form]
    rows = made(states).reshape(states.shape) if form == "unaligned" else made(states)
    for a, b in zip(
        vi.simulate(ROUGH, initial=rows, periods=5),
        vi.simulate(ROUGH, initial=states, periods=5),
        strict=True,
    ):
        np.testing.assert_array_equal(a.impacts, b.impacts)
    impacts = vi.impact(ROUGH, x1=made(x1), v1=1.0, v2=0.0)
    np.testing.assert_array_equal(impacts, vi.impact(ROUGH, x1=x1, v1=1.0, v2=0.0))
    times = np.array([1.0, 0.25, 3.5])
    np.testing.assert_array_equal(RUN.trajectory(made(times)), RUN.trajectory(times))
    gaps = np.array([0.5, 0.25])
    swept = [vi.sweep(ROUGH, initial=START, periods=5, gap=values) for values in (made(gaps), gaps)]
    np.testing.assert_array_equal(swept[0].m, swept[1].m)


def test_arguments_are_left_alone():
    states = np.array([[0.0, 0.5, 0.0, 0.0], [-0.0, -0.5, 0.125, 0.5]])
    before = states.tobytes()
    states.flags.writeable = False
    vi.simulate(ROUGH, initial=states, periods=2)
    vi.search_motions(SYSTEM, starts=states, periods=20)
    assert states.tobytes() == before


def results():
    """Return one result of each public class that can be made in a moment."""
    diagram = vi.bifurcation_diagram(ROUGH, initial=START, periods=5, drive_frequency=[1.5, 1.6])
    branch = vi.follow_motion(MOTION, max_points=3, both=False, drive_frequency=(1.75, 1.85))
    found = vi.basins(
        SYSTEM, periods=300, scouts=4, rounds=1, x1=np.array([0.0, 0.1]), v1=np.array([0.0, 0.1])
    )
    return [
        SYSTEM,
        RUN,
        RUN.final_state,
        RUN.period,
        RUN.energy_audit(),
        vi.Regime.SLIP,
        vi.EventKind.STICK,
        vi.impact(ROUGH, x1=0.3, v1=1.0, v2=0.1),
        vi.impact_regimes(ROUGH, x1=[0.1, 0.2], velocity_ratio=[0.1, 0.2]),
        vi.impact_agreement(ROUGH, steps=(30, 60), cells=3),
        diagram,
        diagram.settings,
        vi.sweep(ROUGH, initial=START, periods=5, gap=[0.5, 0.6]),
        vi.chart(ROUGH, initial=START, periods=5, gap=[0.5], friction=[0.1]),
        found,
        *found.attractors,
        vi.lyapunov_spectrum(ROUGH, initial=START, periods=20, keep=20),
        vi.lyapunov_spectrum(ROUGH, initial=START, periods=20, keep=20, gap=[0.5, 0.6]),
        MOTION,
        vi.periodic_motion(SYSTEM, initial=(0.0, 50.0, 0.0, 0.0), periods=1),
        vi.periodic_motions(SYSTEM),
        vi.motion_map(SYSTEM, gap=[0.5], drive_frequency=[1.8]),
        vi.search_motions(SYSTEM, starts=2, periods=200),
        branch,
        *branch.bifurcations,
        vi.ParameterError("gap = nan"),
        vi.StateError("x1 = nan"),
        vi.SimulationError("at t = 1"),
        vi.Interrupted("interrupted", RUN),
    ]


def test_every_result_can_be_pickled_and_copied():
    kinds = set()
    for result in results():
        kinds.add(type(result).__name__)
        for protocol in range(2, pickle.HIGHEST_PROTOCOL + 1):
            back = pickle.loads(pickle.dumps(result, protocol))
            assert type(back) is type(result)
            assert repr(back) == repr(result)
        assert repr(copy.deepcopy(result)) == repr(result)
    assert kinds >= {"Run", "Diagram", "Sweep", "Chart", "Basins", "PeriodicMotion", "Branch"}


def test_several_threads_at_once_get_the_bits_of_one():
    def work(number):
        system = ROUGH.replace(drive_frequency=1.5 + 0.01 * (number % 4))
        run = vi.simulate(system, initial=START, periods=50)
        swept = vi.sweep(system, initial=START, periods=20, gap=[0.4, 0.5], workers=2)
        motion = vi.periodic_motion(SYSTEM, initial=START, periods=1)
        row = vi.impact(system, x1=[0.1, 0.2], v1=1.0, v2=0.0)
        return [
            run.impacts.tobytes(),
            run.trajectory(np.linspace(0, 10, 50)).tobytes(),
            RUN.trajectory(BETWEEN).tobytes(),
            swept.label.tolist(),
            repr(motion),
            row.tobytes(),
        ]

    alone = [work(number) for number in range(4)]
    with ThreadPoolExecutor(8) as pool:
        together = list(pool.map(work, range(24)))
    assert all(found == alone[number % 4] for number, found in enumerate(together))
