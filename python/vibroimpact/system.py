"""The parameters of the vibrating system, validated once and then immutable.

    x1'' + 2 zeta1 omega0 x1' + omega0^2 x1 = f1 cos(omega t + phi)
    x2'' + 2 zeta2        x2' +          x2 = f2 cos(omega t + phi)    while the gap is open

Source: Han, Jin & Hu (2004), eqs. (22), (23), as on the theory page, section 1;
symbols on the notation page.
"""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ._core import PARAMETERS
from .arguments import naming, number, pair, parameter, reject, states
from .errors import warn
from .interruption import interruptible
from .keyword_types import Changes, Contact, Law, completing
from .mechanics import Mechanics
from .physical import PURE, changed, dimensionless, quantities
from .restitution import HasRestitution, Restitution, in_units, restitution_of
from .scales import Scales, chosen, in_si, needed, not_in_si
from .showing import Facts
from .verbs import verb

# Names in code of the symbols in reference data.
SYMBOLS = {parameter.symbol: name for name, parameter in PARAMETERS.items()}

# The coordinates of a state, in its order.
COORDINATES = ("x1", "v1", "x2", "v2")

# A large change of a dimensionless number that is small itself.
_LEAST_SIZE = 0.1

# What each choice means, for the error about another one.
CHOICES = {
    "contact": {"oblique": "the tip of a pendulum", "direct": "head-on"},
    "law": {
        "poisson": "ratio of impulses",
        "newton": "ratio of velocities",
        "energetic": "ratio of works, Stronge's",
        "paper": "as printed in Han, Jin & Hu 2004",
    },
}


