"""Immutable objects that are compared, hashed, shown and copied by the values of their fields."""

import inspect
import json
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from functools import cache, cached_property
from typing import Any, ClassVar, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from .arguments import reject
from .errors import ParameterError
from .hints import close_to
from .interruption import interruptible

Number = TypeVar("Number", bound=np.generic)


class Compared(ABC):
    """An object that is compared and hashed by what it holds."""

    @property
    @abstractmethod
    def _identity(self) -> tuple[Any, ...]:
        """What is compared, such that it can be hashed."""

    def __eq__(self, other: object) -> bool:
        """Whether both hold the same numbers, choices and names."""
        if not isinstance(other, type(self)):
            return NotImplemented
        return self._identity == other._identity

    def __hash__(self) -> int:
        """Return the hash of what ``==`` compares."""
        return hash(self._identity)


@interruptible
class ByValue(Compared):
    """An object that is the values of its fields."""

    # What errors call it, the arguments that stand for several fields, and the fields that have no
    # influence on equality and hash.
    _WHAT: ClassVar[str]
    _SHORTHANDS: ClassVar[tuple[str, ...]] = ()
    _NOT_COMPARED: ClassVar[tuple[str, ...]] = ()

    @abstractmethod
    def _fields(self) -> dict[str, Any]:
        """Return the fields by name, but for those that are None."""

    @classmethod
    def _maker(cls, fields: Mapping[str, Any]) -> Callable[..., Self]:
        """Return what makes an object of such fields."""
        return cls

    @classmethod
    def _arguments(cls, fields: Mapping[str, Any]) -> dict[str, Any]:
        """Return the fields of ``to_dict`` as arguments of the maker."""
        return dict(fields)

    @classmethod
    def _of_json(cls, fields: dict[str, Any]) -> dict[str, Any]:
        """Return the fields of ``to_json`` as those of ``to_dict``."""
        return fields

    def to_dict(self) -> dict[str, Any]:
        """Return all fields by name; ``from_dict`` goes back.

        Arrays are lists, parts are dicts, and what is None is not among them.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> stop = vi.Stop([0, 1], 0.3, 0.8)
        >>> stop.to_dict()["normal"]
        [0.0, 1.0]
        """
        return {name: _plain(value) for name, value in self._fields().items()}

    @classmethod
    def from_dict(cls, fields: Mapping[str, Any]) -> Self:
        """Build an object from a mapping of field names to values.

        A Structure is built from the arguments of ``from_modes``, too.

        Raises
        ------
        ParameterError
            For a missing or unknown name, or a value out of range.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> stop = vi.Stop([0, 1], 0.3, 0.8)
        >>> vi.Stop.from_dict(stop.to_dict()) == stop
        True
        """
        if not isinstance(fields, Mapping):
            reject("fields", fields, "a mapping of parameter names to values")
        maker = cls._maker(fields)
        names, required = arguments_of(maker)
        known = [name for name in names if name not in cls._SHORTHANDS]
        unknown = sorted(map(str, set(fields) - set(known)))
        if unknown:
            hint = close_to(unknown[0], known)
            raise ParameterError(f"unknown {cls._WHAT} parameters: {', '.join(unknown)}{hint}")
        missing = sorted(set(required) - set(fields))
        if missing:
            raise ParameterError(f"missing {cls._WHAT} parameters: {', '.join(missing)}")
        return maker(**cls._arguments(fields))

    def to_json(self) -> str:
        """Return the fields as a JSON object; the numbers come back bit for bit.

        Complex numbers are pairs of real and imaginary part.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> vi.Stop([0, 1], 0.3, 0.8).to_json()[:34]
        '{"normal": [0.0, 1.0], "gap": 0.3,'
        """
        return json.dumps(self.to_dict(), allow_nan=False, default=_pair)

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Build an object from the text of ``to_json``.

        Raises
        ------
        ParameterError
            If the text is no JSON object, or its fields do not make an object.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> stop = vi.Stop([0, 1], 0.3, 0.8)
        >>> vi.Stop.from_json(stop.to_json()) == stop
        True
        """
        try:
            fields = json.loads(text)
        except (TypeError, ValueError) as error:
            raise ParameterError(f"not the JSON of a {cls._WHAT}: {error}") from error
        return cls.from_dict(cls._of_json(fields) if isinstance(fields, dict) else fields)

    def _made_by(self) -> str:
        """Return the call that makes the object, without its arguments."""
        return type(self).__name__

    @cached_property
    def _identity(self) -> tuple[Any, ...]:
        compared = (item for item in self._fields().items() if item[0] not in self._NOT_COMPARED)
        return tuple((name, _comparable(value)) for name, value in compared)

    def __repr__(self) -> str:
        """Return the call that makes the object."""
        return f"{self._made_by()}({in_a_call(self._fields())})"

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle and copy through the fields, so that a copy is validated like any other."""
        return type(self).from_dict, (self.to_dict(),)


@cache
def arguments_of(maker: Callable[..., Any]) -> tuple[list[str], list[str]]:
    """Return the names of all arguments of a call, and of those that it needs."""
    arguments = inspect.signature(maker).parameters.values()
    needed = [each.name for each in arguments if each.default is each.empty]
    return [each.name for each in arguments], needed


def fixed(array: NDArray[Number]) -> NDArray[Number]:
    """Return an array of the caller's own, made read-only."""
    array.flags.writeable = False
    return array


def in_a_call(fields: Mapping[str, Any]) -> str:
    """Return fields as the arguments of a call; arrays as lists, which show every digit."""
    return ", ".join(f"{name}={_shown(value)!r}" for name, value in fields.items())


def leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Give what is in the fields of ``to_dict``, at any depth, each with its path."""
    if isinstance(value, dict):
        for name, part in value.items():
            yield from leaves(part, f"{path}.{name}" if path else name)
    elif isinstance(value, list):
        for place, part in enumerate(value):
            yield from leaves(part, f"{path}[{place}]")
    else:
        yield path, value


def _shown(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    return [*value] if isinstance(value, tuple) else value


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, ByValue):
        return value.to_dict()
    return [each.to_dict() for each in value] if isinstance(value, tuple) else value


def _pair(value: Any) -> list[float]:
    return [value.real, value.imag]


def _comparable(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.shape, value.dtype.str, value.tobytes()
    return value
