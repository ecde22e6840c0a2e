"""Along what a run of a structure is differentiated: names, and directions of its own fields.

A direction holds derivatives of fields by one number. It is given as a mapping from names to
derivatives, or as a function of the number that makes the structure, with the number.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from .arguments import complex_vector, in_short, matrix, number, reject, unknown, vector
from .errors import ParameterError, StateError
from .modal_basis import ModalBasis
from .restitution import OF_POWER_LAWS, OF_TABLES
from .stop import OF_DRIVE, Stop, is_of_stops, numbered, of_one_stop
from .structure import Structure

Array = NDArray[np.float64]
#: What the core takes: a name, and derivatives of fields where the name does not say them.
By = list[tuple[str, dict[str, Any] | None]]

_MATRICES: Final = ("mass", "stiffness", "damping")
_VECTORS: Final = ("damping_ratios", "static_load", "drive_amplitude")
_NUMBERS: Final = ("drive_frequency", "phase")
# Numbers of a stop, in the order of the core's columns.
_OF_STOPS: Final = ("gap", "restitution", "friction", "amplitude", "phase")
# After them the numbers of the curve of restitution, of a stop that has one.
_OF_CURVES: Final = len(OF_TABLES)
_OF_ALL: Final = (*_OF_STOPS, *OF_TABLES, *OF_POWER_LAWS)
_START: Final = ("q", "v")
# What cannot be varied, of stops and of a structure from modes.
_FIXED: Final = frozenset({"normal", "tangent", "shapes"})
_ENTRY: Final = re.compile(r"(mass|stiffness|damping)\[\s*(\d+)\s*,\s*(\d+)\s*\]", re.ASCII)
_KNOWN: Final = (
    "mass, stiffness, damping, damping_ratios, static_load, drive_amplitude, drive_frequency, "
    "phase; gap, restitution, friction of all stops, or with the number of one, gap_0 ..., also "
    "amplitude_0, phase_0, of a curve of restitution r_1, r_1_0 ...; q, v of the start; of a "
    "structure from modes also frequencies"
)
# Coordinates whose entries of matrices may be meant by a name that is none.
_MOST_TRIED: Final = 8
# Part of the scale of a number over which a function of it is differentiated: the error of the
# differences, of fourth order, is then the rounding of the fields over the step.
_STEP: Final = 1e-3
# A structure may differ so much from the one that the function makes at the number.
_SAME: Final = 1e-9


def directions(structure: Structure, names: tuple[Any, ...], given: Mapping[str, Any]) -> By:
    """Return what the core differentiates by: names, and then directions by name.

    Raises
    ------
    ParameterError
        For what is no name, and for a direction that the structure cannot be varied along.
    """
    by: By = []
    for name in names:
        if not isinstance(name, str):
            reject("names", name, "a name; directions are given by keyword")
        _check_name(structure, name)
        _check_has(structure, name)
        by.append((name, _named_in_modes(structure, name)))
    for name, direction in given.items():
        if callable(direction) or (isinstance(direction, tuple) and len(direction) == 2):
            slopes = slopes_of_function(structure, name, direction)
            if not slopes:
                raise ParameterError(f"{name}: the structure does not depend on it")
            by.append((name, _fields(structure, name, slopes)))
        else:
            by.append((name, _fields(structure, name, direction)))
    return by


def _check_name(structure: Structure, name: str) -> None:
    """Refuse what no structure has under this name; what this one lacks is refused later."""
    own = numbered(name)
    of_start = own is not None and own.what in _START
    if name in OF_DRIVE or is_of_stops(name) or of_start or _ENTRY.fullmatch(name):
        return
    shown = range(min(structure.coordinates, _MOST_TRIED))
    entries = [f"{matrix}[{i}, {j}]" for matrix in _MATRICES for i in shown for j in shown]
    allowed = (
        f"{structure._names_in_words}; an entry of mass, stiffness or damping, stiffness[0, 0] "
        f"...; any other number by keyword, name=(function, value): {structure._by_function}"
    )
    reject("names", name, allowed, known=(*structure._names, *entries))


def _check_has(structure: Structure, name: str) -> None:
    """Refuse the number of a stop or coordinate, or of the drive, that this structure lacks."""
    stops, known = structure.stops, structure._names
    if name in OF_DRIVE and structure.drive_frequency == 0.0:
        reject("names", name, "another name with drive_frequency = 0: the drive stands still")
    if own := of_one_stop(name):
        if own.place >= len(stops):
            reject("names", name, f"that of one of {len(stops)} stops", known=known)
    elif (own := numbered(name)) and own.what in _START and own.place >= structure.coordinates:
        reject("names", name, f"that of one of {structure.coordinates} coordinates", known=known)
    what, places = (own.what, [own.place]) if own else (name, [*range(len(stops))])
    if what == "friction":
        for place in places:
            if not stops[place].friction:
                allowed = "a stop with friction > 0, however small: without any it has no slip"
                reject(f"friction_{place}", 0.0, allowed)


def _named_in_modes(structure: Structure, name: str) -> dict[str, Any] | None:
    """Return the direction of a name in physical coordinates of a structure from modes."""
    if not structure._basis.is_modal:
        return None
    count = structure.coordinates
    if (own := numbered(name)) and own.what in _START:
        try:
            return _fields(structure, name, {own.what: np.eye(count)[own.place]})
        except ParameterError:
            together = f"run.sensitivity(name={{{own.what!r}: shapes @ p}})"
            allowed = "a coordinate of the start that can change alone; here modes move several of "
            reject("names", name, f"{allowed}them together, as in {together}")
    if match := _ENTRY.fullmatch(name):
        i, j = int(match[2]), int(match[3])
        if max(i, j) >= count:
            reject("names", name, f"two numbers of {count} coordinates in brackets")
        one = np.zeros((count, count))
        one[i, j] = one[j, i] = 1.0
        return _fields(structure, name, {match[1]: one})
    return None


def _fields(structure: Structure, name: str, direction: Any) -> dict[str, Any]:
    """Return a direction in the coordinates of the compiled structure, checked."""
    if not isinstance(direction, Mapping):
        allowed = (
            "a mapping from fields to their derivatives, or a pair (function, number) whose "
            "function makes the structure of the number"
        )
        reject(name, direction, allowed)
    if not direction:
        reject(name, direction, "at least one field")
    count, basis = structure.coordinates, structure._basis
    found: dict[str, Any] = {}
    stops = np.zeros((len(structure.stops), len(_OF_STOPS) + _OF_CURVES))
    for key, value in direction.items():
        what = f"{name}[{key!r}]"
        of_one = numbered(key) if isinstance(key, str) and key not in _OF_ALL else None
        of_one = of_one if of_one and of_one.what in _OF_ALL else None
        if key in _MATRICES:
            given = matrix(what, value, rows=count, columns=count)
            found[key] = basis.square(what, _symmetric(what, given))
        elif key == "frequencies" and isinstance(basis, ModalBasis):
            rates = vector(what, value, length=len(basis.frequencies))
            moved = np.diag(2.0 * basis.frequencies * rates)
            found["stiffness"] = found.get("stiffness", 0.0) + moved
        elif key == "damping_ratios":
            found[key] = vector(what, value, length=len(structure.frequencies), spread=True)
        elif key == "static_load":
            found[key] = basis.on(what, vector(what, value, length=count))
        elif key == "drive_amplitude":
            amplitude = basis.on(what, complex_vector(what, value, length=count))
            found[key] = np.asarray(amplitude, dtype=np.complex128)
        elif key in _NUMBERS:
            found[key] = number(what, value)
        elif key in _START:
            row = np.zeros((2, count))
            row[_START.index(key)] = vector(what, value, length=count)
            try:
                found[key] = structure._to_core(row)[_START.index(key)]
            except StateError:
                reject(what, value, "shapes @ p, with modal coordinates p that it determines")
        elif of_one is not None or key in _OF_ALL:
            field = of_one.what if of_one is not None else key
            places = [*range(len(stops))] if of_one is None else [of_one.place]
            if of_one is not None and places[0] >= len(stops):
                reject(what, key, f"that of one of {len(stops)} stops", known=structure._names)
            columns = {place: _numbers(structure.stops[place]) for place in places}
            having = [place for place in places if field in columns[place]]
            if not having or (field in _OF_STOPS and len(having) < len(places)):
                own = ", ".join(columns[places[0]]) if places else "none: there are no stops"
                reject(what, key, f"a number that the stop has: {own}")
            for place in having:
                stops[place, columns[place].index(field)] = number(what, value)
        else:
            of_modes = ("frequencies",) if isinstance(basis, ModalBasis) else ()
            known = (*_MATRICES, *_VECTORS, *of_modes, *structure._numbers_by_name, *_START)
            raise unknown(str(key), known, f"allowed: {_KNOWN}", of=f" in {name}")
    if stops.any():
        found["stops"] = stops
    return found


def _numbers(stop: Stop) -> tuple[str, ...]:
    """Return what varies in a stop, at the places of the core's columns."""
    if not stop._of_curve:
        return _OF_STOPS
    # Restitution is no number of its own.
    return (*(name if name != "restitution" else "" for name in _OF_STOPS), *stop._of_curve)