@interruptible
@dataclass(frozen=True, eq=False, repr=False, init=False, kw_only=True)
class System(HasRestitution, Mechanics):
    """Two bodies that collide obliquely (or head-on): all parameters, dimensionless.

    Immutable, comparable, hashable, picklable; ``eval(repr(system)) == system``. Systems with the
    same dimensionless numbers, contact and law are equal, whatever their ``scales``: they simulate
    alike, bit for bit.

    Parameters
    ----------
    mass_ratio
        M1/M2 >= 0; 0 means that impacts do not act on the second body.
    frequency_ratio
        omega_1/omega_2 >= 0; 0 is a free rotor, and below 1e-150 it is computed as one.
    restitution
        Coefficient of restitution in [0, 1]; or a ``RestitutionTable`` or ``RestitutionPowerLaw``,
        where it depends on the approach velocity.
    gap
        Delta/l, any value with a reachable free region.
    drive_frequency
        Omega/omega_2 in [0, 1e50]; 0 is a drive that stands still, without drive period.
    pendulum_damping
        Damping ratio zeta1 = C1/(2 sqrt(M1 K1 l^2)) of the pendulum, >= 0.
    oscillator_damping
        Damping ratio zeta2 = C2/(2 sqrt(M2 K2)) of the oscillator, >= 0.
    moment_amplitude
        Of the moment on the pendulum, f10/(M1 l^2 omega_2^2), any value.
    force_amplitude
        Of the force on the oscillator, f20/(K2 l), any value.
    static_moment
        Constant moment on the pendulum, C10/(M1 l^2 omega_2^2), any value.
    static_force
        Constant force on the oscillator, F20/(K2 l), any value.
    friction
        Coulomb's coefficient >= 0; must be 0 for ``contact="direct"``.
    phase
        Phase of the drive at t = 0 in radians.
    contact
        ``"oblique"`` or ``"direct"`` (head-on).
    law
        Impact law. Three of them follow friction along the impulse and differ in restitution:
        ``"poisson"``, impulses, P_II = r P_I; ``"newton"``, velocities, u_post = -r u;
        ``"energetic"``, works of the normal impulse, r^2 (Stronge). ``"paper"`` takes the formulas
        as printed in Han, Jin & Hu (2004), eqs. (14), (16), (18). **Warning**: ``"newton"`` can
        create energy where slip ends during an impact, a few per cent at the paper's mass ratio
        and without bound as ``mass_ratio`` goes to 0, and so can ``"paper"``.
    damping
        Shorthand (pendulum_damping, oscillator_damping).
    scales
        The units of the dimensionless numbers in SI: a Scales, or a mapping of its fields
        ``length``, ``mass``, ``time``; None where no units are known. ``from_physical`` knows them,
        and ``replace`` keeps them: in the changed system l, M1 and omega_2 are the same.

    Raises
    ------
    ParameterError
        Names the parameter, its value and the allowed range.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> system.drive_frequency, system.is_wall
    (1.8, False)
    >>> system == system.replace(gap=0.5)
    True
    """

    _WHAT = "system"
    _SHORTHANDS = ("damping",)
    # Without influence on the motion.
    _NOT_COMPARED = ("scales",)
    _AXES = 1

    mass_ratio: float
    frequency_ratio: float
    restitution: Any  # a float, or a curve
    gap: float
    drive_frequency: float
    pendulum_damping: float
    oscillator_damping: float
    moment_amplitude: float
    force_amplitude: float
    static_moment: float
    static_force: float
    friction: float
    phase: float
    contact: Contact
    law: Law
    scales: Scales | None

    # Written out rather than generated: an InitVar would leave ``system.damping`` as None.
    @naming
    def __init__(
        self,
        *,
        mass_ratio: float,
        frequency_ratio: float,
        restitution: Restitution,
        gap: float,
        drive_frequency: float,
        pendulum_damping: float = 0.0,
        oscillator_damping: float = 0.0,
        moment_amplitude: float = 0.0,
        force_amplitude: float = 0.0,
        static_moment: float = 0.0,
        static_force: float = 0.0,
        friction: float = 0.0,
        phase: float = 0.0,
        contact: Contact = "oblique",
        law: Law = "poisson",
        damping: tuple[float, float] | None = None,
        scales: Scales | Mapping[str, float] | None = None,
    ) -> None:
        if damping is not None:
            for name, value in (
                ("pendulum_damping", pendulum_damping),
                ("oscillator_damping", oscillator_damping),
            ):
                if number(name, value, PARAMETERS[name].allowed) != 0.0:
                    reject("damping", damping, f"None beside {name} = {value!r}")
            wanted = "a pair (pendulum_damping, oscillator_damping)"
            pendulum_damping, oscillator_damping = pair("damping", damping, wanted)
        numbers = {
            "mass_ratio": mass_ratio,
            "frequency_ratio": frequency_ratio,
            "gap": gap,
            "drive_frequency": drive_frequency,
            "pendulum_damping": pendulum_damping,
            "oscillator_damping": oscillator_damping,
            "moment_amplitude": moment_amplitude,
            "force_amplitude": force_amplitude,
            "static_moment": static_moment,
            "static_force": static_force,
            "friction": friction,
            "phase": phase,
        }
        for name, value in numbers.items():
            object.__setattr__(self, name, parameter(name, value, PARAMETERS[name].allowed))
        object.__setattr__(self, "restitution", restitution_of(restitution))
        for name, choice in (("contact", contact), ("law", law)):
            # A lone surrogate is no character; the core does not accept it.
            if not isinstance(choice, str) or not choice.isascii():
                reject(name, choice, "a name, as a string")
            if choice not in CHOICES[name]:
                allowed = [f"{known!r} ({what})" for known, what in CHOICES[name].items()]
                reject(name, choice, ", ".join(allowed))
            object.__setattr__(self, name, choice)
        object.__setattr__(self, "scales", Scales.of(scales))
        self._compiled  # noqa: B018  builds the compiled form, which checks the ranges

    @classmethod
    @naming
    def from_physical(
        cls,
        *,
        pendulum_mass: float,
        oscillator_mass: float,
        length: float,
        torsional_stiffness: float,
        stiffness: float,
        gap: float,
        restitution: Restitution,
        drive_frequency: float,
        torsional_damping: float = 0.0,
        damping: float = 0.0,
        moment_amplitude: float = 0.0,
        force_amplitude: float = 0.0,
        static_moment: float = 0.0,
        static_force: float = 0.0,
        friction: float = 0.0,
        phase: float = 0.0,
        contact: Contact = "oblique",
        law: Law = "poisson",
    ) -> Self:
        """Build a system from SI quantities (theory page, section 1).

        Its ``scales`` are l, M1 and 1/omega_2 = sqrt(M2/K2).

        Parameters
        ----------
        pendulum_mass
            M1 in kg, > 0.
        oscillator_mass
            M2 in kg, > 0.
        length
            Length l of the pendulum in m, > 0.
        torsional_stiffness
            K1 >= 0 in N m/rad.
        stiffness
            K2 > 0 in N/m.
        gap
            Delta in m.
        restitution
            As in ``System``; the speeds of a curve in m/s.
        drive_frequency
            Omega in rad/s, >= 0: 2 pi times that in Hz.
        torsional_damping
            C1 >= 0 in N m s/rad; C1 > 0 needs K1 > 0.
        damping
            C2 >= 0 in N s/m.
        moment_amplitude
            f10 in N m.
        force_amplitude
            f20 in N.
        static_moment
            Constant moment C10 on the pendulum, in N m.
        static_force
            Constant force F20 on the oscillator, in N.
        friction
            Coulomb's coefficient >= 0; must be 0 for ``contact="direct"``.
        phase
            Phase of the drive at t = 0 in radians.
        contact
            Geometry, ``"oblique"`` or ``"direct"``, as in ``System``.
        law
            Impact law, as in ``System``.

        Raises
        ------
        ParameterError
            Names the quantity, its value and the allowed range.

        Warns
        -----
        UserWarning
            If the gap is larger than the length in oblique contact: then the tip cannot reach body
            2 where it rests, as when one of them is in millimetres.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> machine = vi.System.from_physical(
        ...     pendulum_mass=3, oscillator_mass=5, length=0.1, torsional_stiffness=500,
        ...     stiffness=50e3, gap=0.05, restitution=0.8, drive_frequency=180,
        ...     moment_amplitude=300,
        ... )
        >>> round(machine.mass_ratio, 2), round(machine.gap, 2)
        (0.6, 0.5)
        """
        ratios = dimensionless(
            pendulum_mass=pendulum_mass,
            oscillator_mass=oscillator_mass,
            length=length,
            torsional_stiffness=torsional_stiffness,
            stiffness=stiffness,
            torsional_damping=torsional_damping,
            damping=damping,
            moment_amplitude=moment_amplitude,
            force_amplitude=force_amplitude,
            static_moment=static_moment,
            static_force=static_force,
            drive_frequency=drive_frequency,
            gap=gap,
        )
        system = cls(
            **ratios,
            restitution=in_units(restitution_of(restitution), 1.0 / ratios["scales"].speed),
            friction=friction,
            phase=phase,
            contact=contact,
            law=law,
        )
        # The tip is at sin x1 <= 1; body 2 rests at the gap, or where a preload presses it.
        if system.contact == "oblique" and system.gap + min(system.static_force, 0.0) > 1.0:
            warn(
                f"gap = {float(gap)} m is larger than length = {float(length)} m: the tip cannot "
                "reach body 2 where it rests; both are in metres"
            )
        return system

    def to_physical(self) -> dict[str, Any]:
        """Return the SI quantities of the system; ``System.from_physical`` goes back, to rounding.

        Returns
        -------
        dict
            The arguments of ``from_physical`` by name, in its units.

        Raises
        ------
        ParameterError
            If the system has no ``scales``, or ``mass_ratio`` is 0.

        Examples
        --------
        >>> machine = vi.System.from_physical(
        ...     pendulum_mass=3, oscillator_mass=5, length=0.1, torsional_stiffness=500,
        ...     stiffness=50e3, gap=0.05, restitution=0.8, drive_frequency=180,
        ... )
        >>> round(machine.to_physical()["torsional_stiffness"], 9)  # in N m/rad
        500.0
        """
        fields, scales = self._fields(), needed(self.scales)
        pure = {name: fields[name] for name in (*PURE, "contact", "law")}
        pure["restitution"] = in_units(self.restitution, scales.speed)
        return quantities(fields, scales) | pure

    @property
    def damping(self) -> tuple[float, float]:
        """Both damping ratios, (pendulum_damping, oscillator_damping)."""
        return self.pendulum_damping, self.oscillator_damping

    @completing(Changes)
    def replace(self, **changes: Any) -> Self:
        """Return a system with some parameters changed; ``damping=`` and ``scales=`` work too.

        Parameters
        ----------
        **changes
            New values by name. They are dimensionless, also where the system came from SI
            quantities. With ``units="SI"`` they are quantities of ``from_physical`` in its units,
            such as ``drive_frequency`` in rad/s or ``stiffness`` in N/m, and all other quantities
            stay as they are; the system needs ``scales``.

        Raises
        ------
        ParameterError
            Names the parameter, its value and the allowed range.

        Examples
        --------
        >>> system.replace(restitution=0.6).restitution
        0.6
        >>> machine = vi.System.from_physical(
        ...     pendulum_mass=3, oscillator_mass=5, length=0.1, torsional_stiffness=500,
        ...     stiffness=50e3, gap=0.05, restitution=0.8, drive_frequency=180,
        ... )
        >>> round(machine.replace(drive_frequency=150, units="SI").drive_frequency, 12)
        1.5
        """
        fields = self._fields()
        if in_si(changes.pop("units", None)):
            changes = changed(fields, needed(self.scales), changes)
        if "damping" in changes:
            del fields["pendulum_damping"], fields["oscillator_damping"]
        self._take_curve(fields, changes)
        return type(self)(**(fields | changes))

    def _fields(self) -> dict[str, Any]:
        # dataclasses.asdict copies every value deeply, at several times the cost.
        values = {name: getattr(self, name) for name in _FIELDS}
        if self.scales is not None:
            values["scales"] = dataclasses.asdict(self.scales)
        return values

    def _starts(self, initial: Any) -> NDArray[np.float64]:
        return states(initial)

    @property
    def _numbers_by_name(self) -> tuple[str, ...]:
        if not self._of_curve:
            return tuple(PARAMETERS)
        return (*(name for name in PARAMETERS if name != "restitution"), *self._of_curve)

    @property
    def _coordinates_by_name(self) -> tuple[str, ...]:
        return COORDINATES

    @property
    def _fastest(self) -> float:
        return max(1.0, self.frequency_ratio, self.drive_frequency)

    @property
    def _usual_period(self) -> float:
        return min(self.drive_period, 2.0 * np.pi)

    def _least_size(self, name: str, start: NDArray[np.float64]) -> float:
        return _LEAST_SIZE

    def _turned(self, angle: float) -> Self:
        return self.replace(phase=(self.phase + angle) % (2.0 * np.pi))

    @property
    def _stop_count(self) -> int:
        return 0

    @property
    def _turning(self) -> dict[str, Any]:
        return {"phase": 1.0}

    def _accelerations(
        self, states: NDArray[np.float64], phases: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        return self.accelerations(states, phases)

    def _where_to_begin(self, starts: NDArray[np.float64]) -> str:
        for x1, _, x2, _ in np.reshape(starts, (-1, 4)).tolist():
            reach = (math.sin(x1) if self.contact == "oblique" else x1) - self.gap
            if x2 < reach:
                return f", which is x2 >= {reach:.6g} there"
        return ""

    @property
    def _not_in_si(self) -> str:
        return "" if self.scales is None else not_in_si(self.scales)

    def _chosen(self, units: Any) -> Scales | None:
        return chosen(units, self.scales)

    def _run(self, core: Any, start: NDArray[np.float64]) -> Any:
        return super()._run(core, tuple(start.tolist()))

    def _run_class(self) -> Any:
        return verb("run")

    def _facts(self) -> Facts:
        return dict(self.to_dict())


# What a simulation depends on: all fields but the scales.
_FIELDS = tuple(entry.name for entry in dataclasses.fields(System) if entry.name != "scales")
