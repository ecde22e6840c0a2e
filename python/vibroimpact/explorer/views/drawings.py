"""Which view draws which machine."""

from __future__ import annotations

from ..machine import Machine
from ..of_structure import OfStructure
from ..of_system import OfSystem
from .columns import Sources
from .drawing import Drawing
from .machine import MachineView
from .stops import StopsView

_DRAWINGS: dict[type[Machine], type[Drawing]] = {OfSystem: MachineView, OfStructure: StopsView}


def drawing_of(machine: Machine, sources: Sources) -> Drawing:
    """Return the view that draws a machine."""
    return _DRAWINGS[type(machine)](machine, sources)
