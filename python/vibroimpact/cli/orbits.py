"""`vibroimpact orbits`: periodic motions, found, judged and followed (orbits page)."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..errors import ParameterError
from ..orbits import NotFound, PeriodicMotion, search_motions
from ..orbits.branch import AT_IMPACTS
from ..orbits.ranges import range_around
from ..orbits.structure_piece import AT_STOPS
from ..run import Run
from ..scales import Units
from ..simulation import simulate
from ..single_impact import periodic_motions
from ..structure_motion import StructureOrbit
from ..system import System
from . import branches, outputs, proofs
from . import motion_table as table
from . import options as shared
from .exit_codes import ExitCode

ABOUT = f"""\
Periodic motions to rounding, stable or not, each with its Floquet multipliers
and the verdict whether it is one. Which ones:
  by default      the motion that a run from --initial settles on
  --n N           without friction: all motions of N drive periods with one
                  impact
  --search K      the motions that K random starts settle on
  --follow NAME FIRST LAST
                  the motion settled on, followed over a parameter, with its
                  bifurcations
Of a structure the motion settled on, and followed.

{shared.UNITS}
{shared.SI}"""
MORE = f"""\
printed, one row per motion: its label, the state just before its first
impact, the largest |multiplier|, and the verdict; of a search the part of the
starts that end on it. Of a branch its bifurcations, one per row, with
  no               their number, for --switch
  mirror image of  number of the one before of whose motion the motion is the
                   mirror image: -q, half a drive period later
  goes on as       at a border (a graze, the edge of a regime, ...): the events
                   of the motion beyond it, in order; empty where the events
                   stay the same, and where the branch ends
and where the two ends of the branch are: at which bound, or at which value and
why it ends early. A branch ends where the mirror image of itself would follow.

columns of the CSV, one row per motion:
{table.COLUMNS}
with --prove it ends with
  proof            proved, and stable or unstable; disproved, or undecided,
                   and why
a search begins the row with
  share            part of the starts that end on the motion
and a branch with
  branch           with --switch: 0, or the number of the bifurcation it leaves
  kind             point, or saddle_node, period_doubling, grazing, ...: first
                   the points along the branch, then its bifurcations
  (parameter)      its value, under its name in Python, e.g. drive_frequency

exit code 3: no periodic motion was found, intervals are left undecided, starts
were not resolved, a proof was left undecided, or a branch broke off.

