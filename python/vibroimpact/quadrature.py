"""Integrals over a run of what varies smoothly between its events."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arguments import reject
from .errors import ParameterError
from .interruption import interruptible
from .tables import EventKind

Array = NDArray[np.float64]

# Panels of an integral in the shortest period, at least.
_PANELS = 4.0

# Nodes of Lobatto's rule in each panel, and how many are computed at once.
_NODES, _AT_ONCE = 11, 20_000
# The last coefficients of a panel in Legendre polynomials, relative to what is integrated: they
# fall by the same factor again up to those that the rule does not see.
_TAIL = 1e-7
# Panels are halved so often at most, as where the rate itself has a kink.
_HALVINGS = 24


@interruptible
class Integrable:
    """A run over which rates can be integrated."""

    def integral(self, rate: Callable[[Array, Any], ArrayLike]) -> float:
        """Return the integral of a rate over the kept window, such as a mean power or a path.

        By Lobatto's rule between events, in panels that are halved until it sees all of the rate:
        to some 1e-13 for smooth rates, and 1e-7 with kinks, as of ``abs``. ``gradient`` has its
        derivatives.

        Parameters
        ----------
        rate
            A function of times (j,) and states (j, 4), of a structure (j, 2, N), as ``trajectory``
            returns them; it returns (j,) numbers.

        Raises
        ------
        ParameterError
            If ``rate`` returns something else, and of a run that has ended early or has complete
            chatter, which is infinitely many impacts.

        Examples
        --------
        The path of body 1, there and back:

        >>> import numpy as np
        >>> import vibroimpact as vi
        >>> free = vi.System(mass_ratio=1, frequency_ratio=1, restitution=1, gap=50,
        ...                  drive_frequency=1)
        >>> run = vi.simulate(free, initial=(0.3, 0, 0, 0), periods=2)
        >>> round(run.integral(lambda t, states: np.abs(states[:, 1])), 9)
        2.4
        """
        check_rate(rate)

        def along(times: Array) -> Array:
            found = rates_at(rate, times, self._at(times, False)[0])
            return np.asarray(found, dtype=np.float64)

        return float(integral_over(self, along)[0])

    if TYPE_CHECKING:

        def _at(self, t: ArrayLike, forces: bool) -> list[Any]: ...


def rates_at(rate: Callable[[Any, Any], Any], times: Array, states: Any) -> Any:
    """Return what a rate gives, checked to be one number for each time."""
    rates = rate(times, states)
    if np.shape(rates) != times.shape:
        raise ParameterError(
            f"rate returned shape {np.shape(rates)}, which is not allowed; allowed: a function "
            f"that returns {len(times)} numbers here"
        )
    return rates


def check_rate(rate: Any) -> None:
    """Refuse what is no function."""
    if not callable(rate):
        reject("rate", rate, "a function of times and states")


def integral_over(run: Any, rates: Callable[[Array], Array]) -> Array:
    """Return integrals over the kept window of a run, (m,), of rates at times, (j, m).

    By Lobatto's rule between events, in panels that are halved until it sees all that the rates do.
    The ends of a panel are nodes, or a kink near one would lie between the nodes of both panels
    beside it, and neither see it.

    Raises
    ------
    ParameterError
        Of a run that has ended early, and of one with complete chatter.
    """
    need_whole(run, "integral")
    if (run.contacts["kind"] == EventKind.CHATTER).any():
        raise ParameterError(
            "the run has complete chatter: infinitely many impacts, over which no rate is "
            "integrated"
        )
    first, last = run.kept_from, run.final_state.time
    edges = np.unique(np.clip([first, *np.asarray(run.events["time"]), last], first, last))
    begins, widths, within = _panels(edges, 2.0 * np.pi / (_PANELS * run.system._fastest))
    nodes, weights, ends = _lobatto()
    total = sizes = np.zeros(1)
    for halvings in range(_HALVINGS + 1):
        coarse = np.zeros(len(begins), dtype=bool)
        for start in range(0, len(begins), _AT_ONCE // _NODES):
            here = slice(start, start + _AT_ONCE // _NODES)
            half = 0.5 * widths[here, None]
            times = begins[here, None] + half * (1.0 + nodes)
            times = np.clip(times, within[here, :1], within[here, 1:])
            numbers = rates(times.ravel()).reshape(*times.shape, -1)
            sizes = np.maximum(sizes, np.abs(numbers).max(axis=(0, 1), initial=0.0))
            tails = np.abs(ends @ numbers).max(axis=1)
            coarse[here] = (tails > _TAIL * sizes).any(axis=1) & (halvings < _HALVINGS)
            fine = ~coarse[here]
            total = total + np.einsum("pnk,n,p->k", numbers[fine], weights, half[fine, 0])
        if not coarse.any():
            break
        within = np.repeat(within[coarse], 2, axis=0)
        widths = np.repeat(0.5 * widths[coarse], 2)
        begins = np.repeat(begins[coarse], 2)
        begins[1::2] += widths[1::2]
    return total


def need_whole(run: Any, what: str) -> None:
    """Refuse a run that has ended early."""
    if run.stop_reason not in ("completed", "rest"):
        raise ParameterError(f"no {what} of a run that has ended early ({run.stop_reason})")


def _lobatto() -> tuple[Array, Array, Array]:
    """Return nodes, weights, and what gives the last two coefficients in Legendre polynomials.

    Source: F. B. Hildebrand, *Introduction to Numerical Analysis*, 2nd ed., 1974, section 8.12.
    """
    from numpy.polynomial import legendre  # here, to keep the import of the package light

    degree = _NODES - 1
    highest = np.zeros(_NODES)
    highest[degree] = 1.0
    nodes = np.concatenate([[-1.0], legendre.legroots(legendre.legder(highest)), [1.0]])
    polynomials = legendre.legvander(nodes, degree)
    weights = 2.0 / (degree * _NODES * polynomials[:, degree] ** 2)
    # The rule takes the square of the highest polynomial for larger than it is.
    sizes = np.array([degree - 0.5, 0.5 * degree])
    return nodes, weights, (polynomials[:, degree - 1 :] * weights[:, None] * sizes).T


def _panels(edges: Array, longest: float) -> tuple[Array, Array, Array]:
    """Return where panels between edges begin, how long they are, and within which times.

    At an edge an event may be, with another state before than after: the times are between edges.
    """
    lengths = np.diff(edges)
    counts = np.maximum(np.ceil(lengths / longest), 1.0).astype(np.int64)
    widths = np.repeat(lengths / counts, counts)
    place = np.arange(len(widths)) - np.repeat(np.cumsum(counts) - counts, counts)
    ends = np.nextafter(edges[:-1], np.inf), np.nextafter(edges[1:], -np.inf)
    within = np.column_stack([np.minimum(*ends), np.maximum(*ends)])
    begins = np.repeat(edges[:-1], counts) + place * widths
    return begins, widths, np.repeat(within, counts, axis=0)
