"""Which machine a call was given: a System, a Structure, or a function that makes one."""

from __future__ import annotations

from typing import Any

from .arguments import reject
from .machine import Machine
from .system import System

# What an error about a structure adds, where only a System can be had.
NOT_YET = "; not for structures yet"


def is_maker(system: Any) -> bool:
    """Whether a function, not a system, is given."""
    return callable(system) and not isinstance(system, System)


def is_structure(system: Any) -> bool:
    """Whether this is a Structure; its module is not loaded to be asked."""
    return isinstance(system, Machine) and not isinstance(system, System)


def need_system(system: Any, *, maker: bool = False) -> None:
    """Refuse what is no System, nor, with ``maker``, a function that makes one."""
    if not isinstance(system, System) and not (maker and is_maker(system)):
        also = " or a function that makes one" if maker else ""
        yet = NOT_YET if is_structure(system) else ""
        reject("system", system, f"a vibroimpact.System{also}{yet}")
