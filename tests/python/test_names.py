"""Names that users guess: columns, NotFound, motions at a value, periods, dimensions."""

import copy
import math
import pickle

import numpy as np
import pytest

import vibroimpact as vi
from small_results import START, branch, motion, run
from systems import COEXISTING, LOW, PAPER, ROUGH, STICKY
from vibroimpact.orbits.motion import same_orbit
from vibroimpact.orbits.points import motions_at
from vibroimpact.sweeps.lyapunov_results import dimension_of

# Tables.


def test_a_run_that_ended_early_has_no_motion_and_says_how_it_ended():
    corner = vi.Structure(
        np.eye(2),
        [[2, -1], [-1, 2]],
        [vi.Stop(n, gap, r) for n, gap, r in (([1, 0], 0.1, 0.3), ([1, -1], 0.05, 0.4))]
        + [vi.Stop(n, gap, r) for n, gap, r in (([-1, 0], 0.1, 0.3), ([-1, 1], 0.05, 0.4))],
        damping_ratios=[0.02, 0.02],
        drive_amplitude=[1, 0.5],
        drive_frequency=0.2,
    )
    stopped = vi.simulate(corner, initial=np.zeros((2, 2)), periods=50)
    assert stopped.stop_reason == "simultaneous"
    assert stopped.refine().reason.endswith(f"; it ended early: {stopped.stop_detail}")


@pytest.mark.parametrize("system", [PAPER, ROUGH, LOW, STICKY, PAPER.replace(contact="direct")])
def test_the_approach_velocity_is_that_of_the_impact(system):
    impacts = vi.simulate(system, initial=START, periods=20).impacts
    assert len(impacts) > 3
    states = {name: impacts[name] for name in ("x1", "v1_pre", "v2_pre")}
    single = vi.impact(system, x1=states["x1"], v1=states["v1_pre"], v2=states["v2_pre"])
    assert impacts["approach_velocity"].tolist() == single["approach_velocity"].tolist()
    assert (impacts["approach_velocity"] > 0.0).all()


def test_an_unknown_column_is_refused_with_the_list_of_columns():
    impacts = run().impacts
    with pytest.raises(
        ValueError, match=r"no column 'u'; the columns: time, period, .*energy_loss"
    ):
        impacts["u"]
    with pytest.raises(ValueError, match="no column 'v1_per', did you mean v1_pre"):
        impacts[["time", "v1_per"]]
    with pytest.raises(ValueError, match="the columns: time, period, kind, index"):
        run().events["regime"]


def test_a_table_is_a_structured_array():
    impacts = run().impacts
    assert type(impacts["time"]) is np.ndarray
    assert isinstance(impacts[0], np.void)
    assert isinstance(impacts[0]["time"], float)
    assert impacts[["time", "x1"]].dtype.names == ("time", "x1")
    assert impacts[impacts["regime"] == 1].dtype == impacts.dtype
    assert len(impacts[1:]) == len(impacts) - 1
    with pytest.raises(ValueError, match="read-only"):
        impacts["time"][0] = 0.0
    again = pickle.loads(pickle.dumps(impacts))
    assert again.tobytes() == impacts.tobytes()
    assert type(again) is type(impacts)


# What is not found.


def test_what_is_asked_of_a_missing_motion_says_why_it_is_missing():
    chaotic = vi.simulate(ROUGH, initial=START, periods=300, keep=100)
    assert chaotic.label == "chaotic"
    missing = chaotic.refine()
    assert not missing
    for name in ("multipliers", "plot", "follow", "label", "impacts"):
        with pytest.raises(vi.NoMotionError, match=f"no '{name}': the run is chaotic") as caught:
            getattr(missing, name)
        assert caught.value.reason == missing.reason == "the run is chaotic, not periodic"
        assert (caught.value.name, caught.value.obj) == (name, missing)
        assert isinstance(caught.value, AttributeError)
        assert not hasattr(missing, name)
        assert getattr(missing, name, None) is None


@pytest.mark.parametrize(
    ("asked", "what"),
    [
        (lambda missing: missing[0], "element 0"),
        (lambda missing: missing["label"], "element 'label'"),
        (iter, "elements"),
        (lambda missing: [*missing], "elements"),
        (lambda missing: "1-1" in missing, "elements"),
    ],
)
def test_a_missing_motion_has_no_elements_for_its_reason(asked, what):
    missing = vi.NotFound(reason="the run is chaotic, not periodic")
    with pytest.raises(vi.NoMotionError, match=f"no {what}: the run is chaotic, not") as caught:
        asked(missing)
    assert caught.value.reason == missing.reason
    assert np.array([missing, missing]).shape == (2,)  # a thing, not a sequence
    assert [motion for motion in (missing,) if motion] == []


