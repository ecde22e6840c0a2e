"""Scenes with complete chatter and sustained contact, and how they are written to a file.

    python -m reference.regenerate contact_reference.json --write     (in tests)

Every phase of docs/theory.md, section 5: chatter in slip, without friction and in stick (a ratio
other than r), r from 0 to 0.95, slides in both directions, across sin x1 = 0 and across v1 = 0,
stick, release; direct contact, walls at rest and moving; starts in contact; rest and Painleve
points. Parameters are float64. No scene is chaotic: each records its amplification (measure.py).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from flint import arb

from vibroimpact.reference.flight import System, exact
from vibroimpact.reference.hybrid import sections
from vibroimpact.reference.measure import Measured, measured

#: Fig. 7(c) of the paper, at its lowest frequencies.
BASE = {
    "mbar": 0.6, "omega0": 2.0, "r": 0.8, "delta": 0.5, "zeta1": 0.1, "zeta2": 0.1,
    "f1": 1.0, "f2": 1.5, "omega": 0.25, "mu": 0.0,
}  # fmt: skip
_STRONG = {"r": 0.3, "f1": 3.0}
_BALL = {"mbar": 0.0, "omega0": 0.0, "omega": 0.0, "zeta1": 0.0, "zeta2": 0.0, "f2": 0.0}
_WALL = {"mbar": 0.0, "omega0": 1.0, "f1": 2.0, "f2": 0.0, "omega": 0.4, "r": 0.5}
_EVEN = {"zeta1": 0.0, "zeta2": 0.0, "f1": 3.0, "f2": 1.0, "omega": 0.5, "r": 0.5}


@dataclass(frozen=True)
class Scene:
    """Changes to BASE, start, contact, forcing phase; so many periods, or the times of samples."""

    changes: dict[str, float]
    initial: tuple[float, float, float, float] = (0.0, 0.5, 0.0, 0.0)
    periods: int = 3
    contact: str = "oblique"
    phase: float = 0.0
    times: tuple[float, ...] = field(default=())

    def parameters(self) -> dict[str, float]:
        """The ten numbers."""
        return BASE | self.changes

    def system(self) -> System:
        """The system of exactly these floats."""
        return System.parse(self.parameters(), self.contact)

    def sampled(self) -> Callable[[], Sequence[arb]]:
        """The times of the samples: given, or the ends of the periods."""
        times = self.times
        if times:
            return lambda: [arb(exact(t)) for t in times]
        return sections(self.system(), self.periods)

    def measured(self) -> Measured:
        """The run with its errors and amplification."""
        return measured(self.system(), self.initial, self.sampled(), phase=self.phase)


SCENES: dict[str, Scene] = {
    # the supplied scenes, and more of Fig. 7(c)
    "fig7c_omega_0.25": Scene({}, periods=4),
    "fig7c_omega_0.21": Scene({"omega": 0.21}, periods=4),
    "frictionless_low_restitution": Scene(_STRONG, periods=4),
    "friction_stick_slip": Scene(_STRONG | {"mu": 0.3}, periods=4),
    "fig7c_omega_0.3": Scene({"omega": 0.3}, periods=6),
    "fig7c_omega_0.45": Scene({"omega": 0.45}, periods=6),
    # restitution near 0 and near 1, and 0
    "restitution_0.05": Scene({"r": 0.05}, periods=4),
    "restitution_0.05_friction": Scene({"r": 0.05, "mu": 0.3}, periods=4),
    "restitution_0.95": Scene({"r": 0.95, "omega": 0.2, "zeta1": 0.2, "zeta2": 0.2}),
    "restitution_0": Scene({"r": 0.0}, periods=4),
    "restitution_0_friction": Scene({"r": 0.0, "mu": 0.9}, periods=4),
    # stick-slip
    "stick_slip_mu_0.3": Scene(
        {"mu": 0.3, "r": 0.3, "omega": 0.23, "f1": 1.8, "f2": 2.3, "delta": 0.1, "omega0": 2.5},
        phase=1.0,
    ),
    "stick_slip_mu_0.5": Scene(
        {"mu": 0.5, "r": 0.1, "omega": 0.36, "f1": 2.7, "f2": 1.4, "delta": 0.3, "omega0": 2.5},
        phase=4.0,
    ),
    "stick_slip_mu_0.5_fast": Scene(
        {"mu": 0.5, "r": 0.3, "omega": 0.51, "f1": 2.8, "f2": 1.8, "delta": 0.0, "mbar": 1.0},
        initial=(0.0, 0.5, 0.1, 0.0), phase=1.0,
    ),
    "stick_slip_mu_0.9": Scene(
        {"mu": 0.9, "r": 0.5, "omega": 0.21, "f1": 3.9, "f2": 2.2, "omega0": 2.5, "mbar": 0.2},
        phase=1.0,
    ),
    "stick_slip_mu_0.9_fast": Scene(
        {"mu": 0.9, "r": 0.3, "omega": 0.74, "f1": 1.7, "f2": 2.3, "delta": -0.2, "mbar": 0.2},
        initial=(0.0, 0.5, 0.3, 0.0), phase=2.0,
    ),
    "stick_slip_mu_1.9": Scene(
        {"mu": 1.9, "r": 0.3, "omega": 0.25, "f1": 2.7, "f2": 2.1, "omega0": 2.5}
    ),
    # stick follows the chatter at once: impacts that stick, with a ratio other than r
    "chatter_into_stick_mu_0.5": Scene(
        {"mu": 0.5, "r": 0.1, "omega": 0.35, "f1": 3.7, "f2": 2.6, "omega0": 1.0, "mbar": 0.2},
        phase=4.0,
    ),
    "chatter_into_stick_mu_0.9": Scene(
        {"mu": 0.9, "r": 0.7, "omega": 0.39, "f1": 3.3, "f2": 1.7, "delta": 0.1, "omega0": 2.5,
         "mbar": 0.2},
    ),
    # slip in contact across sin x1 = 0
    "crossing_mu_0.3": Scene(
        {"mu": 0.3, "r": 0.2, "omega": 0.51, "f1": 2.8, "f2": 2.3, "delta": -0.2, "mbar": 1.0},
        initial=(0.0, 0.5, 0.3, 0.0),
    ),
    "crossing_mu_0.5": Scene(
        {"mu": 0.5, "r": 0.3, "omega": 0.3, "f1": 2.5, "f2": 2.7, "delta": -0.2, "omega0": 1.0,
         "mbar": 2.0},
        initial=(0.0, 0.5, 0.3, 0.0),
    ),
    "crossing_mu_0.9": Scene(
        {"mu": 0.9, "r": 0.7, "omega": 0.55, "f1": 3.7, "f2": 2.1, "delta": -0.2, "omega0": 2.5,
         "mbar": 0.2},
        initial=(0.0, 0.5, 0.3, 0.0), phase=2.0,
    ),
    # direct contact
    "direct_omega_0.3": Scene(
        {"omega": 0.3, "r": 0.6, "f1": 2.0, "delta": 0.3}, contact="direct"
    ),
    "direct_omega_0.5": Scene(
        {"omega": 0.5, "r": 0.6, "f1": 2.0, "delta": 0.3}, contact="direct"
    ),
    "bouncing_ball_0.5": Scene(
        _BALL | {"f1": 9.8, "r": 0.5, "delta": 1.0},
        initial=(0.0, 0.0, 0.0, 0.0), contact="direct", times=(0.5, 1.0, 1.5, 2.0),
    ),
    "bouncing_ball_0.7": Scene(
        _BALL | {"f1": 9.81, "r": 0.7, "delta": 1.0},
        initial=(0.0, 0.0, 0.0, 0.0), contact="direct", times=(0.5, 1.0, 2.0, 3.0),
    ),
    # walls
    "wall_at_rest_friction": Scene(_WALL | {"mu": 0.3}),
    "wall_at_rest_sticking": Scene(_WALL | {"mu": 1.8}),
    "wall_moving": Scene(_WALL | {"f2": 0.3}),
    "wall_moving_friction": Scene(_WALL | {"f2": 0.3, "mu": 0.3}),
    "wall_moving_direct": Scene(_WALL | {"f2": 0.3, "delta": 0.2}, contact="direct"),
    # rest, under a constant and a changing load; a Painleve point
    "rest_constant_load": Scene(
        {"omega": 0.0, "mu": 0.5, "f1": 2.0, "f2": -0.2, "r": 0.5, "delta": 0.3},
        times=(5.0, 10.0, 20.0, 40.0),
    ),
    "rest_changing_load": Scene(
        {"mu": 0.5, "r": 0.7, "omega": 0.37, "f1": 2.2, "f2": 0.7, "delta": -0.2, "omega0": 1.0,
         "mbar": 0.2},
        initial=(0.0, 0.5, 0.3, 0.0), phase=4.0,
    ),
    "painleve": Scene(
        {"mu": 1.5, "r": 0.1, "omega": 0.9, "f1": 0.9, "f2": 3.0, "mbar": 0.05, "omega0": 0.1,
         "delta": 0.4},
        initial=(0.0, 0.5, 0.1, 0.0),
    ),
    # one slip direction is forbidden, but friction holds the tip
    "stick_beside_painleve": Scene(
        {"mu": 1.9, "r": 0.3, "omega": 0.9, "f1": 0.9, "f2": 3.0, "mbar": 0.2}, phase=4.0
    ),
    # starts at g = 0: u > 0, u < 0, u = 0 with g'' > 0 and < 0, with friction (sin x1 = 0),
    # and u = g'' = 0 with g''' > 0 and < 0
    "start_approaching": Scene({}, initial=(0.0, 0.5, -0.5, -0.3)),
    "start_separating": Scene({}, initial=(0.0, -0.2, -0.5, 0.3)),
    "start_touching_pressed": Scene({"f1": 3.0, "f2": 1.0}, initial=(0.0, 0.1, -0.5, 0.1)),
    "start_touching_apart": Scene({}, initial=(0.0, 0.1, -0.5, 0.1)),
    "start_touching_friction": Scene(
        {"f1": 3.0, "f2": 1.0, "mu": 0.3, "r": 0.3}, initial=(0.0, 0.1, -0.5, 0.1)
    ),
    "start_touching_at_rest": Scene(
        {"f1": 3.0, "f2": 1.0, "mu": 0.3, "r": 0.3}, initial=(0.0, 0.0, -0.5, 0.0)
    ),
    "start_unloaded_pressed": Scene(_EVEN, initial=(0.5, -0.1, 0.0, -0.1), contact="direct"),
    "start_unloaded_apart": Scene(_EVEN, initial=(0.5, 0.1, 0.0, 0.1), contact="direct"),
}  # fmt: skip
