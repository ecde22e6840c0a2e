"""Motions that never strike: the bound holds against simulation, and decides what basins say."""

import numpy as np

import vibroimpact as vi
from vibroimpact.sweeps.basins.free_motion import never_strike

FREE = vi.System(
    mass_ratio=0.6,
    frequency_ratio=3.0380059258125627,
    restitution=0.5,
    gap=0.3231107145034594,
    drive_frequency=3.7589192105868934,
    oscillator_damping=1.5,
    moment_amplitude=0.2992024397687129,
    law="newton",
)


def test_what_never_strikes_does_not():
    generator = np.random.default_rng(5)
    starts = generator.uniform(-0.6, 0.6, (200, 4)) * [0.35, 1.0, 0.15, 0.15]
    starts = starts[np.sin(starts[:, 0]) - starts[:, 2] < FREE.gap]
    bounded = never_strike(FREE, starts)
    assert 20 < np.count_nonzero(bounded) < len(starts) - 20
    for start in starts[bounded][:40]:
        run = vi.simulate(FREE, initial=start, periods=3000, keep=1)
        assert run.impact_count == 0


def test_the_bound_is_reached():
    # Frequencies without a common period bring all phases: just above the bound it strikes.
    system = FREE.replace(oscillator_damping=0.0, contact="direct", gap=0.5)
    low, high = 0.0, 2.0
    while high - low > 1e-6:
        middle = 0.5 * (low + high)
        free = never_strike(system, np.array([[0.0, middle, 0.05, 0.0]]))[0]
        low, high = (middle, high) if free else (low, middle)
    below = vi.simulate(system, initial=(0.0, low, 0.05, 0.0), periods=20_000, keep=1)
    above = vi.simulate(system, initial=(0.0, 1.05 * high, 0.05, 0.0), periods=20_000, keep=1)
    assert below.impact_count == 0
    assert above.impact_count > 0


def test_resonance_and_rotors_are_never_bounded():
    rest = np.zeros((1, 4))
    assert never_strike(FREE, rest).all()
    assert not never_strike(FREE.replace(frequency_ratio=0.0), rest).any()
    resonant = FREE.replace(drive_frequency=FREE.frequency_ratio)
    assert not never_strike(resonant, rest).any()
    assert never_strike(resonant.replace(moment_amplitude=0.0), rest).all()


def test_starts_that_strike_again_belong_to_no_family():
    basins = vi.basins(
        FREE, periods=600, x1=np.linspace(-1.5, 0.3, 9), v1=np.linspace(-2.0, 2.0, 9)
    )
    family = [k for k, found in enumerate(basins.attractors) if found.kind == "family"]
    cells = np.argwhere(np.isin(basins.attractor, family))
    x1, v1 = basins.axes.values()
    assert len(cells) > 5
    for i, j in cells:
        run = vi.simulate(FREE, initial=(x1[i], v1[j], 0.0, 0.0), periods=600, keep=1)
        assert run.resume(periods=10_000, keep=10_000).impact_count == run.impact_count
