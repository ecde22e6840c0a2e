"""The numbers of curves of restitution on the page: symbols and ranges."""

from ..restitution import OF_SPEEDS, OF_TABLES, OF_VALUES
from ..stop import SUBSCRIPTS

# Values are not 0.
_VALUES = (0.01, 1.0)
SYMBOLS = {
    **{name: f"r{str(i).translate(SUBSCRIPTS)}" for i, name in enumerate(OF_VALUES)},
    **{name: f"u{str(i).translate(SUBSCRIPTS)}" for i, name in enumerate(OF_SPEEDS)},
    "r_low": "r",
    "least_speed": "u₀",
    "exponent": "p",
}


def span(name: str, speed: float) -> tuple[float, float] | None:
    """Return the range of a number of a curve where velocities are of this size, None of another.

    Parameters
    ----------
    name
        Of a number.
    speed
        Velocities that impacts may have.
    """
    if name in ("least_speed", *OF_SPEEDS):
        return 1e-3 * speed, speed
    return _VALUES if name in ("r_low", "exponent", *OF_TABLES) else None
