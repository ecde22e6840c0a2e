"""Coefficients of restitution that depend on the approach velocity, and what holds of all."""

from typing import Any

import numpy as np
import pytest

import vibroimpact as vi

TABLE = vi.RestitutionTable([0.05, 0.3, 1.0], [0.9, 0.75, 0.5])
LAW = vi.RestitutionPowerLaw(0.9, 0.05, 0.2)
CURVES = [TABLE, LAW]


def same(one: Any, other: Any) -> bool:
    """Whether two runs have equal bits."""
    tables = ("impacts", "stroboscopic", "events")
    equal = (getattr(one, t).tobytes() == getattr(other, t).tobytes() for t in tables)
    return all(equal) and one.stop_reason == other.stop_reason


def check_product(curve: Any, motion: Any, initial: Any, decay: float) -> None:
    """Compare multipliers and exponents with the determinants of all impacts and of the damping.

    Without friction det(dv+/dv-) = -(r + u dr/du), and g'+/g'- = -r; volumes of the flights shrink
    at the rate ``decay``.
    """
    system, time = motion.system, motion.period
    run = vi.simulate(system, initial=initial, periods=motion.m)
    product = np.exp(-decay * time)
    step = 1e-7
    for u in run.impacts["approach_velocity"]:
        r, slope = curve(u), (curve(u + step) - curve(u - step)) / (2.0 * step)
        product *= r * (r + u * slope)
    assert np.prod(motion.multipliers).real == pytest.approx(product, rel=1e-6)
    exponents = vi.lyapunov_spectrum(system, initial=initial, periods=400).exponents
    assert np.sum(exponents) == pytest.approx(np.log(product) / time, rel=1e-3)
