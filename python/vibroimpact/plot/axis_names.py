"""What an axis is called: every quantity in words and by its symbol, as on the notation page.

Words and symbols of both bodies hold for oblique and for direct contact: a position is the angle of
the pendulum in the one, a length in the other. Units in SI are added by `parameter_units` and
`units`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final

from .._core import PARAMETERS
from ..restitution import MEANINGS, OF_SPEEDS, OF_VALUES
from ..stop import Stop, numbered, of_one_stop, varied_in

PARAMETER_SYMBOLS = {name: f"${parameter.latex}$" for name, parameter in PARAMETERS.items()}

# Of the numbers of curves of restitution.
_CURVE_SYMBOLS: Final[Mapping[str, str]] = {
    **{name: f"$r_{{{i}}}$" for i, name in enumerate(OF_VALUES)},
    **{name: f"$u_{{{i}}}$" for i, name in enumerate(OF_SPEEDS)},
    "r_low": r"$r_\mathrm{low}$",
    "least_speed": "$u_0$",
    "exponent": "$p$",
}

STATE_SYMBOLS: Final[Mapping[str, str]] = {
    "x1": "$x_1$",
    "v1": r"$\dot x_1$",
    "x2": "$x_2$",
    "v2": r"$\dot x_2$",
}

_ONCE = r" once per drive period, at $\psi = 0$"

STATE_NAMES: Final[Mapping[str, str]] = {
    "x1": "position $x_1$ of body 1",
    "v1": r"velocity $\dot x_1$ of body 1",
    "x2": "position $x_2$ of body 2",
    "v2": r"velocity $\dot x_2$ of body 2",
    "v1_pre": r"velocity $\dot x_1$ of body 1 before impact",
    "v1_post": r"velocity $\dot x_1$ of body 1 after impact",
    "v2_pre": r"velocity $\dot x_2$ of body 2 before impact",
    "v2_post": r"velocity $\dot x_2$ of body 2 after impact",
    "phase": r"drive phase $\psi$ at impact",
    "time": "time $t$",
    "approach_velocity": "approach velocity $u$",
    "energy_loss": "energy loss $E - E_{+}$",
    "impulse_normal": "normal impulse $P$",
    "impulse_tangential": "tangential impulse",
}
"""What may stand along an axis, of a run of a `System`."""

AT_IMPACT: Final[Mapping[str, str]] = {
    "x1": f"{STATE_NAMES['x1']} at impact",
    "v1": STATE_NAMES["v1_pre"],
    "v2": STATE_NAMES["v2_pre"],
    **{name: STATE_NAMES[name] for name in ("phase", "approach_velocity", "energy_loss")},
}
"""What can be drawn of the impact section of many runs, with its name on the axis."""

ONCE_A_PERIOD: Final[Mapping[str, str]] = {
    name: STATE_NAMES[name] + _ONCE for name in ("x1", "v1", "x2", "v2")
}
"""What can be drawn of the stroboscopic section, with its name on the axis where psi = 0."""

SECTIONS: Final[Mapping[str, Mapping[str, str]]] = {
    "impact": AT_IMPACT,
    "stroboscopic": ONCE_A_PERIOD,
}

_BETWEEN = r",\ "
EXPONENTS = r"Lyapunov exponents $\lambda$"
LARGEST_EXPONENT = r"largest Lyapunov exponent $\lambda_1$"

# Of a coordinate and its derivatives: the word, that of several, and the dots over the symbol.
_RATES: Final[Mapping[str, tuple[str, str, str]]] = {
    "q": ("coordinate", "coordinates", ""),
    "x": ("position", "positions", ""),
    "v": ("velocity", "velocities", r"\dot "),
    "a": ("acceleration", "accelerations", r"\ddot "),
}


def state_name(name: str) -> str:
    """Return the label of an axis of a column of a run, or of a coordinate of a structure."""
    return STATE_NAMES.get(name) or structure_axis_name(name, made=False)


def state_symbol(name: str) -> str:
    """Return the symbol of a coordinate of a state, where it stands in a sentence."""
    one = numbered(name)
    return STATE_SYMBOLS[name] if one is None else f"${coordinate_symbol(one.what, one.place)}$"


def worded(name: str, symbol: str) -> str:
    """Return the label of an axis of a parameter: its name in words, and its symbol."""
    return f"{name.replace('_', ' ')} {symbol}"


def axis_name(name: str, *, made: bool) -> str:
    """Return the label of an axis: what is varied, or the name of the argument of the function that
    makes the systems.
    """  # noqa: D205
    if name in PARAMETER_SYMBOLS and not made:
        return worded(name, PARAMETER_SYMBOLS[name])
    if name in MEANINGS and not made:
        return f"{MEANINGS[name]}, {_CURVE_SYMBOLS[name]}"
    return STATE_NAMES.get(name, name)


def structure_axis_name(name: str, *, made: bool, stops: Sequence[Stop] = ()) -> str:
    """Return the label of an axis of structures: numbers of stops in words, numbers of a start.

    ``stops`` are those of the structure, for a number without that of a stop.
    """
    one = numbered(name)
    if one and one.what in ("q", "v"):
        return of_coordinates(one.what, [coordinate_symbol(one.what, one.place)])
    if made:
        return name
    if of_stop := of_one_stop(name):
        return f"{MEANINGS.get(of_stop.what, of_stop.what)} of stop {of_stop.place}"
    if name in ("gap", "restitution", "friction", *MEANINGS):
        return f"{MEANINGS.get(name, name)} of {_those_with(name, stops)}"
    return axis_name(name, made=False) if name in PARAMETER_SYMBOLS else name


def _those_with(name: str, stops: Sequence[Stop]) -> str:
    """Return in words which stops have a number of this name."""
    having = [place for place, stop in enumerate(stops) if name in varied_in(stop.restitution)]
    if len(stops) == 1:
        return "the stop"
    if len(having) == len(stops):
        return "all stops"
    return f"stop{'s' if len(having) > 1 else ''} {', '.join(map(str, having))}"


def coordinate_symbol(what: str, place: int) -> str:
    """Return the symbol of a coordinate of a structure: "q", or its velocity "v", "v_pre" ..."""
    index = f"{{{place}}}" if place > 9 else f"{place}"
    sign = {"v_pre": "^-", "v_post": "^+"}.get(what, "")
    return f"q_{index}" if what == "q" else rf"\dot q_{index}{sign}"


def of_coordinates(what: str, symbols: list[str], *, several: bool = False) -> str:
    """Return the label of an axis of coordinates "q" or velocities "v", "v_pre" ..."""
    one, many, _ = _RATES[what[0]]
    return f"{many if several or len(symbols) > 1 else one} ${_BETWEEN.join(symbols)}$"


def of_bodies(what: str, signs: Mapping[int, str]) -> str:
    """Return the label of an axis of positions "x" or velocities "v" of one body or of both.

    Parameters
    ----------
    what : {"x", "v"}
        Which of them.
    signs : mapping from int to str
        For each body the sign of its unit, or nothing.
    """
    if len(signs) == 1:
        ((body, sign),) = signs.items()
        return in_unit(STATE_NAMES[f"{what}{body}"], sign)
    each = (in_unit(STATE_SYMBOLS[f"{what}{body}"], sign) for body, sign in signs.items())
    return f"{_RATES[what][1]} {', '.join(each)}"


def in_unit(text: str, sign: str) -> str:
    """Return the label of an axis with the sign of its unit; a position in rad is an angle."""
    if sign == "rad":
        text = text.replace(_RATES["x"][0], "angle")
    return f"{text} ({sign})" if sign else text


def measured_name(kind: str) -> str:
    """Return the label of an axis of what was measured: "x1", "v2", "a_0", "q_3" ..."""
    one = numbered(kind)
    if one:
        word, _, dots = _RATES[one.what]
        return f"{word} ${dots}q_{{{one.place}}}$"
    what, body = kind[0], kind[1:]
    word, _, dots = _RATES[what]
    return f"{word} ${dots}x_{{{body}}}$ of body {body}"


def at_drive_phase(text: str, phase: float | None) -> str:
    """Return a name of the stroboscopic section with the drive phase at which it is taken.

    Parameters
    ----------
    text : str
        Name for phase 0.
    phase : float or None
        Drive phase in radians; None where it is varied.
    """
    if phase is None:
        return text.replace(r"\psi = 0", r"\psi = \varphi")
    return text.replace(r"\psi = 0", rf"\psi = {phase % (2.0 * math.pi):.4g}")
