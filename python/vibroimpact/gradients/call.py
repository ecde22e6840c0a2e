"""The call: a function of a run, and its gradient."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import CHATTER_TOLERANCE
from ..arguments import in_short, number, reject
from ..interruption import interruptible
from ..machine import Machine, first_of_each
from ..machine_kinds import is_maker
from ..made import basis_of, check_names, is_coordinate, machine_made, varied
from ..simulation import simulated
from .duals import Dual, constant
from .quantities import Quantities

Array = NDArray[np.float64]


@interruptible
def gradient(
    function: Callable[[Any], Any],
    system: Any,
    names: str | Sequence[str] | Mapping[str, float],
    *,
    initial: ArrayLike,
    periods: int | None = None,
    time: float | None = None,
    keep: int | None = None,
    section_phase: float = 0.0,
    max_events: int | None = None,
    chatter_tolerance: float = CHATTER_TOLERANCE,
) -> tuple[Any, Array]:
    """Return a function of a run, and its derivatives by parameters and the start of the motion.

    The function gets the run with numbers that carry their exact derivatives, through impacts and
    contact; it uses them as NumPy arrays. It can ask for ``impacts["time"]`` and other columns,
    ``stroboscopic``, ``final_state``, ``trajectory(t)``, ``initial``, ``system.gap`` and other
    numbers, ``integral(rate)``, as the page on sensitivity tells; ``run`` is the plain run. With
    ``periods`` the end moves with ``drive_frequency``: ``final_state`` goes with it, and
    ``final_state.time`` has a derivative; those of ``run.sensitivity`` are at a fixed time.

    Parameters
    ----------
    function
        A function of the run that returns a number, or an array of any shape S.
    system
        The System or Structure; or a function of named numbers that makes one.
    names
        Names of k numbers of the system, of its stops (``"gap_0"``), or of the function, and of
        coordinates of the start. Or a mapping from names to the values at which the derivatives are
        wanted.
    initial
        The start, as in ``simulate``.
    periods
        Number of drive periods of the run; or else ``time``.
    time
        Its length in time; or else ``periods``.
    keep
        How many of its last periods the function sees; all if not given.
    section_phase
        Drive phase of its sections, as in ``simulate``.
    max_events
        Cap on its events.
    chatter_tolerance
        As in ``simulate``.

    Returns
    -------
    value : number or array of shape S
    gradient : array of shape (k,), or (*S, k)

    Raises
    ------
    ParameterError
        If an argument is out of range.
    StateError
        If the start is not finite, or the bodies overlap in it.
    TypeError
        If the function uses what would lose derivatives, such as ``math.sin`` or ``float``.
    SimulationError
        If the motion, or a derivative of a leg of it, cannot be computed.
    Interrupted
        After Ctrl-C.

    Examples
    --------
    How hard the first impact is, and by what it changes:

    >>> import vibroimpact as vi
    >>> ball = vi.System(mass_ratio=0, frequency_ratio=0, restitution=0.5, gap=0,
    ...                  drive_frequency=0, moment_amplitude=2, contact="direct")
    >>> value, slope = vi.gradient(lambda run: run.impacts["approach_velocity"][0], ball,
    ...                            ["gap", "v1"], initial=(-1, 0, 0, 0), time=2)
    >>> value, slope.tolist()  # sqrt(v1^2 + 2 moment (gap - x1))
    (2.0, [1.0, 0.0])
    """
    if not callable(function):
        reject("function", function, "a function of a run")
    machine, start, numbers, coordinates = _given(system, names, initial)
    basis = basis_of(machine, numbers).with_coordinates(coordinates)
    run = simulated(
        machine,
        initial=start,
        periods=periods,
        time=time,
        keep=keep,
        section_phase=section_phase,
        max_events=max_events,
        chatter_tolerance=chatter_tolerance,
        asked=(tuple(basis.names), basis.directions),
    )
    # In the order of the names.
    order = [[*numbers, *coordinates].index(name) for name in _listed(names)]
    basis = replace(basis, chain=basis.chain[:, order])
    quantities = Quantities(run, machine, _listed(names), basis, periods is not None)
    found = function(quantities)
    found = _with_derivatives(found, len(order))
    value = found.value[()]
    if not (np.isfinite(value).all() and np.isfinite(found.slope).all()):
        what = "value" if not np.isfinite(value).all() else "derivative"
        reject("function", f"one with a {what} that is not finite", "finite ones")
    return (value if found.ndim else float(value)), np.array(found.slope)


def _with_derivatives(found: Any, count: int) -> Dual:
    """Return what a function gave, with derivatives by ``count`` things."""
    if isinstance(found, Dual):
        return found
    wanted = "a function that returns a number, or an array"
    if isinstance(found, list | tuple):
        each = [_with_derivatives(one, count) for one in found]
        if len({one.value.shape for one in each}) > 1:
            reject("function", "one that returns numbers of several shapes", wanted)
        if not each:
            return constant(np.zeros(0), count)
        stacked: Any = np.stack(each)
        together: Dual = stacked
        return together
    try:
        array = np.asarray(found)
    except (TypeError, ValueError):
        reject("function", in_short(found), wanted)
    if array.dtype.kind not in "iuf":  # None would be a NaN
        reject("function", f"one that returns {in_short(found)}", wanted)
    return constant(array, count)


def _listed(names: Any) -> list[str]:
    return [names] if isinstance(names, str) else [*names]


def _given(system: Any, names: Any, initial: Any) -> tuple[Any, Array, list[str], list[str]]:
    """Return the machine and its start at the values of names; the names of both kinds."""
    allowed = "names of numbers, each once, or a mapping from them to values"
    if isinstance(names, bytes | bytearray) or not isinstance(names, str | Sequence | Mapping):
        reject("names", names, allowed)
    listed = _listed(names)
    if not listed or any(not isinstance(name, str) for name in listed):
        reject("names", names, allowed)
    if len({*listed}) < len(listed):
        reject("names", names, allowed)
    values: dict[str, float | None] = dict.fromkeys(listed)
    if isinstance(names, Mapping):
        values = {name: number(f"names[{name!r}]", value) for name, value in names.items()}
    if is_maker(system):
        return _made(system, values, initial)
    if not isinstance(system, Machine):
        reject("system", system, "a System, a Structure, or a function that makes one")
    coordinates = [name for name in values if name in system._coordinates_by_name]
    numbers = [name for name in values if name not in coordinates]
    for name in numbers:
        if name not in system._numbers_by_name:
            allowed = f"{system._names_in_words}; any other number by {system._by_function}"
            reject("names", name, allowed, known=system._names)
    changed = {k: value for k, value in values.items() if k in numbers and value is not None}
    machine = varied(system, changed) if changed else system
    return machine, _started(machine, values, initial), numbers, coordinates


def _made(
    function: Any, values: Mapping[str, Any], initial: Any
) -> tuple[Any, Array, list[str], list[str]]:
    coordinates = [name for name in values if is_coordinate(name)]
    numbers = {name: value for name, value in values.items() if name not in coordinates}
    check_names(function, [*numbers])
    for name, value in numbers.items():
        if value is None:
            reject("names", [*values], f"a mapping from names to values, for the function: {name}")
    sizes = {name: abs(value) or 1.0 for name, value in numbers.items()}
    machine = machine_made(function, numbers, sizes)
    for name in coordinates:
        if name not in (known := machine._coordinates_by_name):
            reject("names", name, f"coordinates {', '.join(first_of_each(known))}", known=known)
    return machine, _started(machine, values, initial), [*numbers], coordinates


def _started(machine: Machine, values: Mapping[str, float | None], initial: Any) -> Array:
    """Return the start with the values of its coordinates."""
    start = np.array(machine._one_start(initial))
    flat = start.reshape(-1)
    for place, name in enumerate(machine._coordinates_by_name):
        value = values.get(name)
        if value is not None:
            flat[place] = value
    return start