def test_a_missing_motion_is_copied_compared_and_hashed():
    missing = vi.NotFound(reason="none")
    for again in (copy.copy(missing), copy.deepcopy(missing), pickle.loads(pickle.dumps(missing))):
        assert again == missing
        assert hash(again) == hash(missing)
    bare = vi.NotFound.__new__(vi.NotFound)
    for name in ("reason", "label", "__deepcopy__", "_repr_png_"):
        assert not hasattr(bare, name)
    with pytest.raises(AttributeError, match="_ipython_display_") as caught:
        missing._ipython_display_  # noqa: B018
    assert type(caught.value) is AttributeError
    with pytest.raises(vi.NoMotionError) as failed:
        getattr(missing, "label")  # noqa: B009
    assert str(pickle.loads(pickle.dumps(failed.value))) == str(failed.value)


# Motions at a value.


@pytest.fixture(scope="module")
def loop():
    """A branch over the drive frequency that turns back, with stable and unstable motions."""
    start = vi.simulate(COEXISTING, initial=START, periods=600, keep=100).refine()
    return start.follow(drive_frequency=(1.5, 1.62))


def test_the_motions_at_a_value_are_those_of_the_branch(loop):
    assert loop.of_kind("saddle_node") or loop.of_kind("grazing")
    draw = np.random.default_rng(7)
    low, high = loop.values.min(), loop.values.max()
    counts = set()
    for value in draw.uniform(low, high, 40):
        found = loop.at(drive_frequency=value)
        counts.add(len(found))
        crossings = sum(np.count_nonzero(np.diff(piece.values > value)) for piece in loop.pieces)
        assert 1 <= len(found) <= max(crossings, 1) + 2
        for each in found:
            assert each.system == COEXISTING.replace(drive_frequency=float(value))
            assert each.residual < 1e-9
            assert each.error < 1e-9
        for k, each in enumerate(found):
            assert not any(same_orbit(each, other) for other in found[:k])
    assert max(counts) > 1


def test_a_motion_at_a_value_is_the_one_that_a_simulation_finds():
    found = motion().follow(drive_frequency=(1.7, 1.9))
    for value in (1.7, 1.745, 1.8, 1.9):
        (at,) = found.at(drive_frequency=value)
        here = PAPER.replace(drive_frequency=value)
        settled = vi.periodic_motion(here, initial=at.initial, periods=1)
        assert at.stable == (value < 1.809)  # a Neimark-Sacker bifurcation
        if at.stable:
            run = vi.simulate(here, initial=at.initial, periods=500, keep=100)
            assert same_orbit(run.refine(), at)
        assert same_orbit(at, settled)
        assert np.abs(at.multipliers - settled.multipliers).max() < 1e-9


@pytest.mark.parametrize("name", ["gap", "restitution", "moment_amplitude", "mass_ratio", "phase"])
def test_any_parameter_has_its_motions(name):
    here = getattr(PAPER, name)
    found = motion().follow(max_points=12, **{name: (here - 0.02, here + 0.02)})
    values = [*found.values[[0, -1]], *(0.5 * (found.values[1:] + found.values[:-1]))]
    for value in values:
        motions = found.at(**{name: float(value)})
        assert motions
        assert all(getattr(each.system, name) == value for each in motions)


def test_at_the_points_of_a_branch_stand_their_motions():
    for k, value in enumerate(branch().values):
        assert any(
            same_orbit(branch().motions[k], each)
            for each in branch().at(drive_frequency=float(value))
        )


def test_the_value_alone_says_where_on_the_branch():
    named = branch().at(drive_frequency=1.513)
    for one, other in zip(branch().at(1.513), named, strict=True):
        assert same_orbit(one, other)
    with pytest.raises(vi.ParameterError, match="or the value alone"):
        branch().at(1.513, drive_frequency=1.513)
    with pytest.raises(vi.ParameterError, match=r"drive_frequency = '1\.6'"):
        branch().at("1.6")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"gap": 0.5}, "argument gap of at; allowed: drive_frequency with its value"),
        ({}, "drive_frequency with its value, or the value alone"),
        ({"drive_frequency": 1.9}, "drive_frequency = 1.9 .* a value of the branch, from 1.5.* to"),
        ({"drive_frequency": math.nan}, "drive_frequency = nan"),
    ],
)
def test_a_value_beyond_the_branch_is_refused(given, words):
    with pytest.raises(vi.ParameterError, match=words):
        branch().at(**given)