def _symmetric(name: str, given: Array) -> Array:
    """Refuse a matrix that is not symmetric."""
    apart = np.abs(given - given.T)
    i, j = map(int, np.unravel_index(apart.argmax(), apart.shape))
    if apart[i, j] > 1e-14 * np.abs(given).max():
        allowed = f"{name}[{j}, {i}] = {float(given[j, i])!r}: the matrix is symmetric"
        reject(f"{name}[{i}, {j}]", float(given[i, j]), allowed)
    return given


def slopes_of_function(structure: Structure, name: str, given: Any) -> dict[str, Any]:
    """Return the derivatives of the fields that a function makes of one number, there.

    By differences of fourth order; beyond an end of what is allowed from one side.
    """
    if not isinstance(given, tuple):
        reject(name, given, "a pair (function, number): where it is to be differentiated, too")
    function, value = given
    if not callable(function):
        reject(name, function, "a function of one number that makes the structure")
    value = number(name, value)
    step = _STEP * (abs(value) or 1.0)
    own = _leaves(structure)
    made = _made(function, name, value)
    here = _leaves(made)
    for field, entries in own.items():
        there = here.get(field)
        size = np.abs(entries).max(initial=0.0)
        alike = there is not None and there.shape == entries.shape
        if not alike or np.abs(there - entries).max(initial=0.0) > _SAME * (size or 1.0):
            at = f"at {name} = {value!r} the function makes another structure than the run has: "
            raise ParameterError(f"{at}it differs in {field}")
    _check_alike(structure, made, f"at {name} = {value!r}")
    beside = _differences(lambda k: _made(function, name, value + k * step))
    for _, other in beside:
        _check_alike(structure, other, f"beside {name} = {value!r}")
    rows = [(weight, _leaves(other)) for weight, other in beside]
    direction: dict[str, Any] = {}
    for field in own:
        # Of what does not change all differences are 0.
        moved = [weight * (row[field] - here[field]) for weight, row in rows]
        slope = np.sum(moved, axis=0) / (12.0 * step)
        if slope.any():
            direction[field] = slope
    for fixed in _FIXED & {*direction}:
        reject(name, fixed, "a function that leaves it as it is")
    if "stops" in direction:
        slopes = direction.pop("stops")
        for place, row in enumerate(slopes):
            names = _numbers(structure.stops[place])
            direction |= {f"{name}_{place}": x for name, x in zip(names, row, strict=False) if x}
    return direction


