"""Plots of one run show its own states: touching at impacts, jumping at the right instants."""

import numpy as np
import pytest
from matplotlib.figure import Figure

import vibroimpact as vi


@pytest.fixture
def run(system, initial) -> vi.Run:
    return vi.simulate(system, initial=initial, periods=40, keep=20)


@pytest.fixture
def ax():
    return Figure().subplots()


def line(ax, label):
    (found,) = [item for item in ax.get_lines() if item.get_label() == label]
    return np.asarray(found.get_xdata()), np.asarray(found.get_ydata())


def last(run: vi.Run, periods: float) -> np.ndarray:
    """The impacts of the last so many drive periods."""
    return run.impacts[
        run.impacts["time"] > run.final_state.time - periods * run.system.drive_period
    ]


def test_time_history_shows_the_trajectory(run, ax):
    assert vi.plot.time_history(run, periods=8, points_per_period=50, ax=ax) is ax
    time, x2 = line(ax, r"$x_2$")
    state = run.trajectory(time)
    assert np.allclose(x2, state[:, 2], rtol=0, atol=1e-12)
    _, face = line(ax, r"$\sin x_1-\delta$")
    assert np.allclose(face, np.sin(state[:, 0]) - run.system.gap, rtol=0, atol=1e-12)
    _, drive = line(ax, r"$\cos\omega t$")
    assert np.array_equal(drive, np.cos(run.system.drive_frequency * time))
    assert time[-1] == run.final_state.time
    assert time[-1] - time[0] == pytest.approx(8 * run.system.drive_period)


def test_the_faces_touch_at_every_impact_and_nowhere_cross(run, ax):
    vi.plot.time_history(run, periods=20, ax=ax)
    time, x2 = line(ax, r"$x_2$")
    _, face = line(ax, r"$\sin x_1-\delta$")
    hits = np.isin(time, run.impacts["time"])
    assert np.count_nonzero(hits) == 2 * len(last(run, 20)) > 0
    assert np.abs(face - x2)[hits].max() < 1e-13
    assert (face - x2).max() < 1e-13


def test_phase_portrait_jumps_from_pre_to_post_velocity(run, ax):
    vi.plot.phase_portrait(run, periods=8, ax=ax)
    for body, label in ((1, r"$x_1,\ \dot x_1$"), (2, r"$x_2,\ \dot x_2$")):
        x, v = line(ax, label)
        for impact in last(run, 8):
            (row,) = np.flatnonzero((x == impact[f"x{body}"]) & (v == impact[f"v{body}_pre"]))
            assert x[row + 1] == x[row]
            assert v[row + 1] == impact[f"v{body}_post"]


def test_phase_portrait_of_one_body(run, ax):
    vi.plot.phase_portrait(run, bodies=(1,), ax=ax)
    assert len(ax.get_lines()) == 1
    assert (ax.get_xlabel(), ax.get_ylabel()) == (
        "position $x_1$ of body 1",
        r"velocity $\dot x_1$ of body 1",
    )


def test_impacts_are_marked_with_their_regime(run, ax):
    vi.plot.time_history(run, periods=20, color="regime", ax=ax)
    hits = last(run, 20)
    assert len(np.unique(hits["regime"])) >= 2
    for code in np.unique(hits["regime"]):
        time, x2 = line(ax, vi.plot.REGIME_STYLES[code].text)
        here = hits[hits["regime"] == code]
        assert time.tolist() == here["time"].tolist()
        assert x2.tolist() == here["x2"].tolist()


def test_impact_section_is_the_impact_table(run, ax):
    vi.plot.impact_section(run, x="phase", y="v2_post", ax=ax)
    (found,) = ax.collections
    expected = np.column_stack([run.impacts["phase"], run.impacts["v2_post"]])
    assert np.array_equal(np.asarray(found.get_offsets()), expected)


