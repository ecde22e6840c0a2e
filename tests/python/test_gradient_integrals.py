"""Integrals in functions that are differentiated, where motion is quick; the end of a motion."""

import numpy as np
import pytest

import vibroimpact as vi
from systems import PAPER


def drift(run):
    return run.integral(lambda t, states: states[:, 1])


def moved(run):
    return run.final_state.x1 - run.initial[0]


@pytest.mark.parametrize("damping", [1, 10, 100])
def test_what_decays_quickly_is_integrated(damping):
    body = vi.System(
        mass_ratio=0.6,
        frequency_ratio=2,
        restitution=0.5,
        gap=50,
        drive_frequency=1.2,
        moment_amplitude=3,
        static_moment=1,
        pendulum_damping=damping,
    )
    options = {"initial": (-0.5, 20, 0, 0), "time": 5}
    value, slopes = vi.gradient(drift, body, ["pendulum_damping", "v1"], **options)
    exact, exact_slopes = vi.gradient(moved, body, ["pendulum_damping", "v1"], **options)
    assert value == pytest.approx(exact, rel=1e-12)
    assert slopes == pytest.approx(exact_slopes, rel=1e-11, abs=1e-14)


def test_slides_are_integrated():
    # After a plastic impact the tip is driven along the mass, and turns faster and faster.
    body = vi.System(
        mass_ratio=1.1,
        frequency_ratio=0,
        restitution=0,
        gap=0.22,
        drive_frequency=1.2,
        moment_amplitude=1.7,
        static_moment=0.55,
        pendulum_damping=0.02,
        oscillator_damping=0.16,
        friction=0.4,
        phase=0.36,
    )
    options = {"initial": (0.1, 0.5, 0.6, -0.3), "time": 6}
    assert len(vi.simulate(body, **options).contacts) > 0
    value, slopes = vi.gradient(drift, body, ["gap", "v1"], **options)
    exact, exact_slopes = vi.gradient(moved, body, ["gap", "v1"], **options)
    assert value == pytest.approx(exact, rel=1e-12)
    assert slopes == pytest.approx(exact_slopes, rel=1e-11)


def test_kinks_of_the_rate_itself_are_found():
    body = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=50, drive_frequency=0)
    period = np.pi

    def distance(run):
        return run.integral(lambda t, states: np.abs(states[:, 1]))

    # x1 = 0.3 cos 2t goes there and back, four times 0.3 in each period.
    options = {"initial": (0.3, 0, 0, 0), "time": 5 * period}
    value, slopes = vi.gradient(distance, body, ["x1"], **options)
    assert value == pytest.approx(5 * 4 * 0.3, rel=1e-12)
    assert slopes == pytest.approx([20], rel=1e-12)


def _turns(run):
    """Return the times at which the velocity of body 1 is 0, between samples of all flights."""
    times = np.linspace(0.0, run.final_state.time, 20_001)
    low = np.flatnonzero(np.diff(np.sign(run.trajectory(times)[:, 1])) != 0)
    hits = run.impacts["time"]
    free = [not ((times[k] <= hits) & (hits <= times[k + 1])).any() for k in low]
    begin, end = times[low[free]], times[low[free] + 1]
    signs = np.sign(run.trajectory(begin)[:, 1])
    for _ in range(60):
        middle = 0.5 * (begin + end)
        same = np.sign(run.trajectory(middle)[:, 1]) == signs
        begin, end = np.where(same, middle, begin), np.where(same, end, middle)
    return begin


@pytest.mark.parametrize("gap", np.linspace(0.1, 0.6, 26).round(2).tolist())
def test_kinks_anywhere_between_events_are_found(gap):
    # A path is the sum of those between turns and impacts.
    body = PAPER.replace(
        gap=gap, drive_frequency=1.3, moment_amplitude=1.2, friction=0.4, damping=(0.02, 0.03)
    )
    options = {"initial": (0, 0.5, 0, 0), "time": 18.0}
    run = vi.simulate(body, **options)
    turns = _turns(run)
    order = np.argsort([*turns, *run.impacts["time"]])

    def path(run):
        places = np.concatenate([run.trajectory(turns)[:, 0], run.impacts["x1"]])[order]
        places = np.concatenate([run.initial[:1], places, np.stack([run.final_state.x1])])
        return np.sum(np.abs(np.diff(places)))

    def integral(run):
        return run.integral(lambda t, states: np.abs(states[:, 1]))

    names = ["gap", "restitution"]
    exact, exact_slopes = vi.gradient(path, body, names, **options)
    value, slopes = vi.gradient(integral, body, names, **options)
    assert value == pytest.approx(exact, rel=1e-12)
    assert slopes == pytest.approx(exact_slopes, rel=1e-6, abs=1e-6)


def test_a_run_has_the_integral_of_which_gradients_are_the_derivatives():
    def work(run):
        return run.integral(lambda t, states: np.abs(states[:, 1, 0]) * np.cos(t))

    structure = vi.Structure(
        [[1, 0], [0, 2]], [[2, -1], [-1, 3]], [vi.Stop([1, 1], 0.1, 0.5)], drive_amplitude=[1, 0]
    ).replace(drive_frequency=1.1)
    options = {"initial": [[0, 0], [0, 0.5]], "periods": 12, "keep": 5}
    run = vi.simulate(structure, **options)
    value, _ = vi.gradient(work, structure, ["gap_0"], **options)
    assert work(run) == pytest.approx(value, rel=1e-10)
    with pytest.raises(vi.ParameterError, match=r"^rate = 3 "):
        run.integral(3)
    with pytest.raises(
        vi.ParameterError, match=r"^rate returned shape \([0-9]+, 2, 2\), .* [0-9]+ numbers here"
    ):
        run.integral(lambda t, states: states)


def test_a_run_that_has_no_end_has_no_integral():
    run = vi.simulate(PAPER, initial=(0, 0.5, 0, 0), periods=20, max_events=3)
    with pytest.raises(vi.ParameterError, match=r"^no integral of a run that has ended early \("):
        run.integral(lambda t, states: t)
    ball = PAPER.replace(
        mass_ratio=0, frequency_ratio=0, gap=0, drive_frequency=0, contact="direct"
    )
    rest = vi.simulate(ball, initial=(-1, 0, 0, 0), time=30)
    with pytest.raises(vi.ParameterError, match="complete chatter"):
        rest.integral(lambda t, states: t)


def test_the_end_of_a_structure_has_places_and_velocities():
    structure = vi.Structure(
        [[1, 0], [0, 2]],
        [[2, -1], [-1, 3]],
        [vi.Stop([0, 1], 0.1, 0.5)],
        drive_amplitude=[1, 0],
        drive_frequency=1,
    )
    options = {"initial": [[0, 0], [0, 0.5]], "time": 5}
    run = vi.simulate(structure, **options)
    exact = run.sensitivity("gap_0").final_state[:, 0]
    for name, rows in (("q", exact[:2]), ("v", exact[2:])):
        value, slopes = vi.gradient(
            lambda run, name=name: getattr(run.final_state, name), structure, ["gap_0"], **options
        )
        assert value == pytest.approx(getattr(run.final_state, name))
        assert slopes[:, 0] == pytest.approx(rows)
