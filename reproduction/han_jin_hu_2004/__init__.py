"""The figures of Han, Jin & Hu (2004) from their parameters, and a verdict on each named motion."""

from typing import TYPE_CHECKING

from .claims import Claim
from .parameters import INITIAL, KEEP, MOTIONS, PERIODS, TRANSITIONS, Motion, Transition

if TYPE_CHECKING:
    from .reproduction import Reproduction, reproduce
else:

    def __getattr__(name):
        """Import the parts that draw, and matplotlib, on first use."""
        if name not in ("Reproduction", "reproduce"):
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        from . import reproduction

        return getattr(reproduction, name)

    def __dir__():
        """Return all names, also those that are imported on first use."""
        return sorted({*globals(), *__all__})


__all__ = [
    "INITIAL",
    "KEEP",
    "MOTIONS",
    "PERIODS",
    "TRANSITIONS",
    "Claim",
    "Motion",
    "Reproduction",
    "Transition",
    "reproduce",
]
