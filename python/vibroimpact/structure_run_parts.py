"""Parts of a run of a structure: the state at its end, and the arrays of its file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from . import _core
from .arguments import reject
from .fixed_arrays import FixedArrays
from .interruption import interruptible
from .made_with import Derived
from .run_parts import Slopes, clock_rates
from .run_trace import Trace
from .showing import Facts, Shown, in_a_line
from .structure import Structure
from .tables import Table, of_columns

Array = NDArray[np.float64]

TABLES: Final = ("impacts", "grazes", "contacts", "events")
# Of impacts, in order, as the core gives them.
IMPACT_COLUMNS: Final = (
    *("time", "period", "time_in_period", "stop", "q", "v_pre", "v_post", "approach_velocity"),
    *("phase", "regime", "impulse_normal", "impulse_tangential", "energy_loss"),
)
# Of a structure from its modes a file has the tables in both coordinates.
_MODAL: Final = "modal_"


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False)
class StructureState(FixedArrays, Shown):
    """The state of a structure at the end of a run, after the impact if one falls on that instant.

    Attributes
    ----------
    q, v
        Coordinates and velocities, (N,).
    time
        Time since the start.
    period, time_in_period
        Completed drive periods and the time since the last one, which together stay exact where
        ``time`` has lost digits.
    mode
        ``"flight"``; or while stops are closed ``"closed"``, without friction, or of the one with
        friction ``"slide_positive"``, ``"slide_negative"`` (the sign of tangent . v) or
        ``"stick"``.
    closed
        Which stops are closed, (number of stops,), booleans.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> structure = vi.Structure([[1]], [[1]], [vi.Stop([1], 0.5, 0.8)],
    ...                          drive_amplitude=[1], drive_frequency=2.0)
    >>> run = vi.simulate(structure, initial=[[0], [0]], periods=10)
    >>> run.final_state.mode, run.final_state.q.shape
    ('flight', (1,))
    """

    q: Array
    v: Array
    time: float
    period: int
    time_in_period: float
    mode: str
    closed: NDArray[np.bool_]

    @property
    def state(self) -> Array:
        """Coordinates and velocities (2, N), as ``initial=`` takes them."""
        return np.stack([self.q, self.v])

    def __repr__(self) -> str:
        """Say when it is, what the stops do, and where the coordinates are."""
        return (
            f"<StructureState at time {self.time:.6g} (period {self.period}), "
            f"{self.mode.replace('_', ' ')}, q = {in_a_line(self.q)}>"
        )

    def _facts(self) -> Facts:
        closed = ", ".join(str(stop) for stop in np.flatnonzero(self.closed)) or "none"
        return {
            "time": f"{self.time:.6g}",
            "drive periods": self.period,
            "mode": self.mode.replace("_", " "),
            "closed stops": closed,
            "q": in_a_line(self.q),
            "v": in_a_line(self.v),
        }


@interruptible
@dataclass(frozen=True, kw_only=True)
class StructureEnergyAudit:
    """The works of all forces in the kept window of a run of a structure, in its own units.

    Energy is E = (v M v + q K q)/2. Works are positive where energy enters. Between impacts they
    are integrated by quadrature along the motion, independently of the formulas that gave it;
    impacts skipped in chatter are resolved.

    Attributes
    ----------
    energy_start, energy_end
        E at both ends of the window.
    loads
        Work of the drive and the constant load.
    damping
        Work of the dampers, <= 0.
    impacts
        Minus what impacts take, by restitution and friction.
    contact_friction
        Work of friction in lasting contact, <= 0.
    stops
        Work of stops that move, in impacts and in contact.
    total
        Sum of all absolute works.
    residual
        Change of energy that no work explains: rounding, some 1e-13 of ``total``.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> structure = vi.Structure([[1]], [[1]], [vi.Stop([1], 0.3, 0.8)],
    ...                          drive_amplitude=[1], drive_frequency=2.0)
    >>> run = vi.simulate(structure, initial=[[0], [0]], periods=10)
    >>> run.energy_audit().stops  # nothing moves them
    0.0
    """

    energy_start: float
    energy_end: float
    loads: float
    damping: float
    impacts: float
    contact_friction: float
    stops: float
    total: float
    residual: float


def check_arrays(given: Mapping[str, NDArray[Any]], like: Mapping[str, NDArray[Any]]) -> None:
    """Check that arrays are of the same names, types and rows as others.

    Raises
    ------
    ParameterError
        Names the array.
    """
    if given.keys() != like.keys():
        reject("arrays", sorted(given), ", ".join(sorted(like)))
    for name, array in given.items():
        known, fixed = like[name], name == "initial"
        same = array.shape == known.shape if fixed else array.shape[1:] == known.shape[1:]
        if array.ndim != known.ndim or array.dtype != known.dtype or not same:
            reject(name, f"{array.dtype}, {array.shape}", f"rows like {known.dtype}, {known.shape}")


def arrays_of(
    core: _core.StructureRun, physical: Mapping[str, NDArray[Any]], modal: bool
) -> dict[str, NDArray[Any]]:
    """Return the arrays of a file: the physical ones, and where they differ those of the core."""
    arrays = dict(physical)
    if modal:
        arrays[f"{_MODAL}stroboscopic"] = core.stroboscopic
        arrays |= {
            f"{_MODAL}{name}": of_columns(getattr(core, name)).view(np.ndarray) for name in TABLES
        }
    return arrays


def core_of(
    structure: _core.Structure,
    text: str,
    arrays: Mapping[str, NDArray[Any]],
    modal: bool,
    trace: Trace | None,
) -> _core.StructureRun:
    """Return the core of a run from the text of its progress, the arrays of a file, and a trace."""
    prefix = _MODAL if modal else ""

    def columns(name: str) -> dict[str, NDArray[Any]]:
        rows = arrays[prefix + name]
        return {each: np.ascontiguousarray(rows[each]) for each in rows.dtype.names or ()}

    tables = {name: columns(name) for name in TABLES}
    sections = arrays[f"{prefix}stroboscopic"]
    return _core.StructureRun.from_parts(
        structure, text, stroboscopic=sections, **tables, trace=trace
    )


def physical_sensitivity(core: Any, physical: Callable[[Array], Array]) -> Derived:
    """Return what the core gives of a sensitivity in coordinates of a structure from modes."""

    def states(rows: Array) -> Array:
        n, width, k = rows.shape
        modal = rows.reshape(n, 2, width // 2, k).transpose(0, 3, 1, 2)
        found = physical(modal).transpose(0, 2, 3, 1)
        return found.reshape(n, 2 * found.shape[2], k)  # there may be no rows

    return Derived(core, states, lambda times: times)


def impact_rates(
    structure: Structure, rows: Table, found: Any, slopes: Slopes
) -> dict[str, NDArray[np.float64]]:
    """Return derivatives of columns of the impacts ``rows``; `RunRecord._impact_rates`."""
    time, before, after = found
    count, omega = structure.coordinates, structure.drive_frequency
    rates = clock_rates(rows, omega, time, slopes)
    rates |= {"q": before[:, :count], "v_pre": before[:, count:], "v_post": after[:, count:]}
    basis = structure._basis
    mass = basis.matrices[0]
    moved = slopes("mass", mass.shape)
    # Velocities before and after, and their derivatives (n, k, N), in which M is that of the core.
    (v, dv), (w, dw) = (
        (
            basis.near(np.asarray(rows[f"v_{side}"])),
            basis.near(rates[f"v_{side}"].transpose(0, 2, 1)),
        )
        for side in ("pre", "post")
    )
    # The momentum M (v+ - v-) is what the impulses give.
    given = np.einsum("ij,nkj->nki", mass, dw - dv) + np.einsum("ijk,nj->nki", moved, w - v)
    energy = [
        np.einsum("ni,ij,nkj->nk", v, mass, dv) + 0.5 * np.einsum("ni,ijk,nj->nk", v, moved, v)
        for v, dv in ((v, dv), (w, dw))
    ]
    lost = energy[0] - energy[1]
    approach, normal, tangential = (np.zeros_like(time) for _ in range(3))
    rate, instants = slopes("drive_frequency"), np.asarray(rows["time"])[:, None]
    for place, stop in enumerate(structure.stops):
        here = np.flatnonzero(rows["stop"] == place)
        along = [-basis.on("normal", stop.normal)]
        if stop.tangent is not None:
            along.append(basis.on("tangent", stop.tangent))
        impulses = given[here] @ np.linalg.pinv(np.array(along))
        normal[here] = impulses[..., 0]
        if len(along) > 1:
            tangential[here] = impulses[..., 1]
        # The stop moves towards the body: u = n . v + s, s = a omega sin(omega t + phase).
        t = instants[here]
        phase = omega * t + stop.phase
        turned = rate * t + omega * time[here] + slopes(f"phase_{place}")
        swing = stop.amplitude * rate + slopes(f"amplitude_{place}") * omega
        speed = stop.amplitude * omega * np.sin(phase)
        faster = swing * np.sin(phase) + stop.amplitude * omega * np.cos(phase) * turned
        approach[here] = np.einsum("j,njk->nk", stop.normal, rates["v_pre"][here]) + faster
        # Its impulse P does the work -P s on the body.
        pushed = np.asarray(rows["impulse_normal"])[here, None]
        lost[here] += normal[here] * speed + pushed * faster
    rates |= {"approach_velocity": approach, "impulse_normal": normal}
    return rates | {"impulse_tangential": tangential, "energy_loss": lost}
