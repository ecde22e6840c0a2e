"""Maps of single impacts as results: regimes, and how well the laws are known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ._core import Regime
from .fixed_arrays import FixedArrays
from .interruption import interruptible
from .showing import Facts, Shown
from .system import System
from .verbs import verb

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ImpactRegimes(FixedArrays, Shown):
    """What every impact of a system does, on a grid; all arrays are read-only.

    The laws are homogeneous: twice the velocities, twice the outcome. So the angle x1 and the
    velocity ratio x1'/u determine an impact, with x2' = x1' cos x1 - u. A restitution that depends
    on u is taken at one u.

    Attributes
    ----------
    system
        The system.
    approach_velocity
        u of all impacts; without influence where the restitution is a number.
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

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1, friction=0.3)
    >>> import numpy as np
    >>> grid = np.linspace(-1, 1, 11)
    >>> regimes = vi.impact_regimes(system, x1=grid, velocity_ratio=grid)
    >>> sorted(vi.Regime(int(code)).name for code in np.unique(regimes.regime))[-1]
    'SLIP'
    """

    system: System
    approach_velocity: float
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

    def plot(self, **options: Any) -> list[Axes]:
        """Draw the maps of regime, restitution and energy loss, by ``vi.plot.impact_regimes``.

        Parameters
        ----------
        **options
            As in ``vi.plot.impact_regimes``.

        Returns
        -------
        list of matplotlib.axes.Axes

        Examples
        --------
        >>> len(regimes.plot())
        3
        """
        axes: list[Axes] = verb("draw")(self, **options)
        return axes

    def _facts(self) -> Facts:
        low, high = self.spread
        rows, columns = self.regime.shape
        shares = {each.name.lower(): float(np.mean(self.regime == each.value)) for each in Regime}
        return {
            "grid": f"{columns} angles, {rows} velocity ratios",
            "law": self.system.law,
            "restitution -u_post/u": f"{low:.6g} to {high:.6g}",
            **{name: f"{share:.1%}" for name, share in shares.items() if share > 0.0},
        }

    def __repr__(self) -> str:
        """Say what the grid is and what is found on it."""
        low, high = self.spread
        rows, columns = self.regime.shape
        return (
            f"ImpactRegimes({columns} angles x {rows} velocity ratios, law={self.system.law!r}, "
            f"-u_post/u {low:.3g} ... {high:.3g})"
        )


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ImpactAgreement(FixedArrays, Shown):
    """Differences between exact impulse path and incremental integration; read-only arrays.

    Attributes
    ----------
    system
        The system; its own law has no influence.
    approach_velocity
        As in `ImpactRegimes`.
    laws
        Names of the laws, l of them.
    steps
        Numbers of steps, shape (k,); the last and largest step is the ``1/steps``-th part of the
        impulse.
    difference
        The larger absolute difference, of x1' or of x2', after the impact, relative to u: its mean
        over the impacts of a regime and over eight numbers of steps within 10 % (the place in a
        step at which an impact ends is random), shape (l, 6, k), by value of ``Regime``; NaN
        without impacts, and where the steps leave the range of floats (mass ratios near 1e-300).
    impacts
        Number of impacts of each regime, the same under every law, shape (6,).

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1, friction=0.3)
    >>> agreement = vi.impact_agreement(system, steps=(30, 100), cells=5)
    >>> agreement.steps
    array([ 30, 100])
    """

    system: System
    approach_velocity: float
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

    def plot(self, **options: Any) -> list[Axes]:
        """Draw the differences against the step, by ``vi.plot.impact_agreement``.

        Parameters
        ----------
        **options
            As in ``vi.plot.impact_agreement``.

        Returns
        -------
        list of matplotlib.axes.Axes

        Examples
        --------
        >>> len(agreement.plot())
        3
        """
        axes: list[Axes] = verb("draw")(self, **options)
        return axes

    def _facts(self) -> Facts:
        order = self.order
        known = order[~np.isnan(order)]
        return {
            "impacts": int(self.impacts.sum()),
            "laws": ", ".join(self.laws),
            "order": f"{known.min():.2f} to {known.max():.2f}" if len(known) else "not known",
        }

    def __repr__(self) -> str:
        """Say how many impacts are compared, and how well they agree."""
        known = self.order[~np.isnan(self.order)]
        order = f"{known.min():.2f} ... {known.max():.2f}" if len(known) else "not known"
        return (
            f"ImpactAgreement({self.impacts.sum()} impacts, laws {', '.join(self.laws)}, "
            f"order {order})"
        )
