"""Any linear structure with rigid stops, validated once and then immutable.

    M q'' + C q' + K q = c + Re(F e^{i psi}) - sum_j (n_j P_j - t_j Q_j),    psi = omega t + phi
    g_j = n_j . q - gap_j - A_j cos(omega t + phi_j) <= 0

Source: the page on structures.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .arguments import naming, reject, starts
from .by_value import arguments_of, fixed
from .hints import close_to
from .interruption import interruptible
from .keyword_types import CoulombLaw, Simultaneous, StructureChanges, completing
from .machine import Machine
from .modal_basis import Matrices, ModalBasis, damping_of
from .showing import Facts, counted, in_a_line
from .stop import (
    OF_STOPS,
    Stop,
    checked_stops,
    from_dicts,
    is_of_stops,
    numbered,
    numbers_by_name,
    numbers_in_words,
    with_changes,
)
from .structure_fields import checked_fields, drive_of_pairs, warn_of_ratios
from .structure_rest import where_to_begin
from .verbs import verb

Array = NDArray[np.float64]


@interruptible
@dataclass(frozen=True, eq=False, repr=False, init=False)
class Structure(Machine):
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
        C, (N, N), symmetric and positive semidefinite; ``damping_matrix`` has that of the ratios.
    damping_ratios
        In place of ``damping``: damping ratios (N,) of the modes in the order of ascending natural
        frequency, or one number for all, >= 0; 0 for a mode of frequency 0, equal for equal
        frequencies.
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

    Warns
    -----
    UserWarning
        If a damping ratio is 1 or more, as when it is given in per cent.

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

    _WHAT = "structure"
    _AXES = 2

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
    # In whose coordinates it is computed.
    _basis: Matrices | ModalBasis

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
        self._set(
            Matrices.of(mass, stiffness),
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
        warn_of_ratios(self.damping_ratios)

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
            phi_i M phi_i of the shapes, (N,) or one number for all, > 0; None for shapes that are
            orthonormal in M.
        damping
            C, (n, n), symmetric and positive semidefinite.
        damping_ratios
            In place of ``damping``: damping ratios of the modes, (N,) or one number, as in
            Structure.
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
        structure = object.__new__(cls)
        structure._set(
            ModalBasis.of(frequencies, shapes, modal_mass),
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
        warn_of_ratios(structure.damping_ratios)
        return structure

    def _set(
        self, basis: Matrices | ModalBasis, like: _core.Structure | None = None, **given: Any
    ) -> None:
        """Check and set the fields; ``like``: compiled in the same basis."""
        count, modes = basis.sizes
        fields = {"mass": None, "stiffness": None, **basis.given, "_basis": basis}
        fields |= checked_fields(given, count=count, modes=modes)
        for name in self.__dataclass_fields__:
            object.__setattr__(self, name, fields[name])
        # No field: it has no influence on equality, hash, repr or pickle.
        vars(self)["_compiled"] = self._compile(like)

    @cached_property
    def _compiled(self) -> _core.Structure:
        return self._compile(None)

    def _compile(self, like: _core.Structure | None) -> _core.Structure:
        """Build the compiled form, which checks the ranges."""
        basis = self._basis
        drive = basis.on("drive_amplitude", self.drive_amplitude)
        return _core.Structure(
            *basis.matrices,
            [basis.stop(stop, place) for place, stop in enumerate(self.stops)],
            damping=None if self.damping is None else basis.square("damping", self.damping),
            damping_ratios=self.damping_ratios,
            static_load=basis.on("static_load", self.static_load),
            drive_amplitude=drive.astype(np.complex128),
            drive_frequency=self.drive_frequency,
            phase=self.phase,
            law=self.law,
            simultaneous=self.simultaneous,
            like=like,
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
        known = self._basis.given.get("frequencies")
        return fixed(self._compiled.frequencies) if known is None else known

    @cached_property
    def shapes(self) -> Array:
        """Mode shapes (N, N), that of mode i in column i, orthonormal in M; of `from_modes` (n, N).

        Its sign is that of the computation, or of what was given.
        """
        known = self._basis.given.get("shapes")
        return fixed(self._compiled.shapes) if known is None else known

    @cached_property
    def damping_matrix(self) -> Array | None:
        """The damping matrix C that holds, (N, N): as given, or that of the damping ratios.

        C = M Phi diag(2 zeta_i omega_i) Phi^T M, zeros without damping. Of a structure `from_modes`
        (n, n), and None with damping ratios: as its mass matrix it does not follow from the modes.

        Examples
        --------
        >>> oscillator = vi.Structure([[2]], [[8]], [vi.Stop([1], 0.3, 0.8)], damping_ratios=0.05)
        >>> oscillator.damping_matrix.tolist()  # 2 zeta sqrt(K M)
        [[0.4]]
        """
        if self.damping is not None:
            return self.damping
        if self.damping_ratios is None or not self.damping_ratios.any():
            return fixed(np.zeros((self.coordinates, self.coordinates)))
        if self.mass is None:
            return None
        return fixed(damping_of(self.damping_ratios, self.mass, self._compiled))

    @completing(StructureChanges)
    def replace(self, **changes: Any) -> Self:
        """Return a structure with some parameters changed.

        Parameters
        ----------
        **changes
            New values by name: of the arguments that made the structure; ``gap``, ``restitution``,
            ``friction`` of all stops, or a number of the restitution curve of those that have it,
            as ``r_1``; or of one, as ``gap_0``, ``restitution_2``, ``r_1_0``, which goes before
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
        fields = self._fields()
        maker = self._maker(fields)
        known, _ = arguments_of(maker)
        own = {name: value for name, value in changes.items() if name in known}
        of_stops = {name: value for name, value in changes.items() if is_of_stops(name)}
        for name in changes.keys() - own.keys() - of_stops.keys():
            names = [*known, *OF_STOPS, *(f"{each}_0" for each in OF_STOPS)]
            hint = close_to(name, names) or f"; known: {', '.join(names)} ..."
            raise TypeError(f"replace() got an unexpected keyword argument {name!r}{hint}")
        if "modal_mass" in own and "shapes" not in own:
            reject("modal_mass", own["modal_mass"], "a value beside shapes=, which it scales")
        for name, other in (("damping", "damping_ratios"), ("damping_ratios", "damping")):
            if name in own:
                fields.pop(other, None)
        fields |= own
        if of_stops:
            fields["stops"] = with_changes(checked_stops(fields["stops"]), of_stops)
        if not own.keys().isdisjoint({*self._basis.given, "modal_mass"}):
            return maker(**fields)
        # Its modes, which take longest, stay.
        structure = object.__new__(type(self))
        rest = {name: fields.get(name) for name in _REST}
        structure._set(self._basis, self._compiled, **rest)
        return structure

    @classmethod
    def _maker(cls, fields: Mapping[str, Any]) -> Callable[..., Self]:
        return cls if fields.keys().isdisjoint(_OF_MODES) else cls.from_modes

    @classmethod
    def _arguments(cls, fields: Mapping[str, Any]) -> dict[str, Any]:
        return {**fields, "stops": from_dicts(fields["stops"])}

    @classmethod
    def _of_json(cls, fields: dict[str, Any]) -> dict[str, Any]:
        drive = fields.get("drive_amplitude")
        return fields if drive is None else {**fields, "drive_amplitude": drive_of_pairs(drive)}

    @property
    def _numbers_by_name(self) -> tuple[str, ...]:
        return numbers_by_name([stop.restitution for stop in self.stops])

    @property
    def _coordinates_by_name(self) -> tuple[str, ...]:
        return tuple(f"{row}_{k}" for row in "qv" for k in range(self.coordinates))

    @property
    def _fastest(self) -> float:
        return max(float(self.frequencies[-1]), self.drive_frequency)

    @property
    def _usual_period(self) -> float:
        if np.isfinite(self.drive_period):
            return self.drive_period
        moving = self.frequencies[self.frequencies > 0.0]
        return 2.0 * np.pi / float(moving[0]) if len(moving) else 1.0

    def _least_size(self, name: str, start: Array) -> float:
        kind = one.what if (one := numbered(name)) else name
        if name == "drive_frequency":
            return _LEAST_PART * self._fastest
        if kind not in ("gap", "q", "v"):
            return _LEAST_PART
        # The units of length are not known: what gaps and start have of it.
        q, v = np.abs(start).reshape(2, -1).max(axis=1)
        lengths = [*(abs(stop.gap) for stop in self.stops), q]
        lengths += [v / self._fastest] if self._fastest > 0.0 else []
        length = float(max(lengths)) or 1.0
        return _LEAST_PART * length * (self._fastest or 1.0 if kind == "v" else 1.0)

    def _turned(self, angle: float) -> Structure:
        turn = 2.0 * np.pi
        stops = [each.replace(phase=(each.phase + angle) % turn) for each in self.stops]
        moving = any(each.amplitude for each in self.stops)
        changes: dict[str, Any] = {"stops": stops} if moving else {}
        return self.replace(phase=(self.phase + angle) % turn, **changes)

    @property
    def _stop_count(self) -> int:
        return len(self.stops)

    @property
    def _turning(self) -> dict[str, Any]:
        moving = (place for place, each in enumerate(self.stops) if each.amplitude)
        return {"phase": 1.0, **{f"phase_{place}": 1.0 for place in moving}}

    def _accelerations(self, states: Array, phases: Array) -> Array:
        basis = self._basis
        rows = basis.near(states.reshape(len(states), 2, -1))
        mass, stiffness = basis.matrices
        drive = basis.on("drive_amplitude", self.drive_amplitude)
        force = basis.on("static_load", self.static_load) - rows[:, 0] @ stiffness
        force = force + (np.exp(1j * phases)[:, None] * drive).real
        if self.damping is not None:
            force -= rows[:, 1] @ basis.square("damping", self.damping)
        elif self.damping_ratios is not None:
            force -= rows[:, 1] @ damping_of(self.damping_ratios, mass, self._compiled)
        return basis.physical(np.linalg.solve(mass, force.T).T)

    @property
    def _numbers_in_words(self) -> str:
        return numbers_in_words([stop.restitution for stop in self.stops])

    @property
    def _made_as(self) -> str:
        drive = ", ".join(["F", *["0"] * (self.coordinates - 1)][:4])
        drive += ", ..." if self.coordinates > 4 else ""
        return f", such as lambda F: structure.replace(drive_amplitude=[{drive}])"

    def _starts(self, initial: Any) -> Array:
        return starts(initial, self.coordinates)

    def _where_to_begin(self, starts: Array) -> str:
        return where_to_begin(self._basis, self.stops, self.static_load, starts)

    def _chosen(self, units: Any) -> None:
        if units is not None:
            reject("units", units, "None: a structure has no scales")

    def _run_class(self) -> Any:
        return verb("structure_run")

    def _to_core(self, states: Array) -> Array:
        return self._basis.modal(states)

    def _from_core(self, states: Array) -> Array:
        return self._basis.physical(states)

    def _fields(self) -> dict[str, Any]:
        fields = self._basis.given | {name: getattr(self, name) for name in _REST}
        return {name: value for name, value in fields.items() if value is not None}

    def _facts(self) -> Facts:
        words = {name: getattr(self, name) for name in ("drive_frequency", "law", "simultaneous")}
        stops = {f"stops[{place}]": stop._line() for place, stop in enumerate(self.stops)}
        return {
            "coordinates": self.coordinates,
            "frequencies": in_a_line(self.frequencies),
            **words,
            **stops,
        }

    def _in_short(self) -> str:
        counts = {"coordinate": self.coordinates, "stop": len(self.stops)}
        return f"a structure of {' with '.join(counted(n, what) for what, n in counts.items())}"

    def _made_by(self) -> str:
        return "Structure.from_modes" if self._basis.is_modal else "Structure"


# A large change of a number that is small itself, as part of its usual size.
_LEAST_PART = 0.1
_REST = (
    *("stops", "damping", "damping_ratios", "static_load", "drive_amplitude", "drive_frequency"),
    *("phase", "law", "simultaneous"),
)
# Arguments that only `from_modes` has.
_OF_MODES = ("frequencies", "shapes", "modal_mass")
