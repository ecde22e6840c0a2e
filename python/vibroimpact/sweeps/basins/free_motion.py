"""Motions that never strike again: a bound of the gap over all times of a free motion.

Without contact each body is a sum of its equilibrium c/w^2, its steady response, of amplitude
|f|/|w^2 - omega^2 + 2 i zeta w omega|, and its free oscillation, whose energy does not grow. So
each stays within a distance X of its equilibrium for ever. Where the highest place of the tip, less
the lowest of body 2, stays below the gap, the bodies never meet. If the bound is not below the gap,
contact may occur after any time: with frequencies without a common period every combination of
phases comes up.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...system import System


def never_strike(system: Any, sections: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell which free motions are bounded away from contact for ever.

    Parameters
    ----------
    system
        The system; of a structure nothing is proved.
    sections
        States x1, v1, x2, v2 at the start of a drive period, shape (k, 4).

    Returns
    -------
    array of bool, shape (k,)
        True is proved; False means that contact is not excluded.
    """
    if not isinstance(system, System):
        return np.zeros(len(sections), dtype=bool)
    omega, turn = system.drive_frequency, np.exp(1j * system.phase)
    ranges = []
    for place, w, zeta, f, c in (
        (
            0,
            system.frequency_ratio,
            system.pendulum_damping,
            system.moment_amplitude,
            system.static_moment,
        ),
        (2, 1.0, system.oscillator_damping, system.force_amplitude, system.static_force),
    ):
        stiffness = w * w - omega * omega + 2j * zeta * w * omega
        if w == 0.0 or (stiffness == 0.0 and f != 0.0) or (w * w == 0.0 and c != 0.0):
            # The angle of a free rotor, and a motion at resonance, are not bounded.
            return np.zeros(len(sections), dtype=bool)
        steady = f * turn / stiffness if f != 0.0 else 0.0
        middle = c / (w * w) if c != 0.0 else 0.0
        x = sections[:, place] - middle - np.real(steady)
        v = sections[:, place + 1] - np.real(1j * omega * steady)
        reach = np.abs(steady) + np.hypot(x, v / w)
        ranges.append((middle - reach, middle + reach))
    (lowest, highest), (low_2, _) = ranges
    tip = np.maximum(system.tip(lowest), system.tip(highest))
    if system.contact == "oblique":
        # Some angle of the range is a quarter turn, where the tip is farthest.
        first, last = ((end / np.pi - 0.5) / 2.0 for end in (lowest, highest))
        tip[np.floor(last) >= np.ceil(first)] = 1.0
    return np.asarray(tip - low_2 < system.gap)
