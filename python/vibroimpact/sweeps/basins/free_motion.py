"""Motions that never strike again: a bound of the gap over all times of a free motion.

Without contact each body is a sum of its steady response, of amplitude
|f|/|w^2 - omega^2 + 2 i zeta w omega|, and of its free oscillation, whose energy does not grow. So
|x1| <= X1 and |x2| <= X2 for ever, and where sin X1 + X2 stays below the gap (X1 + X2 in direct
contact) the bodies never meet. If the bound is not below the gap, contact may occur after any time:
with frequencies without a common period every combination of phases comes up.
"""

import numpy as np
from numpy.typing import NDArray

from ...system import System


def never_strike(system: System, sections: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell which free motions are bounded away from contact for ever.

    Parameters
    ----------
    system
        The system.
    sections
        States x1, v1, x2, v2 at the start of a drive period, shape (k, 4).

    Returns
    -------
    array of bool, shape (k,)
        True is proved; False means that contact is not excluded.
    """
    omega, turn = system.drive_frequency, np.exp(1j * system.phase)
    reaches = []
    for place, w, zeta, f in (
        (0, system.frequency_ratio, system.pendulum_damping, system.moment_amplitude),
        (2, 1.0, system.oscillator_damping, system.force_amplitude),
    ):
        stiffness = w * w - omega * omega + 2j * zeta * w * omega
        if w == 0.0 or (stiffness == 0.0 and f != 0.0):
            # The angle of a free rotor, and a motion at resonance, are not bounded.
            return np.zeros(len(sections), dtype=bool)
        steady = f * turn / stiffness if f != 0.0 else 0.0
        x = sections[:, place] - np.real(steady)
        v = sections[:, place + 1] - np.real(1j * omega * steady)
        reaches.append(np.abs(steady) + np.hypot(x, v / w))
    # The tip of the pendulum is farthest at a quarter turn; in direct contact it has no limit.
    crest = 0.5 * np.pi if system.contact == "oblique" else np.inf
    tip = system.tip(np.minimum(reaches[0], crest))
    return np.asarray(tip + reaches[1] < system.gap)
