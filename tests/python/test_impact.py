"""Single impacts from Python: columns, arrays, laws, errors; and the maps made of them."""

import dataclasses
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import repository
import vibroimpact as vi
from vibroimpact import _core
from vibroimpact._core import COULOMB_LAWS, LAWS

# Rounding of a dozen operations on numbers of order one.
ROUNDING = 1e-14


def made(**changes) -> vi.System:
    values = {
        "mass_ratio": 0.6,
        "frequency_ratio": 2.0,
        "restitution": 0.8,
        "gap": 0.5,
        "drive_frequency": 1.0,
        "friction": 0.5,
    }
    return vi.System(**(values | changes))


def test_a_level_impact_is_the_textbook_one():
    # cos x1 = 1: M1 v1 + M2 v2 with M2 = M1/mbar is kept, and u turns into -r u.
    hit = vi.impact(made(), x1=0.0, v1=1.0, v2=-0.5)
    assert hit.shape == ()
    assert hit["regime"] == vi.Regime.FRICTIONLESS
    assert hit["approach_velocity"] == 1.5
    assert hit["separation_velocity"] == pytest.approx(-1.2, rel=ROUNDING)
    momentum = hit["v1_post"] + hit["v2_post"] / 0.6
    assert momentum == pytest.approx(1.0 - 0.5 / 0.6, rel=ROUNDING)
    # (1 - r^2) of the energy of the relative motion, with the reduced mass 1/(1 + mbar).
    assert hit["energy_loss"] == pytest.approx(0.5 * 0.36 * 1.5**2 / 1.6, rel=ROUNDING)
    assert hit["friction_loss"] == 0.0


def test_columns_are_those_of_the_notation():
    page = repository.root() / "docs" / "notation.md"
    text = page.read_text(encoding="utf-8").split("\n## Single impacts\n")[1]
    listed = re.findall(r"^\| `([^`]+)` \|", text.split("\n## ")[0], re.M)
    hit = vi.impact(made(), x1=0.3, v1=1.0, v2=0.0)
    assert listed == list(hit.dtype.names) == list(_core.OUTCOME_DTYPE.names)


def test_arrays_broadcast_and_equal_single_calls():
    x1, v1 = np.linspace(-1.4, 1.4, 7), np.array([[-1.0], [0.0], [0.5], [2.0]])
    v2 = v1 * np.cos(x1) - 1.0
    for law in LAWS:
        table = vi.impact(made(law=law), x1=x1, v1=v1, v2=v2)
        assert table.shape == (4, 7)
        for row, column in np.ndindex(4, 7):
            alone = vi.impact(made(law=law), x1=x1[column], v1=v1[row, 0], v2=v2[row, column])
            assert alone.tobytes() == table[row, column].tobytes()


@pytest.mark.parametrize("name", ["x1", "velocity_ratio"])
def test_a_map_of_no_impacts_is_refused(name):
    with pytest.raises(vi.ParameterError, match=rf"^{name} = \[\] is not allowed; .* at least one"):
        vi.impact_regimes(made(), **{name: []})


def test_empty_arrays_and_any_stride_are_taken():
    assert vi.impact(made(), x1=[], v1=1.0, v2=0.0).shape == (0,)
    states = np.array([[0.1, 1.0, 0.0], [0.2, 1.5, -1.0]])
    table = vi.impact(made(), x1=states[:, 0], v1=states[:, 1], v2=states[:, 2])
    assert table["v1_pre"].tolist() == [1.0, 1.5]


def test_impacts_are_those_of_a_run(system, initial):
    run = vi.simulate(system, initial=initial, periods=50)
    hits = run.impacts
    table = vi.impact(system, x1=hits["x1"], v1=hits["v1_pre"], v2=hits["v2_pre"])
    for name in ("v1_post", "v2_post", "regime", "impulse_normal", "energy_loss"):
        assert np.array_equal(table[name], hits[name]), name
    assert len(hits) > 30


@pytest.mark.parametrize("law", ["newton", "energetic"])
def test_a_run_follows_its_law(system, initial, law):
    run = vi.simulate(system.replace(law=law), initial=initial, periods=50)
    assert run.stop_reason == "completed"
    hits = run.impacts
    table = vi.impact(run.system, x1=hits["x1"], v1=hits["v1_pre"], v2=hits["v2_pre"])
    assert np.array_equal(table["v1_post"], hits["v1_post"])
    poisson = vi.impact(system, x1=hits["x1"], v1=hits["v1_pre"], v2=hits["v2_pre"])
    assert (poisson["v1_post"] != hits["v1_post"]).any()


