"""Results are copied and pickled as they are; calls neither disturb each other nor leak."""

import copy
import gc
import inspect
import os
import pickle
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vibroimpact as vi
from fitting_calls import expected, found, heard
from small_results import (
    START,
    branch,
    branch_proof,
    folder,
    grid_basins,
    motion,
    motions,
    proof,
    region,
    run,
    solutions_proof,
)
from struck import moving_run, orbit, small_diagram, spectrum
from systems import PAPER, ROUGH
from valid_calls import calls

CALLS = calls()


def _results() -> dict[str, Any]:
    """Return one object of every public class by its name."""
    saddle = CALLS["unstable_manifold"]()
    diagram = CALLS["bifurcation_diagram"]()
    # What is computed on first use is copied, too, or computed anew.
    assert len(motion().impacts) == len(motion().sections) == len(motion().itinerary.legs)
    made = [
        PAPER,
        vi.Scales(length=0.2, mass=0.3, time=0.1),
        vi.simulate(
            PAPER.replace(scales={"length": 0.2, "mass": 0.3, "time": 0.1}),
            initial=(0.0, 0.5, 0.0, 0.0),
            periods=3,
        ).in_si(),
        run(),
        run().impacts,
        run().final_state,
        run().period,
        run().period.evidence,
        run().energy_audit(),
        run().bounces(),
        run().sensitivity("gap", "x1"),
        run().sensitivity("gap", "x1").impacts,
        vi.OneSided(index=0, time=0.5, reason="graze"),
        vi.Regime.SLIP,
        vi.EventKind.STICK,
        vi.BouncesEnd.CAP,
        diagram,
        diagram.settings,
        grid_basins(),
        *grid_basins().attractors,
        motion(),
        motions(),
        branch(),
        *branch().bifurcations,
        region(),
        saddle,
        *saddle.sides,
        vi.NotFound(reason="none"),
        vi.NoMotionError("no 'multipliers'", "none"),
        moving_run(),
        moving_run().final_state,
        moving_run().energy_audit(),
        orbit(),
        small_diagram(),
        spectrum(),
        vi.Undecided(lo=0.0, hi=1.0, reason="a double root"),
        vi.Disagreement(event="impact", number=1, time=0.5, reason="digits"),
        proof().box,
        branch_proof(),
        *branch_proof().stretches,
        vi.ProvedBifurcation(kind="saddle_node", lo=1.0, hi=1.1, label="1-1"),
        vi.Unproved(lo=1.0, hi=1.1, label="1-1", why="stability"),
        solutions_proof(),
        *proof().multipliers,
        heard(),
        found(),
        expected(),
        vi.ProofError("damaged"),
        vi.ParameterError("gap = nan"),
        vi.StateError("x1 = nan"),
        *(kind("at t = 1", run()) for kind in (vi.SimulationError, vi.ClusterError)),
        vi.Interrupted("interrupted", run()),
    ]
    names = ("sweep", "chart", "lyapunov_spectrum", "lyapunov_spectrum: grid", "Stop", "Structure")
    names += ("RestitutionTable", "RestitutionPowerLaw")
    more = (
        "impact_regimes",
        "impact_agreement",
        "periodic_motions",
        "search_motions",
        "bifurcation_curve",
        "verify",
        "prove",
    )
    made += [CALLS[name]() for name in (*names, *more)]
    return {type(result).__name__: result for result in made}


RESULTS = _results()
COPIES = {
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    **{
        f"pickle {protocol}": lambda result, protocol=protocol: pickle.loads(
            pickle.dumps(result, protocol)
        )
        for protocol in range(2, pickle.HIGHEST_PROTOCOL + 1)
    },
}


