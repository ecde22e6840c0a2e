"""The errors of vibroimpact: bad input, failed computation, an interrupted call."""

from typing import Any


class ParameterError(ValueError):
    """A parameter lies outside its allowed range; names it, its value and the range."""


class StateError(ValueError):
    """An initial state is not finite, or starts inside the other body."""


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
    """


class ClusterError(SimulationError):
    """A cluster was lost in the middle of a computation; ``result`` holds what was done by then."""


class Interrupted(_Unfinished, KeyboardInterrupt):
    """A long call was interrupted with Ctrl-C; ``result`` holds what was done by then."""


class NoMotionError(AttributeError):
    """What was asked of a motion that was not found; ``reason`` says why there is none."""

    def __init__(self, message: str = "", reason: str = "", **names: Any) -> None:
        super().__init__(message, **names)
        self.reason = reason
