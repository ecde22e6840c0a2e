"""Impulses and energy losses by the mass ratio, on what is a wall where that is 0."""

import numpy as np
import pytest

import vibroimpact as vi

OPTIONS = {"initial": (-1.2, 0.1, 0, 0), "time": 6.0}
COLUMNS = ("impulse_normal", "impulse_tangential", "energy_loss")
# Numbers with which tips slip, reverse and stick on a wall at rest, and on one that moves.
FREE = {"frequency_ratio": 0.5, "gap": 0.2, "drive_frequency": 1.3, "moment_amplitude": 2.0}
MOVED = FREE | {"force_amplitude": 0.3}
HELD = {"frequency_ratio": 1.63, "gap": -0.796, "drive_frequency": 1.786, "moment_amplitude": 0.584}
HELD_MOVED = {"frequency_ratio": 1.0, "gap": -0.2, "drive_frequency": 1.1, "force_amplitude": 0.3}
WALLS = {
    "smooth": (MOVED, 0.0),
    "at rest": (FREE, 0.3),
    "held at rest": (HELD, 1.12),
    "held": (HELD_MOVED | {"moment_amplitude": 1.0}, 1.1),
}
# Where a heavy body takes an impulse without bound.
JUMPS = {("held at rest", "newton"), ("held at rest", "energetic"), ("held", "newton")}


def machine(name: str, law: str) -> vi.System:
    fields, friction = WALLS[name]
    fields = fields | {"restitution": 0.7, "oscillator_damping": 0.1}
    return vi.System(mass_ratio=0, law=law, friction=friction, **fields)


def first(run, column: str):
    """The first impacts, as many as there are on a wall and on a heavy body."""
    return run.impacts[column][: 1 if run.run.system.gap == HELD["gap"] else 3]


@pytest.mark.parametrize("law", ["poisson", "newton", "energetic"])
@pytest.mark.parametrize("name", WALLS)
def test_a_wall_that_becomes_a_heavy_body(name, law):
    wall = machine(name, law)
    step = 1e-5
    for column in COLUMNS:
        if (name, law) in JUMPS:
            with pytest.raises(vi.ParameterError, match=f"'{column}'\\] has no derivatives"):
                vi.gradient(lambda run, of=column: first(run, of), wall, ["mass_ratio"], **OPTIONS)
            continue
        values, slopes = [], []
        for k in range(5):
            at = {"mass_ratio": k * step}
            value, slope = vi.gradient(lambda run, of=column: first(run, of), wall, at, **OPTIONS)
            values.append(value)
            slopes.append(slope)
        differences = np.tensordot([-25.0, 48.0, -36.0, 16.0, -3.0], values, 1) / (12.0 * step)
        assert slopes[0][:, 0] == pytest.approx(differences, rel=1e-7, abs=1e-7)


def test_tips_stick_on_walls_at_rest_and_on_those_that_move():
    for name, moves in (("held at rest", False), ("held", True)):
        rows = vi.simulate(machine(name, "poisson"), **OPTIONS).impacts
        sticks = rows["regime"] == vi.Regime.STICK_RESTITUTION
        assert (rows["v2_pre"][sticks] > 0.0).any() == moves
        assert sticks.any()
