"""The numbers of curves of restitution on the page: symbols, words and ranges."""

from ..restitution import OF_TABLES
from ..stop import SUBSCRIPTS

# Values are not 0; nor are they 1 in all of a table that falls.
_VALUES = (0.01, 1.0)
_SYMBOLS = {"r_low": "r", "least_speed": "u₀", "exponent": "p"}


def symbol(name: str) -> str:
    """Return the symbol of a number of a curve, "" of another."""
    if name in OF_TABLES:
        what, _, knot = name.partition("_")
        return f"{what[:1].replace('s', 'u')}{knot.translate(SUBSCRIPTS)}"
    return _SYMBOLS.get(name, "")


def words(name: str) -> str:
    """Return what a number of a curve is, "" of another."""
    if name in OF_TABLES:
        what, _, knot = name.partition("_")
        return f"speed of knot {knot}" if what == "speed" else f"restitution at knot {knot}"
    known = {
        "r_low": "restitution of slow impacts",
        "least_speed": "speed from which it falls",
        "exponent": "exponent of its fall",
    }
    return known.get(name, "")


def span(name: str, speed: float) -> tuple[float, float] | None:
    """Return the range of a number of a curve where velocities are of this size, None of another.

    Parameters
    ----------
    name
        Of a number.
    speed
        Velocities that impacts may have.
    """
    if name == "least_speed" or name.startswith("speed_"):
        return 1e-3 * speed, speed
    return _VALUES if name in (*OF_TABLES, "r_low", "exponent") else None
