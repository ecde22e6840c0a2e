"""Any linear structure with rigid stops, validated once and then immutable.

    M q'' + C q' + K q = c + Re(F e^{i psi}) - sum_j (n_j P_j - t_j Q_j),    psi = omega t + phi
    g_j = n_j . q - gap_j - A_j cos(omega t + phi_j) <= 0

Source: the page on structures.
"""

from __future__ import annotations

import inspect
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .arguments import (
    close_to,
    matrix,
    naming,
    reject,
    starts,
)
from .by_value import ByValue, check_fields, fixed, in_a_call
from .errors import ParameterError
from .interruption import interruptible
from .keyword_types import CoulombLaw, Simultaneous, StructureChanges, completing
from .modal_basis import ModalBasis, projected
from .showing import Facts, Shown, in_a_line
from .stop import OF_STOPS, Stop, checked_stops, from_dicts, is_of_stops, with_changes
from .structure_fields import checked_fields

Array = NDArray[np.float64]


@interruptible
@dataclass(frozen=True, eq=False, repr=False, init=False)
class Structure(ByValue, Shown):
    """A linear structure of N coordinates with rigid stops, in any consistent units.

    Immutable, comparable, hashable, picklable; ``eval(repr(structure)) == structure``. Its arrays
    are read-only. Time is what its frequencies are measured in; there are no SI scales.

    Parameters
    ----------
    mass
        M, (N, N), symmetric and positive definite; N at most 256 (`from_modes` for larger models).
    stiffness
        K, (N, N), symmetric and positive semidefinite.
    stops
        The stops, each a Stop with rows of N entries; one Stop stands for a sequence of one.
    damping
        C, (N, N), symmetric and positive semidefinite.
    damping_ratios
        In place of ``damping``: damping ratios (N,) of the modes in the order of ascending natural
        frequency, >= 0; 0 for a mode of frequency 0, equal for equal frequencies.
    static_load
        Constant load c, (N,); zeros where none is given.
    drive_amplitude
        F, (N,), real or complex: the drive is Re(F e^{i (omega t + phase)}). Zeros where none is
        given.
    drive_frequency
        omega in [0, 1e50]; 0 is a drive that stands still, without drive period.
    phase
        Phase of the drive at t = 0 in radians.
    law
        Impact law of all stops: ``"poisson"``, ``"newton"`` or ``"energetic"``, as in System.
        Without friction they agree.
    simultaneous
        What happens when stops that act on each other meet at one instant, or one of them while
        another is closed: ``"stop"``, the run ends; ``"sequence"``, one impact after another, the
        lowest index first; ``"together"``, all at once, without friction.

    Raises
    ------
    ParameterError
        Names the parameter, its value and what is allowed.

    Examples
    --------
    Two masses on springs; the second meets a stop.

    >>> import vibroimpact as vi
    >>> structure = vi.Structure(
    ...     [[1, 0], [0, 1]], [[2, -1], [-1, 2]], [vi.Stop([0, 1], 0.3, 0.8)],
    ...     damping_ratios=[0.01, 0.02], drive_amplitude=[1, 0], drive_frequency=1.2,
    ... )
    >>> structure.frequencies.round(3)
    array([1.   , 1.732])
    >>> structure == structure.replace(gap=0.3)
    True
    """

    mass: Array | None
    stiffness: Array | None
    stops: tuple[Stop, ...]
    damping: Array | None
    damping_ratios: Array | None
    static_load: Array
    drive_amplitude: Array | NDArray[np.complex128]
    drive_frequency: float
    phase: float
    law: CoulombLaw
    simultaneous: Simultaneous
    # What `from_modes` was given; its structure is computed in modal coordinates.
    _basis: ModalBasis | None

    @naming
    def __init__(
        self,
        mass: ArrayLike,
        stiffness: ArrayLike,
        stops: Stop | Sequence[Stop],
        *,
        damping: ArrayLike | None = None,
        damping_ratios: ArrayLike | None = None,
        static_load: ArrayLike | None = None,
        drive_amplitude: ArrayLike | None = None,
        drive_frequency: float = 0.0,
        phase: float = 0.0,
        law: CoulombLaw = "poisson",
        simultaneous: Simultaneous = "stop",
    ) -> None:
        checked = matrix("mass", mass)
        count = len(checked)
        self._set(
            None,
            count,
            mass=fixed(checked),
            stiffness=fixed(matrix("stiffness", stiffness, rows=count, columns=count)),
            stops=stops,
            damping=damping,
            damping_ratios=damping_ratios,
            static_load=static_load,
            drive_amplitude=drive_amplitude,
            drive_frequency=drive_frequency,
            phase=phase,
            law=law,
            simultaneous=simultaneous,
        )

    @classmethod
    @naming
    def from_modes(
        cls,
        frequencies: ArrayLike,
        shapes: ArrayLike,
        stops: Stop | Sequence[Stop],
        *,
        modal_mass: ArrayLike | None = None,
        damping: ArrayLike | None = None,
        damping_ratios: ArrayLike | None = None,
        static_load: ArrayLike | None = None,
        drive_amplitude: ArrayLike | None = None,
        drive_frequency: float = 0.0,
        phase: float = 0.0,
        law: CoulombLaw = "poisson",
        simultaneous: Simultaneous = "stop",
    ) -> Self:
        """Build a structure from N of its modes, as finite elements or a measurement give them.

        The motion stays in the span of these modes: q = shapes @ p. All else is physical: rows of
        stops, loads, damping, starts and results have n coordinates. ``mass`` and ``stiffness`` of
        such a structure are None.

        Parameters
        ----------
        frequencies
            Natural frequencies (N,), ascending: 0, or at least 1e-6 of the highest; in radians per
            unit of time, 2 pi times those in Hz.
        shapes
            (n, N), column i the shape of mode i.
        stops
            As in Structure, with rows of n entries.
        modal_mass
            phi_i M phi_i of the shapes, (N,), > 0; None for shapes that are orthonormal in M.
        damping
            C, (n, n), symmetric and positive semidefinite.
        damping_ratios
            In place of ``damping``: damping ratios (N,) of the modes, as in Structure.
        static_load
            Constant load c, (n,).
        drive_amplitude
            F, (n,), real or complex, as in Structure.
        drive_frequency
            omega in [0, 1e50].
        phase
            Phase of the drive at t = 0 in radians.
        law
            Impact law, as in Structure.
        simultaneous
            What happens at stops that are met at one instant, as in Structure.

        Raises
        ------
        ParameterError
            Names the parameter, its value and what is allowed.

        Examples
        --------
        Two modes of a beam, known at three points; the last of them meets a stop.

        >>> beam = vi.Structure.from_modes(
        ...     [22.0, 138.0], [[0.3, -0.7], [0.7, -0.5], [1.0, 1.0]],
        ...     [vi.Stop([0, 0, 1], 0.01, 0.7)], modal_mass=[0.25, 0.25],
        ... )
        >>> beam.coordinates, beam.shapes[2].tolist()
        (3, [2.0, 2.0])
        """
        basis = ModalBasis.of(frequencies, shapes, modal_mass)
        structure = object.__new__(cls)
        structure._set(
            basis,
            len(basis.shapes),
            mass=None,
            stiffness=None,
            stops=stops,
            damping=damping,
            damping_ratios=damping_ratios,
            static_load=static_load,
            drive_amplitude=drive_amplitude,
            drive_frequency=drive_frequency,
            phase=phase,
            law=law,
            simultaneous=simultaneous,
        )
        return structure

    def _set(self, basis: ModalBasis | None, count: int, **given: Any) -> None:
        """Check and set the fields; ``count`` is the number of physical coordinates."""
        modes = count if basis is None else len(basis.frequencies)
        checked = checked_fields(given, count=count, modes=modes)
        for name, value in (checked | {"_basis": basis}).items():
            object.__setattr__(self, name, value)
        self._compiled  # noqa: B018  builds the compiled form, which checks the ranges

    @cached_property
    def _compiled(self) -> _core.Structure:
        # It is no field, so that it has no influence on equality, hash, repr or pickle.
        rest: dict[str, Any] = {
            "damping_ratios": self.damping_ratios,
            "drive_frequency": self.drive_frequency,
            "phase": self.phase,
            "law": self.law,
            "simultaneous": self.simultaneous,
        }
        basis = self._basis
        if basis is None:
            assert self.mass is not None
            assert self.stiffness is not None
            return _core.Structure(
                self.mass,
                self.stiffness,
                [stop._compiled for stop in self.stops],
                damping=self.damping,
                static_load=self.static_load,
                drive_amplitude=self.drive_amplitude.astype(np.complex128),
                **rest,
            )
        drive = basis.on("drive_amplitude", self.drive_amplitude)
        return _core.Structure(
            np.eye(len(basis.frequencies)),
            np.diag(basis.frequencies**2),
            [projected(stop, basis, place) for place, stop in enumerate(self.stops)],
            damping=None if self.damping is None else basis.square("damping", self.damping),
            static_load=basis.on("static_load", self.static_load),
            drive_amplitude=drive.astype(np.complex128),
            **rest,
        )

    @property
    def coordinates(self) -> int:
        """Number of coordinates of starts and results: N, or n of a structure `from_modes`."""
        return len(self.static_load)

    @cached_property
    def frequencies(self) -> Array:
        """Natural frequencies (N,), ascending; 0 for a rigid-body mode, w^2 < 1e-12 of the largest.

        Where equal frequencies occur, their shapes are any orthonormal ones of their span.
        """
        return fixed(self._compiled.frequencies) if self._basis is None else self._basis.frequencies

    @cached_property
    def shapes(self) -> Array:
        """Mode shapes (N, N), that of mode i in column i, orthonormal in M; of `from_modes` (n, N).

        Its sign is that of the computation, or of what was given.
        """
        return fixed(self._compiled.shapes) if self._basis is None else self._basis.shapes

    @property
    def drive_period(self) -> float:
        """Drive period 2 pi/drive_frequency; infinite for ``drive_frequency = 0``."""
        return self._compiled.drive_period

    @completing(StructureChanges)
    def replace(self, **changes: Any) -> Self:
        """Return a structure with some parameters changed.

        Parameters
        ----------
        **changes
            New values by name: of the arguments that made the structure; ``gap``, ``restitution``,
            ``friction`` of all stops; or of one, as ``gap_0``, ``restitution_2``, which goes before
            that of all. One of ``damping``, ``damping_ratios`` takes the place of the other.

        Raises
        ------
        ParameterError
            Names the parameter, its value and what is allowed.

        Examples
        --------
        >>> structure.replace(gap_0=0.5).stops[0].gap
        0.5
        """
        maker = type(self) if self._basis is None else type(self).from_modes
        known = [*inspect.signature(maker).parameters]
        own = {name: value for name, value in changes.items() if name in known}
        of_stops = {name: value for name, value in changes.items() if is_of_stops(name)}
        for name in changes.keys() - own.keys() - of_stops.keys():
            names = [*known, *OF_STOPS, *(f"{each}_0" for each in OF_STOPS)]
            hint = close_to(name, names) or f"; known: {', '.join(names)} ..."
            raise TypeError(f"replace() got an unexpected keyword argument {name!r}{hint}")
        if "modal_mass" in own and "shapes" not in own:
            reject(
                "modal_mass", own["modal_mass"], "a value together with shapes=, which it scales"
            )
        fields = self._fields()
        for name, other in (("damping", "damping_ratios"), ("damping_ratios", "damping")):
            if name in own:
                fields.pop(other, None)
        fields |= own
        if of_stops:
            fields["stops"] = with_changes(checked_stops(fields["stops"]), of_stops)
        return maker(**fields)

    def to_dict(self) -> dict[str, Any]:
        """Return all fields by name, arrays as lists; ``Structure.from_dict`` goes back.

        Those that are None are not among them. The stops are a list of dicts.

        Examples
        --------
        >>> structure.to_dict()["stiffness"]
        [[2.0, -1.0], [-1.0, 2.0]]
        """
        fields = self._fields() | {"stops": [stop.to_dict() for stop in self.stops]}
        return {
            name: value.tolist() if isinstance(value, np.ndarray) else value
            for name, value in fields.items()
        }

    @classmethod
    def from_dict(cls, fields: Mapping[str, Any]) -> Self:
        """Build a structure from a mapping of argument names to values, of ``from_modes`` too.

        Raises
        ------
        ParameterError
            For a missing or unknown name, or a value out of range.

        Examples
        --------
        >>> vi.Structure.from_dict(structure.to_dict()) == structure
        True
        """
        modal = isinstance(fields, Mapping) and not fields.keys().isdisjoint(_OF_MODES)
        maker = cls.from_modes if modal else cls
        arguments = inspect.signature(maker).parameters.values()
        required = [each.name for each in arguments if each.default is each.empty]
        known = [each.name for each in arguments]
        check_fields("structure", fields, known=known, required=required)
        given = dict(fields)
        given["stops"] = from_dicts(given["stops"])
        return maker(**given)

    def to_json(self) -> str:
        """Return the fields as a JSON object; the numbers come back bit for bit.

        Complex numbers are pairs of real and imaginary part.

        Examples
        --------
        >>> structure.to_json()[:29]
        '{"mass": [[1.0, 0.0], [0.0, 1'
        """
        fields = self.to_dict()
        if np.iscomplexobj(self.drive_amplitude):
            fields["drive_amplitude"] = [[f.real, f.imag] for f in fields["drive_amplitude"]]
        return json.dumps(fields, allow_nan=False)

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Build a structure from the text of ``to_json``.

        Raises
        ------
        ParameterError
            If the text is no JSON object, or its fields do not make a structure.

        Examples
        --------
        >>> vi.Structure.from_json(structure.to_json()) == structure
        True
        """
        try:
            fields = json.loads(text)
        except (TypeError, ValueError) as error:
            raise ParameterError(f"not the JSON of a structure: {error}") from error
        drive = fields.get("drive_amplitude") if isinstance(fields, dict) else None
        if isinstance(drive, list) and all(isinstance(pair, list) for pair in drive):
            pairs = matrix("drive_amplitude", drive, columns=2)
            fields["drive_amplitude"] = pairs[:, 0] + 1j * pairs[:, 1]
        return cls.from_dict(fields)

    def _to_core(self, initial: Any) -> Array:
        """Return starts (2, n) or (k, 2, n), rows q and v, as (k, 2, N) of the compiled structure.

        Raises
        ------
        StateError
            For another shape, numbers that are not finite, or a start outside the span of the
            modes.
        """
        states = starts(initial, self.coordinates)
        return states if self._basis is None else self._basis.modal(states)

    def _from_core(self, states: Array) -> Array:
        """Return coordinates or velocities (..., N) of the compiled structure as (..., n)."""
        return states if self._basis is None else self._basis.physical(states)

    def _fields(self) -> dict[str, Any]:
        basis = self._basis
        if basis is None:
            first = {"mass": self.mass, "stiffness": self.stiffness}
        else:
            first = {"frequencies": basis.frequencies, "shapes": basis.shapes}
        rest = {name: getattr(self, name) for name in _REST}
        return {name: value for name, value in (first | rest).items() if value is not None}

    def _facts(self) -> Facts:
        names = ("drive_frequency", "law", "simultaneous")
        words = {name: getattr(self, name) for name in names}
        stops = {f"stops[{place}]": stop._line() for place, stop in enumerate(self.stops)}
        return {
            "coordinates": self.coordinates,
            "frequencies": in_a_line(self.frequencies),
            **words,
            **stops,
        }

    def __repr__(self) -> str:
        """Return the call that makes the structure."""
        maker = "Structure" if self._basis is None else "Structure.from_modes"
        return f"{maker}({in_a_call(self._fields() | {'stops': [*self.stops]})})"


_REST = (
    *("stops", "damping", "damping_ratios", "static_load", "drive_amplitude", "drive_frequency"),
    *("phase", "law", "simultaneous"),
)
# Arguments that only `from_modes` has.
_OF_MODES = ("frequencies", "shapes", "modal_mass")
