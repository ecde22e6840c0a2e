"""Which machine of the explorer a system or a structure is."""

from __future__ import annotations

from typing import Any

from ..arguments import reject
from ..structure import Structure
from ..system import System
from .machine import Machine
from .of_structure import OfStructure
from .of_system import OfSystem


def machine_of(system: Any) -> Machine:
    """Return the machine of a system or a structure.

    Raises
    ------
    ParameterError
        If it is neither.
    """
    if isinstance(system, System):
        return OfSystem(system)
    if isinstance(system, Structure):
        return OfStructure.of(system)
    reject("system", system, "a vibroimpact.System or a vibroimpact.Structure")
