"""Basins of attraction as a result: which cell belongs to which attractor, and what follows."""

from __future__ import annotations

import dataclasses
import json
import os
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...fixed_arrays import FixedArrays
from ...interruption import interruptible
from ...run import read_only
from ...scales import COLUMN_UNITS, Units
from ...showing import Facts, Shown, counted
from ...tables import frame
from ...verbs import verb
from ..columns import axis_attributes, need_xarray
from ..fields import STATUS, STATUS_NAMES, Field
from ..machines import machine_of
from .attractors import Attractor
from .measures import BasinEntropy, UncertaintyExponent, basin_entropy, uncertainty_exponent
from .region import Follow

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes

ATTRACTOR = Field("attractor", "int16", "number of the attractor, -1 for none", fill=-1)
SETTLING = Field(
    "settling", "int32", "drive periods until its trapping region is entered, -1 for none", fill=-1
)


@interruptible
@dataclass(frozen=True, kw_only=True)
class BasinSettings:
    """The arguments that basins were computed with; meanings as in ``basins``."""

    initial: tuple[Any, ...]
    periods: int
    keep: int
    scouts: int
    rounds: int
    max_events: int | None
    chatter_tolerance: float
    units: Units | None = None

    @property
    def follow(self) -> Follow:
        """How a cell is followed at first."""
        return Follow(self.periods, self.keep, self.max_events, self.chatter_tolerance)


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Basins(FixedArrays, Shown):
    """Basins of attraction over a grid of a x b initial states; all arrays are read-only.

    Attributes
    ----------
    system
        The System or Structure.
    axes
        Names and values of the two coordinates that vary, shapes (a,) and (b,), in SI with
        ``units="SI"``.
    attractors
        What was found, in the order of finding.
    attractor
        Number of the attractor of each cell, -1 for none, shape (a, b).
    status_code
        How each cell ended, as a place in ``vi.sweeps.STATUS_NAMES``, shape (a, b).
    settling
        Drive periods until the trapping region of the attractor was entered; -1 where the cell was
        judged by its sections at the end, shape (a, b).
    settings
        The other arguments.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> import numpy as np
    >>> grid = np.linspace(-1, 1, 8)
    >>> basins = vi.basins(system, x1=[0.0, 0.1, 0.2], v1=grid, scouts=20, periods=300)
    >>> basins
    <Basins over 3 x1 x 8 v1: 1-1 100.0%>
    """

    system: Any
    axes: dict[str, NDArray[np.float64]]
    attractors: tuple[Attractor, ...]
    attractor: NDArray[np.int16]
    status_code: NDArray[np.int8]
    settling: NDArray[np.int32]
    settings: BasinSettings

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for name in ("attractor", "status_code", "settling"):
            getattr(self, name).flags.writeable = False

    def __repr__(self) -> str:
        """Say what was computed, the attractors with their shares, and what has none."""
        axes = " x ".join(f"{len(values)} {name}" for name, values in self.axes.items())
        parts = [
            f"{name} {share:.1%}" for name, share in zip(self._names, self.shares, strict=True)
        ]
        parts += self._without
        return f"<Basins over {axes}: {', '.join(parts) or 'nothing'}>"

    @cached_property
    def _names(self) -> tuple[str, ...]:
        """What the attractors are called: their labels, equal ones told apart."""
        labels = [attractor.label for attractor in self.attractors]
        motions = [attractor.motion for attractor in self.attractors]
        names: tuple[str, ...] = verb("motion_names")(labels, motions)
        return names

    @property
    def _without(self) -> list[str]:
        """In words, how many cells have no attractor, and why."""
        return [f"{name} in {counted(number, 'cell')}" for name, number in self.reasons.items()]

    @cached_property
    def shares(self) -> NDArray[np.float64]:
        """Part of the cells with an attractor that belongs to each, shape (attractors,)."""
        inside = self.attractor[self.attractor >= 0]
        numbers = np.bincount(inside, minlength=len(self.attractors))
        return numbers / max(len(inside), 1)

    @cached_property
    def reasons(self) -> dict[str, int]:
        """Number of cells without an attractor, by status."""
        codes, numbers = np.unique(self.status_code[self.attractor < 0], return_counts=True)
        return {
            STATUS_NAMES[code]: int(number) for code, number in zip(codes, numbers, strict=True)
        }

    @property
    def status(self) -> NDArray[np.str_]:
        """How each cell ended, shape (a, b): ``completed`` with an attractor, else why without.

        ``overlap`` (the bodies overlap at the start), ``unresolved`` (none was reached in the time
        given, or could be told), a stop reason, ``failed``, or ``pending`` after Ctrl-C.
        """
        return read_only(np.asarray(STATUS_NAMES)[self.status_code])

    @property
    def label(self) -> NDArray[np.str_]:
        """Label of the attractor of each cell, or its status, shape (a, b)."""
        names = np.array([*(found.label for found in self.attractors), *STATUS_NAMES])
        none = len(self.attractors) + self.status_code
        return read_only(names[np.where(self.attractor >= 0, self.attractor, none)])

    @property
    def complete(self) -> bool:
        """Whether no cell is pending."""
        return bool(self.status_code.all())

    def __len__(self) -> int:
        """Return the number of cells."""
        return self.attractor.size

    def uncertainty_exponent(self, *, steps: ArrayLike | None = None) -> UncertaintyExponent:
        """Return the uncertainty exponent of the basins' boundary; see ``UncertaintyExponent``.

        Parameters
        ----------
        steps
            Distances, in cells; default 1, 2, 4 ... up to an eighth of the shorter axis.

        Raises
        ------
        ParameterError
            If an axis is not evenly spaced, or the grid is too small.

        Examples
        --------
        >>> basins.uncertainty_exponent().exponent  # one attractor has no border
        nan
        """
        return uncertainty_exponent(self.attractor, axes=self.axes, steps=steps)

    def entropy(self, *, box: int = 5) -> BasinEntropy:
        """Return basin entropy and boundary basin entropy; see ``BasinEntropy``.

        Parameters
        ----------
        box
            Cells along each side of a box.

        Raises
        ------
        ParameterError
            If the grid is smaller than a box.

        Examples
        --------
        >>> basins.entropy(box=2).boxes
        4
        """
        return basin_entropy(self.attractor, box=box)

    def run(self, *indices: int) -> Any:
        """Make the run from the start of one cell again.

        Parameters
        ----------
        *indices
            Place of the cell, an index for each axis; negative ones count from the end.

        Returns
        -------
        Run; of a structure StructureRun
            Over the ``periods`` of the settings, doubled as in the rounds until the cell has
            arrived at its attractor; where it has not, as long as in the last round.

        Raises
        ------
        ParameterError
            If there is no such cell.
        StateError, SimulationError
            If the status of the cell is ``overlap`` or ``failed``.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2.0, restitution=0.8, gap=0.5,
        ...                    drive_frequency=1.8, moment_amplitude=1.0)
        >>> basins = vi.basins(system, x1=[0.0, 0.1], v1=[0.4, 0.5])
        >>> basins.run(0, 1).initial
        (0.0, 0.5, 0.0, 0.0)
        """
        return verb("run_of_start")(self, *indices)

    def plot(self, **options: Any) -> Axes:
        """Draw the basins, by ``vi.plot.basins``.

        Parameters
        ----------
        **options
            As in ``vi.plot.basins``.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> basins.plot().get_xlabel()
        'position $x_1$ of body 1'
        """
        axes: Axes = verb("draw")(self, **options)
        return axes

    def to_pandas(self) -> pandas.DataFrame:
        """Return the cells as a data frame, one row each.

        Raises
        ------
        ImportError
            If pandas is not installed.

        Examples
        --------
        >>> len(basins.to_pandas())
        24
        """
        first, second = np.meshgrid(*self.axes.values(), indexing="ij")
        return frame(
            dict(zip(self.axes, (first.ravel(), second.ravel()), strict=True))
            | {
                "attractor": self.attractor.ravel(),
                "label": self.label.ravel(),
                "status": self.status.ravel(),
                "settling": self.settling.ravel(),
            }
        )

    def _facts(self) -> Facts:
        facts: Facts = {
            name: f"{len(values)} values from {values[0]:.6g} to {values[-1]:.6g}"
            for name, values in self.axes.items()
        }
        for number, name in enumerate(self._names):
            facts[f"attractor {number}"] = f"{name}: {self.shares[number]:.1%}"
        if self.reasons:
            facts["without attractor"] = ", ".join(self._without)
        return facts

    def to_xarray(self) -> xarray.Dataset:
        """Return attractor, status, settling and label over both axes as an xarray data set.

        Raises
        ------
        ImportError
            If xarray is not installed.

        Examples
        --------
        >>> dict(basins.to_xarray().sizes)
        {'x1': 3, 'v1': 8}
        """
        need_xarray()
        import xarray

        dims = tuple(self.axes)
        columns: dict[str, Any] = {
            field.name: (dims, values, field.attributes())
            for field, values in (
                (ATTRACTOR, self.attractor),
                (STATUS, self.status_code),
                (SETTLING, self.settling),
            )
        }
        description = "label of the attractor, or the status where there is none"
        columns["label"] = (dims, self.label, {"description": description})
        described = [
            {"label": found.label, "kind": found.kind, "confirmed": found.confirmed}
            for found in self.attractors
        ]
        return xarray.Dataset(
            columns,
            {name: (name, values, self._attributes(name)) for name, values in self.axes.items()},
            {
                "kind": "basins",
                "system": json.dumps(machine_of(self.system).to_dict()),
                "settings": json.dumps(dataclasses.asdict(self.settings)),
                "attractors": json.dumps(described),
            },
        )

    def _attributes(self, name: str) -> dict[str, Any]:
        """Return the attributes of an axis of a data set."""
        return {"units": COLUMN_UNITS[name][1]} if self.settings.units else axis_attributes()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the basins to ``path`` (.npz, no pickle); ``vibroimpact.load`` reads it.

        Examples
        --------
        >>> basins.save("basins.npz")
        >>> vi.load("basins.npz").complete
        True
        """
        verb("write_basins")(path, self)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Basins:
        """Read basins from the file that ``save`` wrote.

        Raises
        ------
        ValueError
            If it is damaged, foreign, or holds something else.

        Examples
        --------
        >>> basins.save("basins.npz")
        >>> vi.Basins.load("basins.npz").complete
        True
        """
        basins: Basins = verb("read_basins")(path)
        return basins
