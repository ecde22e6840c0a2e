"""Ctrl-C, as a signal of the system, in the middle of every long call of the package."""

import inspect
import os
import signal
import sys

import numpy as np
import pytest

import vibroimpact as vi
from ctrl_c import ctrl_c_at, ctrl_c_in
from struck import REST, SETTLING
from systems import ROUGH
from test_orbits_interrupt import Count, settled
from vibroimpact import _core, impact_maps
from vibroimpact.orbits import manifolds, shooting
from vibroimpact.orbits.problem import OrbitProblem
from vibroimpact.single_impact import motions
from vibroimpact.sweeps.store import Store
from vibroimpact.sweeps.store_check import Chunks
from vibroimpact.verification.motion import _Followed

try:
    from vibroimpact.proof.branch_proving import Tubes
except ImportError:  # without python-flint; its test is skipped
    Tubes = None

pytestmark = pytest.mark.skipif(os.name != "posix", reason="a process cannot interrupt itself")
START = (0.0, 0.5, 0.0, 0.0)
# Much more work than is done before Ctrl-C comes.
FOR_EVER = {"periods": 10**9, "keep": 20, "max_events": 10**15}
FREQUENCIES = np.linspace(1.2, 2.0, 100_000)
SYSTEM = ROUGH.replace(friction=0.0)


def _motion():
    return settled(drive_frequency=1.8)


def _follow():
    motion = settled(drive_frequency=1.5752, friction=0.5)
    return lambda: vi.follow_motion(motion, max_step=1e-6, drive_frequency=(1.5, 1.6))


def _switch():
    branch = vi.follow_motion(_motion(), drive_frequency=(1.4, 1.85))
    doubling = branch.of_kind("period_doubling")[0]
    return lambda: vi.switch_branch(doubling, max_step=1e-6, drive_frequency=(1.4, 1.85))


def _curve():
    branch = vi.follow_motion(_motion(), drive_frequency=(1.4, 1.85))
    doubling = branch.of_kind("period_doubling")[0]
    bounds = {"drive_frequency": (1.4, 1.85), "moment_amplitude": (0.8, 1.2)}
    return lambda: vi.bifurcation_curve(doubling, max_step=1e-6, **bounds)


def _region():
    motion = settled(drive_frequency=1.25)
    plane = {"drive_frequency": (1.1, 1.6), "moment_amplitude": (0.7, 1.3)}
    return lambda: vi.stability_region(motion, max_step=1e-6, **plane)


def _manifold():
    saddles = (found for found in vi.periodic_motions(SYSTEM) if found.admissible)
    saddle = next(found for found in saddles if np.sum(abs(found.multipliers) > 1.0) == 1)
    return lambda: vi.unstable_manifold(saddle, length=1e9, spacing=1e-6, max_points=10**9)


def _fit():
    # Noise is no motion: every start is tried.
    noise = np.random.default_rng(1).standard_normal(20)
    record = vi.Record("x1", np.arange(20.0), noise, sigma=0.01)
    return lambda: vi.fit(record, ROUGH, unknown=["gap"], initial=START, starts=50)


# Of each long call: how it is prepared, what the exception holds.
def _verify():
    # What it needs is imported by the first call.
    vi.verify(vi.simulate(ROUGH, initial=START, periods=1))
    run = vi.simulate(ROUGH, initial=START, periods=20_000)
    return lambda: vi.verify(run)


def _prove():
    pytest.importorskip("flint")
    motion = settled(drive_frequency=1.8, damping=(0.05, 0.05))
    branch = vi.follow_motion(motion, drive_frequency=(1.6, 2.0))
    return lambda: vi.prove(branch, max_tubes=10**6)


