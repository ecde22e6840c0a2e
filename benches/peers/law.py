"""The corrected impact law for the peers, coded again; shares nothing with the core.

Poisson's law on the walk over the normal impulse (docs/theory.md, section 4). Written in plain
arithmetic, so that Numba can compile it and mpmath can run it.
"""

import math
from typing import Any


def walk(mbar: Any, r: Any, mu: Any, cos: Any, sin: Any, v1: Any, v2: Any) -> Any:
    """Velocities after an impact at an angle given by its cosine and sine."""
    friction = mu * abs(sin)
    u = v1 * cos - v2
    # The second leg: held at v1 = 0, or slipping back with s = -sgn(cos x1).
    if abs(cos) <= friction:
        k_after = 0.0 * cos
    elif cos > 0:
        k_after = cos - friction
    else:
        k_after = cos + friction
    if v1 > 0:
        k = cos + friction
    elif v1 < 0:
        k = cos - friction
    else:
        k = k_after
    rate = mbar + k * cos
    stops = friction > 0 and v1 * k > 0
    if stops:
        until_stop = v1 / k
        # u = 0 lies beyond the stop, or is never reached.
        if rate <= 0 or until_stop * rate < u:
            left = -(v2 + mbar * until_stop)
            impulse = (1 + r) * (until_stop + left / (mbar + k_after * cos))
            return -k_after * (impulse - until_stop), v2 + mbar * impulse
        impulse = (1 + r) * u / rate
        if until_stop < impulse:
            return -k_after * (impulse - until_stop), v2 + mbar * impulse
        return v1 - k * impulse, v2 + mbar * impulse
    impulse = (1 + r) * u / rate
    return v1 - k * impulse, v2 + mbar * impulse


def resolve(parameters: dict[str, float], x1: float, v1: float, v2: float) -> tuple[float, float]:
    """Velocities after an impact of a system given by code names."""
    mbar, r, mu = (parameters[name] for name in ("mass_ratio", "restitution", "friction"))
    post: tuple[float, float] = walk(mbar, r, mu, math.cos(x1), math.sin(x1), v1, v2)
    return post
