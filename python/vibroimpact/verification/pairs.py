"""Which events of a run and of the exact motion, or of two passes of it, belong together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

#: Phases of sustained contact.
HOLDS = ("closed", "slide_positive", "slide_negative", "stick")


def pairs(left: Sequence[str], right: Sequence[str]) -> Iterator[tuple[int, int]]:
    """Places of the events that belong together, up to the first that do not.

    How many impacts of a complete chatter are listed depends on tolerances: further impacts on one
    side are skipped if a chatter ends them. With a small restitution the last impact may be listed
    as plastic: then the bodies are in contact at once, and the chatter of the other side is skipped
    with its impacts. The rows that follow show how large the difference is. A last pair, (left,
    right) beyond one of the ends or of different kinds, says where it stops.
    """
    i = j = 0
    while i < len(left) and j < len(right):
        if left[i] == right[j]:
            yield i, j
            i, j = i + 1, j + 1
        elif left[i] == "impact" and right[j] == "chatter" and _chatters(left, i):
            i = left.index("chatter", i)
        elif right[j] == "impact" and left[i] == "chatter" and _chatters(right, j):
            j = right.index("chatter", j)
        elif hold := _same_hold(left, i, right, j):
            i, j = hold
        else:
            break
    yield i, j


def _same_hold(left: Sequence[str], i: int, right: Sequence[str], j: int) -> tuple[int, int] | None:
    """Places of the contact that both go over to by impacts, one of them or both by a chatter."""
    k, m = _hold(left, i), _hold(right, j)
    if k is None or m is None or left[k] != right[m]:
        return None
    return (k, m) if "chatter" in (left[k - 1], right[m - 1]) else None


def _hold(kinds: Sequence[str], place: int) -> int | None:
    """Place of the next contact, if impacts and at most one chatter, just before it, lead to it."""
    k = place
    while k < len(kinds) and kinds[k] == "impact":
        k += 1
    if k < len(kinds) and kinds[k] == "chatter":
        k += 1
    landed = k > 0 and kinds[k - 1] in ("impact", "chatter")
    return k if landed and k < len(kinds) and kinds[k] in HOLDS else None


def _chatters(kinds: Sequence[str], place: int) -> bool:
    """Whether the next event that is no impact is the end of a chatter."""
    return next((kind for kind in kinds[place:] if kind != "impact"), "") == "chatter"
