"""What a fit returns: values with standard errors, what stays open, and whether the model fits."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray

from .. import archive
from ..arguments import count as counted_argument
from ..errors import ParameterError
from ..fixed_arrays import FixedArrays
from ..interruption import interruptible
from ..machine import Machine
from ..made import numbers_of, varied
from ..showing import Facts, Shown, counted
from ..sweeps.machines import machine_from_dict
from ..verbs import verb
from .record import Record, is_heard

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..run_record import AnyRun

Array = NDArray[np.float64]

Verdict = Literal[
    "fits", "systematic residuals", "residuals too large", "not identifiable", "not converged"
]

# Machines that can be drawn at once.
_MOST_SAMPLES = 100_000
# Arrays of a file.
_ARRAYS = ("estimates", "covariance", "standard_errors", "combinations", "combination_errors")
_OF_FIT = (*_ARRAYS, "ranges", "predicted", "sigma")
# Parts of a combination that are less than this part of its largest are not told.
_LEAST_PART = 0.05


@interruptible
class Determined(FixedArrays, Shown):
    """Values of unknowns with their uncertainty: what a `Fit` and `ExpectedErrors` have alike."""

    names: tuple[str, ...]
    estimates: Array
    covariance: Array
    standard_errors: Array
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

        An unknown counts in units of its size (its value at the start of the search, at least 0.1,
        at most its range). A combination is open if its standard error is larger than 1 in these
        units; small parts are left out.
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
        """Return a sentence for each combination that is open."""
        said = []
        for parts, error in zip(self.undetermined, self.combination_errors.tolist(), strict=True):
            mixed = " ".join(f"{part:+.2g} {name}" for name, part in parts.items())
            size = "not at all" if np.isinf(error) else f"to {error:.2g} only"
            said.append(f"determined {size} (in units of the sizes): {mixed}")
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
    combinations, combination_errors
        Combinations that stay open, one in each row, shape (j, k), and their standard errors in
        units of the sizes of the unknowns; ``undetermined`` has them by name.
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

    names: tuple[str, ...]
    estimates: Array
    covariance: Array
    standard_errors: Array
    combinations: Array
    combination_errors: Array
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


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Fit(Determined):
    """A machine found from records of its motion, by ``fit``.

    Attributes
    ----------
    verdict
        ``"fits"``: the residuals are random, and as large as stated. ``"systematic residuals"``:
        they are not random, the model is wrong or the search ended in the wrong place; standard
        errors mean nothing then. ``"residuals too large"``: random, but larger than the stated
        ``sigma``. ``"not identifiable"``: the residuals fit, but some combination of the unknowns
        stays open. ``"not converged"``: no minimum was found.
    reasons
        Sentences on which the verdict rests.
    machine
        The System or Structure with the values found.
    initial
        The start with the values found.
    names
        The unknowns.
    estimates
        The values found, shape (k,); ``values`` has them by name.
    covariance
        Their covariance, shape (k, k), from the derivatives at the minimum: a linear estimate.
    standard_errors
        Shape (k,); ``errors`` has them by name. Infinite where the records say nothing.
    combinations, combination_errors
        Combinations that stay open, one in each row, shape (j, k), and their standard errors in
        units of the sizes of the unknowns; ``undetermined`` has them by name.
    ranges
        Ends (low, high) of the ranges of the unknowns, shape (k, 2); infinite where there is none.
    profile
        Rises of ``chi2`` 2 standard errors below and above each unknown, the others fitted anew,
        shape (k, 2): 4 where the linear estimate of its error holds; infinite where there is no
        machine or motion. None unless the verdict is ``"fits"``, and with a robust loss.
    at_bounds
        Unknowns that ended at an end of their range; their errors are those without it.
    records
        What was fitted.
    predicted
        What the machine predicts of all rows of the records, one after another, shape (n,).
    sigma
        Standard errors that the rows were weighted with, shape (n,): those of the records, or
        estimated from the residuals. Infinite for rows that do not count: of what jumps at impacts
        those so near to one that the fit cannot tell on which side they are.
    chi2, dof
        Sum of the squares of residuals in standard errors, and the number of rows that count less
        that of the unknowns; with a robust loss without outliers, those beyond 4 standard errors.
    probability
        Of so large a ``chi2`` by chance; None if no record has a ``sigma``.
    loss
        The loss.
    steps
        Steps of the search.
    segments
        Times at which the segments of the motion start, in multiple shooting.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=20)
    >>> record = vi.measure(run, "impact_times", noise=0.01)
    >>> guess = system.replace(restitution=0.6, gap=0.4)
    >>> found = vi.fit(record, guess, unknown=["restitution", "gap"], initial=run.initial)
    >>> found.verdict
    'fits'
    >>> abs(found.values["gap"] - 0.5) < 3 * found.errors["gap"]
    True
    """

    verdict: Verdict
    reasons: tuple[str, ...]
    machine: Machine
    initial: tuple[Any, ...]
    names: tuple[str, ...]
    estimates: Array
    covariance: Array
    standard_errors: Array
    combinations: Array
    combination_errors: Array
    ranges: Array
    profile: Array | None
    at_bounds: tuple[str, ...]
    records: tuple[Record, ...]
    predicted: Array
    sigma: Array
    chi2: float
    dof: int
    probability: float | None
    loss: str
    steps: int
    segments: tuple[float, ...]

    def __bool__(self) -> bool:
        """Whether the model fits, with all unknowns determined."""
        return self.verdict == "fits"

    @property
    def residuals(self) -> list[Array]:
        """Measured minus predicted, one array for each record, in the units of the record."""
        return [
            record.values - predicted
            for record, predicted in zip(self.records, self._split(self.predicted), strict=True)
        ]

    @property
    def sigmas(self) -> list[Array]:
        """The standard errors that were used, one array for each record."""
        return self._split(self.sigma)

    def _split(self, rows: Array) -> list[Array]:
        ends = np.cumsum([len(record) for record in self.records])[:-1]
        return list(np.split(rows, ends))

    @cached_property
    def run(self) -> AnyRun:
        """The motion of the machine found, from its start to the end of the records.

        A chaotic motion of many Lyapunov times leaves the fitted one by rounding: ``predicted`` is
        that of the segments.
        """
        end = max(float(record.times[-1]) for record in self.records)
        span = {"initial": self.initial, "time": max(end, 1e-9)}
        simulated: AnyRun = verb("simulate")(self.machine, **span)
        return simulated

    def summary(self) -> str:
        """Return verdict and values with their errors in some lines.

        Examples
        --------
        >>> print(found.summary().splitlines()[0])
        fits: 19 rows, chi2 11.31 of 17 degrees of freedom
        """
        many = counted(sum(map(len, self.records)), "row")
        size = f", chi2 {self.chi2:.4g} of {self.dof} degrees of freedom"
        head = f"{self.verdict}: {many}{'' if self.probability is None else size}"
        bounds = [f"{name} is at an end of its range" for name in self.at_bounds]
        told = [*self.reasons, *bounds, *self._open_in_words()]
        return "\n".join([head, *self._rows(), *told])

    def __str__(self) -> str:
        """The summary."""
        return self.summary()

    def sample(self, count: int, *, seed: int = 0) -> list[Any]:
        """Return machines as the records leave them possible: for bands of uncertainty.

        Their numbers are drawn from the normal distribution of the estimate; outside of the range
        of a number, at its end.

        Parameters
        ----------
        count
            How many.
        seed
            Of the random numbers.

        Raises
        ------
        ParameterError
            If an argument is out of range, or a number is not determined at all.

        Examples
        --------
        >>> [round(machine.gap, 2) for machine in found.sample(2)]
        [0.5, 0.5]
        """
        number = counted_argument("count", count, least=0, most=_MOST_SAMPLES)
        random = np.random.default_rng(counted_argument("seed", seed, least=0))
        for name, error in self.errors.items():
            if np.isinf(error):
                raise ParameterError(f"{name} is not determined: no machines can be drawn")
        size, vectors = np.linalg.eigh(self.covariance)
        factor = vectors * np.sqrt(np.maximum(size, 0.0))
        drawn = self.estimates + random.standard_normal((number, len(size))) @ factor.T
        drawn = np.clip(drawn, *self.ranges.T)
        known = numbers_of(self.machine)
        own = [name for name in self.names if name in known]
        start = [name for name in self.names if name in self.machine._coordinates_by_name]
        if len(own) + len(start) < len(self.names):
            name = next(name for name in self.names if name not in (*own, *start))
            raise ParameterError(
                f"{name} is a number of the function that made the machine, which no file holds: "
                "no machines can be drawn"
            )
        machines = []
        for row in drawn:
            values = dict(zip(self.names, row.tolist(), strict=True))
            machines.append(varied(self.machine, {name: values[name] for name in own}))
        return machines

    def plot(self, **options: Any) -> list[Axes]:
        """Draw prediction beside record, with the residuals, by ``vi.plot.fit``.

        Parameters
        ----------
        **options
            As in ``vi.plot.fit``.

        Returns
        -------
        list of matplotlib.axes.Axes
            Of prediction and residuals.

        Examples
        --------
        >>> [ax.get_xlabel() for ax in found.plot()]
        ['', '$t$']
        """
        axes: list[Axes] = verb("draw")(self, **options)
        return axes

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the fit to ``path`` (.npz, no pickle); ``load`` gives it back bit for bit.

        Examples
        --------
        >>> found.save("fit.npz")
        >>> vi.load("fit.npz").values == found.values
        True
        """
        arrays: dict[str, NDArray[Any]] = {name: getattr(self, name) for name in _OF_FIT}
        if self.profile is not None:
            arrays["profile"] = self.profile
        kinds = []
        for number, record in enumerate(self.records):
            kinds.append([record.kind, record.name])
            arrays |= {f"times_{number}": record.times, f"values_{number}": record.values}
            if record.sigma is not None:
                arrays[f"sigma_{number}"] = record.sigma
        metadata = {
            "system": json.loads(self.machine.to_json()),
            "records": kinds,
            **{name: getattr(self, name) for name in _IN_TEXT},
        }
        archive.write(path, "fit", metadata, arrays)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read a fit written by ``save``.

        Raises
        ------
        ValueError
            If the file is damaged, foreign, or holds something else.

        Examples
        --------
        >>> found.save("fit.npz")
        >>> vi.Fit.load("fit.npz").verdict
        'fits'
        """
        return archive.read(path, {"fit": cls._from_parts})

    @classmethod
    def _from_parts(cls, metadata: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> Self:
        records = []
        for number, (kind, name) in enumerate(metadata["records"]):
            records.append(
                Record(
                    kind,
                    arrays[f"times_{number}"],
                    None if is_heard(kind) else arrays[f"values_{number}"],
                    sigma=arrays.get(f"sigma_{number}"),
                    name=name,
                )
            )
        fields: dict[str, Any] = {name: metadata[name] for name in _IN_TEXT}
        for name in ("reasons", "initial", "names", "at_bounds", "segments"):
            fields[name] = tuples(fields[name])
        fields |= {name: arrays[name] for name in _OF_FIT} | {"profile": arrays.get("profile")}
        machine = machine_from_dict(metadata["system"]).system
        return cls(machine=machine, records=tuple(records), **fields)

    def _facts(self) -> Facts:
        facts: Facts = {"verdict": self.verdict}
        pairs = zip(self.names, self.estimates.tolist(), self.standard_errors.tolist(), strict=True)
        return facts | {name: with_error(value, error) for name, value, error in pairs}

    def __repr__(self) -> str:
        """Say it in one line."""
        pairs = zip(self.names, self.estimates.tolist(), self.standard_errors.tolist(), strict=True)
        told = ", ".join(f"{name} {with_error(value, error)}" for name, value, error in pairs)
        return f"<Fit {self.verdict}: {told}>"


_IN_TEXT = (
    "verdict",
    "reasons",
    "initial",
    "names",
    "at_bounds",
    "chi2",
    "dof",
    "probability",
    "loss",
    "steps",
    "segments",
)


def tuples(given: Any) -> Any:
    """Return lists, at any depth, as tuples."""
    return tuple(map(tuples, given)) if isinstance(given, list) else given


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
