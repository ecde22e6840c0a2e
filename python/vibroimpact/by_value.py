"""Immutable objects that are compared, hashed, shown and copied by the values of their fields."""

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping
from functools import cached_property
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from .arguments import close_to, reject
from .errors import ParameterError

Number = TypeVar("Number", bound=np.generic)


class ByValue(ABC):
    """An object that is the values of its fields."""

    @abstractmethod
    def _fields(self) -> dict[str, Any]:
        """Return the fields by name, but for those that are None."""

    @classmethod
    @abstractmethod
    def from_dict(cls, fields: Mapping[str, Any]) -> Self:
        """Build an object from its fields."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """Return the fields by name, arrays as lists."""

    @cached_property
    def _identity(self) -> tuple[Any, ...]:
        return tuple((name, _comparable(value)) for name, value in self._fields().items())

    def __eq__(self, other: object) -> bool:
        """Whether both have the same numbers and choices."""
        if not isinstance(other, type(self)):
            return NotImplemented
        return self._identity == other._identity

    def __hash__(self) -> int:
        """Return the hash of what ``==`` compares."""
        return hash(self._identity)

    def __repr__(self) -> str:
        """Return the call that makes the object."""
        return f"{type(self).__name__}({in_a_call(self._fields())})"

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle and copy through the fields, so that a copy is validated like any other."""
        return type(self).from_dict, (self.to_dict(),)


def fixed(array: NDArray[Number]) -> NDArray[Number]:
    """Return an array of the caller's own, made read-only."""
    array.flags.writeable = False
    return array


def in_a_call(fields: Mapping[str, Any]) -> str:
    """Return fields as the arguments of a call; arrays as lists, which show every digit."""
    shown = {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in fields.items()
    }
    return ", ".join(f"{name}={value!r}" for name, value in shown.items())


def check_fields(
    what: str, fields: Any, *, known: Collection[str], required: Collection[str]
) -> None:
    """Refuse what is no mapping of known names with all that are required.

    Raises
    ------
    ParameterError
        Names what is unknown or missing.
    """
    if not isinstance(fields, Mapping):
        reject("fields", fields, "a mapping of parameter names to values")
    unknown = sorted(map(str, set(fields) - set(known)))
    if unknown:
        hint = close_to(unknown[0], known)
        raise ParameterError(f"unknown {what} parameters: {', '.join(unknown)}{hint}")
    missing = sorted(set(required) - set(fields))
    if missing:
        raise ParameterError(f"missing {what} parameters: {', '.join(missing)}")


def _comparable(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.shape, value.dtype.str, value.tobytes()
    return value
