"""Signatures of the compiled core. All quantities are dimensionless; see the notation page."""

from collections.abc import Callable, Sequence
from enum import IntEnum, StrEnum
from types import MappingProxyType
from typing import Any, ClassVar, Self, TypeAlias, final, type_check_only

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "ABSOLUTE_ERROR",
    "CHATTER_TOLERANCE",
    "CONTACTS",
    "CONTACT_DTYPE",
    "COULOMB_LAWS",
    "EVENT_DTYPE",
    "GRAZE_DTYPE",
    "IMPACT_DTYPE",
    "LAWS",
    "MOST_KNOTS",
    "MOST_TURNED",
    "MOTION_NAMES",
    "OUTCOME_DTYPE",
    "PARAMETERS",
    "RELATIVE_ERROR",
    "SIMULTANEOUS",
    "STATUS_NAMES",
    "UNREDUCED",
    "Arrivals",
    "Border",
    "BorderKind",
    "BouncesEnd",
    "Cancellation",
    "Condition",
    "EvidenceKind",
    "FinalState",
    "Itinerary",
    "Leg",
    "LegEnd",
    "LegKind",
    "OneImpacts",
    "Parameter",
    "PeriodReport",
    "Regime",
    "RestitutionCurve",
    "Run",
    "Sensitivity",
    "Spectrum",
    "Stop",
    "StopCondition",
    "StopLeg",
    "Structure",
    "StructureItinerary",
    "StructureOrbit",
    "StructureRun",
    "StructureSpectrum",
    "StructureSweep",
    "Sweep",
    "System",
    "Systems",
    "WhyUndecided",
    "__version__",
    "_heed",
    "_interrupt_at",
    "arrivals",
    "decay_minus_1",
    "enclosed_sin_cos",
    "impact",
    "lyapunov_spectrum",
    "sensitivity",
    "simulate",
    "simulate_with_sensitivity",
    "sin_cos",
    "structure_motion",
    "structure_sensitivity",
    "structure_spectrum",
    "structure_sweep",
    "sweep",
]

__version__: str

STATUS_NAMES: tuple[str, ...]
MOTION_NAMES: tuple[str, ...]
PARAMETERS: MappingProxyType[str, Parameter]
CHATTER_TOLERANCE: float
# Errors of the elementary functions: relative to a value; of the reduction of angles from
# `UNREDUCED` to `MOST_TURNED`.
RELATIVE_ERROR: float
ABSOLUTE_ERROR: float
UNREDUCED: float
MOST_TURNED: float
# Most knots of a table of restitution.
MOST_KNOTS: int
CONTACTS: tuple[str, ...]
LAWS: tuple[str, ...]
COULOMB_LAWS: tuple[str, ...]
SIMULTANEOUS: tuple[str, ...]
IMPACT_DTYPE: np.dtype[np.void]
EVENT_DTYPE: np.dtype[np.void]
GRAZE_DTYPE: np.dtype[np.void]
OUTCOME_DTYPE: np.dtype[np.void]
CONTACT_DTYPE: np.dtype[np.void]

# Lower and upper ends of intervals.
_Ends: TypeAlias = tuple[NDArray[np.float64], NDArray[np.float64]]

@final
class Parameter:
    """What a numeric parameter is."""

    @property
    def symbol(self) -> str:
        """Its symbol in plain text, as reference data name it."""

    @property
    def latex(self) -> str:
        """Its symbol in LaTeX."""

    @property
    def meaning(self) -> str:
        """What it is, in one line."""

    @property
    def allowed(self) -> str:
        """The allowed range, in words."""

    @property
    def default(self) -> float | None:
        """The value where none is given; None: one must be given."""