LONG = {
    "simulate": (lambda: lambda: vi.simulate(ROUGH, initial=START, **FOR_EVER), vi.Run),
    "gradient": (
        lambda: lambda: vi.gradient(len, ROUGH, ["gap"], initial=START, **FOR_EVER),
        vi.Run,
    ),
    "bifurcation_diagram": (
        lambda: lambda: vi.bifurcation_diagram(ROUGH, initial=START, drive_frequency=FREQUENCIES),
        vi.Diagram,
    ),
    "sweep": (lambda: lambda: vi.sweep(ROUGH, initial=START, gap=FREQUENCIES), vi.Sweep),
    "chart": (
        lambda: lambda: vi.chart(ROUGH, initial=START, drive_frequency=FREQUENCIES, gap=[0.5, 0.6]),
        vi.Chart,
    ),
    "lyapunov_spectrum": (
        lambda: (
            lambda: vi.lyapunov_spectrum(
                ROUGH, initial=START, drive_frequency=FREQUENCIES, periods=10_000
            )
        ),
        vi.LyapunovSweep,
    ),
    "basins": (
        lambda: (
            lambda: vi.basins(
                ROUGH, scouts=9, x1=np.linspace(-1, 0.4, 500), v1=np.linspace(-1, 1, 500)
            )
        ),
        vi.Basins,
    ),
    "motion_map": (
        lambda: lambda: vi.motion_map(SYSTEM, drive_frequency=FREQUENCIES[:300]),
        vi.MotionMap,
    ),
    "periodic_motions": (
        lambda: lambda: vi.periodic_motions(SYSTEM, 100_000, within=(-999.0, 999.0)),
        vi.PeriodicMotions,
    ),
    "search_motions": (lambda: lambda: vi.search_motions(ROUGH, starts=20_000), vi.MotionSearch),
    "follow_motion": (_follow, vi.Branch),
    "switch_branch": (_switch, vi.Branch),
    "bifurcation_curve": (_curve, vi.BifurcationCurve),
    "stability_region": (_region, vi.StabilityRegion),
    "unstable_manifold": (_manifold, vi.UnstableManifold),
    "impact_agreement": (
        lambda: lambda: vi.impact_agreement(ROUGH, steps=(10_000, 20_000), cells=301),
        vi.ImpactAgreement,
    ),
    "verify": (_verify, vi.Verification),
    "fit": (_fit, vi.Fit),
    "prove": (_prove, vi.BranchProof),
}
# Asks of the core before Ctrl-C comes.
ASKS = dict.fromkeys(LONG, 100_000) | {"impact_agreement": 50}
# A moment's work: a table of impacts (a plain KeyboardInterrupt ends a huge one), one orbit by
# Newton's method, one file, a branch of one mode (the others are followed by the same code).
# Serves a page until Ctrl-C, which is its usual end (test_explorer.py).
SERVING = {"explore"}
SHORT = {"impact", "impact_regimes", "periodic_motion", "load", "nonsmooth_mode"}
# A certificate is read and verified; it is one, or it is none.
SHORT |= {"check_proof"}
# A record of a run that is there, and what one would tell of its machine.
SHORT |= {"measure", "expected_errors"}


def test_every_function_of_the_package_is_long_or_short():
    functions = {name for name in vi.__all__ if inspect.isfunction(getattr(vi, name))}
    assert functions == {*LONG} | SHORT | SERVING


# Where Ctrl-C comes: at an ask of the core, or in a call of a function that works in Python.
IN_PYTHON = {
    "motion_map": (sys.modules[vi.motion_map.__module__], "_rows", 2),
    "periodic_motions": (motions, "solve_many", 1),
    "follow_motion": (OrbitProblem, "residual", 30),
    "switch_branch": (OrbitProblem, "residual", 30),
    "bifurcation_curve": (OrbitProblem, "residual", 30),
    "stability_region": (OrbitProblem, "residual", 30),
    "unstable_manifold": (manifolds, "first_piece", 1),
    "verify": (_Followed, "_tell", 3),
    "fit": (sys.modules[vi.fit.__module__], "_fitted", 2),
    "prove": (Tubes, "one", 2),
}


