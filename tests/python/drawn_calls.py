"""Calls of public functions made of bytes: most arguments as they should be, some otherwise.

A fuzzer gives the bytes (fuzz/python/entry.py), or a test. What is drawn asks for little work: few
periods, points and events, and times in which the bodies turn a limited number of times.
"""

import contextlib
import math
import struct
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import vibroimpact as vi
from any_values import NOT_TRIED, TAKES, VALUES
from complete_results import assert_complete
from systems import PAPER, ROUGH, STICKY
from valid_calls import Call, calls
from vibroimpact._core import PARAMETERS

# What may come of a call beside a result; OSError and ValueError of files alone.
ENDS = (vi.ParameterError, vi.StateError, vi.SimulationError)
SPECIAL = (
    *(0.0, -0.0, 5e-324, 2.2e-308, 1e-160, 1e-16, 1e-9, 1e-3, 1.0, -1.0, math.pi, 1e3, 1e9, 1e16),
    *(1e154, 1.7e308, -5e-324, -1e16, -1.7e308, math.nan, math.inf, -math.inf),
)
LOADS = ("moment_amplitude", "force_amplitude", "static_moment", "static_force")
SIGNED = ("gap", *LOADS, "phase")
# Turns and times of decay of the bodies that a call may ask for, and events.
MOST_TURNS = 1e3
MOST_EVENTS = 100
# Calls that take a tenth of a second, of which there are fewer, and files.
SLOW = (
    *("unstable_manifold", "basins", "search_motions", "periodic_motions", "motion_map"),
    *("stability_region", "verify", "save", "load"),
)


class Bytes:
    """Values of many kinds read from bytes; zeros where these have ended."""

    def __init__(self, data: bytes) -> None:
        self.data, self.at = data, 0

    def take(self, count: int) -> bytes:
        """Return the next bytes."""
        part = self.data[self.at : self.at + count]
        self.at += count
        return part.ljust(count, b"\0")

    def below(self, limit: int) -> int:
        """Return a whole number below a limit."""
        return int.from_bytes(self.take(1 if limit <= 256 else 2), "little") % limit

    def one_of(self, values: Any) -> Any:
        """Return one of several values."""
        return values[self.below(len(values))]

    def number(self) -> float:
        """Return any float: most between -4 and 4, some special, some of any bits."""
        kind = self.below(8)
        if kind == 7:
            return float(self.one_of(SPECIAL))
        if kind == 6:
            return float(struct.unpack("<d", self.take(8))[0])
        return self.below(65536) / 8192.0 - 4.0

    def finite(self) -> float:
        """Return a finite float."""
        value = self.number()
        return value if math.isfinite(value) else 0.5

    def system(self) -> vi.System:
        """Return a system in range, a few of whose parameters are any numbers."""
        fields: dict[str, Any] = self.one_of((PAPER, ROUGH, STICKY)).to_dict()
        for _ in range(self.below(6)):
            name = self.one_of([*PARAMETERS])
            value = self.finite()
            fields[name] = value if name in SIGNED else abs(value)
        fields["restitution"] = min(fields["restitution"], 1.0)
        fields["drive_frequency"] = min(fields["drive_frequency"], 1e50)
        fields["law"] = self.one_of(("poisson", "newton", "energetic", "paper"))
        if self.below(4) == 0:
            fields |= {"contact": "direct", "friction": 0.0}
        return vi.System(**fields)


def is_short(system: vi.System, periods: float = 4.0) -> bool:
    """Whether so many drive periods are few turns, and times of decay, of both bodies."""
    first = system.frequency_ratio * (1 + 2 * system.pendulum_damping)
    second = 1 + 2 * system.oscillator_damping
    speed = sum(abs(getattr(system, name)) for name in LOADS)
    return periods * system.drive_period * (first + second + speed) < MOST_TURNS