def _check_alike(structure: Structure, other: Structure, where: str) -> None:
    """Refuse a structure that differs in more than its numbers."""
    mine, theirs = _form(structure), _form(other)
    for field in {**mine, **theirs}:
        if mine.get(field) != theirs.get(field):
            raise ParameterError(
                f"{where} the function makes another structure, with other {field}; allowed: one "
                "whose numbers vary, and nothing else"
            )


def _form(structure: Structure) -> dict[str, Any]:
    """Return by field what a structure is, beside its numbers."""
    fields = {
        name: value if isinstance(value, str) else np.shape(value)
        for name, value in structure._fields().items()
        if name != "stops"
    }
    return {"stops": [tuple(_numbers(stop)) for stop in structure.stops]} | fields


# Steps and weights of differences of fourth order, over 12 steps: central, and of either side.
_CENTRAL: Final = ((-2.0, 1.0), (-1.0, -8.0), (1.0, 8.0), (2.0, -1.0))
_FORWARD: Final = ((1.0, 48.0), (2.0, -36.0), (3.0, 16.0), (4.0, -3.0))
_BACKWARD: Final = tuple((-k, -weight) for k, weight in _FORWARD)


def _differences(at: Callable[[float], Any]) -> list[tuple[float, Any]]:
    """Return weights and what a function makes so many steps away, on both sides if it can."""
    for rule in (_CENTRAL, _FORWARD):
        with suppress(ParameterError):
            return [(weight, at(k)) for k, weight in rule]
    return [(weight, at(k)) for k, weight in _BACKWARD]


def _made(function: Callable[[float], Any], name: str, value: float) -> Structure:
    try:
        found = function(value)
    except ParameterError as error:
        raise ParameterError(f"at {name} = {value!r}: {error}") from error
    if not isinstance(found, Structure):
        at = f"at {name} = {value!r}: the function gave {in_short(found)}"
        raise ParameterError(f"{at}; allowed: a vibroimpact.Structure")
    return found


def _leaves(structure: Structure) -> dict[str, NDArray[Any]]:
    """Return all numbers of a structure, by field, with those of its stops."""
    fields = dict(structure._fields())
    stops = fields.pop("stops")
    found = {
        name: np.asarray(value) for name, value in fields.items() if not isinstance(value, str)
    }
    found["stops"] = np.zeros((len(stops), len(_OF_STOPS) + _OF_CURVES))
    for row, stop in zip(found["stops"], stops, strict=True):
        for column, name in enumerate(_numbers(stop)):
            row[column] = getattr(stop, name) if name else 0.0
    found["normal"] = np.array([stop.normal for stop in stops], dtype=float)
    tangents = [np.zeros_like(s.normal) if s.tangent is None else s.tangent for s in stops]
    found["tangent"] = np.array(tangents, dtype=float)
    return found
