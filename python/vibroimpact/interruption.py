"""Ctrl-C anywhere in a public call raises `Interrupted`: the decorator of public calls.

A long computation raises `Interrupted` itself, with what is done by then. Elsewhere, such as in the
checks of arguments or while an array is built, there is no result yet; there the decorator of this
module raises it, without a result. It also lets the error about an unknown keyword say which one
was meant.

Only the main thread of a program receives Ctrl-C. Calls on another thread end in the same way by a
`Cancellation` that the thread heeds.
"""

import enum
import functools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

from . import _core
from ._core import Cancellation as Cancellation
from .arguments import unexpected
from .errors import Interrupted

Target = TypeVar("Target", bound=Callable[..., Any])


def interruptible(target: Target) -> Target:
    """Let Ctrl-C in a function, or in public members of a class, raise `Interrupted`."""
    if not isinstance(target, type):
        return _call(target)  # type: ignore[return-value]
    for name, member in list(vars(target).items()):
        if not name.startswith("_"):
            covered = _member(member)
            if covered is not member:
                setattr(target, name, covered)
    return target


@contextmanager
def heeding(cancellation: Cancellation) -> Iterator[None]:
    """Let ``cancellation.cancel()``, from any thread, end the calls in a ``with`` block.

    They raise `Interrupted`, with what is done by then, as after Ctrl-C.
    """
    _core._heed(cancellation)
    try:
        yield
    finally:
        _core._heed(None)


def is_covered(member: Any) -> bool:
    """Whether a function or a member of a class is decorated."""
    for name in ("__func__", "fget", "func"):
        member = getattr(member, name, member)
    return hasattr(member, "__ctrl_c__")


def _call(function: Callable[..., Any]) -> Callable[..., Any]:
    @functools.wraps(function)
    def covered(*arguments: Any, **options: Any) -> Any:
        try:
            return function(*arguments, **options)
        except Interrupted:
            raise
        except TypeError:
            if (error := unexpected(function, arguments, options)) is not None:
                raise error from None
            raise
        except KeyboardInterrupt as error:
            said = str(error) or f"interrupted in {function.__qualname__}"
            raise Interrupted(said, holds="nothing") from None

    covered.__ctrl_c__ = True  # type: ignore[attr-defined]
    return covered


def _member(member: Any) -> Any:
    match member:
        case classmethod() | staticmethod():
            return type(member)(_call(member.__func__))
        case property(fget=getter) if getter is not None:
            return property(_call(getter), member.fset, member.fdel, member.__doc__)
        case functools.cached_property():
            member.func = _call(member.func)
            return member
        case type() | enum.Enum():
            return member
        case _ if callable(member):
            return _call(member)
    return member
