"""The figures of Han, Jin & Hu (2004) from their parameters, and a verdict on each named motion."""

from .claims import Claim
from .parameters import INITIAL, KEEP, MOTIONS, PERIODS, TRANSITIONS, Motion, Transition
from .reproduction import Reproduction, reproduce

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