@settings(max_examples=200, derandomize=True, deadline=None)
@given(
    st.floats(-np.pi, np.pi),
    st.floats(-2.0, 2.0),
    st.floats(1e-3, 2.0),
    st.floats(0.0, 5.0),
    st.floats(0.01, 10.0),
    st.sampled_from(COULOMB_LAWS),
)
def test_energy_is_accounted_for(x1, v1, u, friction, mass_ratio, law):
    system = made(friction=friction, mass_ratio=mass_ratio, law=law)
    hit = vi.impact(system, x1=x1, v1=v1, v2=v1 * np.cos(x1) - u)
    before = 0.5 * hit["v1_pre"] ** 2 + 0.5 * hit["v2_pre"] ** 2 / mass_ratio
    after = 0.5 * hit["v1_post"] ** 2 + 0.5 * hit["v2_post"] ** 2 / mass_ratio
    # Twelve digits of the energies; friction's work is among them.
    size = before + after + hit["friction_loss"]
    assert abs(before - after - hit["energy_loss"]) <= 1e-12 * size
    assert hit["friction_loss"] >= 0.0
    if law == "newton":
        assert hit["effective_restitution"] == pytest.approx(0.8, rel=ROUNDING)
    else:
        assert hit["energy_loss"] >= 0.0


def test_small_steps_approach_the_exact_outcome():
    state = {"x1": np.linspace(-1.5, 1.5, 30), "v1": 0.5, "v2": -0.7}
    for law in COULOMB_LAWS:
        exact = vi.impact(made(law=law), **state)
        off = [
            np.abs(vi.impact(made(law=law), **state, steps=steps)["v1_post"] - exact["v1_post"])
            for steps in (100, 10_000)
        ]
        # An error of two last steps at most (tests/impact_incremental.rs), with (1 + mu) = 1.5.
        for error, steps in zip(off, (100, 10_000), strict=True):
            assert (error <= 3.0 * 1.1 * exact["impulse_normal"] / steps).all()
        assert off[1].max() < 0.1 * off[0].max()


def test_an_impact_without_outcome_is_a_row():
    # A wall that approaches a tip which sticks, between two that have an outcome.
    wall = made(mass_ratio=0.0, friction=2.0)
    table = vi.impact(wall, x1=[0.0, 1.2, 0.1], v1=[1.0, 1.0, -0.1], v2=[0.0, -0.5, -1.0])
    assert (table["regime"] == -1).tolist() == [False, True, False]
    jammed = table[1]
    assert jammed["approach_velocity"] > 0.5
    for name in ("v1_post", "v2_post", "impulse_normal", "friction_loss", "effective_restitution"):
        assert np.isnan(jammed[name])
        assert np.isfinite(table[[0, 2]][name]).all()
    stepped = vi.impact(wall, x1=1.2, v1=1.0, v2=-0.5, steps=100)
    assert stepped["regime"] == -1
    failed = vi.impact(made(mass_ratio=0.4, law="paper"), x1=0.9, v1=-1.9, v2=-1.3)
    assert failed["regime"] == -1


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"v2": 2.0}, vi.StateError, r"approach velocity u = -1.* at x1 = 0, v1 = 1, v2 = 2 is"),
        ({"v2": 1.0}, vi.StateError, r"u = 0 at .* allowed: u > 0"),
        ({"v1": np.nan}, vi.StateError, "v1 = nan is not allowed; allowed: a finite number"),
        ({"x1": [0.0, np.inf]}, vi.StateError, "x1 = inf"),
        ({"x1": [0.0, 0.1], "v1": [1, 1, 1]}, vi.ParameterError, r"\(2,\), \(3,\), \(\)"),
        ({"x1": "up"}, vi.ParameterError, "x1 = 'up' is not allowed"),
        ({"v1": True}, vi.ParameterError, "v1 = True is not allowed"),
        ({"x1": [[0.0], [0.0, 1.0]]}, vi.ParameterError, "x1 = "),
        ({"steps": 0}, vi.ParameterError, "steps = 0 is not allowed; allowed: an integer from 1"),
        ({"steps": 10**6 + 1}, vi.ParameterError, "steps = 1000001"),
        ({"steps": 10.5}, vi.ParameterError, "steps = 10.5"),
    ],
)
def test_bad_input_is_named(arguments, error, message):
    state = {"x1": 0.0, "v1": 1.0, "v2": 0.0}
    with pytest.raises(error, match=message):
        vi.impact(made(), **(state | arguments))


def test_the_law_of_the_paper_has_no_small_steps():
    with pytest.raises(vi.ParameterError, match=r"law = paper is not allowed; allowed: poisson"):
        vi.impact(made(law="paper"), x1=0.0, v1=1.0, v2=0.0, steps=10)
    with pytest.raises(vi.ParameterError, match="system = 3"):
        vi.impact(3, x1=0.0, v1=1.0, v2=0.0)
    with pytest.raises(vi.ParameterError, match=r"allowed: 'poisson' .*, 'paper'"):
        made(law="stronge")


