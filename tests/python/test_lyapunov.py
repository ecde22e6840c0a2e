"""Lyapunov spectra from Python: known values, identities, convergence, grids, bad input.

Closed forms, all regimes and laws are tests of the compiled core (tests/lyapunov.rs).
"""

import numpy as np
import pytest

import vibroimpact as vi

START = (0.0, 0.5, 0.0, 0.0)
PAPER = {"mass_ratio": 0.6, "frequency_ratio": 2.0, "restitution": 0.8, "gap": 0.5}


def paper(frequency: float, **others) -> vi.System:
    return vi.System(drive_frequency=frequency, **{"moment_amplitude": 1.0, **PAPER, **others})


@pytest.fixture(scope="module")
def chaotic() -> vi.LyapunovSpectrum:
    # Fig. 9(2): about +0.025 (docs/claims.md).
    return vi.lyapunov_spectrum(paper(1.545, friction=0.5), initial=START, periods=20_000)


def test_the_chaotic_motion_of_the_paper(chaotic):
    assert chaotic.label == "chaotic"
    assert chaotic.exponents[0] == pytest.approx(0.025, abs=3e-3)
    assert 0.0 < chaotic.error[0] < 1.5e-3
    assert (np.diff(chaotic.exponents) <= 0.0).all()
    assert chaotic.flow is None
    assert chaotic.time == pytest.approx(0.75 * 20_000 * 0.9 * chaotic.system.drive_period)


def test_the_other_one_is_no_chaos():
    # Fig. 9(4) from the paper's start, erratum E10: negative or zero within its error.
    system = paper(
        2.55, friction=0.4, pendulum_damping=0.01, oscillator_damping=0.01, force_amplitude=0.5
    )
    spectrum = vi.lyapunov_spectrum(system, initial=START, periods=20_000)
    assert spectrum.exponents[0] <= 3.0 * spectrum.error[0]
    assert spectrum.exponents[0] > -0.01


def test_weak_chaos_beside_it():
    # Fig. 9(4) from another start, erratum E10: 7.8e-4, and the sum is that of the damping alone
    # and of the impacts; measured over so many periods the error is some thirtieth of it.
    system = paper(
        2.55, friction=0.4, pendulum_damping=0.01, oscillator_damping=0.01, force_amplitude=0.5
    )
    start = (0.21444256595254158, -0.9328288493890713, 0.09186217857197765, -0.648688758794882)
    spectrum = vi.lyapunov_spectrum(system, initial=start, periods=200_000)
    assert spectrum.label == "chaotic"
    assert spectrum.exponents[0] == pytest.approx(7.78e-4, abs=6e-5)
    assert spectrum.error[0] < 5e-5
    # By two trajectories, pulled together to 1e-8 every 100 drive periods.
    beside = np.array([0.0, 1e-8, 0.0, 0.0])
    state, distance, logs = np.array(start), beside, []
    for _ in range(600):
        pair = vi.simulate(system, initial=np.array([state, state + distance]), periods=100, keep=1)
        state, other = (run.stroboscopic[-1] for run in pair)
        size = np.linalg.norm(other - state)
        logs.append(np.log(size / 1e-8))
        distance = (other - state) / size * 1e-8
    growth = np.mean(logs[100:]) / (100 * system.drive_period)
    assert growth == pytest.approx(7.78e-4, abs=1.5e-4)


def test_convergence_is_shown(chaotic):
    assert chaotic.history.shape == (len(chaotic.history_time), 4)
    assert (np.diff(chaotic.history_time) > 0.0).all()
    assert chaotic.history_time[-1] <= chaotic.time
    # The second half stays within some standard errors of the end.
    late = chaotic.history_time > 0.5 * chaotic.time
    spread = np.abs(chaotic.history[late] - chaotic.exponents)
    assert (spread < 5.0 * chaotic.error).all()


def chatters(system: vi.System, start: tuple[float, ...], periods: int) -> bool:
    run = vi.simulate(system, initial=start, periods=periods, keep=periods)
    return bool((run.events["kind"] == vi.EventKind.CHATTER).any())