def good(draw: Bytes, kind: str, name: str) -> Any:
    """Return a value that an argument of a kind may well take."""
    if name == "system":
        return draw.system()
    if "whole number" in kind:
        return draw.below(24) - 2
    if "state" in kind:
        rows = np.array([draw.number() for _ in range(4 * (1 + draw.below(2)))]).reshape(-1, 4)
        return rows[0] if len(rows) == 1 else rows
    if kind.startswith("axis") or kind in ("times", "numbers"):
        return np.array([draw.number() for _ in range(draw.below(4))])
    if "range" in kind or "pair" in kind:
        return draw.number(), draw.number()
    if "true" in kind:
        return bool(draw.below(2))
    if kind == "law":
        return draw.one_of(("poisson", "newton", "energetic", "paper", "direct"))
    if kind == "rows of two":
        return np.array([draw.number() for _ in range(2 * draw.below(3))]).reshape(-1, 2)
    if kind.startswith(("number", "part", "phase", "step", "grid")):
        return draw.number()
    return VALUES[draw.one_of([*VALUES])]


def drawn(data: bytes) -> tuple[str, Call, dict[str, Any]]:
    """Return the name of a call, the call, and its changed arguments."""
    draw = Bytes(data)
    names = [*calls()]
    name = names[draw.below(len(names))]
    if any(part in name for part in SLOW) and draw.below(32):
        name = names[draw.below(len(names))]
    call = calls()[name]
    changes: dict[str, Any] = {}
    if "max_events" in call.kinds:
        changes["max_events"] = MOST_EVENTS
    for _ in range(1 + draw.below(4)):
        argument = draw.one_of([*call.kinds])
        kind = call.kinds[argument]
        if draw.below(3):
            changes[argument] = good(draw, kind, argument)
            continue
        what = draw.one_of([*VALUES])
        if (kind, what) not in NOT_TRIED and not (kind.startswith("path") and what in TAKES[kind]):
            changes[argument] = VALUES[what]
    return name, call, _limited(call, changes)


def _limited(call: Call, changes: dict[str, Any]) -> dict[str, Any]:
    """Leave out what asks for much work."""
    given = call.arguments | changes
    system = given.get("system")
    if isinstance(system, vi.System) and not is_short(system):
        changes.pop("system", None)
        if "system" in call.arguments:
            changes["system"] = call.arguments["system"]
    if call.function in (vi.periodic_motion, vi.search_motions, vi.periodic_motions):
        # Newton's method on motions of many periods or impacts takes seconds, and so do intervals
        # where no number is told from zero.
        for name in ("periods", "system"):
            changes.pop(name, None)
    for name, value in [*changes.items()]:
        fast = name in ("x1", "v1", "initial", "starts", "drive_frequency", "time", "length")
        if not fast or isinstance(value, str | bytes | dict | set):
            continue
        with contextlib.suppress(TypeError, ValueError, OverflowError):
            given_numbers = np.asarray(value)
            if np.iscomplexobj(given_numbers):
                continue
            with np.errstate(over="ignore"):
                numbers = np.abs(given_numbers.astype(np.float64))
            numbers = numbers[np.isfinite(numbers)]
            slow = name == "drive_frequency" and (numbers[numbers > 0.0] < 0.05).any()
            if slow or (numbers > 50.0).any():
                del changes[name]
    return changes


def execute(data: bytes) -> tuple[str, str]:
    """Make a call, check what comes of it, and return its name and whether it was refused."""
    name, call, changes = drawn(data)
    ends: tuple[type[Exception], ...] = ENDS
    if any(call.kinds[argument].startswith("path") for argument in changes):
        ends = (*ends, OSError, ValueError)
    with contextlib.chdir(_folder()):
        try:
            result = call(**changes)
        except ends as error:
            if not str(error):
                raise AssertionError("an error without words") from error
            return name, "refused" if isinstance(error, ENDS[:2]) else "failed"
    assert_complete(result)
    return name, "taken"


def _folder() -> Path:
    """Return a folder in which words are paths."""
    place = Path(tempfile.gettempdir()) / "drawn_calls"
    place.mkdir(exist_ok=True)
    return place
