"""Rows of a structure's run that only say what impacts did to closed stops."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from .pairs import HOLDS

_LOW = 2.0**-32


def essential(
    events: Sequence[tuple[str, int, float]],
    *,
    told_again: bool,
    holds: Mapping[int, str] | None = None,
    impulses: Sequence[float] | None = None,
) -> tuple[list[int], dict[int, str]]:
    """Places of (kind, stop, time) without such rows, and what is told last of closed stops.

    Impacts tell that a closed stop goes on as before, or that one they hit has opened. Where it is
    `told_again`, a closed stop that is hit is told to be closed again, and one that is not told so
    has opened. `holds` are the stops that are closed before. Of several stops that close or open
    at one instant, one after another, the first stands for all: a run has one row for them.

    Where impacts of one instant have no end, one after another, a run has those down to the
    rounding of its velocities, and the reference has more: those whose impulse is below 2^-32 of
    the largest of that instant are left out.
    """
    before = dict(holds or {})
    kept, first = list[int](), 0
    while first < len(events):
        end = first
        while end < len(events) and events[end][2] == events[first][2]:
            end += 1
        group = range(first, end)
        struck = {events[k][1] for k in group if events[k][0] == "impact"}
        least = _LOW * max(impulses[k] for k in group) if impulses else 0.0
        now = dict(before)
        for k in group:
            kind, stop, _ = events[k]
            if kind == "release" or (told_again and kind == "impact"):
                now.pop(stop, None)
        last = ""
        for k in group:
            kind, stop, _ = events[k]
            if kind == "impact" and impulses and impulses[k] < least:
                continue
            if kind in HOLDS:
                now[stop] = kind
            repeated = struck and kind in HOLDS and before.get(stop) == kind
            opened = kind == "release" and stop in struck and stop in before
            if repeated or opened:
                continue
            if kind not in ("closed", "release") or kind != last:
                kept.append(k)
            last = kind
        before, first = now, end
    return kept, before