@pytest.mark.parametrize(("frequency", "damping"), [(0.55, 0.0), (2.3, 0.0), (0.55, 0.01)])
def test_their_sum_is_that_of_all_contractions(frequency, damping):
    # docs/theory.md, section 7: without friction, on a motion that is not periodic.
    system = paper(frequency, damping=(damping, damping), moment_amplitude=2.0)
    # Complete chatter, into which some of these chaotic motions fall, contracts without end.
    starts = [(0.0, v1, 0.0, 0.0) for v1 in np.linspace(0.4, 0.6, 21)]
    start = next(start for start in starts if not chatters(system, start, 4000))
    spectrum = vi.lyapunov_spectrum(system, initial=start, periods=4000)
    rate = spectrum.impacts / spectrum.time
    expected = -2.0 * (damping * 2.0 + damping) + 2.0 * np.log(0.8) * rate
    assert spectrum.impacts > 100
    assert spectrum.sum == pytest.approx(expected, abs=1e-6)
    assert spectrum.sum == pytest.approx(expected, rel=1e-9)


def test_they_agree_with_the_growth_that_names_the_motion(chaotic):
    run = vi.simulate(chaotic.system, initial=START, periods=5000, keep=200)
    period = run.period
    growth, error = period.evidence.growth, period.evidence.growth_error
    difference = abs(chaotic.per_period[0] - growth)
    assert difference < 4.0 * np.hypot(error, chaotic.error[0] * run.system.drive_period)


def test_of_a_periodic_motion_they_are_those_of_its_multipliers():
    system = paper(1.1)
    motion = vi.simulate(system, initial=START, periods=2000, keep=100).refine()
    spectrum = vi.lyapunov_spectrum(system, initial=START, periods=40_000, keep=36_000)
    exact = np.sort(np.log(np.abs(motion.multipliers)))[::-1] / (motion.m * system.drive_period)
    np.testing.assert_allclose(spectrum.exponents, exact, atol=2e-5)
    assert spectrum.sum == pytest.approx(exact.sum(), rel=1e-6)


def test_without_a_drive_one_exponent_is_that_of_the_flow():
    # Elastic impacts under a constant load: nothing is lost, and the motion never ends.
    system = vi.System(drive_frequency=0.0, moment_amplitude=0.5, **PAPER | {"restitution": 1.0})
    spectrum = vi.lyapunov_spectrum(system, initial=(0.0, 2.0, 0.0, 0.0), time=20_000.0)
    assert spectrum.impacts > 1000
    assert spectrum.flow is not None
    assert abs(spectrum.exponents[spectrum.flow]) < 2e-3
    # Volumes are kept, and the exponents come in pairs of opposite sign.
    assert abs(spectrum.sum) < 1e-9
    np.testing.assert_allclose(spectrum.exponents, -spectrum.exponents[::-1], atol=2e-3)


def test_a_grid_has_the_spectra_of_its_systems():
    frequencies = [1.1, 1.545, 2.55]
    swept = vi.lyapunov_spectrum(
        paper(1.0, friction=0.5), initial=START, periods=800, keep=600, drive_frequency=frequencies
    )
    assert isinstance(swept, vi.LyapunovSweep)
    assert swept.exponents.shape == swept.error.shape == (3, 4)
    for i, frequency in enumerate(frequencies):
        single = vi.lyapunov_spectrum(
            paper(frequency, friction=0.5), initial=START, periods=800, keep=600
        )
        assert swept.exponents[i].tolist() == single.exponents.tolist()
        assert swept.error[i].tolist() == single.error.tolist()
    assert swept.to_xarray()["exponents"].dims == ("drive_frequency", "exponent")


def test_the_repr_gives_the_numbers(chaotic):
    assert repr(chaotic).startswith("<LyapunovSpectrum of a motion chaotic: 0.02")
    assert not chaotic.exponents.flags.writeable


