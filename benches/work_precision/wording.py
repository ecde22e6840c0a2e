"""Numbers of the tables, with as many digits as they are worth."""

import math


def short_error(value: float) -> str:
    """One digit, e.g. 2e-9; ``none`` for the error of a run that did not reach the end."""
    if not math.isfinite(value):
        return "none"
    digit, exponent = f"{value:.0e}".split("e")
    return f"{digit}e{int(exponent)}" if value else "0"


def times(ratio: float) -> str:
    """Two digits, e.g. 0.78, 5.3, 32, 2,100: a ratio of run times has no more."""
    rounded = float(f"{ratio:.1e}")
    return f"{rounded:,.0f}" if rounded >= 10.0 else f"{rounded:.2g}"