@pytest.mark.parametrize("name", LONG)
def test_ctrl_c_in_the_middle_of(name, monkeypatch):
    prepare, kind = LONG[name]
    monkeypatch.setattr(sys.modules[vi.motion_map.__module__], "BATCH", 100)
    call = prepare()
    place = ctrl_c_in(monkeypatch, *IN_PYTHON[name]) if name in IN_PYTHON else ctrl_c_at(ASKS[name])
    with place as caught:
        call()
    assert isinstance(caught.value.result, kind)
    assert repr(caught.value.result)


def test_ctrl_c_before_a_spectrum_is_measured():
    with ctrl_c_at(50_000) as caught:
        vi.lyapunov_spectrum(ROUGH, initial=START, **FOR_EVER)
    run = caught.value.result
    assert isinstance(run, vi.Run)
    assert run.final_state.period > 0


def test_ctrl_c_while_the_period_of_a_run_is_looked_for():
    # A torus: the time grows with the square of the sections kept.
    torus = SYSTEM.replace(gap=3.0, frequency_ratio=2**0.5)
    run = vi.simulate(torus, initial=START, periods=100_000)
    with ctrl_c_at(3) as caught:
        _ = run.label
    assert caught.value.result is run


@pytest.mark.parametrize("forces", [False, True])
@pytest.mark.parametrize("asks", [2, 1_000, 9_999])
def test_ctrl_c_along_a_trajectory(forces, asks):
    run = vi.simulate(SYSTEM, initial=START, periods=100)
    times = np.linspace(0, run.final_state.time, 10_000)
    whole = run.trajectory(times, forces=forces)
    with ctrl_c_at(asks) as caught:
        run.trajectory(times, forces=forces)
    rows = caught.value.result
    # One ask for each time, the last of which is not answered.
    assert len(rows) == asks - 1
    np.testing.assert_array_equal(rows, whole[: asks - 1])


def test_ctrl_c_while_works_are_added_up():
    run = vi.simulate(SYSTEM, initial=START, periods=500)
    with ctrl_c_at(300) as caught:
        run.energy_audit()
    assert caught.value.result is run


def test_ctrl_c_while_works_of_a_structure_are_added_up():
    run = vi.simulate(SETTLING, initial=REST[1], periods=500)
    with ctrl_c_at(300) as caught:
        run.energy_audit()
    assert caught.value.result is run


def test_ctrl_c_while_a_motion_is_followed():
    _core._interrupt_at(4_000)
    try:
        with pytest.raises(KeyboardInterrupt, match="followed"):
            _core.Itinerary.follow(SYSTEM.replace(restitution=1.0)._compiled, START, 10**9, 10**15)
    finally:
        _core._interrupt_at(None)


def test_ctrl_c_while_a_store_is_made_or_looked_through(monkeypatch, tmp_path):
    options = {"initial": START, "periods": 60, "gap": [0.5, 0.6], "chunk": 1}
    expected = vi.sweep(ROUGH, **options).final_states
    options["store"] = tmp_path / "store.zarr"
    for place in ((Store, "_opened"), (Chunks, "read")):
        with monkeypatch.context() as patch:
            owner, name = place
            plain = getattr(owner, name)

            def signalled(*arguments, plain=plain):
                signal.raise_signal(signal.SIGINT)
                return plain(*arguments)

            patch.setattr(owner, name, signalled)
            with pytest.raises(vi.Interrupted, match="store was opened") as caught:
                vi.sweep(ROUGH, **options)
        # Read only now, without further signals.
        assert caught.value.result.status.tolist() == ["pending"] * 2
    assert vi.sweep(ROUGH, **options).final_states.tobytes() == expected.tobytes()


