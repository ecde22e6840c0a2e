"""Random structures against an integrator that knows neither modes nor the library's search.

SciPy's DOP853 with events integrates the equations of motion from impact to impact; each flight
starts from the run's own state, so that nothing adds up and one bound holds for all of them.
"""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import sizes
import vibroimpact as vi
from random_structures import swinging


def damping(structure: vi.Structure) -> np.ndarray:
    """C, from ratios by the modes: M Phi 2 zeta w Phi^T M."""
    mass = np.array(structure.mass)
    if structure.damping is not None:
        return np.array(structure.damping)
    if structure.damping_ratios is None:
        return 0 * mass
    modes = mass @ np.array(structure.shapes)
    rates = 2 * np.array(structure.damping_ratios) * np.array(structure.frequencies)
    return (modes * rates) @ modes.T


def motion(structure: vi.Structure) -> tuple[Callable, list[Callable]]:
    """The right-hand side of the equations of motion, and the gaps as events."""
    count, omega = len(structure.mass), structure.drive_frequency
    inverse = np.linalg.inv(structure.mass)
    stiffness, decay = inverse @ np.array(structure.stiffness), inverse @ damping(structure)
    load, drive = inverse @ structure.static_load, inverse @ structure.drive_amplitude

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        driven = (drive * np.exp(1j * (omega * t + structure.phase))).real
        return np.concatenate(
            [y[count:], load + driven - stiffness @ y[:count] - decay @ y[count:]]
        )

    def gap(stop: vi.Stop) -> Callable:
        def event(t: float, y: np.ndarray) -> float:
            moved = stop.amplitude * np.cos(omega * t + stop.phase)
            return float(stop.normal @ y[:count] - stop.gap - moved)

        event.terminal = True  # type: ignore[attr-defined]
        event.direction = 1  # type: ignore[attr-defined]
        return event

    return rates, [gap(stop) for stop in structure.stops]


@pytest.mark.parametrize("rough", [False, True])
def test_flights_are_those_of_an_integrator(rough: bool) -> None:
    worst, compared = 0.0, 0
    cases = sizes.either(25, 200)
    for seed in range(cases):
        structure, initial = swinging(seed, rough=rough)
        run = vi.simulate(structure, initial=initial, periods=6, max_events=60)
        # contact, and the impacts of a chatter that has no first one, are compared elsewhere
        until = min(run.contacts["time"], default=np.inf)
        rates, gaps = motion(structure)
        time, state = 0.0, np.concatenate(initial)
        count = len(structure.mass)
        for row in run.impacts:
            if not time < row["time"] < until - 1e-9:
                break
            flight = row["time"] - time
            found = solve_ivp(
                rates,
                (time, row["time"] + 0.5 * flight),
                state,
                method="DOP853",
                rtol=3e-14,
                atol=1e-14,
                events=gaps,
                # a hop that one step spans has no change of sign
                max_step=min(0.02 * run.final_state.time, flight / 6),
            )
            met = [
                (float(times[0]), stop, states[0])
                for stop, (times, states) in enumerate(
                    zip(found.t_events, found.y_events, strict=True)
                )
                # the start of a hop is no event
                if len(times) and times[0] > time + 1e-9
            ]
            assert met, f"{seed} at {row['time']}"
            when, stop, there = min(met, key=lambda event: event[0])
            assert stop == row["stop"], f"{seed} at {row['time']}"
            slow = min(1.0, row["approach_velocity"])
            off = np.abs(np.append(there[:count] - row["q"], when - row["time"])).max() * slow
            assert off < 1e-10, f"{seed} at {row['time']}: {off:.1e}"
            worst, compared = max(worst, off), compared + 1
            time, state = row["time"], np.concatenate([row["q"], row["v_post"]])
    print(f"{cases} structures, {compared} flights, worst {worst:.1e}")
    assert compared > 4 * cases