examples, with the system file of vibroimpact --help:
  vibroimpact orbits --system fig5b.toml --plot orbit.svg
  vibroimpact orbits --system fig5b.toml --n 1 --csv all.csv
  vibroimpact orbits --system fig5b.toml --friction 0.5 \\
      --drive-frequency 1.5752 --search 20
  vibroimpact orbits --system fig5b.toml --follow drive-frequency 1.4 2.2 \\
      --csv branch.csv --plot branch.pdf
  vibroimpact orbits --system fig5b.toml --follow drive-frequency 1.45 1.9 \\
      --switch 1 --plot doubled.png"""

# Pictures of motions on one page.
MOST_DRAWN = 6
# Flags that only one of the searches uses.
_ONLY = {"within": "n", "seed": "search", "workers": "search", "max_step": "follow"}
_ONLY |= {"value": "follow", "switch": "follow", "stop_at": "follow"}
_DECIDED = ("chaotic", "quasi-periodic")


def add(subparsers: Any) -> None:
    """Add the command."""
    command = shared.command(
        subparsers,
        "orbits",
        summary="periodic motions and their bifurcations",
        about=ABOUT,
        more=MORE,
    )
    which = command.add_argument_group("which motions").add_mutually_exclusive_group()
    which.add_argument(
        "--n", type=shared.whole, metavar="N", help="all motions N-1, without friction"
    )
    which.add_argument(
        "--search", type=shared.whole, metavar="K", help="those that K starts settle on"
    )
    which.add_argument(
        "--follow", nargs=3, metavar=("NAME", "FIRST", "LAST"), help="over a parameter"
    )
    shared.add_system(command)
    group = command.add_argument_group("how")
    group.add_argument(
        "--periods",
        type=shared.whole,
        metavar="N",
        help="drive periods to settle in (default: 600; with --search 2000)",
    )
    group.add_argument(
        "--within", nargs=2, type=float, metavar=("LO", "HI"), help="--n: x1 at the impact, radians"
    )
    group.add_argument(
        "--seed", type=shared.whole, metavar="N", help="--search: of the starts (default: 0)"
    )
    group.add_argument(
        "--workers", type=shared.whole, metavar="N", help="--search: threads (default: all cores)"
    )
    group.add_argument(
        "--max-step",
        type=float,
        metavar="X",
        help="--follow: largest step, as part of the range and of the motion's size "
        "(default: 0.05)",
    )
    group.add_argument(
        "--stop-at",
        nargs="+",
        metavar="KIND",
        help="--follow: end branches at the first bifurcation of these kinds, such as branch-point",
    )
    group.add_argument(
        "--switch",
        nargs="+",
        type=shared.whole,
        metavar="N",
        help="--follow: also the branches that leave the bifurcations of these numbers of the "
        "list, a period doubling or a branch point; those of a new branch are numbered on",
    )
    group.add_argument(
        "--value",
        metavar="COLUMN",
        help="--follow: what of the impacts --plot draws: x1, v1, v2, phase, approach_velocity; of "
        "a structure q-0, v-pre-0, ... (default: x1; of a wall at rest, and of structures, "
        "approach_velocity)",
    )
    proofs.add_options(command)
    outputs.add_outputs(command, "the motions")
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> ExitCode:
    """Find motions one of four ways."""
    ways = {"n": _all, "search": _search, "follow": _follow}
    way = next((name for name in ways if getattr(options, name) is not None), None)
    for name, wanted in _ONLY.items():
        if getattr(options, name) is not None and way != wanted:
            raise ParameterError(f"--{name.replace('_', '-')} goes with --{wanted} only")
    proofs.check(options)
    request = shared.Request.of(options)
    if way in ("n", "search"):
        request.need_two_bodies(f"--{way}")
    system = request.system()
    if system.drive_frequency == 0:
        raise ParameterError(
            "drive_frequency = 0.0 is not allowed; allowed: a number > 0: orbits are closed after "
            "whole drive periods"
        )
    outputs.check(options)
    return (ways[way] if way else _settled)(request, system)


def _all(request: shared.Request, system: System) -> ExitCode:
    options = request.options
    found, interrupted = outputs.partial_on_interrupt(
        lambda: periodic_motions(system, options.n, within=options.within)
    )
    code = _write(options, found.motions)
    stream = outputs.summary_stream(options)
    lo, hi = found.within
    known = "no solution lies outside" if found.bounded else "solutions may lie outside"
    print(f"searched x1 in [{lo:.6g}, {hi:.6g}]: {known}", file=stream)
    if found.note:
        print(found.note, file=stream)
    for part in found.undecided:
        print(f"undecided x1 in [{part.lo!r}, {part.hi!r}]: {part.reason}", file=stream)
    if interrupted is not None:
        raise interrupted
    return ExitCode.INCOMPLETE if found.undecided else code


def _search(request: shared.Request, system: System) -> ExitCode:
    options = request.options
    values = request.values(own=("periods", "seed", "workers"))
    found, interrupted = outputs.partial_on_interrupt(
        lambda: search_motions(system, starts=options.search, **values)
    )
    code = _write(options, found.motions, found.shares.tolist())
    stream = outputs.summary_stream(options)
    for label, share in found.others.items():
        print(f"{share:.4g} of the starts: {label}", file=stream)
    if interrupted is not None:
        raise interrupted
    return code if set(found.others) <= set(_DECIDED) else ExitCode.INCOMPLETE


def _settled(request: shared.Request, system: System) -> ExitCode:
    motion = _motion(request, system)
    if isinstance(motion, NotFound):
        return _no_motion(request, motion)
    return _write(request.options, [motion])


def _motion(request: shared.Request, system: System) -> Any:
    settled: Run = simulate(system, **request.values("initial", periods=600), **request.units)
    return settled.refine()


def _no_motion(request: shared.Request, found: NotFound) -> ExitCode:
    stream = outputs.summary_stream(request.options)
    print(f"no periodic motion: {found.reason}", file=stream)
    return ExitCode.INCOMPLETE


def _follow(request: shared.Request, system: System) -> ExitCode:
    options = request.options
    branches.check(options)
    drawn = request.drawn((*AT_IMPACTS, *AT_STOPS))
    word, *ends = options.follow
    name = shared.chosen_name("--follow", word, request.names)
    try:
        first, last = map(float, ends)
    except ValueError as error:
        raise ParameterError(f"--follow {word}: {error}") from error
    if not request.units:
        range_around(system, name, (first, last))
    motion = _motion(request, system)
    if isinstance(motion, NotFound):
        return _no_motion(request, motion)
    followed = branches.follow(options, motion, {name: (first, last), **request.units})
    branches.write(options, followed, (first, last), drawn)
    if followed.interrupted is not None:
        raise followed.interrupted
    if proofs.wanted(options):
        return max(followed.code, proofs.prove_branches(options, followed.branches))
    return followed.code


def _write(
    options: argparse.Namespace,
    motions: Sequence[PeriodicMotion | StructureOrbit],
    shares: Sequence[float] | None = None,
) -> ExitCode:
    """Write and print motions, with their shares of the starts if there are any."""
    share_of: list[dict[str, float]] = [{}] * len(motions)
    if shares is not None:
        share_of = [{"share": share} for share in shares]
    heads = {} if shares is None else {"share": ""}
    proving = proofs.Proving(motions) if proofs.wanted(options) else None
    tails = {} if proving is None else {"proof": ""}
    proved: list[dict[str, str]] = [{}] * len(motions)
    if proving is not None:
        proved = proving.columns(len(motions))
    write = outputs.Writing()
    if options.csv:
        rows = [
            share | table.csv_row(motion, options.units) | proof
            for share, motion, proof in zip(share_of, motions, proved, strict=True)
        ]
        names = [*(rows[0] if rows else (*heads, *table.CSV_NAMES, *tails))]
        write(outputs.write_csv, options.csv, names, (row.values() for row in rows))
    if options.plot and motions:
        write(_plot, motions, options.plot, options.units)
    printed = [
        {name: f"{part:.4g}" for name, part in share.items()}
        | table.printed_row(motion, options.units)
        | proof
        for share, motion, proof in zip(share_of, motions, proved, strict=True)
    ]
    names = [*(printed[0] if printed else (*heads, *table.PRINTED_NAMES, *tails))]
    outputs.print_table(
        [names, *([*row.values()] for row in printed)], outputs.summary_stream(options)
    )
    if proving is not None and options.proof_out is not None:
        write(proving.write, options.proof_out)
    write.end()
    if proving is not None and proving.interrupted is not None:
        raise proving.interrupted
    complete = proving is None or proving.complete
    return ExitCode.DONE if complete and (motions or not options.plot) else ExitCode.INCOMPLETE


def _plot(motions: Sequence[Any], path: Path, units: Units | None) -> None:
    from .. import plot

    drawn = table.shown(motions, MOST_DRAWN)
    if len(drawn) < len(motions):
        print(f"{path} shows {len(drawn)} of {len(motions)} motions", file=sys.stderr)
    panels = 2 if isinstance(drawn[0], StructureOrbit) else 3
    with outputs.figure(path, 7.1, 2.4 * len(drawn)) as figure:
        rows = figure.subplots(len(drawn), panels, squeeze=False)
        for motion, row in zip(drawn, rows, strict=True):
            plot.orbit(motion, legend=False, axes=row, units=units)
            row[0].set_title(f"{motion.label}, {table.verdict(motion)}", loc="left")
            row[-1].set_title("", loc="left")