def test_coloured_impact_section_splits_the_table_by_regime(run, ax):
    vi.plot.impact_section(run, color="regime", ax=ax)
    drawn = {item.get_label(): np.asarray(item.get_offsets()) for item in ax.collections}
    assert sum(map(len, drawn.values())) == len(run.impacts)
    for code in np.unique(run.impacts["regime"]):
        here = run.impacts[run.impacts["regime"] == code]
        expected = np.column_stack([here["x1"], here["v1_pre"]])
        assert np.array_equal(drawn[vi.plot.REGIME_STYLES[code].text], expected)


def test_gap_is_closed_at_impacts_only(run, ax):
    vi.plot.gap_history(run, periods=20, ax=ax)
    time, gap = (np.asarray(data) for data in ax.get_lines()[1].get_data())
    hits = np.isin(time, run.impacts["time"])
    assert np.abs(gap[hits]).max() < 1e-13
    assert gap[~hits].max() < 0.0
    assert ax.get_ylabel() == r"gap function $\sin x_1-x_2-\delta$"


def test_displacements_are_the_trajectory(run, ax):
    window = (run.kept_from, run.kept_from + 3.0)
    vi.plot.displacement_history(run, window=window, color="regime", ax=ax)
    for column, label in ((0, "$x_1$"), (2, "$x_2$")):
        time, value = line(ax, label)
        assert np.allclose(value, run.trajectory(time)[:, column], rtol=0, atol=1e-12)
    assert ax.get_xlim() == window


def test_impact_count_ends_at_the_number_of_impacts(system, initial, ax):
    run = vi.simulate(system, initial=initial, periods=40)
    vi.plot.impact_count(run, ax=ax)
    period, count = ax.get_lines()[0].get_data()
    assert count[-1] == run.impact_count
    assert period[-1] == pytest.approx(40)
    for end in (5, 20):
        assert count[period <= end].max() == np.count_nonzero(run.impacts["period"] < end)
    kept = vi.simulate(system, initial=initial, periods=40, keep=10)
    vi.plot.impact_count(kept, ax=ax)
    assert ax.get_lines()[1].get_ydata().tolist() == count[period > 30].tolist()


def test_impact_count_without_impacts_is_empty(system, initial, ax):
    run = vi.simulate(system.replace(gap=5.0), initial=initial, periods=5)
    assert run.impact_count == 0
    vi.plot.impact_count(run, ax=ax)
    ax.figure.canvas.draw()
    assert ax.get_lines()[0].get_ydata().tolist() == [0]


def test_direct_contact_has_its_own_gap(initial, ax):
    system = vi.System(
        mass_ratio=0.0,
        frequency_ratio=1.0,
        restitution=0.8,
        gap=0.5,
        drive_frequency=1.0,
        pendulum_damping=0.05,
        moment_amplitude=1.0,
        contact="direct",
    )
    run = vi.simulate(system, initial=initial, periods=20, keep=8)
    vi.plot.gap_history(run, ax=ax)
    time, gap = (np.asarray(data) for data in ax.get_lines()[1].get_data())
    x1, _, x2, _ = run.trajectory(time).T
    assert np.allclose(gap, x1 - x2 - 0.5, rtol=0, atol=1e-12)
    assert ax.get_ylabel() == r"gap function $x_1-x_2-\delta$"


def test_a_constant_load_has_no_periods(system, initial, ax):
    run = vi.simulate(system.replace(drive_frequency=0.0), initial=initial, time=5.0)
    with pytest.raises(ValueError, match="window="):
        vi.plot.time_history(run, periods=8, ax=ax)
    vi.plot.time_history(run, window=(0.0, 5.0), points_per_period=50, ax=ax)
    time, x2 = line(ax, r"$x_2$")
    assert np.allclose(x2, run.trajectory(time)[:, 2], rtol=0, atol=1e-12)


def test_a_window_outside_the_run_is_an_error(run, ax):
    with pytest.raises(ValueError, match=r"."):
        vi.plot.gap_history(run, window=(0.0, 1.0), ax=ax)
