"""The errors of vibroimpact: bad input, failed computation, an interrupted call."""

from typing import Any


class ParameterError(ValueError):
    """A parameter lies outside its allowed range; names it, its value and the range."""


class StateError(ValueError):
    """An initial state is not finite, or starts inside the other body."""


class SimulationError(RuntimeError):
    """A computation failed; the message gives time, number of impacts and state.

    ``result`` holds what was done by then: the run, or the list of runs; None where nothing was.
    """

    def __init__(self, message: str, result: Any = None) -> None:
        super().__init__(message)
        self.result = result


class ClusterError(SimulationError):
    """A cluster was lost in the middle of a computation; ``result`` holds what was done by then."""

    def __init__(self, message: str, result: Any = None) -> None:
        super().__init__(message)
        self.result = result


class Interrupted(KeyboardInterrupt):
    """A long call was interrupted with Ctrl-C; ``result`` holds what was done by then."""

    def __init__(self, message: str, result: Any = None) -> None:
        super().__init__(message)
        self.result = result
