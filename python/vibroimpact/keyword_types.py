"""The names of what can be varied, as typed keywords: for type checkers, and for completion.

Calls take them as ``**axes: Unpack[Axes]``. Completion in notebooks looks at signatures at run
time, where such names do not appear: `completing` lists them there.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, Literal, TypedDict, TypeVar

from numpy.typing import ArrayLike

from .arguments import LISTED

Contact = Literal["oblique", "direct"]
Law = Literal["poisson", "newton", "energetic", "paper"]
CoulombLaw = Literal["poisson", "newton", "energetic"]
Simultaneous = Literal["stop", "sequence", "together"]

Function = TypeVar("Function", bound=Callable[..., Any])


class Parameters(TypedDict, total=False):
    """Values of numeric parameters of System, each a one-dimensional array."""

    mass_ratio: ArrayLike
    frequency_ratio: ArrayLike
    restitution: ArrayLike
    gap: ArrayLike
    drive_frequency: ArrayLike
    pendulum_damping: ArrayLike
    oscillator_damping: ArrayLike
    moment_amplitude: ArrayLike
    force_amplitude: ArrayLike
    static_moment: ArrayLike
    static_force: ArrayLike
    friction: ArrayLike
    phase: ArrayLike


class Coordinates(TypedDict, total=False):
    """Values of coordinates of the initial state, each a one-dimensional array."""

    x1: ArrayLike
    v1: ArrayLike
    x2: ArrayLike
    v2: ArrayLike


class Axes(Parameters, Coordinates, total=False):
    """What a sweep can vary."""


class Ranges(TypedDict, total=False):
    """Ranges of numeric parameters of System, (low, high)."""

    mass_ratio: tuple[float, float]
    frequency_ratio: tuple[float, float]
    restitution: tuple[float, float]
    gap: tuple[float, float]
    drive_frequency: tuple[float, float]
    pendulum_damping: tuple[float, float]
    oscillator_damping: tuple[float, float]
    moment_amplitude: tuple[float, float]
    force_amplitude: tuple[float, float]
    static_moment: tuple[float, float]
    static_force: tuple[float, float]
    friction: tuple[float, float]
    phase: tuple[float, float]


class Changes(TypedDict, total=False):
    """Fields of System, as `System.replace` takes them."""

    mass_ratio: float
    frequency_ratio: float
    restitution: Any
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
    damping: tuple[float, float]
    scales: Any
    units: Any


class StopChanges(TypedDict, total=False):
    """Fields of Stop, as `Stop.replace` takes them."""

    normal: ArrayLike
    gap: float
    restitution: float
    friction: float
    tangent: ArrayLike | None
    amplitude: float
    phase: float


class StructureChanges(TypedDict, total=False):
    """Fields of Structure, and numbers of all its stops, as `Structure.replace` takes them."""

    mass: ArrayLike
    stiffness: ArrayLike
    frequencies: ArrayLike
    shapes: ArrayLike
    modal_mass: ArrayLike
    stops: Any
    damping: ArrayLike | None
    damping_ratios: ArrayLike | None
    static_load: ArrayLike
    drive_amplitude: ArrayLike
    drive_frequency: float
    phase: float
    law: CoulombLaw
    simultaneous: Simultaneous
    gap: float
    restitution: float
    friction: float


def completing(names: type) -> Callable[[Function], Function]:
    """List the keys of a TypedDict in the signature of a function with ``**keywords``."""

    def listed(function: Function) -> Function:
        signature = inspect.signature(function)
        own = [*signature.parameters.values()]
        more = [
            inspect.Parameter(
                name,
                inspect.Parameter.KEYWORD_ONLY,
                default=None,
                annotation=getattr(annotation, "__forward_arg__", annotation),
            )
            for name, annotation in inspect.get_annotations(names).items()
            if name not in signature.parameters
        ]
        function.__signature__ = signature.replace(  # type: ignore[attr-defined]
            parameters=[*own[:-1], *more, own[-1]]
        )
        setattr(function, LISTED, {each.name for each in more})
        return function

    return listed
