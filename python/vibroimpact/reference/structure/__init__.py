"""An independent simulator of linear structures with stops, in ball arithmetic.

`Structure.parse` takes plain numbers, `simulate_structure` follows a motion through flights,
impacts, chatter, closed stops and releases (structures page).
"""

from .model import Stop, Structure
from .result import Change, Impact, StructureRun
from .simulate import simulate_structure

__all__ = ["Change", "Impact", "Stop", "Structure", "StructureRun", "simulate_structure"]