def assert_same(one: Any, other: Any, seen: set[int]) -> None:
    """Check that two objects are the same to the last bit, and may be written to as little."""
    if id(one) in seen:
        return
    seen.add(id(one))
    assert type(one) is type(other)
    if isinstance(one, np.ndarray):
        assert (one.dtype, one.shape) == (other.dtype, other.shape)
        assert one.tobytes() == other.tobytes()
        assert one.flags.writeable == other.flags.writeable
    elif isinstance(one, list | tuple):
        for first, second in zip(one, other, strict=True):
            assert_same(first, second, seen)
    elif isinstance(one, dict):
        assert [*one] == [*other]
        for name in one:
            assert_same(one[name], other[name], seen)
    elif isinstance(one, float | int | str):
        assert repr(one) == repr(other)
    elif hasattr(one, "__dict__") and not isinstance(one, vi.Run | vi.StructureRun | vi.System):
        for name in vars(one).keys() & vars(other).keys():
            assert_same(getattr(one, name), getattr(other, name), seen)


def test_every_public_class_has_an_object():
    assert {name for name in vi.__all__ if inspect.isclass(getattr(vi, name))} <= RESULTS.keys()


@pytest.mark.parametrize("way", COPIES)
@pytest.mark.parametrize("name", RESULTS)
def test_a_copy_is_the_same_to_the_last_bit_and_as_read_only(name, way):
    result = RESULTS[name]
    again = COPIES[way](result)
    assert repr(again) == repr(result)
    assert_same(result, again, set())
    assert_same(result.__reduce_ex__(2)[2:], again.__reduce_ex__(2)[2:], set())


@pytest.mark.parametrize("way", COPIES)
def test_what_is_compared_by_value_equals_its_copy(way):
    for name in (
        "System",
        "RestitutionTable",
        "RestitutionPowerLaw",
        "Stop",
        "Structure",
        "FinalState",
        "EnergyAudit",
        "StructureEnergyAudit",
        "DiagramSettings",
        "Disagreement",
    ):
        again = COPIES[way](RESULTS[name])
        assert again == RESULTS[name]
        assert hash(again) == hash(RESULTS[name])
    assert COPIES[way](vi.Regime.SLIP) is vi.Regime.SLIP
    assert PAPER.replace(gap=0.25) != COPIES[way](PAPER)


def test_a_copy_of_a_run_goes_on_to_the_same_bits():
    for make in COPIES.values():
        again = make(run())
        assert_same(again._parts(), run()._parts(), set())
        assert_same(again.resume(periods=5)._parts(), run().resume(periods=5)._parts(), set())


def test_a_system_out_of_range_comes_out_of_no_pickle():
    rebuild, (fields,) = PAPER.__reduce__()
    with pytest.raises(vi.ParameterError, match="restitution"):
        rebuild(fields | {"restitution": 2.0})


# Forms of an array that hold the same numbers.
FORMS = {
    "list": lambda a: a.tolist(),
    "tuple": lambda a: tuple(map(tuple, a.tolist())) if a.ndim > 1 else tuple(a.tolist()),
    "float32": lambda a: a.astype(np.float32),
    "longdouble": lambda a: a.astype(np.longdouble),
    "big endian": lambda a: a.astype(">f8"),
    "little endian": lambda a: a.astype("<f8"),
    "Fortran": np.asfortranarray,
    "every second": lambda a: np.repeat(a, 2, axis=0)[::2],
    "backwards": lambda a: np.ascontiguousarray(a[::-1])[::-1],
    "of a transpose": lambda a: np.ascontiguousarray(a.T).T,
    "unaligned": lambda a: (
        np.frombuffer(b"x" + a.tobytes(), np.uint8)[1:].view(a.dtype).reshape(a.shape)
    ),
    "a class of its own": lambda a: a.copy().view(type("Mine", (np.ndarray,), {})),
    "a mask that hides nothing": np.ma.masked_array,
    "read-only": lambda a: np.frombuffer(a.tobytes(), a.dtype).reshape(a.shape),
}