def test_a_motion_that_ends_has_none():
    # The printed law fails (docs/theory.md, erratum E1).
    system = paper(2.55, friction=0.4, law="paper", force_amplitude=0.5)
    with pytest.raises(vi.SimulationError, match="the motion ends"):
        vi.lyapunov_spectrum(system, initial=START, periods=4000)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"periods": 0}, "periods"),
        ({"periods": 19}, "periods = 19"),
        ({"periods": 20, "keep": 21}, "keep"),
        ({"periods": 20, "keep": 0}, "keep"),
        ({"time": 100.0}, "time"),
        ({"drive_frequency": [0.0, 1.0]}, "drive_frequency"),
        ({"wall": [1.0]}, "unknown argument wall of lyapunov_spectrum"),
    ],
)
def test_bad_arguments_are_named(arguments, message):
    with pytest.raises(vi.ParameterError, match=message):
        vi.lyapunov_spectrum(paper(1.5), initial=START, **arguments)
    with pytest.raises(vi.ParameterError, match="time"):
        vi.lyapunov_spectrum(paper(0.0), initial=START)


def test_the_shortest_measurement_has_all_its_periods():
    spectrum = vi.lyapunov_spectrum(paper(1.5), initial=START, periods=20)
    assert spectrum.time == pytest.approx(18 * spectrum.system.drive_period, rel=1e-12)


def test_a_spectrum_is_a_data_set_too(chaotic):
    data = chaotic.to_xarray()
    assert data["exponents"].values.tolist() == chaotic.exponents.tolist()
    assert data["history"].dims == ("time", "exponent")
    assert data["time"].values.tolist() == chaotic.history_time.tolist()
    assert data.attrs["label"] == "chaotic"
    assert vi.System.from_json(data.attrs["system"]) == chaotic.system


@pytest.mark.parametrize(
    "arguments", [{"store": "x.zarr"}, {"chunk": 4}, {"client": "x"}, {"workers": 0}]
)
def test_a_single_motion_has_no_store(arguments):
    (name,) = arguments
    with pytest.raises(vi.ParameterError, match=name):
        vi.lyapunov_spectrum(paper(1.5), initial=START, **arguments)


def settled_at(system: vi.System, start: tuple[float, ...], m: int) -> int:
    """Drive periods after which a motion returns after m of them, for the rest of 8,000."""
    sections = vi.simulate(system, initial=start, periods=8_000, keep=8_000).stroboscopic
    moves = np.abs(sections[m:] - sections[:-m]).max(axis=1) > 1e-6
    return int(np.flatnonzero(moves)[-1])


def test_a_motion_that_settles_late_is_measured_when_it_has():
    # A chaotic transient of a thousand periods or two, then a 5-1 motion.
    system = vi.System(
        mass_ratio=0.4,
        frequency_ratio=1.5,
        restitution=0.7,
        gap=0.3,
        drive_frequency=2.7,
        damping=(0.02, 0.02),
        moment_amplitude=0.8,
        friction=0.2,
    )
    starts = [(0.0, v1, 0.0, 0.0) for v1 in np.linspace(0.4, 0.6, 101)]
    # A transient that has gone on long enough by period 500 is told as chaos, though it ends.
    start = next(
        start
        for start in starts
        if vi.simulate(system, initial=start, periods=500, keep=200).label == "5-1"
        and 1_200 < settled_at(system, start, 5) < 1_950
    )
    spectrum = vi.lyapunov_spectrum(system, initial=start)
    motion = vi.simulate(system, initial=start, periods=10_000, keep=100).refine()
    exact = np.log(np.abs(motion.multipliers).max()) / (motion.m * system.drive_period)
    assert spectrum.label == motion.label == "5-1"
    assert spectrum.exponents[0] == pytest.approx(exact, abs=2e-3)
    both = vi.lyapunov_spectrum(system, initial=start, drive_frequency=[2.7, 2.71])
    assert both.label[0] == "5-1"
    assert both.exponents[0].tolist() == spectrum.exponents.tolist()