def test_a_branch_without_points_has_no_motions():
    empty = vi.Branch(parameter="gap", pieces=(), bifurcations=(), ends=("start", "start"))
    assert len(empty) == len(empty.motions) == 0
    assert empty
    with pytest.raises(vi.ParameterError, match="the branch has no points"):
        empty.at(gap=0.5)


def test_where_newton_fails_the_error_says_between_which_points(monkeypatch):
    monkeypatch.setattr("vibroimpact.orbits.points._solved", lambda *_: None)
    middle = float(branch().values[:2].mean())
    with pytest.raises(vi.SimulationError, match=f"2-2 at drive_frequency = {middle!r}") as caught:
        motions_at(branch(), middle)
    assert caught.value.result == ()


# Single names.


def test_a_branch_has_as_many_motions_as_points():
    assert len(branch()) == len(branch().values) == len(branch().motions)
    for each, value in zip(branch().motions, branch().values, strict=True):
        assert each.system.drive_frequency == value


def test_a_motion_repeats_after_its_period():
    doubled = branch().motions[0]
    assert doubled.m == 2
    assert doubled.period == 4 * math.pi / doubled.system.drive_frequency
    times = np.array([0.1, 1.0])
    later = doubled.trajectory(times + doubled.period)
    assert np.allclose(later, doubled.trajectory(times), atol=1e-12)
    assert doubled.stability == "stable"
    saddles = [each for each in vi.periodic_motions(PAPER) if each.admissible and not each.stable]
    assert saddles[0].stability == "unstable"
    lost = [each for each in vi.periodic_motions(PAPER) if not each.admissible]
    assert all(each.stability == "not admissible" for each in lost)


def test_to_follow_is_a_method_of_the_motion():
    one = motion().follow(max_points=5, drive_frequency=(1.75, 1.85))
    other = vi.follow_motion(motion(), max_points=5, drive_frequency=(1.75, 1.85))
    assert one.values.tobytes() == other.values.tobytes()


def test_the_summary_of_a_run_has_its_facts():
    text = vi.simulate(STICKY, initial=START, periods=8).summary()
    lines = text.splitlines()
    assert lines[0].split()[:2] == ["motion", "1-inf"]
    assert any(line.startswith("drive periods") and line.endswith(" 8") for line in lines)
    capped = vi.simulate(ROUGH, initial=START, periods=8, max_events=3).summary()
    assert "event_cap: " in capped


@pytest.mark.parametrize(
    ("exponents", "dimension"),
    [
        ((0.2, -0.4, -1.0, -1.0), 1.5),
        ((0.2, 0.1, -0.4, -1.0), 2.75),
        ((0.0, -0.4, -1.0, -1.0), 1.0),
        ((-0.1, -0.4, -1.0, -1.0), 0.0),
        ((0.2, 0.1, 0.1, -0.1), 4.0),
        ((0.2, -math.inf, -math.inf, -math.inf), 1.0),
        ((0.2, -0.4, math.nan, math.nan), 1.5),
        ((math.nan,) * 4, math.nan),
    ],
)
def test_the_dimension_of_kaplan_and_yorke(exponents, dimension):
    found = float(dimension_of(np.array(exponents)))
    assert found == pytest.approx(dimension, rel=1e-12, nan_ok=True)


def test_largest_exponent_and_dimension_of_spectra_and_grids():
    options = {"initial": START, "periods": 200}
    spectrum = vi.lyapunov_spectrum(ROUGH, **options)
    grid = vi.lyapunov_spectrum(ROUGH, drive_frequency=[1.545, 1.8], **options)
    assert spectrum.largest == spectrum.exponents[0]
    assert grid.largest.tolist() == grid.exponents[:, 0].tolist()
    assert grid.dimension.tolist() == [float(dimension_of(each)) for each in grid.exponents]
    assert spectrum.dimension == float(dimension_of(spectrum.exponents))


def test_a_sweep_without_axes_has_one_label_and_one_status():
    sweep = vi.sweep(PAPER, initial=START, periods=300)
    assert (sweep.label.item(), sweep.status.item()) == ("1-1", "completed")
    assert sweep.run().label == "1-1"
    assert sweep.to_pandas()["label"].tolist() == ["1-1"]
