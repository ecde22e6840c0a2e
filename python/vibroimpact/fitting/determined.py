"""Values of unknowns with their uncertainty: what a fit has, and what a plan of one expects."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..fixed_arrays import FixedArrays
from ..interruption import interruptible
from ..showing import Facts, Shown, counted

Array = NDArray[np.float64]

# Parts of a combination that are less than this part of its largest are not told.
_LEAST_PART = 0.05


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Determined(FixedArrays, Shown):
    """Values of unknowns with their uncertainty: what a `Fit` and `ExpectedErrors` have alike."""

    names: tuple[str, ...]
    estimates: Array
    covariance: Array
    standard_errors: Array
    sizes: Array
    combinations: Array
    combination_errors: Array

    def __post_init__(self) -> None:
        """Make all arrays read-only."""
        for value in vars(self).values():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False

    @property
    def values(self) -> dict[str, float]:
        """The values by name."""
        return dict(zip(self.names, self.estimates.tolist(), strict=True))

    @property
    def errors(self) -> dict[str, float]:
        """Their standard errors by name; infinite where the record says nothing."""
        return dict(zip(self.names, self.standard_errors.tolist(), strict=True))

    @property
    def correlation(self) -> Array:
        """Correlations of the unknowns, in the order of ``names``, shape (k, k)."""
        spread = np.sqrt(np.diag(self.covariance))
        spread = np.where(spread > 0.0, spread, 1.0)
        matrix: Array = np.clip(self.covariance / np.outer(spread, spread), -1.0, 1.0)
        np.fill_diagonal(matrix, 1.0)
        return matrix

    @property
    def undetermined(self) -> list[dict[str, float]]:
        """The combinations that the record leaves open: how much of each unknown is in one.

        An unknown counts in units of its size: ``sizes``. That is its value, at the start of the
        search or at its end if it is larger there, and at least 0.1; of a coordinate of the start
        how large it becomes in the motion; and at most the range. A combination is open if its
        standard error is larger than 1 in these units; small parts are left out.
        """
        return [
            {
                name: part
                for name, part in zip(self.names, row.tolist(), strict=True)
                if abs(part) >= _LEAST_PART * np.abs(row).max()
            }
            for row in self.combinations
        ]

    def _rows(self) -> list[str]:
        """Return a line for each unknown."""
        wide = max(map(len, self.names))
        return [
            f"{name:<{wide}} = {with_error(value, error)}"
            for name, value, error in zip(
                self.names, self.estimates.tolist(), self.standard_errors.tolist(), strict=True
            )
        ]

    def _open_in_words(self) -> list[str]:
        """Return a sentence for each combination that is open, and what can be done."""
        said = []
        sizes = dict(zip(self.names, self.sizes.tolist(), strict=True))
        for parts, error in zip(self.undetermined, self.combination_errors.tolist(), strict=True):
            lost = np.isinf(error)
            far = 1.0 if lost else error
            moved = {name: part * far * sizes[name] for name, part in parts.items()}
            if len(moved) == 1:
                ((name, by),) = moved.items()
                known = "nothing" if lost else f"little, +- {abs(by):.2g},"
                said.append(f"the record says {known} about {name}")
                continue
            as_much = (
                "the record stays as it is" if lost else "the record changes within its errors"
            )
            together = ", ".join(f"{name} {by:+.2g}" for name, by in moved.items())
            said.append(f"cannot be told apart: if these change together, {as_much}: {together}")
        if said:
            said.append("fix what you know of these, or measure more")
        return said


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ExpectedErrors(Determined):
    """The errors that a measurement would leave, by ``expected_errors``.

    Attributes
    ----------
    names
        The unknowns.
    estimates
        Their values in the run, shape (k,); ``values`` has them by name.
    covariance
        Inverse of the Fisher matrix, shape (k, k).
    standard_errors
        Shape (k,); ``errors`` has them by name. Infinite where the measurement says nothing.
    sizes
        What counts as a large change of each unknown, shape (k,).
    combinations, combination_errors
        Combinations that stay open, one in each row, shape (j, k), and their standard errors in
        units of ``sizes``; ``undetermined`` has them by name.
    rows
        Number of rows of the measurement.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=20)
    >>> plan = vi.measure(run, "impact_times", noise=0.01)
    >>> expected = vi.expected_errors(run, plan, unknown=["restitution", "gap"])
    >>> expected
    <ExpectedErrors of 19 rows: restitution 0.0026, gap 0.00025>
    """

    rows: int

    def summary(self) -> str:
        """Return the values with the expected errors, one a line.

        Examples
        --------
        >>> print(expected.summary())
        restitution = 0.8000 +- 0.0026
        gap         = 0.50000 +- 0.00025
        """
        return "\n".join([*self._rows(), *self._open_in_words()])

    def __str__(self) -> str:
        """The summary."""
        return self.summary()

    def _facts(self) -> Facts:
        return {"rows": self.rows, **{name: f"{e:.2g}" for name, e in self.errors.items()}}

    def __repr__(self) -> str:
        """Say it in one line."""
        told = ", ".join(f"{name} {error:.2g}" for name, error in self.errors.items())
        return f"<ExpectedErrors of {counted(self.rows, 'row')}: {told}>"


def with_error(value: float, error: float) -> str:
    """Return a value with its standard error, both to two digits of the error."""
    if not np.isfinite(error):
        return f"{value:.3g} +- infinity"
    if error <= 0.0:
        return f"{value:.6g} +- 0"
    places = 1 - int(np.floor(np.log10(error)))
    if 0 <= places <= 12:
        return f"{value:.{places}f} +- {error:.{places}f}"
    return f"{value:.6g} +- {error:.2g}"