@final
class System:
    """Validated parameters; raises ParameterError naming the parameter, its value and range."""

    def __new__(
        cls, *, contact: str, law: str, curve: RestitutionCurve | None = None, **numbers: float
    ) -> Self: ...
    @property
    def drive_period(self) -> float:
        """2 pi / drive_frequency; infinite for drive_frequency = 0."""

    @property
    def is_wall(self) -> bool:
        """Whether impacts do not act on body 2."""

    @property
    def is_rotor(self) -> bool:
        """Whether the angle counts modulo a turn."""

    def tip(self, x1: NDArray[np.float64]) -> NDArray[np.float64]:
        """Positions of the tip along the normal."""

    def slope(self, x1: NDArray[np.float64]) -> NDArray[np.float64]:
        """Their derivatives by x1."""

    def is_in_friction_cone(self, x1: float) -> bool:
        """Whether friction can hold the tip at this angle."""

    def gap_function(self, states: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gap function of states (n, 4)."""

    def gap_rate(self, states: NDArray[np.float64]) -> NDArray[np.float64]:
        """Rate g' of states (n, 4)."""

    def gap_acceleration(
        self, states: NDArray[np.float64], phase: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Free g'' of states (n, 4), each at its phase of the drive."""

    def accelerations(
        self, states: NDArray[np.float64], phase: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Free x1'' and x2'', (n, 2), of states (n, 4), each at its phase of the drive."""

    def free_flight(
        self,
        state: tuple[float, float, float, float],
        times: NDArray[np.float64],
        phase: float,
    ) -> NDArray[np.float64]:
        """States (n, 4) at times >= 0 after a state, without contact, from a phase of the drive."""

# The enums are made by the core from its own lists of names; stubtest compares the members.

class Regime(IntEnum):
    """What the contact point did during an impact (theory page, section 4)."""

    FRICTIONLESS = 0
    SLIP = 1
    REVERSAL_APPROACH = 2
    REVERSAL_RESTITUTION = 3
    STICK_APPROACH = 4
    STICK_RESTITUTION = 5

class LegKind(StrEnum):
    """What the bodies do during a leg."""

    IMPACT = "impact"
    CHATTER = "chatter"
    SLIDE = "slide"
    STICK = "stick"
    CIRCUIT = "circuit"

class LegEnd(StrEnum):
    """What ends a phase of contact: release, a stop, or slip in one direction."""

    RELEASE = "release"
    STOP = "stop"
    SLIDE_POSITIVE = "slide_positive"
    SLIDE_NEGATIVE = "slide_negative"

@final
class Leg:
    """One leg of a motion with the event at its end; ``str`` gives the text of files.

    ``"impact:slip:+-"`` (regime, signs of x1' and of sin x1), ``"impact:frictionless"``,
    ``"chatter"``, ``"slide+:release"``, ``"slide-:stop"``, ``"stick:slide+"``,
    ``"stick:release"``, or ``"circuit"``, which is alone: a motion without events.
    """

    CHATTER: ClassVar[Leg]
    CIRCUIT: ClassVar[Leg]
    @staticmethod
    def impact(regime: Regime, direction: int = 0, side: int = 0) -> Leg:
        """A flight to an impact; with friction the signs of x1' and of sin x1 there."""

    @staticmethod
    def slide(direction: int, end: LegEnd) -> Leg:
        """A slide with this sign of x1', to a release or a stop."""

    @staticmethod
    def stick(end: LegEnd) -> Leg:
        """A stick to a release or to slip."""

    @classmethod
    def from_text(cls, text: str) -> Leg:
        """The leg of this text, from a file."""

    @property
    def kind(self) -> LegKind: ...
    @property
    def regime(self) -> Regime | None:
        """Of an impact."""

    @property
    def direction(self) -> int:
        """Sign of x1' in a slide or an impact with friction, else 0."""

    @property
    def side(self) -> int:
        """Sign of sin x1 in an impact with friction, else 0."""

    @property
    def end(self) -> LegEnd | None:
        """Of a slide or stick."""

    def __eq__(self, value: object, /) -> bool: ...
    def __ne__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

class Border(StrEnum):
    """The conditions that vanish where a leg changes its kind."""

    APPROACH_VELOCITY = "u"
    FLIGHT = "flight"
    SIDE_OF_IMPACT = "sin x1 = 0"
    SLIP_BEFORE = "x1' = 0 before"
    STOP_AT_END_OF_APPROACH = "P* = P_f"
    STOP_AT_END_OF_IMPACT = "P* = (1 + r) P_f"
    FRICTION_CONE = "|cos x1| = mu |sin x1|"
    FORCE_AT_START = "contact force at the start"
    LENGTH = "length of the phase"
    SLIP_AT_START = "slip at the start"
    FORCE_IN_SLIDE = "contact force in the slide"
    SPEED_IN_SLIDE = "x1' in the slide"
    FORCE_AT_STOP = "contact force at the stop"
    SPEED_AT_RELEASE = "x1' at the release"
    HOLD_POSITIVE = "hold against slip, x1' > 0"
    HOLD_NEGATIVE = "hold against slip, x1' < 0"
    FORCE_IN_STICK = "contact force in stick"

class BorderKind(StrEnum):
    """What changes at a border."""

    GRAZING = "grazing"
    REGIME_BORDER = "regime_border"
    CHATTER_ONSET = "chatter_onset"
    CONTACT_BORDER = "contact_border"

@final
class Condition:
    """One condition of a motion, a border of one of its legs."""

    def __new__(cls, border: Border, leg: int) -> Self: ...
    @property
    def border(self) -> Border: ...
    @property
    def kind(self) -> BorderKind: ...
    @property
    def leg(self) -> int: ...
    def __eq__(self, value: object, /) -> bool: ...
    def __ne__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

class EvidenceKind(StrEnum):
    """The kind of evidence for a label."""

    RETURNED = "returned"
    CONVERGING = "converging"
    GROWTH_BOUNDED = "growth_bounded"
    GROWTH_EXPONENTIAL = "growth_exponential"
    UNDECIDED = "undecided"

class BouncesEnd(StrEnum):
    """Why the list of the skipped impacts of one chatter ends."""

    APPROACH_VELOCITY = "approach_velocity"
    ACCUMULATION = "accumulation"
    RUN_END = "run_end"
    CAP = "cap"
    INTERRUPTED = "interrupted"

class WhyUndecided(StrEnum):
    """Why a motion is not judged."""

    NO_DRIVE_PERIOD = "no_drive_period"
    TOO_FEW_SECTIONS = "too_few_sections"
    NOT_FINITE = "not_finite"
    INCOMPLETE = "incomplete"
    NO_RETURN = "no_return"
    NOT_MEASURABLE = "not_measurable"
    GROWTH_UNCLEAR = "growth_unclear"
    INTERRUPTED = "interrupted"

@final
class Stop:
    """A stop, with all checked that does not depend on its structure."""

    def __new__(
        cls,
        normal: NDArray[np.float64],
        gap: float,
        restitution: float,
        *,
        curve: RestitutionCurve | None,
        friction: float,
        tangent: NDArray[np.float64] | None,
        amplitude: float,
        phase: float,
    ) -> Self: ...

@final
class Structure:
    """A validated structure; raises ParameterError naming the parameter, its value and range."""

    def __new__(
        cls,
        mass: NDArray[np.float64],
        stiffness: NDArray[np.float64],
        stops: Sequence[Stop],
        *,
        damping: NDArray[np.float64] | None,
        damping_ratios: NDArray[np.float64] | None,
        static_load: NDArray[np.float64],
        drive_amplitude: NDArray[np.complex128],
        drive_frequency: float,
        phase: float,
        law: str,
        simultaneous: str,
        like: Structure | None,
    ) -> Self:
        """Take over from ``like`` what is the same there: bit by bit what is built without it."""

    @property
    def frequencies(self) -> NDArray[np.float64]:
        """Natural frequencies, ascending."""

    @property
    def shapes(self) -> NDArray[np.float64]:
        """Mode shapes (N, N), that of mode i in column i."""

    def sticks_at(self, stop: int) -> bool:
        """Whether friction holds the contact point at a stop that has come to rest."""

    @property
    def drive_period(self) -> float:
        """2 pi / drive_frequency; infinite for drive_frequency = 0."""

@final
class StopLeg:
    """One leg of a motion of a structure; ``str`` gives the text of files.

    ``"impact 0:frictionless"`` (stop, regime), ``"impact 1:slip:+"`` (with the sign of the slip
    before it), or ``"circuit"``, which is alone: a motion without impacts.
    """

    CIRCUIT: ClassVar[StopLeg]
    @staticmethod
    def impact(stop: int, regime: Regime, direction: int = 0) -> StopLeg:
        """A flight to an impact on a stop; with friction the sign of the slip before it."""

    @classmethod
    def from_text(cls, text: str) -> StopLeg:
        """The leg of this text, from a file."""

    @property
    def kind(self) -> LegKind: ...
    @property
    def stop(self) -> int | None:
        """The stop; None of a circuit."""

    @property
    def regime(self) -> Regime | None: ...
    @property
    def direction(self) -> int: ...
    def __eq__(self, value: object, /) -> bool: ...
    def __ne__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class StopCondition:
    """One condition of a motion of a structure, a border of one of its legs at a stop."""

    def __new__(cls, border: Border, leg: int, stop: int) -> Self: ...
    @property
    def border(self) -> Border: ...
    @property
    def kind(self) -> BorderKind: ...
    @property
    def leg(self) -> int: ...
    @property
    def stop(self) -> int: ...
    def __eq__(self, value: object, /) -> bool: ...
    def __ne__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class StructureItinerary:
    """The impacts of a periodic motion of a structure, and the kernels of shooting on them.

    Nodes, shape (legs, 2 N + 1), are (q, v, t) just after the impact at which a leg starts: t is
    the time in the drive period. A circuit starts with a drive period, and has no t.
    """

    def __new__(cls, legs: Sequence[StopLeg], periods: int, clocks: list[int]) -> Self: ...
    @staticmethod
    def follow(
        system: Structure, initial: NDArray[np.float64], periods: int, max_events: int
    ) -> tuple[tuple[StructureItinerary, NDArray[np.float64]] | None, str]:
        """Return the legs of a simulation of one orbit from t = 0, or why there are none."""

    @property
    def legs(self) -> list[StopLeg]: ...
    @property
    def periods(self) -> int:
        """Drive periods after which the motion repeats."""

    @property
    def clocks(self) -> list[int]:
        """Completed drive periods at the start of each leg."""

    def with_legs(
        self, legs: Sequence[StopLeg], periods: int, clocks: list[int]
    ) -> StructureItinerary:
        """Return other legs of the same machine."""

    def residual(
        self, system: Structure, nodes: NDArray[np.float64], parameters: list[str] | None = None
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """2 N + 1 equations per leg, and their derivatives by nodes and by parameters.

        NaN where a leg cannot be followed.
        """

    def tests(
        self, system: Structure, nodes: NDArray[np.float64]
    ) -> list[tuple[StopCondition, float, float]]:
        """The conditions, positive inside: (condition, value, time in the leg)."""

    def return_map(self, system: Structure, nodes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the derivative of the return map from the start of a drive period, (2 N, 2 N)."""

    def verdict(self, system: Structure, nodes: NDArray[np.float64], max_events: int) -> str:
        """Return why a solution is no motion of its structure, ``""`` if it is one."""

    def sections(self, system: Structure, nodes: NDArray[np.float64]) -> NDArray[np.float64]:
        """States (periods, 2, N) at the starts of the drive periods."""

    def trajectory(
        self, system: Structure, nodes: NDArray[np.float64], times: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return states (k, 2, N) at any times; the orbit repeats."""

    def before_events(self, system: Structure, nodes: NDArray[np.float64]) -> NDArray[np.float64]:
        """States (legs, 2, N) just before the event of each leg; NaN where it has none."""

    def state_in_leg(
        self, system: Structure, nodes: NDArray[np.float64], leg: int, time: float
    ) -> NDArray[np.float64]:
        """State (2, N) at a time after the start of a leg, whether or not a stop is penetrated."""

@type_check_only
class _AnyRun:
    """What compiled runs of all machines have; each access builds a new array."""

    @property
    def stroboscopic(self) -> NDArray[np.float64]:
        """Kept sections, (k, 4), of a structure (k, 2, N)."""

    @property
    def time_in_contact(self) -> float:
        """Time in contact within the kept window."""

    @property
    def stop_reason(self) -> str:
        """Why it ended."""

    @property
    def stop_detail(self) -> str:
        """A sentence with time, impact number and state for a run that did not complete."""

    @property
    def kept_from(self) -> float:
        """Start of the kept window (time)."""

    @property
    def impact_count(self) -> int:
        """Impacts since t = 0, kept or not."""

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C ended it."""

    def energy_audit(self) -> dict[str, float] | None:
        """Energies and works in the kept window, by name; None after Ctrl-C."""

    def to_json(self) -> str:
        """Everything but structure and arrays, as JSON with exact numbers."""

    def trace(self) -> tuple[NDArray[np.uint8], NDArray[np.float64]] | None:
        """What it knows of its events beyond the tables, as JSON, and residuals of their clocks."""

    def period(self) -> PeriodReport:
        """Period, impact count and label; may follow a nearby orbit for some periods."""

    def resume(
        self,
        *,
        periods: int | None = None,
        time: float | None = None,
        keep: int | None = None,
        max_events: int | None = None,
    ) -> Self:
        """Continue for further periods or time; the bits are those of one long run."""

@type_check_only
class _Cells:
    """What compiled sweeps of all machines have: a column for each quantity, n cells."""

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C ended the sweep."""

    @property
    def status(self) -> NDArray[np.int8]:
        """(n,) place of each status in ``STATUS_NAMES``."""

    @property
    def impact_count(self) -> NDArray[np.int64]:
        """(n,) kept impacts of each cell."""

    @property
    def stroboscopic_count(self) -> NDArray[np.int64]:
        """(n,) kept stroboscopic states of each cell."""

    @property
    def stroboscopic(self) -> NDArray[np.float64]:
        """(rows, 4) x1, v1, x2, v2; of structures (rows, 2, N) q and v."""

    @property
    def m(self) -> NDArray[np.int64]:
        """(n,) period in drive periods, 0 where none was found."""

    @property
    def n(self) -> NDArray[np.int64]:
        """(n,) impacts per orbit, -1 with complete chatter."""

    @property
    def motion(self) -> NDArray[np.int8]:
        """(n,) place of each kind of motion in ``MOTION_NAMES``."""

    @property
    def residual(self) -> NDArray[np.float64]:
        """(n,) largest difference of sections m periods apart."""

    @property
    def exponents(self) -> NDArray[np.float64]:
        """(n, most) Lyapunov exponents, descending; NaN where a cell has none."""

    @property
    def exponent_errors(self) -> NDArray[np.float64]:
        """(n, most) their standard errors."""

    @property
    def contact_fraction(self) -> NDArray[np.float64]:
        """(n,) part of the kept window in contact; NaN where nothing is kept."""

    @property
    def final_states(self) -> NDArray[np.float64]:
        """(n, 4) or (n, 2, N) state at the end."""

@final
class StructureRun(_AnyRun):
    """Result of a simulation of a structure, in the coordinates of its compiled form."""

    @property
    def impacts(self) -> dict[str, NDArray[Any]]:
        """Columns of the kept impacts."""

    @property
    def grazes(self) -> dict[str, NDArray[Any]]:
        """Columns of the kept grazes."""

    @property
    def contacts(self) -> dict[str, NDArray[Any]]:
        """Columns of the kept events of lasting contact."""

    @property
    def events(self) -> dict[str, NDArray[Any]]:
        """Columns of the kept events."""

    @property
    def final_state(self) -> dict[str, Any]:
        """Time, period, time in the period, mode, q, v, and which stops are closed, at the end."""

    @staticmethod
    def from_parts(
        structure: Structure,
        text: str,
        impacts: dict[str, NDArray[Any]],
        stroboscopic: NDArray[np.float64],
        events: dict[str, NDArray[Any]],
        grazes: dict[str, NDArray[Any]],
        contacts: dict[str, NDArray[Any]],
        trace: tuple[NDArray[np.uint8], NDArray[np.float64]] | None = None,
    ) -> StructureRun:
        """A run from its structure, text of ``to_json``, arrays, and what ``trace`` gave."""

    def trajectory(
        self, t: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], bool]:
        """States (k, 2, N), forces (k, stops, 2), and whether Ctrl-C ended it with fewer rows."""

    def bounces(
        self, slowest: float, most: int
    ) -> tuple[dict[str, NDArray[Any]], NDArray[np.bool_], list[BouncesEnd], bool]:
        """Impacts of the kept window and those skipped in it, as Run has them."""

@final
class RestitutionCurve:
    """A coefficient of restitution that depends on the approach velocity."""

    @staticmethod
    def table(speeds: NDArray[np.float64], values: NDArray[np.float64]) -> RestitutionCurve:
        """Linear between knots; raises ParameterError naming the entry."""

    @staticmethod
    def power_law(r_low: float, least_speed: float, exponent: float) -> RestitutionCurve:
        """Return a power law; raises ParameterError naming the number."""

    def at(self, speeds: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return r at approach velocities."""

    @property
    def names(self) -> list[str]:
        """The names of its numbers."""

    def get(self, name: str) -> float:
        """Return the value of one of them."""

@final
class Systems:
    """Systems that differ in some parameters: system i has row i of ``values`` for ``names``."""

    def __new__(cls, system: System, names: Sequence[str], values: NDArray[np.float64]) -> Self: ...
    def __len__(self) -> int: ...
    def column(self, name: str) -> NDArray[np.float64]:
        """Return the values of a numeric parameter."""

    @property
    def is_wall(self) -> NDArray[np.bool_]:
        """Which have a body 2 on which impacts do not act."""

@final
class OneImpacts:
    """The condition of periodicity of motions with one impact, for several systems.

    Coefficients [lo, hi] of 1, kappa and kappa^2 have a column for each system, and 15 rows: those
    of D, then (p, q) of Nc and of Ns.
    """

    def __new__(
        cls,
        contact: str,
        gap: NDArray[np.float64],
        lo: NDArray[np.float64],
        hi: NDArray[np.float64],
    ) -> Self: ...
    def enclose(
        self, numbers: NDArray[np.int64], lo: NDArray[np.float64], hi: NDArray[np.float64]
    ) -> tuple[_Ends, _Ends]:
        """Enclose F and its slope over boxes of x1, each of the system of its number."""

@final
class Itinerary:
    """The legs of a periodic motion, and the kernels of shooting on them.

    Nodes, shape (legs, 4), are (x1, v1, v2, t) just after the event at which a leg starts: t is the
    time in the drive period, x2 follows from the contact. A circuit starts with a drive period, and
    has x2 in place of t.
    """

    def __new__(
        cls,
        legs: Sequence[Leg],
        periods: int,
        clocks: list[int] | None = None,
        wall_at_rest: bool = False,
    ) -> Self: ...
    @staticmethod
    def follow(
        system: System, initial: tuple[float, float, float, float], periods: int, max_events: int
    ) -> tuple[tuple[Itinerary, NDArray[np.float64]] | None, str]:
        """Return the legs of a simulation from t = 0, or why there are none."""

    @property
    def legs(self) -> list[Leg]: ...
    @property
    def periods(self) -> int:
        """Drive periods after which the motion repeats."""

    @property
    def clocks(self) -> list[int]:
        """Completed drive periods at the start of each leg."""

    @property
    def wall_at_rest(self) -> bool:
        """Whether body 2 is a wall at rest, which is left out."""

    def return_map(self, system: System, nodes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the derivative of the return map, the product of those of the legs, (4, 4).

        NaN where a leg cannot be followed, infinite where one ends in a graze.
        """

    def return_maps(self, systems: Systems, nodes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return these derivatives of several orbits, (k, 4, 4), one of each system.

        The nodes of an orbit are rows, as many as there are legs, after those of the one before.
        """

    def verdict(
        self, system: System, nodes: NDArray[np.float64], max_events: int
    ) -> tuple[NDArray[np.float64], str]:
        """Return the return map, and why a solution is no motion of its system, ``""`` if it is.

        First every condition of its legs; then a simulation over one orbit, of at most
        ``max_events`` events, must pass the same events and come back.
        """

    def judge_all(
        self,
        systems: Systems,
        numbers: NDArray[np.int64],
        nodes: NDArray[np.float64],
        max_events: int,
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Return the return maps (k, 4, 4) of orbits of one leg, and which are motions.

        Orbit i has the node in row i, and is one of the system of that number.
        """

    def trajectory(
        self, system: System, nodes: NDArray[np.float64], times: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return states x1, v1, x2, v2 at any times, shape (k, 4); the orbit repeats.

        NaN where a leg, or chatter in it, cannot be followed.
        """

    def with_legs(self, legs: Sequence[Leg], periods: int, clocks: list[int]) -> Itinerary:
        """Return other legs of the same machine."""

    def residual(
        self, system: System, nodes: NDArray[np.float64], parameters: list[str] | None = None
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Four equations per leg, and their derivatives by nodes and by up to two parameters.

        NaN where a leg cannot be followed.
        """

    def tests(
        self, system: System, nodes: NDArray[np.float64]
    ) -> list[tuple[Condition, float, float]]:
        """The conditions, positive inside: (condition, value, time in the leg)."""

    def transfer(self, system: System, nodes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Derivatives of the legs' maps of (x1, v1, v2, t), shape (legs, 4, 4)."""

    def before_events(self, system: System, nodes: NDArray[np.float64]) -> NDArray[np.float64]:
        """States x1, v1, x2, v2 just before the event of each leg, shape (legs, 4)."""

    def humps(self, system: System, nodes: NDArray[np.float64]) -> list[tuple[float, float] | None]:
        """Time and value of the largest local maximum of the gap inside each flight, or None."""

    def state_in_leg(
        self, system: System, nodes: NDArray[np.float64], leg: int, time: float
    ) -> tuple[float, float, float, float] | None:
        """State at a time after the start of a leg, whether or not the bodies overlap."""

@final
class FinalState:
    """State at the end of a run, after the impact if one falls on that instant."""

    @property
    def x1(self) -> float: ...
    @property
    def v1(self) -> float: ...
    @property
    def x2(self) -> float: ...
    @property
    def v2(self) -> float: ...
    @property
    def time(self) -> float: ...
    @property
    def period(self) -> int: ...
    @property
    def time_in_period(self) -> float: ...
    @property
    def mode(self) -> str:
        """Contact mode: flight, slide_positive, slide_negative, stick."""

@final
class PeriodReport:
    """The label of a motion from its kept stroboscopic states, with the evidence."""

    @property
    def m(self) -> int | None: ...
    @property
    def n(self) -> float | None:
        """Impacts per orbit, a whole number or infinity (complete chatter)."""
    @property
    def residual(self) -> float: ...
    @property
    def kind(self) -> EvidenceKind: ...
    @property
    def further(self) -> int:
        """Drive periods by which the motion was followed beyond the run."""
    @property
    def rate(self) -> float | None: ...
    @property
    def growth(self) -> float | None:
        """Mean logarithmic growth of a small perturbation per drive period."""
    @property
    def growth_error(self) -> float | None: ...
    @property
    def growth_periods(self) -> int | None: ...
    @property
    def why(self) -> WhyUndecided | None: ...
    @property
    def text(self) -> str:
        """The evidence in words."""
    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C ended it."""
    @property
    def label(self) -> str: ...

@final
class Run(_AnyRun):
    """Result of simulate; each access builds a new array."""

    @property
    def impacts(self) -> NDArray[np.void]: ...
    @property
    def events(self) -> NDArray[np.void]: ...
    @property
    def grazes(self) -> NDArray[np.void]: ...
    @property
    def contacts(self) -> NDArray[np.void]: ...
    @property
    def final_state(self) -> FinalState: ...
    def trajectory(self, t: NDArray[np.float64], forces: bool) -> tuple[NDArray[np.float64], bool]:
        """States (len(t), 4), with ``forces`` (len(t), 6); whether Ctrl-C left rows out."""
    def bounces(
        self, slowest: float, most: int
    ) -> tuple[NDArray[np.void], NDArray[np.bool_], list[BouncesEnd], bool]:
        """Impacts with those that chatter skipped; which those are; why each list of them ends.

        The last entry says whether Ctrl-C ended it.
        """
    @staticmethod
    def from_parts(
        text: str,
        impacts: NDArray[np.void],
        stroboscopic: NDArray[np.float64],
        events: NDArray[np.void],
        grazes: NDArray[np.void],
        contacts: NDArray[np.void],
        trace: tuple[NDArray[np.uint8], NDArray[np.float64]] | None = None,
    ) -> Run:
        """A run from the text of ``to_json``, the arrays, and what ``trace`` gave."""

@final
class StructureSweep(_Cells):
    """Result of structure_sweep: a column for each quantity; the rows of sections are ragged."""

    @property
    def impacts(self) -> dict[str, NDArray[Any]]:
        """Columns of all kept impacts, as StructureRun has them."""

@final
class Sweep(_Cells):
    """Result of sweep: a column for each quantity; the rows of both sections are ragged."""

    @property
    def impact_section(self) -> NDArray[np.float64]:
        """(6, rows) x1, v1, v2, phase just before the impact, approach velocity, energy loss."""
    @property
    def regime(self) -> NDArray[np.int8]:
        """(rows,) regime of each impact."""

@final
class Spectrum:
    """Lyapunov exponents of a motion."""

    @property
    def exponents(self) -> NDArray[np.float64]:
        """(4,) per unit time, descending."""
    @property
    def errors(self) -> NDArray[np.float64]:
        """(4,) standard errors."""
    @property
    def time(self) -> float:
        """Time measured over."""
    @property
    def impacts(self) -> int:
        """Impacts in that time."""
    @property
    def history_time(self) -> NDArray[np.float64]:
        """(h,) times since the measurement began."""
    @property
    def history(self) -> NDArray[np.float64]:
        """(h, 4) exponents up to them."""
    @property
    def error(self) -> str | None:
        """Why the measurement ended early; None if it did not."""
    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C ended it."""

@final
class Sensitivity:
    """Derivatives of a run; each access builds a new array."""

    @property
    def times(self) -> NDArray[np.float64]:
        """(n, k) of the times of the kept impacts."""
    @property
    def before(self) -> NDArray[np.float64]:
        """(n, r, k) of the states before them."""
    @property
    def after(self) -> NDArray[np.float64]:
        """(n, r, k) of the states after them."""
    @property
    def stroboscopic(self) -> NDArray[np.float64]:
        """(m, r, k) of the sections."""
    @property
    def final_state(self) -> NDArray[np.float64]:
        """(1, r, k) of the final state."""
    @property
    def one_sided(self) -> list[tuple[int, float, str]]:
        """Index, time and reason of each event from which on derivatives are one-sided."""
    @property
    def until(self) -> float | None:
        """Up to when they are known, where Ctrl-C has ended the work; else None."""
    def trajectory(self, t: NDArray[np.float64]) -> tuple[NDArray[np.float64], bool]:
        """(len(t), r, k) of states at times in the kept window; whether Ctrl-C left some out."""

def sensitivity(
    run: Run, initial: tuple[float, float, float, float], names: Sequence[str]
) -> Sensitivity:
    """Derivatives of a run from this start by the numbers of these names."""

def structure_sensitivity(
    run: StructureRun,
    initial: NDArray[np.float64],
    by: Sequence[tuple[str, dict[str, Any] | None]],
) -> Sensitivity:
    """Derivatives of a run of a structure from this start, (2, N), along directions by name.

    Each has the derivatives of fields where the name alone does not say them.
    """

def simulate_with_sensitivity(
    machine: System | Structure,
    initial: NDArray[np.float64],
    by: Sequence[tuple[str, dict[str, Any] | None]],
    *,
    periods: int | None = None,
    time: float | None = None,
    keep: int | None = None,
    max_events: int = ...,
    chatter_tolerance: float = ...,
    section_phase: float = 0.0,
    progress: Callable[[int], object] | None = None,
) -> tuple[Any, Sensitivity | None]:
    """A run from one start with its derivatives by names, or along directions by name.

    None if Ctrl-C has ended it. ``progress`` gets how many millionths of it are done.
    """

def lyapunov_spectrum(run: Run, steps: int, step: float | None = None) -> Spectrum:
    """The spectrum of the motion that continues from the end of ``run``.

    Over so many drive periods, or steps of this time without drive period.
    """

def enclosed_sin_cos(lo: NDArray[np.float64], hi: NDArray[np.float64]) -> tuple[_Ends, _Ends]:
    """Enclose sine and cosine over intervals; beyond `MOST_TURNED` they lie in [-1, 1]."""

def sin_cos(x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sine and cosine of each number, shapes (n,); the core's own for |x| <= 1e5."""

def decay_minus_1(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return e^x - 1 of each number x <= 0, shapes (n,)."""

def impact(
    system: System,
    x1: NDArray[np.float64],
    v1: NDArray[np.float64],
    v2: NDArray[np.float64],
    *,
    steps: int | None = None,
) -> NDArray[np.void]:
    """Single impacts from one-dimensional arrays of one length, rows of OUTCOME_DTYPE.

    In closed form, or by the incremental-impulse integrator in so many steps. Raises StateError
    where an input is not finite or the bodies do not approach, ParameterError for bad steps.
    """

def simulate(
    machine: System | Structure,
    initial: NDArray[np.float64],
    *,
    periods: int | None = None,
    time: float | None = None,
    keep: int | None = None,
    max_events: int = ...,
    chatter_tolerance: float = ...,
    section_phase: float = 0.0,
    workers: int | None = None,
    progress: Callable[[int], object] | None = None,
) -> tuple[list[Any], bool, tuple[int, str] | None]:
    """Runs that were begun, whether Ctrl-C ended the work, the first failure with its place.

    One run of a start of shape (4,) or (2, N), whose millionths that are done ``progress`` gets; or
    a run of each of (k, 4) or (k, 2, N), and it gets the number of those that are done.
    """

@final
class StructureOrbit:
    """A periodic motion of a structure."""

    @property
    def state(self) -> NDArray[np.float64]:
        """(2, N): q and v at the start of a drive period."""

    @property
    def periods(self) -> int:
        """Its length in drive periods."""

    @property
    def residual(self) -> float:
        """Largest difference of its end from its start."""

    @property
    def derivative(self) -> NDArray[np.float64]:
        """Derivative of the return map, (2N, 2N)."""

    @property
    def multipliers(self) -> list[tuple[float, float]]:
        """Its eigenvalues, real and imaginary parts, by descending modulus."""

    @property
    def bound(self) -> float:
        """Rounding of their moduli."""

    @property
    def stability(self) -> str:
        """Stable, unstable or undecided."""

    @property
    def impacts(self) -> list[int]:
        """Impacts of an orbit at each stop, without those that a complete chatter skips."""

    @property
    def chatters(self) -> bool:
        """Whether an orbit has complete chatter."""

def structure_motion(run: StructureRun, periods: int) -> tuple[StructureOrbit | None, str | None]:
    """The periodic motion of so many drive periods on which a run has settled; or why not."""

@final
class StructureSpectrum:
    """Lyapunov exponents of a motion of a structure."""

    @property
    def exponents(self) -> NDArray[np.float64]:
        """Per unit time, descending."""

    @property
    def errors(self) -> NDArray[np.float64]:
        """Their standard errors."""

    @property
    def time(self) -> float:
        """Time measured over."""

    @property
    def impacts(self) -> list[int]:
        """Impacts in it at each stop."""

    @property
    def history_time(self) -> NDArray[np.float64]:
        """Times since the measurement began."""

    @property
    def history(self) -> NDArray[np.float64]:
        """The exponents up to each of these times, one row for each."""

    @property
    def error(self) -> str | None:
        """Why the measurement ended early; None if it did not."""

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C ended it."""

def structure_spectrum(
    run: StructureRun, steps: int, count: int, step: float | None = None
) -> StructureSpectrum:
    """The largest ``count`` exponents of the motion from the end of a run on."""

def structure_sweep(
    structures: Sequence[Structure],
    which: NDArray[np.int64],
    names: Sequence[str],
    values: NDArray[np.float64],
    initials: NDArray[np.float64],
    *,
    periods: int,
    keep: int,
    start: str = "fresh",
    measure: str = "returns",
    measured: int = 0,
    rows: bool = True,
    max_events: int = ...,
    chatter_tolerance: float = ...,
    section_phase: float = 0.0,
    workers: int | None = None,
    progress: Callable[[int], object] | None = None,
) -> StructureSweep:
    """One run per cell, of the structure ``which[i]`` with the numbers ``names`` of row i.

    ``initials`` has the shape (n, 2, N). Progress and Ctrl-C as in ``sweep``.
    """

def sweep(
    system: System,
    names: Sequence[str],
    values: NDArray[np.float64],
    initials: NDArray[np.float64],
    *,
    periods: int,
    keep: int,
    start: str = "fresh",
    measure: str = "returns",
    measured: int = 0,
    rows: bool = True,
    max_events: int = ...,
    chatter_tolerance: float = ...,
    section_phase: float = 0.0,
    workers: int | None = None,
    progress: Callable[[int], object] | None = None,
) -> Sweep:
    """One run per cell: row i of ``values`` holds its parameters ``names``.

    ``progress`` is called with the number of cells done so far. Ctrl-C ends the sweep early: cells
    not done are pending.
    """

@final
class Arrivals:
    """The attractor of each of n starts; starts left over have sections, counts and a period."""

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C or ``progress`` ended the work."""

    @property
    def status(self) -> NDArray[np.int8]:
        """(n,) place of each status in ``STATUS_NAMES``; "unresolved" for those left over."""

    @property
    def attractor(self) -> NDArray[np.int64]:
        """(n,) number of the attractor, -1 for none of them."""

    @property
    def periods(self) -> NDArray[np.int64]:
        """(n,) drive periods until its region was entered, -1 for none."""

    @property
    def states(self) -> NDArray[np.float64]:
        """(n, d) state at the arrival or the end; NaN where there is none."""

    @property
    def m(self) -> NDArray[np.int64]:
        """(n,) period in drive periods of those left over, 0 where none was found."""

    @property
    def n(self) -> NDArray[np.int64]:
        """(n,) their impacts per orbit, -1 with complete chatter."""

    @property
    def left(self) -> NDArray[np.int64]:
        """(l,) the starts left over at the end of a completed run."""

    @property
    def tails(self) -> NDArray[np.float64]:
        """(l, keep, d) their last sections."""

    @property
    def counts(self) -> NDArray[np.int64]:
        """(l, keep) impacts in the drive period before each section, -1 with complete chatter."""

def arrivals(
    machine: System | Structure,
    initials: NDArray[np.float64],
    *,
    centers: NDArray[np.float64],
    factors: NDArray[np.float64],
    counts: list[list[int]],
    periods: int,
    keep: int,
    max_events: int = ...,
    chatter_tolerance: float = ...,
    workers: int | None = None,
    progress: Callable[[int], object] | None = None,
) -> Arrivals:
    """Follow every start (n, d) until it arrives at one of the attractors, or for ``periods``.

    Attractor i is entered where ``|factors[i] @ (X - centers[i])| <= 1`` at a section X, and has
    ``counts[i]`` impacts in the drive periods after ``centers[i]`` (-1: complete chatter).
    ``progress`` gets the number of starts done; Ctrl-C ends the work.
    """

@final
class Cancellation:
    """Ends the calls of each thread that heeds it, as Ctrl-C does on the main thread."""

    def __new__(cls) -> Cancellation: ...
    def cancel(self) -> None:
        """End the work, soon; it is never taken back."""
    @property
    def cancelled(self) -> bool:
        """Whether the work is to end."""

def _heed(cancellation: Cancellation | None) -> None:
    """Let a cancellation end what the calling thread computes from now on; None: nothing does."""

def _interrupt_at(asks: int | None) -> int:
    """Let the ``asks``-th read of the token act as Ctrl-C (for tests); None: no such read.

    Returns how many asks were left.
    """
