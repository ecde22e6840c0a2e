"""How far a run goes, and what it keeps: checks of ``periods``, ``time`` and ``keep``."""

from typing import Any, NamedTuple

from .arguments import count, optional_count, positive, reject
from .errors import ParameterError


class Horizon(NamedTuple):
    """How far a run goes and what it keeps: exactly one of ``periods`` and ``time`` is set."""

    periods: int | None
    time: float | None
    keep: int | None


def kept_periods(keep: Any, periods: int, *, usual: int, least: int = 0) -> int:
    """Return how many of ``periods`` are kept: ``usual``, or all of fewer, where None is given."""
    if keep is None:
        return min(usual, periods)
    return count("keep", keep, least=least, most=periods)


def horizon(drive_frequency: float, *, periods: Any, time: Any, keep: Any) -> Horizon:
    """Check the length of a run: whole drive periods, or a time where there is no period."""
    if (periods is None) == (time is None):
        given = "neither" if periods is None else "both"
        raise ParameterError(f"give exactly one of periods= and time=, got {given}")
    if drive_frequency == 0.0:
        for name, value in (("periods", periods), ("keep", keep)):
            if value is not None:
                allowed = "None, as drive_frequency = 0 has no drive period; give time="
                reject(name, value, f"{allowed}, or the machine a drive_frequency")
    if periods is None:
        if keep is not None:
            reject("keep", keep, "None together with time=; it counts drive periods")
        return Horizon(None, positive("time", time), None)
    periods = count("periods", periods, least=1)
    return Horizon(periods, None, optional_count("keep", keep, least=0, most=periods))
