"""Maps of single impacts: regimes, effective restitution, loss; and how well they are known.

With a constant r the laws are homogeneous of degree one in the velocities, so that the angle x1 and
the ratio x1'/u determine an impact, with x2' = x1' cos x1 - u. Else u is given, too. With
k = cos x1 + mu |sin x1| and x1' cos x1 > 0, slip ends within the impact while
x1'/u < (1 + r) k/(mbar + k cos x1).

Source: theory page, section 4; Han, Jin & Hu (2004), section 2. All quantities dimensionless.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import COULOMB_LAWS, Regime
from .arguments import axis, count, number, reject, vector
from .errors import Interrupted
from .impact_results import ImpactAgreement, ImpactRegimes
from .impacts import MOST_STEPS, impact
from .interruption import interruptible
from .machine_kinds import need_system
from .restitution import RestitutionCurve
from .system import System

# Cells of a map along each axis. Even: no column has sin x1 = 0, no row has x1' = 0: there the
# regimes differ from those on both sides.
_CELLS = 400
# The default range of the velocity ratio: so much wider than the borders of the regimes, at most so
# wide. It is part of what users see: narrower, it does not show every regime of these systems;
# wider, regimes near 0 fall into few cells.
_WIDEST = 10.0
_MARGIN = 1.25


@interruptible
def impact_regimes(
    system: System,
    *,
    x1: ArrayLike | None = None,
    velocity_ratio: ArrayLike | None = None,
    steps: int | None = None,
    approach_velocity: float | None = None,
) -> ImpactRegimes:
    """Resolve the impacts of a system on a grid of angle and velocity ratio.

    Parameters
    ----------
    system
        The system; its gap and its drive have no influence.
    x1
        Angles, increasing; by default the centres of 400 cells from -pi/2 to pi/2.
    velocity_ratio
        x1'/u, increasing; by default the centres of 400 cells on both sides of 0, wide enough for
        every regime that the system has (up to 10 where a regime has no upper limit).
    steps
        As in ``impact``.
    approach_velocity
        u of all impacts, > 0. Needed where the restitution depends on it, and without influence
        where it is a number.

    Returns
    -------
    ImpactRegimes

    Raises
    ------
    ParameterError
        If an axis is not a one-dimensional array of finite numbers, at least one, ``steps`` or
        ``approach_velocity`` is out of range, or the latter is needed and not given.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1, friction=0.3)
    >>> import numpy as np
    >>> grid = np.linspace(-1, 1, 11)
    >>> regimes = vi.impact_regimes(system, x1=grid, velocity_ratio=grid)
    >>> regimes.regime.shape
    (11, 11)
    """
    need_system(system)
    u, at = _approach(system, approach_velocity)
    angles = _cells(np.pi / 2) if x1 is None else axis("x1", x1)
    if velocity_ratio is None:
        ratios = _cells(_widest_ratio(at))
    else:
        ratios = axis("velocity_ratio", velocity_ratio)
    v1 = ratios[:, np.newaxis]
    table = impact(at, x1=angles, v1=v1, v2=v1 * at.slope(angles) - 1.0, steps=steps)
    if not system.is_wall:
        before = 0.5 * table["v1_pre"] ** 2 + 0.5 * table["v2_pre"] ** 2 / system.mass_ratio
        loss = table["energy_loss"] / before
    else:
        loss = np.full(table.shape, np.nan)
    return ImpactRegimes(
        system=system,
        approach_velocity=u,
        x1=angles,
        velocity_ratio=ratios,
        regime=table["regime"].copy(),
        restitution=table["effective_restitution"].copy(),
        energy_loss=loss,
    )


def _cells(limit: float) -> NDArray[np.float64]:
    """Return the centres of equal cells from -limit to limit."""
    return limit * (2.0 * np.arange(_CELLS) + 1.0 - _CELLS) / _CELLS


def _approach(system: System, given: float | None) -> tuple[float, System]:
    """Return the approach velocity of all impacts, and the system with its restitution there.

    With that number for r the impacts are homogeneous, and those of u = 1 stand for them.
    """
    allowed = "a finite number > 0"
    curve = system.restitution
    if given is None and isinstance(curve, RestitutionCurve):
        reject("approach_velocity", given, f"{allowed}, on which the restitution depends")
    u = 1.0 if given is None else number("approach_velocity", given, allowed)
    if not u > 0.0:
        reject("approach_velocity", u, allowed)
    is_curve = isinstance(curve, RestitutionCurve)
    return u, system.replace(restitution=float(curve(u))) if is_curve else system


def _widest_ratio(system: System) -> float:
    """Return a ratio beyond which impacts with x1' cos x1 > 0 only slip.

    There P* = (1 + r) P_f means x1'/u = (1 + r) k/(mbar + k cos x1).
    """
    x1 = np.linspace(0.0, np.pi / 2, 200)
    slope = system.slope(x1)
    k = slope + system.friction * system.tip(x1)
    slows = system.mass_ratio + k * slope
    border = np.minimum((1.0 + system.restitution) * k, _WIDEST * slows) / slows
    return min(_MARGIN * float(border.max()), _WIDEST)


@interruptible
def impact_agreement(
    system: System,
    *,
    steps: ArrayLike = (30, 100, 300, 1000, 3000),
    cells: int = 31,
    approach_velocity: float | None = None,
) -> ImpactAgreement:
    """Compare the exact impulse path with the incremental integration, regime by regime.

    The impacts lie on a grid of ``cells`` x ``cells`` angles and velocity ratios over the range of
    ``impact_regimes``; with an odd number its middle column has sin x1 = 0, which is frictionless.

    Parameters
    ----------
    system
        The system; the laws compared are those of ``vibroimpact._core.COULOMB_LAWS``.
    steps
        At least two different numbers of steps.
    cells
        Grid points along each axis, at least 2.
    approach_velocity
        As in ``impact_regimes``.

    Returns
    -------
    ImpactAgreement

    Raises
    ------
    ParameterError
        If an argument is out of range.
    Interrupted
        After Ctrl-C; ``.result`` is the ImpactAgreement, differences not reached being NaN.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1, friction=0.3)
    >>> agreement = vi.impact_agreement(system, steps=(30, 100), cells=5)
    >>> agreement.difference.shape
    (3, 6, 2)
    """
    need_system(system)
    u, at = _approach(system, approach_velocity)
    cells = count("cells", cells, least=2)
    numbers = [
        count("steps", number, least=1, most=MOST_STEPS)
        for number in vector("steps", steps).tolist()
    ]
    if len(set(numbers)) < 2:
        reject("steps", steps, "at least two different numbers")
    # An odd number of cells puts the middle of one at 0.
    middles = (2.0 * np.arange(cells) + 1.0 - cells) / cells
    x1, v1 = np.pi / 2 * middles, _widest_ratio(at) * middles[:, np.newaxis]
    v2 = v1 * at.slope(x1) - 1.0
    difference: NDArray[np.float64] = np.full(
        (len(COULOMB_LAWS), len(Regime), len(numbers)), np.nan
    )
    counts = np.zeros(len(Regime), np.int64)
    interrupted = False
    try:
        for row, law in enumerate(COULOMB_LAWS):
            under = at.replace(law=law)
            exact = impact(under, x1=x1, v1=v1, v2=v2)
            counts = np.array([np.count_nonzero(exact["regime"] == regime) for regime in Regime])
            for column, number in enumerate(numbers):
                off = np.mean([_difference(under, exact, near) for near in _near(number)], axis=0)
                for regime in Regime:
                    chosen = exact["regime"] == regime
                    if chosen.any():
                        difference[row, regime, column] = off[chosen].mean()
    except KeyboardInterrupt:
        interrupted = True
    result = ImpactAgreement(
        system=system,
        approach_velocity=u,
        laws=COULOMB_LAWS,
        steps=np.array(numbers),
        difference=difference,
        impacts=counts,
    )
    if interrupted:
        raise Interrupted("interrupted between the laws", result, holds="what is compared")
    return result


def _near(number: int) -> NDArray[np.int64]:
    """Return eight numbers of steps within 10 % of the given one, at least 1."""
    places = np.round(number * (0.9 + 0.2 * (np.arange(8) + 0.5) / 8)).astype(np.int64)
    return np.clip(places, 1, MOST_STEPS)


def _difference(system: System, exact: NDArray[np.void], steps: int) -> NDArray[np.float64]:
    """Return the larger difference of the two velocities after each impact; u is 1."""
    x1, v1, v2 = exact["x1"], exact["v1_pre"], exact["v2_pre"]
    stepped = impact(system, x1=x1, v1=v1, v2=v2, steps=int(steps))
    result: NDArray[np.float64] = np.maximum(
        np.abs(stepped["v1_post"] - exact["v1_post"]), np.abs(stepped["v2_post"] - exact["v2_post"])
    )
    return result
