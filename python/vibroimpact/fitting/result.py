"""What a fit returns: values with standard errors, what stays open, and whether the model fits."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray

from ..archived import Archived
from ..arguments import count as counted_argument
from ..errors import ParameterError
from ..interruption import interruptible
from ..made import numbers_of, varied
from ..showing import Facts, counted
from ..sweeps.machines import machine_from_dict
from ..verbs import verb
from .determined import Determined, with_error
from .record import Record, is_heard

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..run_record import AnyRun

Array = NDArray[np.float64]

Verdict = Literal[
    "fits",
    "systematic residuals",
    "residuals too large",
    "other impacts",
    "not identifiable",
    "not converged",
]

# Machines that can be drawn at once.
_MOST_SAMPLES = 100_000
# Arrays of a file.
_ARRAYS = (
    *("estimates", "covariance", "standard_errors", "sizes", "combinations"),
    "combination_errors",
)
_OF_FIT = (*_ARRAYS, "ranges", "predicted", "sigma")
# A run that ends at its last impact by rounding may lack it.
_JUST_AFTER = 1.0 + 1e-9
_OF_IMPACTS = ("missing_impacts", "extra_impacts")


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Fit(Archived, Determined):
    """A machine found from records of its motion, by ``fit``.

    Unknowns, their values and their errors are as those of `ExpectedErrors`; the errors are linear
    ones, from the derivatives at the minimum.

    Attributes
    ----------
    verdict
        ``"fits"``: the residuals are random, and not larger than stated. ``"systematic
        residuals"``: they are not random, the model is wrong or the search ended in the wrong
        place; standard errors mean nothing then. ``"residuals too large"``: random, but larger than
        the stated ``sigma``; where none is stated, so large that they explain little. ``"other
        impacts"``: the residuals fit, but the motion lacks impacts of the records, or has more.
        ``"not identifiable"``: the residuals fit, but some combination of the unknowns stays open.
        ``"not converged"``: no minimum was found.
    reasons
        Sentences on which the verdict rests.
    machine
        The System or Structure with the values found.
    initial
        The start with the values found.
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
        that of the unknowns; with a robust loss without outliers, those beyond 4 standard errors,
        and without ``missing_impacts``, if these are no more than a quarter of a record.
    probability
        Of so large a ``chi2`` by chance; None if no record has a ``sigma``.
    missing_impacts, extra_impacts
        Times of impacts in the records that the motion lacks, and of impacts of the motion that a
        record of impact times should have, but has not.
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

    _KIND = "fit"
    verdict: Verdict
    reasons: tuple[str, ...]
    machine: Any
    initial: tuple[Any, ...]
    ranges: Array
    profile: Array | None
    at_bounds: tuple[str, ...]
    records: tuple[Record, ...]
    predicted: Array
    sigma: Array
    chi2: float
    dof: int
    probability: float | None
    missing_impacts: Array
    extra_impacts: Array
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

        That is the last row, or the impact that is predicted for it.

        A chaotic motion of many Lyapunov times leaves the fitted one by rounding: ``predicted`` is
        that of the segments.
        """
        end = max(float(record.times[-1]) for record in self.records)
        for record, predicted in zip(self.records, self._split(self.predicted), strict=True):
            if is_heard(record.kind):
                end = max(end, float(predicted.max()) * _JUST_AFTER)
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
        # Where the model does not fit, errors mean nothing, and neither does what they leave open.
        nothing = self.verdict in ("systematic residuals", "not converged")
        told = [*self.reasons, *bounds, *(() if nothing else self._open_in_words())]
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
        ['', 'time $t$']
        """
        axes: list[Axes] = verb("draw")(self, **options)
        return axes

    def _parts(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        names = (*_OF_FIT, *_OF_IMPACTS)
        arrays: dict[str, NDArray[Any]] = {name: getattr(self, name) for name in names}
        if self.profile is not None:
            arrays["profile"] = self.profile
        kinds = []
        for number, record in enumerate(self.records):
            kinds.append([record.kind, record.name, record.resolution])
            arrays |= {f"times_{number}": record.times, f"values_{number}": record.values}
            if record.sigma is not None:
                arrays[f"sigma_{number}"] = record.sigma
        metadata = {
            "system": json.loads(self.machine.to_json()),
            "records": kinds,
            **{name: getattr(self, name) for name in _IN_TEXT},
        }
        return metadata, arrays

    @classmethod
    def _from_parts(cls, metadata: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> Self:
        records = []
        for number, (kind, name, resolution) in enumerate(metadata["records"]):
            records.append(
                Record(
                    kind,
                    arrays[f"times_{number}"],
                    None if is_heard(kind) else arrays[f"values_{number}"],
                    sigma=arrays.get(f"sigma_{number}"),
                    resolution=resolution,
                    name=name,
                )
            )
        fields: dict[str, Any] = {name: metadata[name] for name in _IN_TEXT}
        for name in ("reasons", "initial", "names", "at_bounds", "segments"):
            fields[name] = tuples(fields[name])
        fields |= {name: arrays[name] for name in _OF_FIT} | {"profile": arrays.get("profile")}
        fields |= {name: arrays.get(name, np.zeros(0)) for name in _OF_IMPACTS}
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
