"""Ctrl-C at a place of the work, not at a time: the same place on a busy machine."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

import vibroimpact as vi
from vibroimpact import _core

#: More asks than any call of the tests makes.
MANY = 1 << 60


@contextmanager
def interrupted() -> Iterator[pytest.ExceptionInfo[KeyboardInterrupt]]:
    """Expect Interrupted; a bare KeyboardInterrupt fails the test, and does not end all of them."""
    with pytest.raises(KeyboardInterrupt) as caught:
        yield caught
    assert caught.errisinstance(vi.Interrupted)


@contextmanager
def ctrl_c_at(asks: int) -> Iterator[pytest.ExceptionInfo[KeyboardInterrupt]]:
    """Let Ctrl-C come when the core asks for the so-manieth time, and expect Interrupted."""
    _core._interrupt_at(asks)
    try:
        with interrupted() as caught:
            yield caught
    finally:
        _core._interrupt_at(None)


def asks_of(call: Callable[[], Any]) -> int:
    """Return how often the core asks in a call."""
    _core._interrupt_at(MANY)
    try:
        call()
    finally:
        left = _core._interrupt_at(None)
    return MANY - left


@contextmanager
def ctrl_c_in(monkeypatch, owner: Any, name: str, at: int = 1):
    """Send SIGINT to this process from within the so-manieth call of a function."""
    plain, calls = getattr(owner, name), []

    def signalled(*arguments, **options):
        calls.append(name)
        if len(calls) == at:
            signal.raise_signal(signal.SIGINT)
        return plain(*arguments, **options)

    with monkeypatch.context() as patch, interrupted() as caught:
        patch.setattr(owner, name, signalled)
        yield caught
    assert len(calls) >= at
