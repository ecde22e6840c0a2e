"""The errors of vibroimpact: bad input, failed computation, an interrupted call; warnings."""

import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any

_HERE = Path(__file__).parent
_HEARD: ContextVar[bool] = ContextVar("_HEARD", default=True)


@contextmanager
def unheard() -> Iterator[None]:
    """Let calls in a ``with`` block not warn: what they find is shown in another way."""
    token = _HEARD.set(False)
    try:
        yield
    finally:
        _HEARD.reset(token)


def warn(message: str) -> None:
    """Warn at the line outside of this package that called it."""
    if not _HEARD.get():
        return
    level, frame = 1, sys._getframe()
    while frame.f_back is not None and Path(frame.f_code.co_filename).is_relative_to(_HERE):
        level, frame = level + 1, frame.f_back
    warnings.warn(message, stacklevel=level)


class ParameterError(ValueError):
    """A parameter lies outside its allowed range; names it, its value and the range.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> try:
    ...     vi.System(mass_ratio=1, frequency_ratio=2, restitution=1.5, gap=0, drive_frequency=1)
    ... except vi.ParameterError as error:
    ...     print(error)
    restitution = 1.5 is not allowed; allowed: a number in [0, 1]
    """


class StateError(ValueError):
    """An initial state is not finite, or starts inside the other body.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> try:
    ...     vi.simulate(system, initial=(1.5, 0, 0, 0), periods=10)
    ... except vi.StateError as error:
    ...     print(str(error)[:32])
    the initial state is penetrating
    """


class _Unfinished(BaseException):
    """A call that ended early.

    Parameters
    ----------
    reason
        Why it ended.
    result
        What was done by then, None if nothing was.
    holds
        What ``result`` holds, in words that the message adds to the reason.
    """

    def __init__(self, reason: str, result: Any = None, *, holds: str = "") -> None:
        super().__init__(f"{reason}; .result holds {holds}" if holds else reason)
        self.reason, self.result = reason, result


class SimulationError(_Unfinished, RuntimeError):
    """A computation failed; the message gives time, number of impacts and state.

    ``result`` holds what was done by then: the run, or the list of runs; None where nothing was.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> issubclass(vi.SimulationError, RuntimeError)
    True
    """


class ClusterError(SimulationError):
    """A cluster was lost in the middle of a computation; ``result`` holds what was done by then.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> issubclass(vi.ClusterError, RuntimeError)
    True
    """


class Interrupted(_Unfinished, KeyboardInterrupt):
    """A long call was interrupted with Ctrl-C; ``result`` holds what was done by then.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> try:
    ...     run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600)
    ... except vi.Interrupted as stopped:  # after Ctrl-C
    ...     run = stopped.result
    >>> run.label
    '1-1'
    """


class ProofError(ValueError):
    """A certificate is damaged, or claims what is not shown.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> issubclass(vi.ProofError, ValueError)
    True
    """


class NoMotionError(AttributeError):
    """What was asked of a motion that was not found; ``reason`` says why there is none.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> chaotic = system.replace(drive_frequency=1.9)
    >>> found = vi.simulate(chaotic, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> try:
    ...     found.multipliers
    ... except vi.NoMotionError as error:
    ...     print(error)
    no periodic motion was found, so it has no 'multipliers': the run is chaotic, not periodic
    """

    def __init__(self, message: str = "", reason: str = "", **names: Any) -> None:
        super().__init__(message, **names)
        self.reason = reason