def test_an_interrupted_map_of_motions(monkeypatch):
    values = np.linspace(1.2, 2.0, 11)
    module = sys.modules["vibroimpact.single_impact.motion_map"]
    monkeypatch.setattr(module, "BATCH", 4)
    count = Count(monkeypatch, (module, "_rows"))

    def find():
        return vi.motion_map(SYSTEM, drive_frequency=values)

    whole, places = count.places(find, 3)
    assert not whole.pending.any()
    assert len(places) == 3
    for done, at in enumerate(places):
        part = count.interrupted(find, at)
        assert part.pending.tolist() == [False] * 4 * done + [True] * (11 - 4 * done)
        reached = whole.solutions["point"] < 4 * done
        assert part.solutions.tobytes() == whole.solutions[reached].tobytes()
        assert f"{11 - 4 * done} points pending" in repr(part)
        assert part.undecided.tolist() == [*whole.undecided[: 4 * done], *[0] * (11 - 4 * done)]
    assert "pending" not in repr(whole)


@pytest.mark.parametrize("name", ["solve_many", "motions_in"])
def test_an_interrupted_search_for_all_motions(monkeypatch, name):
    count = Count(monkeypatch, (motions, name))

    def find():
        return vi.periodic_motions(SYSTEM.replace(drive_frequency=1.8, moment_amplitude=3.0), 7)

    whole, places = count.places(find, 4)
    assert len(whole) >= 2
    for at in places:
        part = count.interrupted(find, at)
        states = [motion.state for motion in whole]
        assert [motion.state for motion in part] == [
            state for state in states if state in {motion.state for motion in part}
        ]
        assert len(part) == len(part.boxes) == (at - 1 if name == "motions_in" else 0)
        # No solution is lost: each is found, or in an interval that is named.
        left = [gap for gap in part.undecided if gap.reason == "interrupted"]
        for motion in whole.motions:
            x1 = motion.state[0]
            found = any(motion.state == other.state for other in part)
            assert found != any(gap.lo - 1e-9 <= x1 <= gap.hi + 1e-9 for gap in left)


@pytest.mark.parametrize("name", ["simulated", "refine"])
def test_an_interrupted_search_for_motions(monkeypatch, name):
    monkeypatch.setattr(shooting, "BATCH", 8)
    count = Count(monkeypatch, (shooting if name == "simulated" else vi.Run, name))

    def find():
        return vi.search_motions(SYSTEM.replace(drive_frequency=1.8), starts=30, periods=400)

    whole, places = count.places(find, 4)
    assert "pending" not in whole.others
    assert whole.shares.sum() + sum(whole.others.values()) == pytest.approx(1.0)
    for at in places:
        part = count.interrupted(find, at)
        done = round(30 * (1.0 - part.others["pending"]))
        assert done % 8 == 0 or name == "refine"
        assert ((part.reached >= 0)[:done] == (whole.reached >= 0)[:done]).all()
        assert (part.reached[done:] == -1).all()
        for start, number in enumerate(part.reached[:done]):
            if number >= 0:
                same = whole.motions[whole.reached[start]]
                assert part.motions[number].nodes.tobytes() == same.nodes.tobytes()


def test_starts_that_do_not_fit_are_refused_before_a_search(monkeypatch):
    monkeypatch.setattr(shooting, "BATCH", 1)
    monkeypatch.setattr(shooting, "refine", None)
    with pytest.raises(vi.StateError):
        vi.search_motions(SYSTEM, starts=[START, (1.5, 0.0, -1.0, 0.0)])


def test_a_manifold_interrupted_at_its_first_point(monkeypatch):
    grow = _manifold()
    count = Count(monkeypatch, (manifolds, "first_piece"))
    manifold = count.interrupted(grow, 1)
    (side,) = manifold.sides
    assert (side.end, side.length, side.points.shape) == ("interrupted", 0.0, (0, 4))
    assert not manifold.separates


def test_an_interrupted_comparison_of_impacts(monkeypatch):
    count = Count(monkeypatch, (impact_maps, "impact"))

    def compare():
        return vi.impact_agreement(ROUGH, steps=(10, 20), cells=5)

    whole, places = count.places(compare, 7)
    known = []
    for at in places:
        part = count.interrupted(compare, at)
        done = ~np.isnan(part.difference)
        assert part.difference[done].tolist() == whole.difference[done].tolist()
        known.append(np.count_nonzero(done))
    assert known == sorted(known)
    assert known[0] == 0 < known[-1]
