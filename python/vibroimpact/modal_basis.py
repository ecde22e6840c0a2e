"""The coordinates in which a structure is compiled: its own, or modal ones p, with q = Phi p.

Phi, (n, N), has the mode shapes in its columns; a row of the structure becomes row @ Phi.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from . import _core
from .arguments import matrix, reject, vector
from .by_value import fixed
from .errors import ParameterError, StateError
from .stop import Stop

Array = NDArray[np.float64]

# Frequencies that the compiled core takes; their squares are those of a stiffness matrix.
_LEAST, _MOST = 1e-24, 1e24
# Of modes whose w^2 is a smaller part of the largest it makes rigid-body modes, w = 0.
_RIGID = 1e-12
# A start may lie by this part of its size outside the span of the modes: rounding, amplified by
# shapes that are nearly alike.
_OUTSIDE = 1e-10
# Singular values below this part of the largest are those of dependent shapes.
_DEPENDENT = 1e-10


@dataclass(frozen=True, eq=False)
class Matrices:
    """Mass and stiffness (N, N) of a structure that is compiled in its own coordinates."""

    is_modal: ClassVar = False

    mass: Array
    stiffness: Array

    @classmethod
    def of(cls, mass: Any, stiffness: Any) -> Matrices:
        """Check what a caller gives.

        Raises
        ------
        ParameterError
            Names the argument and what is allowed.
        """
        checked = fixed(matrix("mass", mass))
        count = len(checked)
        return cls(checked, fixed(matrix("stiffness", stiffness, rows=count, columns=count)))

    @property
    def sizes(self) -> tuple[int, int]:
        """Numbers of coordinates and of modes."""
        return len(self.mass), len(self.mass)

    @property
    def given(self) -> dict[str, Array]:
        """The arguments that it was made of."""
        return {"mass": self.mass, "stiffness": self.stiffness}

    @property
    def matrices(self) -> tuple[Array, Array]:
        """Mass and stiffness of the compiled structure."""
        return self.mass, self.stiffness

    def on(self, name: str, row: NDArray[Any]) -> NDArray[Any]:
        """Return a row in the coordinates of the compiled structure."""
        return row

    def square(self, name: str, matrix: Array) -> Array:
        """Return a symmetric matrix in these coordinates."""
        return matrix

    def stop(self, stop: Stop, place: int) -> _core.Stop:
        """Return the compiled form of a stop."""
        return stop._compiled

    def physical(self, states: Array) -> Array:
        """Return coordinates of the compiled structure in physical ones."""
        return states

    def modal(self, states: Array) -> Array:
        """Return physical coordinates of starts in those of the compiled structure."""
        return states

    def near(self, states: Array) -> Array:
        """Return the same without a check."""
        return states


@dataclass(frozen=True, eq=False)
class ModalBasis:
    """Natural frequencies (N,), ascending, and M-orthonormal shapes (n, N) of given modes."""

    is_modal: ClassVar = True

    frequencies: Array
    shapes: Array

    @classmethod
    def of(cls, frequencies: Any, shapes: Any, modal_mass: Any) -> ModalBasis:
        """Check what a caller gives; ``modal_mass`` None means shapes orthonormal in M.

        Raises
        ------
        ParameterError
            Names the argument, its value and what is allowed.
        """
        frequencies = vector("frequencies", frequencies)
        count = len(frequencies)
        if not count:
            reject("frequencies", frequencies.tolist(), "at least one number")
        highest = float(frequencies.max())
        before = 0.0
        for i, frequency in enumerate(frequencies.tolist()):
            name = f"frequencies[{i}]"
            if frequency != 0.0 and not _LEAST <= frequency <= _MOST:
                reject(name, frequency, f"0, or a number in [{_LEAST:g}, {_MOST:g}]")
            if frequency < before:
                reject(name, frequency, f"at least {before!r}: frequencies ascend")
            if frequency and frequency * frequency < _RIGID * (highest * highest):
                reject(name, frequency, f"0, or at least {_RIGID**0.5:g} of the highest frequency")
            before = frequency
        shapes = matrix("shapes", shapes, columns=count)
        if modal_mass is not None:
            masses = vector("modal_mass", modal_mass, length=count, spread=True)
            for i, mass in enumerate(masses.tolist()):
                if mass <= 0.0:
                    reject(f"modal_mass[{i}]", mass, "a finite number > 0")
            with np.errstate(over="ignore"):
                scaled = shapes / np.sqrt(masses)
            if not np.isfinite(scaled).all():
                k, i = map(int, np.argwhere(~np.isfinite(scaled))[0])
                allowed = f"a number that is finite over the root of modal_mass[{i}]"
                reject(f"shapes[{k}, {i}]", float(shapes[k, i]), allowed)
            shapes = scaled + 0.0  # what underflows to -0.0 is 0
        return cls(fixed(frequencies), fixed(shapes))

    @property
    def sizes(self) -> tuple[int, int]:
        """Numbers of coordinates and of modes."""
        coordinates, modes = self.shapes.shape
        return coordinates, modes

    @property
    def given(self) -> dict[str, Array]:
        """The arguments that it was made of."""
        return {"frequencies": self.frequencies, "shapes": self.shapes}

    @property
    def matrices(self) -> tuple[Array, Array]:
        """Mass and stiffness of the compiled structure."""
        return np.eye(len(self.frequencies)), np.diag(self.frequencies**2)

    def on(self, name: str, row: NDArray[Any]) -> NDArray[Any]:
        """Return a real or complex row (n,) in modal coordinates, row @ Phi.

        The sums are rounded once, alike everywhere; those of BLAS depend on the machine.

        Raises
        ------
        ParameterError
            If one of them leaves the range of floats; it names the row.
        """
        if np.iscomplexobj(row):
            result = np.empty(len(self.frequencies), np.complex128)
            result.real, result.imag = self.on(name, row.real), self.on(name, row.imag)
            return result
        used = np.flatnonzero(row)
        with np.errstate(over="ignore"):
            terms = row[used, np.newaxis] * self.shapes[used]
        try:
            sums = np.array([math.fsum(column) for column in terms.T])
        except (OverflowError, ValueError):  # beyond the range, or a sum of inf and -inf
            sums = np.array([math.inf])
        if not np.isfinite(sums).all():
            raise ParameterError(f"{name} in modal coordinates, times shapes, is not finite")
        return sums

    def square(self, name: str, matrix: Array) -> Array:
        """Return a symmetric matrix (n, n) in modal coordinates, Phi^T A Phi, symmetric (N, N)."""
        half = np.array([self.on(name, row) for row in matrix])
        whole = np.array([self.on(name, column) for column in half.T])
        result: Array = 0.5 * (whole + whole.T)
        return result

    def stop(self, stop: Stop, place: int) -> _core.Stop:
        """Return the compiled form of the stop number ``place`` in modal coordinates.

        Raises
        ------
        ParameterError
            If no mode moves along its normal.
        """
        name = f"stops[{place}]"
        normal = self.on(f"{name}.normal", stop.normal)
        if not normal.any():
            reject(f"{name}.normal", stop.normal.tolist(), "a row that some mode moves")
        tangent = None if stop.tangent is None else self.on(f"{name}.tangent", stop.tangent)
        return stop._with_rows(normal, tangent)

    def physical(self, states: Array) -> Array:
        """Return modal coordinates (..., N) in physical ones, (..., n)."""
        result = np.zeros((*states.shape[:-1], len(self.shapes)))
        # Mode by mode: the bits of a row do not depend on how many rows there are.
        for i, shape in enumerate(self.shapes.T):
            result += states[..., i, np.newaxis] * shape
        return result

    def modal(self, states: Array) -> Array:
        """Return physical coordinates (..., n) of starts in modal ones, (..., N).

        Raises
        ------
        StateError
            If they lie outside the span of the modes, or do not determine modal coordinates.
        """
        if states.any() and self._inverse is None:
            allowed = "allowed: 0, all modes at rest"
            raise StateError(f"initial other than 0 is not allowed: {self._open}; {allowed}")
        with np.errstate(over="ignore", invalid="ignore"):
            result = self.near(states)
            outside = np.abs(states - self.physical(result)).max(axis=-1)
        size = np.abs(states).max(axis=-1)
        # Also where the modal coordinates are beyond the range of floats.
        far = ~(outside <= _OUTSIDE * size)
        if far.any():
            place = tuple(int(i) for i in np.argwhere(far)[0])
            *run, row = place
            which = f"initial[{', '.join(map(str, run))}]" if run else "initial"
            raise StateError(
                f"{'qv'[row]} of {which} lies outside the span of the modes by "
                f"{outside[place] / size[place]:.3g} of its size; allowed: shapes @ p for any "
                "modal coordinates p"
            )
        return result

    def near(self, states: Array) -> Array:
        """Return the modal coordinates that come nearest.

        Raises
        ------
        StateError
            If the shapes are dependent at these coordinates.
        """
        if not states.any():
            return np.zeros((*states.shape[:-1], len(self.frequencies)))
        if self._inverse is None:
            raise StateError(self._open)
        with np.errstate(over="ignore", invalid="ignore"):
            result: Array = states @ self._inverse.T
            # Once more for what rounding has left.
            return result + (states - self.physical(result)) @ self._inverse.T

    @property
    def _open(self) -> str:
        """What is said where the shapes are dependent."""
        n, count = self.shapes.shape
        return f"{n} coordinates do not determine {count} modes whose shapes are dependent there"

    @cached_property
    def _inverse(self) -> Array | None:
        """The least-squares inverse (N, n) of the shapes; None where they are dependent."""
        # Each mode has a unit of its own: the shapes are compared by their directions.
        sizes = np.abs(self.shapes).max(axis=0)
        if not sizes.all() or len(self.shapes) < len(sizes):
            return None
        left, values, right = np.linalg.svd(self.shapes / sizes, full_matrices=False)
        if values[-1] <= _DEPENDENT * values[0]:
            return None
        with np.errstate(over="ignore"):
            inverse: Array = (right.T / values) @ left.T / sizes[:, np.newaxis]
        return inverse


def damping_of(ratios: Array, mass: Array, compiled: _core.Structure) -> Array:
    """Return C = M Phi diag(2 zeta_i omega_i) Phi^T M in coordinates of a compiled structure."""
    half = mass @ compiled.shapes * np.sqrt(2.0 * ratios * compiled.frequencies)
    return half @ half.T