@pytest.mark.parametrize("form", FORMS)
def test_the_form_of_an_array_changes_no_bit_and_no_array(form):
    # Numbers that float32 holds, too.
    states = np.array([[0.0, 0.5, 0.0, 0.0], [0.25, -0.5, 0.125, 0.5]])
    values = np.array([0.25, 0.5, -0.125, 0.0])
    gaps, times = np.array([0.5, 0.25]), np.array([1.0, 0.25, 3.5])
    # Two or three numbers in a tuple are no axis.
    axis = np.array([0.5, 0.25, 0.375, 0.625])
    calls_with = {
        "simulate": lambda make: [
            one._parts()[1] for one in vi.simulate(ROUGH, initial=make(states), periods=3)
        ],
        "impact": lambda make: vi.impact(ROUGH, x1=make(values), v1=1.0, v2=0.0),
        "impact_regimes": lambda make: (
            vi.impact_regimes(ROUGH, x1=make(axis), velocity_ratio=[0.5]).restitution
        ),
        "Run.trajectory": lambda make: run().trajectory(make(times)),
        "PeriodicMotion.trajectory": lambda make: motion().trajectory(make(times)),
        "sweep": lambda make: (
            vi.sweep(ROUGH, initial=START, periods=3, gap=make(axis)).final_states
        ),
        "basins": lambda make: CALLS["basins"](x1=make(gaps[1:])).attractor,
        "search_motions": lambda make: CALLS["search_motions"](starts=make(states)).starts,
        "motion_map": lambda make: CALLS["motion_map"](gap=make(axis)).solutions,
        "StabilityRegion.sheets": lambda make: region().sheets(make(states[:, :2])),
        "System": lambda make: PAPER.replace(damping=make(gaps)).damping,
    }
    for name, call in calls_with.items():
        given: list[tuple[Any, bytes]] = []

        def make(array, given=given):
            given.append((formed := FORMS[form](array), np.asarray(formed).tobytes()))
            return formed

        assert_same(call(np.copy), call(make), set())
        assert given, name
        assert all(np.asarray(array).tobytes() == before for array, before in given)


def test_eight_threads_at_once_get_the_bits_of_one():
    def work(number: int) -> list[Any]:
        system = ROUGH.replace(drive_frequency=1.5 + 0.01 * (number % 4))
        here = vi.simulate(system, initial=START, periods=20)
        return [
            here._parts()[1],
            here.label,
            # Objects that all threads share, and what they compute on first use.
            run().trajectory(np.linspace(0.0, 10.0, 50)),
            copy.deepcopy(motion()).sections,
            vi.sweep(system, initial=START, periods=5, gap=[0.4, 0.5], workers=2).final_states,
            vi.periodic_motion(PAPER, initial=START, periods=1).nodes,
            vi.impact(system, x1=[0.1, 0.2], v1=1.0, v2=0.0),
            CALLS["follow_motion"]().values,
        ]

    alone = [work(number) for number in range(4)]
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)  # so that threads change places within a call
    try:
        with ThreadPoolExecutor(8) as pool:
            together = list(pool.map(work, range(24)))
    finally:
        sys.setswitchinterval(before)
    for number, each in enumerate(together):
        assert_same(each, alone[number % 4], set())


def _resident() -> int:
    """Return the memory of this process in bytes."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


# Of 2,000 calls each may keep 2 kB before it is noticed.
LEAKS = 4 * 2**20
QUICK = [
    *("System", "simulate", "Run.trajectory", "Run.resume", "impact", "impact_regimes", "sweep"),
    *("bifurcation_diagram", "lyapunov_spectrum", "periodic_motion", "follow_motion"),
]


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="asks Linux for its memory")
@pytest.mark.parametrize("refused", [False, True], ids=["taken", "refused"])
def test_memory_does_not_grow_with_the_number_of_calls(refused):
    def some(rounds: int) -> None:
        for _ in range(rounds):
            for name in QUICK:
                argument = next(iter(CALLS[name].arguments))
                if refused:
                    with pytest.raises(vi.ParameterError):
                        CALLS[name](**{argument: None})
                else:
                    CALLS[name]()

    some(30)
    gc.collect()
    before = _resident()
    some(2000 // len(QUICK))
    gc.collect()
    assert _resident() - before < LEAKS


def test_spectra_are_compared_by_their_numbers():
    def made(periods):
        return vi.lyapunov_spectrum(ROUGH, initial=START, periods=periods, keep=20)

    found, again = made(40), vi.load(folder() / "spectrum.npz")
    assert again == found
    assert hash(again) == hash(found)
    assert made(41) != found
    assert found != "spectrum"
