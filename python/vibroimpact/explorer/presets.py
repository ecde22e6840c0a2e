"""Where the explorer can begin: the paper's figures, and special systems by their usual names.

The parameters of the paper's figures are those of the captions of Han, Jin & Hu (2004). The ranges
of the diagrams are ours, and so is the drive frequency of the motion beside a diagram. From the
paper's start the motion of Fig. 9(3) settles on a 6-7, so that its start is ours, too. The impact
oscillator is that of Shaw & Holmes (1983), with its stop at the equilibrium. The ball on a
vibrating table is that of Holmes (1982).
"""

from __future__ import annotations

from typing import Any

from ..system import System
from .axis import Axis
from .state import State

_INITIAL = (0.0, 0.5, 0.0, 0.0)


def _paper(*, vary: tuple[float, float] = (0.2, 4.0), **changes: Any) -> State:
    parameters = {"drive_frequency": 1.8, "moment_amplitude": 1.0} | changes
    system = System(mass_ratio=0.6, frequency_ratio=2.0, restitution=0.8, gap=0.5, **parameters)
    axis = Axis(name="drive_frequency", low=vary[0], high=vary[1])
    return State.of(system, initial=_INITIAL, vary=axis, across=axis)


def _damped(pendulum: float, force: float) -> dict[str, Any]:
    return {
        "pendulum_damping": pendulum,
        "oscillator_damping": pendulum,
        "force_amplitude": force,
    }


DEFAULT = _paper(drive_frequency=1.545, friction=0.5, vary=(1.4, 2.0))
"""A chaotic motion between two windows; a system of the user begins with its kind of map."""

PRESETS: dict[str, State] = {
    "Paper, Fig. 4": _paper(),
    "Paper, Fig. 5(a): 1-1": _paper(drive_frequency=1.25),
    "Paper, Fig. 5(b): 1-1": _paper(drive_frequency=1.8),
    "Paper, Fig. 5(c): 2-1": _paper(drive_frequency=2.75, moment_amplitude=1.5),
    "Paper, Fig. 6(a): 1-2": _paper(drive_frequency=0.73, moment_amplitude=2.3),
    "Paper, Fig. 6(b): 2-4": _paper(drive_frequency=1.1),
    "Paper, Fig. 6(c): 8-6": _paper(drive_frequency=2.56),
    "Paper, Fig. 7(a): damped": _paper(**_damped(0.01, 0.5)),
    "Paper, Fig. 7(b): damped": _paper(**_damped(0.1, 0.5)),
    "Paper, Fig. 7(c): damped": _paper(**_damped(0.1, 1.5)),
    "Paper, Fig. 8(a): friction": _paper(friction=0.5),
    "Paper, Fig. 8(b): friction": _paper(friction=0.4, **_damped(0.01, 0.5)),
    "Paper, Fig. 8(c): friction": _paper(friction=0.8, **_damped(0.01, 0.5)),
    "Paper, Fig. 9(1): 1-3": _paper(drive_frequency=0.75, **_damped(0.1, 1.5)),
    "Paper, Fig. 9(2): chaos": DEFAULT,
    "Paper, Fig. 9(3): 4-5": _paper(drive_frequency=1.5752, friction=0.5, vary=(1.5, 1.6)).replace(
        x1=0.2,
        right=Axis(name="x1", low=-1.0, high=0.4),
        up=Axis(name="v1", low=-1.0, high=1.0),
    ),
    "Impact oscillator (a wall)": State.of(
        System(
            mass_ratio=0.0,
            frequency_ratio=1.0,
            restitution=0.8,
            gap=0.0,
            drive_frequency=2.8,
            moment_amplitude=1.0,
            contact="direct",
        ),
        initial=(-0.5, 0.0, 0.0, 0.0),
        vary=Axis(name="drive_frequency", low=2.0, high=4.5),
        value="approach_velocity",
        across=Axis(name="drive_frequency", low=2.0, high=4.5),
        upward=Axis(name="restitution", low=0.4, high=1.0),
        right=Axis(name="x1", low=-2.0, high=0.0),
    ),
    "Two oscillators head on": State.of(
        System(
            mass_ratio=0.6,
            frequency_ratio=1.6,
            restitution=0.7,
            gap=0.2,
            drive_frequency=1.3,
            pendulum_damping=0.02,
            oscillator_damping=0.02,
            moment_amplitude=1.0,
            contact="direct",
        ),
        initial=(0.0, 0.0, 0.0, 0.0),
        vary=Axis(name="drive_frequency", low=0.6, high=3.0),
        across=Axis(name="drive_frequency", low=0.6, high=3.0),
        upward=Axis(name="gap", low=0.0, high=1.0),
        right=Axis(name="x1", low=-1.0, high=0.2),
    ),
    "Bouncing ball": State.of(
        System(
            mass_ratio=0.0,
            frequency_ratio=0.0,
            restitution=0.9,
            gap=0.0,
            drive_frequency=0.0,
            static_moment=1.0,
            contact="direct",
        ),
        initial=(-1.0, 0.0, 0.0, 0.0),
        vary=Axis(name="restitution", low=0.0, high=1.0),
        value="approach_velocity",
        across=Axis(name="restitution", low=0.0, high=1.0),
        right=Axis(name="x1", low=-2.0, high=0.0),
    ),
    "Ball on a vibrating table: 2-2": State.of(
        System(
            mass_ratio=0.0,
            frequency_ratio=0.0,
            restitution=0.8,
            gap=0.0,
            drive_frequency=2.0,
            oscillator_damping=0.05,
            force_amplitude=0.84,
            static_moment=1.0,
            contact="direct",
        ),
        initial=(-1.2, 0.0, 0.0, 0.0),
        vary=Axis(name="force_amplitude", low=0.4, high=1.1),
        value="approach_velocity",
        across=Axis(name="force_amplitude", low=0.4, high=1.1),
        upward=Axis(name="restitution", low=0.4, high=1.0),
        right=Axis(name="x1", low=-3.0, high=0.0),
    ),
}
"""State by name, in the order of the page's list."""

FIRST = PRESETS["Paper, Fig. 9(3): 4-5"]
"""What the explorer shows if it is given nothing: a 4-5 motion, beside which there is a 6-7."""