def test_a_map_holds_what_its_impacts_do():
    system = made()
    result = vi.impact_regimes(system, x1=[-1.2, 0.3, 1.0], velocity_ratio=[-1.0, 0.5])
    assert result.regime.shape == result.restitution.shape == result.energy_loss.shape == (2, 3)
    for row, column in np.ndindex(2, 3):
        x1, v1 = result.x1[column], result.velocity_ratio[row]
        hit = vi.impact(system, x1=x1, v1=v1, v2=v1 * np.cos(x1) - 1.0)
        assert hit["regime"] == result.regime[row, column]
        assert hit["effective_restitution"] == result.restitution[row, column]
        # Homogeneous: the same at thrice the speed, to rounding.
        fast = vi.impact(system, x1=x1, v1=3 * v1, v2=3 * (v1 * np.cos(x1) - 1.0))
        energy = 0.5 * fast["v1_pre"] ** 2 + 0.5 * fast["v2_pre"] ** 2 / 0.6
        expected = pytest.approx(fast["energy_loss"] / energy, rel=10 * ROUNDING)
        assert result.energy_loss[row, column] == expected
    with pytest.raises(dataclasses.FrozenInstanceError):
        result.system = made()
    with pytest.raises(ValueError, match="read-only"):
        result.regime[0, 0] = 3


@pytest.mark.parametrize("friction", [0.1, 0.5, 1.0, 3.0])
def test_the_default_map_shows_every_regime(friction):
    result = vi.impact_regimes(made(friction=friction))
    assert set(np.unique(result.regime)) == {1, 2, 3, 4, 5}
    # No regime but slip at the ends of the range where x1' cos x1 > 0.
    assert (result.regime[-1] == vi.Regime.SLIP).all()
    assert (result.x1 != 0.0).all()
    assert (result.velocity_ratio != 0.0).all()
    assert np.abs(result.x1).max() < np.pi / 2


def test_maps_of_the_degenerate_systems():
    smooth = vi.impact_regimes(made(friction=0.0))
    assert set(np.unique(smooth.regime)) == {0}
    assert smooth.spread == pytest.approx((0.8, 0.8), rel=ROUNDING)
    head_on = vi.impact_regimes(made(friction=0.0, contact="direct"))
    assert np.ptp(head_on.energy_loss, axis=1).max() == 0.0
    wall = vi.impact_regimes(made(mass_ratio=0.0, friction=1.5))
    assert set(np.unique(wall.regime)) == {-1, 1, 2, 3, 5}
    assert np.isnan(wall.energy_loss).all()
    assert wall.velocity_ratio.max() < 10.0
    assert "law='poisson'" in repr(wall)
    nowhere = vi.impact_regimes(made(mass_ratio=0.0, friction=1.5), x1=[1.5], velocity_ratio=[-1.0])
    assert np.isnan(nowhere.spread).all()


def test_energy_grows_on_the_map_of_newton_alone():
    least = {
        law: vi.impact_regimes(made(friction=1.0, law=law)).energy_loss.min()
        for law in COULOMB_LAWS
    }
    assert least["newton"] < -0.1
    assert least["poisson"] > 0.0
    assert least["energetic"] > 0.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"x1": 1.0}, r"x1 = 1.0 is not allowed; allowed: one dimension, such as \[1.0\]"),
        ({"velocity_ratio": [1.0, np.nan]}, r"velocity_ratio\[1\] = nan"),
        ({"steps": -1}, "steps = -1"),
    ],
)
def test_bad_axes_are_named(arguments, message):
    with pytest.raises(vi.ParameterError, match=message):
        vi.impact_regimes(made(), **arguments)


def test_agreement_is_of_first_order_in_every_regime():
    result = vi.impact_agreement(made(), steps=(100, 400, 1600))
    assert result.laws == COULOMB_LAWS
    assert result.difference.shape == (3, 6, 3)
    assert (result.impacts > 20).all()
    assert result.impacts.sum() == 31 * 31
    # Where in a step an impact ends is uniform, which spreads a mean over eight numbers of steps by
    # 0.58/sqrt(8) = 20 %, and the order by 0.3/ln 16 = 0.1; frictionless impacts are all alike. The
    # other regimes are means over some dozens of different impacts.
    off = np.abs(result.order - 1.0)
    assert off[:, 0].max() < 0.1
    assert off[:, 1:].max() < 0.05
    assert f"order {result.order.min():.2f} ... {result.order.max():.2f}" in repr(result)
    some = vi.impact_agreement(made(friction=0.0), steps=(10, 100), cells=4)
    assert np.isnan(some.difference[:, 1:]).all()
    assert some.impacts.tolist() == [16, 0, 0, 0, 0, 0]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"steps": [100]}, "at least two different numbers"),
        ({"steps": [100, 0]}, "steps = 0"),
        ({"cells": 1}, "cells = 1"),
        ({"system": None}, "system = None"),
    ],
)
def test_bad_arguments_of_agreement_are_named(arguments, message):
    with pytest.raises(vi.ParameterError, match=message):
        vi.impact_agreement(**({"system": made()} | arguments))
