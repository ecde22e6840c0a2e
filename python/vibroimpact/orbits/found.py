"""What a search for periodic motions returns."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..errors import NoMotionError
from ..interruption import interruptible
from ..period_report import PeriodReport
from ..showing import Facts, Shown
from ..tables import frame
from ..verbs import verb
from .motion import columns_of

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

Array = NDArray[np.float64]


class AnyMotion(Protocol):
    """What is told of a motion that is found, of a System or of a structure."""

    @property
    def label(self) -> str: ...  # noqa: D102
    @property
    def stability(self) -> str: ...  # noqa: D102


MotionT = TypeVar("MotionT", bound=AnyMotion)


@interruptible
@dataclass(frozen=True, kw_only=True)
class NotFound(Shown):
    """No periodic motion was found; counts as False.

    What is asked of it as of a motion, such as its multipliers, raises ``NoMotionError``, an
    AttributeError that says why there is no motion. So do an index and a loop.

    Attributes
    ----------
    reason
        Why, in words.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> chaotic = system.replace(drive_frequency=1.9)
    >>> found = vi.simulate(chaotic, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> bool(found)
    False
    >>> found.reason
    'the run is chaotic, not periodic'
    """

    reason: str

    def __bool__(self) -> bool:
        """Return False."""
        return False

    # Not for type checkers: they should say that a motion may be missing.
    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """Say why there is no motion.

            Raises
            ------
            NoMotionError
                Always; for names with an underscore, which Python itself looks for, a plain
                AttributeError.
            """
            if name[:1] == "_" or "reason" not in vars(self):
                raise AttributeError(f"'NotFound' object has no attribute {name!r}")
            raise self._missing(repr(name), name)

        def __getitem__(self, index: object) -> Any:
            """Say why there is no motion, to those who expect a list of motions."""
            raise self._missing(f"element {index!r}")

        def __iter__(self) -> Any:
            """Say why there is no motion, to those who expect a list of motions."""
            raise self._missing("elements")

    def _missing(self, what: str, name: str | None = None) -> NoMotionError:
        return NoMotionError(
            f"no periodic motion was found, so it has no {what}: {self.reason}",
            self.reason,
            name=name,
            obj=self,
        )

    def _facts(self) -> Facts:
        return {"reason": self.reason}


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False)
class MotionSearch(Shown, Generic[MotionT]):
    """Periodic motions reached from many starts.

    Attributes
    ----------
    motions
        Every periodic motion found, that with the largest share first.
    shares
        Part of the starts that end on each motion, shape (motions,).
    others
        Parts of the starts that end elsewhere, by label or stop reason; ``pending`` after Ctrl-C.
    starts
        Initial states, shape (k, 4), of a structure (k, 2, N).
    reached
        Number of the motion each start ends on, -1 for none, shape (k,).

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> search = vi.search_motions(system, starts=16, periods=200)
    >>> search
    <MotionSearch from 16 starts: 1-1 100.0%>
    """

    motions: tuple[MotionT, ...]
    shares: Array
    others: dict[str, float]
    starts: Array
    reached: NDArray[np.int64]

    @cached_property
    def images(self) -> tuple[int | None, ...]:
        """For each motion the place of its mirror image among them, None if it is not there.

        The mirror image of a motion q(t) is -q half a drive period later; a motion may be its own.
        Only structures that are their own mirror image have such motions.
        """
        places: tuple[int | None, ...] = verb("image_places")(self.motions)
        return places

    @cached_property
    def _names(self) -> tuple[str, ...]:
        """What the motions are called: their labels, equal ones told apart."""
        labels = [motion.label for motion in self.motions]
        names: tuple[str, ...] = verb("motion_names")(labels, self.motions)
        return names

    def to_pandas(self) -> pandas.DataFrame:
        """Return the motions as a data frame, one row each, with their shares.

        The column ``image`` has the row of the mirror image, -1 if it is not among them.

        Raises
        ------
        ImportError
            If pandas is not installed.

        Examples
        --------
        >>> len(search.to_pandas()) == len(search.motions)
        True
        """
        images = [-1 if image is None else image for image in self.images]
        return frame({"share": self.shares, "image": images, **columns_of(self.motions)})

    def plot(self, **options: Any) -> Axes:
        """Draw the share of each motion, by ``vi.plot.motion_search``.

        Parameters
        ----------
        **options
            As in ``vi.plot.motion_search``.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> search.plot().get_xlabel()
        'part of the starts'
        """
        axes: Axes = verb("draw")(self, **options)
        return axes

    def _facts(self) -> Facts:
        labels = [
            f"{name}, {motion.stability}"
            for name, motion in zip(self._names, self.motions, strict=True)
        ]
        ends = [*zip(labels, self.shares, strict=True), *self.others.items()]
        return {"starts": len(self.starts)} | {
            f"end {number}": f"{text}: {share:.1%}" for number, (text, share) in enumerate(ends, 1)
        }

    def __repr__(self) -> str:
        """Return the motions on which the starts end, with their shares, in words."""
        ends = [*zip(self._names, self.shares, strict=True), *self.others.items()]
        texts = ", ".join(f"{label} {share:.1%}" for label, share in ends)
        return f"<MotionSearch from {len(self.starts)} starts: {texts}>"


class EndedRun(Protocol):
    """What is told of a run of a System or of a structure."""

    @property
    def label(self) -> str: ...  # noqa: D102
    @property
    def period(self) -> PeriodReport: ...  # noqa: D102
    @property
    def stop_reason(self) -> str: ...  # noqa: D102
    @property
    def stop_detail(self) -> str: ...  # noqa: D102


def not_periodic(run: EndedRun) -> NotFound:
    """Return that a run has not settled on a periodic motion, or that it ended before it could."""
    reason = f"the run is {run.label}, not periodic"
    if run.period.n is None and run.label == "unresolved":
        reason += f": {run.period.evidence}"
    if run.stop_reason not in ("completed", "rest"):
        reason += f"; it ended early: {run.stop_detail}"
    return NotFound(reason=reason)
