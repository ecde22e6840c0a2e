"""Maps of single impacts: regimes, effective restitution, loss; and how well they are known.

The laws are homogeneous of degree one in the velocities, so that the angle x1 and the ratio x1'/u
say all of an impact, with x2' = x1' cos x1 - u. With k = cos x1 + mu |sin x1| and x1' cos x1 > 0,
slip ends within the impact while x1'/u < (1 + r) k/(mbar + k cos x1).

Source: docs/theory.md, section 4; Han, Jin & Hu (2004), section 2. All quantities dimensionless.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import Regime
from .arguments import axis, count, reject
from .errors import Interrupted
from .fixed_arrays import FixedArrays
from .impacts import MOST_STEPS, impact
from .system import System

LAWS = ("poisson", "newton", "energetic")
"""The laws that walk along the impulse; the incremental-impulse integrator knows them, too."""

# Cells of a map along each axis. Even: no column has sin x1 = 0, no row x1' = 0, where the
# regimes are others than on either side.
_CELLS = 400
_WIDEST = 10.0
_MARGIN = 1.25


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ImpactRegimes(FixedArrays):
    """What every impact of a system does, on a grid; all arrays are read-only.

    The laws are homogeneous: twice the velocities, twice the outcome. So the angle x1 and the
    velocity ratio x1'/u say all, with x2' = x1' cos x1 - u.

    Attributes
    ----------
    system
        The system.
    x1
        Angles, shape (n,).
    velocity_ratio
        x1'/u, shape (m,).
    regime
        Value of ``Regime``, or -1 for an impact without outcome, shape (m, n).
    restitution
        Effective (kinematic) coefficient of restitution -u_post/u, shape (m, n); NaN without
        outcome.
    energy_loss
        Part of the kinetic energy before the impact, x1'^2/2 + x2'^2/(2 mbar), that is lost, shape
        (m, n); negative where the law creates energy. NaN without outcome, and everywhere for
        mbar = 0: a wall that moves has no energy to compare with.
    """

    system: System
    x1: NDArray[np.float64]
    velocity_ratio: NDArray[np.float64]
    regime: NDArray[np.int64]
    restitution: NDArray[np.float64]
    energy_loss: NDArray[np.float64]

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for name in ("x1", "velocity_ratio", "regime", "restitution", "energy_loss"):
            getattr(self, name).flags.writeable = False

    @property
    def spread(self) -> tuple[float, float]:
        """Smallest and largest effective restitution on the grid; NaN if no impact has one."""
        found = self.restitution[np.isfinite(self.restitution)]
        if found.size == 0:
            return np.nan, np.nan
        return float(found.min()), float(found.max())

    def __repr__(self) -> str:
        """Say what the grid is and what is found on it."""
        low, high = self.spread
        rows, columns = self.regime.shape
        return (
            f"ImpactRegimes({columns} angles x {rows} velocity ratios, law={self.system.law!r}, "
            f"-u_post/u {low:.3g} ... {high:.3g})"
        )


def impact_regimes(
    system: System,
    *,
    x1: ArrayLike | None = None,
    velocity_ratio: ArrayLike | None = None,
    steps: int | None = None,
) -> ImpactRegimes:
    """Resolve the impacts of a system on a grid of angle and velocity ratio.

    Parameters
    ----------
    system
        The system; its gap and its drive play no part.
    x1
        Angles, increasing; by default the centres of 400 cells from -pi/2 to pi/2.
    velocity_ratio
        x1'/u, increasing; by default the centres of 400 cells on both sides of 0, wide enough for
        every regime that the system has (up to 10 where one of them reaches to infinity).
    steps
        As in ``impact``.

    Returns
    -------
    ImpactRegimes

    Raises
    ------
    ParameterError
        If an axis is not a one-dimensional array of finite numbers, at least one, or ``steps`` is
        out of range.
    """
    if not isinstance(system, System):
        reject("system", system, "a vibroimpact.System")
    angles = _cells(np.pi / 2) if x1 is None else axis("x1", x1)
    if velocity_ratio is None:
        ratios = _cells(_widest_ratio(system))
    else:
        ratios = axis("velocity_ratio", velocity_ratio)
    cos = np.ones_like(angles) if system.contact == "direct" else np.cos(angles)
    v1 = ratios[:, np.newaxis]
    table = impact(system, x1=angles, v1=v1, v2=v1 * cos - 1.0, steps=steps)
    if system.mass_ratio > 0.0:
        before = 0.5 * table["v1_pre"] ** 2 + 0.5 * table["v2_pre"] ** 2 / system.mass_ratio
        loss = table["energy_loss"] / before
    else:
        loss = np.full(table.shape, np.nan)
    return ImpactRegimes(
        system=system,
        x1=angles,
        velocity_ratio=ratios,
        regime=table["regime"].copy(),
        restitution=table["effective_restitution"].copy(),
        energy_loss=loss,
    )


def _cells(limit: float) -> NDArray[np.float64]:
    """Return the centres of equal cells from -limit to limit."""
    return limit * (2.0 * np.arange(_CELLS) + 1.0 - _CELLS) / _CELLS


def _widest_ratio(system: System) -> float:
    """Return a ratio beyond which impacts with x1' cos x1 > 0 only slip.

    There P* = (1 + r) P_f means x1'/u = (1 + r) k/(mbar + k cos x1), k = cos x1 + mu |sin x1|.
    """
    x1 = np.linspace(0.0, np.pi / 2, 200)
    k = np.cos(x1) + system.friction * np.sin(x1)
    slows = system.mass_ratio + k * np.cos(x1)
    border = np.minimum((1.0 + system.restitution) * k, _WIDEST * slows) / slows
    return min(_MARGIN * float(border.max()), _WIDEST)


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ImpactAgreement(FixedArrays):
    """How far the exact walk and the incremental-impulse integrator are apart; read-only arrays.

    Attributes
    ----------
    system
        The system; its own law plays no part.
    laws
        Names of the laws, l of them.
    steps
        Numbers of steps, shape (k,); the last and largest step is the ``1/steps``-th part of the
        impulse.
    difference
        The larger absolute difference, of x1' or of x2', after the impact, relative to u: its mean
        over the impacts of a regime and over eight numbers of steps within 10 % (where in a step
        an impact ends is chance), shape (l, 6, k), by value of ``Regime``; NaN without impacts, and
        where the steps leave the range of floats (mass ratios near 1e-300).
    impacts
        Number of impacts of each regime, the same under every law, shape (6,).
    """

    system: System
    laws: tuple[str, ...]
    steps: NDArray[np.int64]
    difference: NDArray[np.float64]
    impacts: NDArray[np.int64]

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for name in ("steps", "difference", "impacts"):
            getattr(self, name).flags.writeable = False

    @property
    def order(self) -> NDArray[np.float64]:
        """Order of convergence between the fewest and the most steps, shape (l, 6)."""
        fewest, most = int(np.argmin(self.steps)), int(np.argmax(self.steps))
        ratio = self.difference[:, :, fewest] / self.difference[:, :, most]
        result: NDArray[np.float64] = np.log(ratio) / np.log(self.steps[most] / self.steps[fewest])
        return result

    def __repr__(self) -> str:
        """Say how many impacts are compared, and how well they agree."""
        known = self.order[~np.isnan(self.order)]
        order = f"{known.min():.2f} ... {known.max():.2f}" if len(known) else "not known"
        return (
            f"ImpactAgreement({self.impacts.sum()} impacts, laws {', '.join(self.laws)}, "
            f"order {order})"
        )


def impact_agreement(
    system: System, *, steps: ArrayLike = (30, 100, 300, 1000, 3000), cells: int = 31
) -> ImpactAgreement:
    """Compare the exact walk with the incremental-impulse integrator, regime by regime.

    The impacts lie on a grid of ``cells`` x ``cells`` angles and velocity ratios over the range of
    ``impact_regimes``; with an odd number its middle column has sin x1 = 0, which is frictionless.

    Parameters
    ----------
    system
        The system; the laws compared are those of ``LAWS``.
    steps
        At least two different numbers of steps.
    cells
        Grid points along each axis, at least 2.

    Returns
    -------
    ImpactAgreement

    Raises
    ------
    ParameterError
        If an argument is out of range.
    Interrupted
        After Ctrl-C; ``.result`` is the ImpactAgreement, differences not reached being NaN.
    """
    if not isinstance(system, System):
        reject("system", system, "a vibroimpact.System")
    count("cells", cells, least=2)
    numbers = [
        count("steps", int(number) if number.is_integer() else number, least=1, most=MOST_STEPS)
        for number in axis("steps", steps).tolist()
    ]
    if len(set(numbers)) < 2:
        reject("steps", steps, "at least two different numbers")
    # An odd number of cells puts the middle of one at 0.
    middles = (2.0 * np.arange(cells) + 1.0 - cells) / cells
    x1, v1 = np.pi / 2 * middles, _widest_ratio(system) * middles[:, np.newaxis]
    v2 = v1 * (np.ones(cells) if system.contact == "direct" else np.cos(x1)) - 1.0
    difference: NDArray[np.float64] = np.full((len(LAWS), len(Regime), len(numbers)), np.nan)
    counts = np.zeros(len(Regime), np.int64)
    interrupted = False
    try:
        for row, law in enumerate(LAWS):
            under = system.replace(law=law)
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
        laws=LAWS,
        steps=np.array(numbers),
        difference=difference,
        impacts=counts,
    )
    if interrupted:
        raise Interrupted("interrupted between the laws; .result holds what is compared", result)
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
