"""Branches of `vibroimpact orbits --follow`: following, switching, what is written and printed."""

import argparse
import functools
import itertools
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from .._core import Leg, Regime, StopLeg
from ..continuation.names import PathEnd
from ..errors import ClusterError, Interrupted, ParameterError
from ..orbits import Bifurcation, Branch, follow_motion, switch_branch
from ..scales import Units
from . import motion_table as table
from . import outputs
from .exit_codes import ExitCode

# Ends of a branch that are failures: the rest are bounds, and borders at which the motion ends.
_BROKEN_OFF = (PathEnd.POINTS, PathEnd.NO_CONVERGENCE, PathEnd.OUTSIDE_DOMAIN, PathEnd.REFUSED)


def check(options: argparse.Namespace) -> None:
    """Refuse numbers of bifurcations that no list has."""
    for number in options.switch or ():
        if number < 1:
            raise ParameterError(f"--switch {number}: allowed are the numbers of the list, from 1")


def follow(options: argparse.Namespace, motion: Any, keywords: dict[str, Any]) -> "Followed":
    """Follow a motion, and the branches that leave the bifurcations of ``--switch``."""
    keywords = dict(keywords)
    if options.max_step is not None:
        keywords["max_step"] = options.max_step
    if options.stop_at is not None:
        keywords["stop_at"] = [kind.replace("-", "_") for kind in options.stop_at]
    found = Followed()
    found.add(lambda: follow_motion(motion, **keywords), "")
    for number in options.switch or ():
        if found.interrupted is not None:
            break
        if number > len(found.points):
            found.problems.append(
                f"--switch {number}: there are {len(found.points)} bifurcations so far"
            )
            continue
        point = found.points[number - 1]
        switched = functools.partial(switch_branch, point, **keywords)
        try:
            found.add(switched, str(number))
        except ParameterError as error:
            found.problems.append(f"--switch {number}: {error}")
    return found


class Followed:
    """Branches with the numbers of the bifurcations that they leave, and what went wrong."""

    def __init__(self) -> None:
        self.branches: list[Branch] = []
        self.origins: list[str] = []
        self.problems: list[str] = []
        self.interrupted: Interrupted | ClusterError | None = None

    def add(self, compute: Callable[[], Branch], origin: str) -> None:
        """Add a branch, as far as it was followed."""
        branch, self.interrupted = outputs.partial_on_interrupt(compute)
        self.branches.append(branch)
        self.origins.append(origin)

    @property
    def points(self) -> list[Bifurcation]:
        """The bifurcations of all branches, in the order of their numbers."""
        return [found for branch in self.branches for found in branch.bifurcations]

    @property
    def code(self) -> ExitCode:
        """Whether a part is missing."""
        ends = (end for branch in self.branches for end in branch.ends)
        broken = any(end in _BROKEN_OFF for end in ends)
        return ExitCode.INCOMPLETE if broken or self.problems else ExitCode.DONE


def write(
    options: argparse.Namespace,
    followed: Followed,
    bounds: tuple[float, float],
    drawn: dict[str, Any],
) -> None:
    """Write and print branches: the points of each, then its bifurcations."""
    writing = outputs.Writing()
    branches = followed.branches
    name = branches[0].parameter
    if options.csv:
        rows = [row for number in range(len(branches)) for row in _rows(options, followed, number)]
        heads = ["branch"] if options.switch else []
        names = [*rows[0]] if rows else [*heads, "kind", name, *table.CSV_NAMES]
        writing(outputs.write_csv, options.csv, names, (row.values() for row in rows))
    with_points = [branch for branch in branches if branch.pieces]
    if options.plot and with_points:
        writing(_plot, with_points, options.plot, drawn, options.units)
    stream = outputs.summary_stream(options)
    number = 1
    for branch, origin in zip(branches, followed.origins, strict=True):
        if origin:
            print(f"\nthe branch that leaves bifurcation {origin}:", file=stream)
        _print(branch, number, bounds, stream)
        number += len(branch.bifurcations)
    for problem in followed.problems:
        print(problem, file=stream)
    writing.end()


def _rows(options: argparse.Namespace, followed: Followed, number: int) -> Iterable[dict[str, Any]]:
    branch = followed.branches[number]
    head = {"branch": followed.origins[number] or "0"} if options.switch else {}
    points = (
        ("point", value, piece.motion(k))
        for piece in branch.pieces
        for k, value in enumerate(piece.values.tolist())
    )
    special = ((found.kind, found.value, found.motion) for found in branch.bifurcations)
    for kind, value, motion in itertools.chain(points, special):
        yield {
            **head,
            "kind": kind,
            branch.parameter: value,
            **table.csv_row(motion, options.units),
        }


def _print(branch: Branch, number: int, bounds: tuple[float, float], stream: Any) -> None:
    """Print the bifurcations of a branch, the first of which has this number, and its ends."""
    heads = ["no", "bifurcation", branch.parameter, "motion", "goes on as"]
    printed = [
        [str(place), _kind(found), repr(found.value), found.motion.label, _legs(found.goes_on)]
        for place, found in enumerate(branch.bifurcations, number)
    ]
    if any(image is not None for image in branch.images):
        # Before the last column, which may be long.
        heads.insert(-1, "mirror image of")
        for row, image in zip(printed, branch.images, strict=True):
            row.insert(-1, "" if image is None else str(number + image))
    outputs.print_table([heads, *printed], stream)
    if any(found.goes_on for found in branch.bifurcations):
        print("goes on as: the events of the motion beyond a border, in order", file=stream)
    labels = ", ".join(dict.fromkeys(piece.label for piece in branch.pieces))
    print(f"motions {labels}; {len(branch.values)} points", file=stream)
    for place, end, why in zip(("first", "last"), branch._end_texts(), branch.why_not, strict=True):
        print(f"{place} end: {end}{why and ': '}{why}", file=stream)
    for which, bound in zip(("low", "high"), sorted(bounds), strict=True):
        if {*branch.ends} == {PathEnd.BOUND} and bound not in branch.values[[0, -1]]:
            print(f"never reached: the {which} bound {bound:.12g}", file=stream)


def _kind(found: Bifurcation) -> str:
    """Name the kind, of a branch point also how the branches cross."""
    return f"{found.kind} ({found.branching})" if found.branching else found.kind


def _legs(legs: Iterable[Leg | StopLeg]) -> str:
    """Name legs in their order: 18 x frictionless, impact:slip:+-."""
    # Without friction an impact is told by its regime; of a structure by its stop, too.
    texts = (
        "frictionless" if isinstance(leg, Leg) and leg.regime == Regime.FRICTIONLESS else str(leg)
        for leg in legs
    )
    counted = ((len([*same]), text) for text, same in itertools.groupby(texts))
    return ", ".join(text if number == 1 else f"{number} x {text}" for number, text in counted)


def _plot(
    branches: Sequence[Branch], path: Path, drawn: dict[str, Any], units: Units | None
) -> None:
    from .. import plot

    with outputs.figure(path, 7.1, 4.0) as figure:
        plot.branches(branches, ax=figure.subplots(), units=units, **drawn)
