"""`vibroimpact simulate`: one motion, its label and the evidence for it."""

import argparse
from pathlib import Path
from typing import Any

from ..arguments import count
from ..errors import ParameterError
from ..run import Run
from ..run_in_si import RunInSI
from ..run_parts import FinalState
from ..run_record import impacts_in_words
from ..simulation import simulate
from ..structure_run import StructureRun
from ..structure_run_parts import StructureState
from ..verification import verify
from ..verification.call import MOST_ASKED, need_flint
from . import options as shared
from . import outputs
from .exit_codes import ExitCode

ABOUT = f"""\
Simulate one motion; print its label m-n (m drive periods, n impacts per
orbit; m-inf with complete chatter), `chaotic` or `quasi-periodic`, with the
evidence for it.

{shared.UNITS}
{shared.SI}"""
MORE = """\
printed:
  label     what the motion is
  residual  largest difference between sections m periods apart; of later
            ones where the motion was followed further
  evidence  what the label stands on: a return or the rate of convergence, or
            the growth of a perturbation per drive period
  impacts   since t = 0, and how many of them are kept; a complete chatter has
            infinitely many more
  contact   part of the kept time in sustained contact, if there is any
  stopped   completed, or why the run stopped earlier (exit code 3)
  state     x1, v1, x2, v2 at the end, or q and v of a structure, as --initial
            takes them, and when
  verified  with --verify: up to which impact the digits asked for are
            right; exit code 3 if not all are

columns of the CSV, one row per kept impact:
  time, period, time_in_period   instant; drive periods completed, time since
  x1, x2                         angle and displacement
  v1_pre, v1_post                angular velocity before and after
  v2_pre, v2_post                velocity of body 2 before and after
  approach_velocity              at which the bodies meet, > 0
  phase                          drive phase, 0 to 2 pi
  regime                         frictionless, slip, reversal_approach, ...
  impulse_normal, impulse_tangential     in M1 l omega_2, or N s
  energy_loss                    in M1 l^2 omega_2^2, or J
and of a structure in place of x1 to v2_post, all in its own units:
  stop                           number of the stop, from 0
  q_0 ..., v_pre_0 ..., v_post_0 ...     coordinates; velocities before, after

example:
  vibroimpact simulate --mass-ratio 0.6 --frequency-ratio 2 \\
      --restitution 0.8 --gap 0.5 --moment-amplitude 1 \\
      --drive-frequency 1.8 --initial 0 0.5 0 0 --periods 600 --keep 100 \\
      --csv impacts.csv --plot motion.pdf

and of a structure:
  vibroimpact template --out rig.toml
  vibroimpact simulate --system rig.toml --gap 0.25 --set gap-1 0.5"""


def add(subparsers: Any) -> None:
    """Add the command."""
    command = shared.command(
        subparsers, "simulate", summary="one motion, and its name", about=ABOUT, more=MORE
    )
    shared.add_system(command)
    shared.add_run(command, periods=None, keep=None)
    outputs.add_outputs(command, "the kept impacts", save="write the run for vibroimpact.load")
    command.add_argument(
        "--verify",
        type=shared.whole,
        nargs="?",
        const=10,
        metavar="DIGITS",
        help="compare with the exact motion, by python-flint: so many digits (10), 1 to 14",
    )
    command.add_argument("--quiet", action="store_true", help="show no progress of --verify")
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> ExitCode:
    """Simulate; after Ctrl-C write what is done, then raise."""
    request = shared.Request.of(options)
    system = request.system()
    values = request.values(
        *("initial", "periods", "time", "keep", "max_events", "chatter_tolerance", "section_phase")
    )
    if ("periods" in values) == ("time" in values):
        given = "both" if "time" in values else "neither"
        raise ParameterError(
            f"give exactly one of --periods and --time, got {given} (in [run] of a system file: "
            "periods and time)"
        )
    outputs.check(options)
    if options.verify is not None:
        count("verify", options.verify, least=1, most=MOST_ASKED)
        need_flint()
    result, interrupted = outputs.partial_on_interrupt(
        lambda: simulate(system, **values, **request.units)
    )
    shown = result.in_si() if request.units else result
    write = outputs.Writing()
    if options.csv:
        write(_write_csv, shown, options.csv)
    if options.save:
        write(result.save, options.save)
    if options.plot:
        write(_plot, result, options.plot, request.units)
    outputs.print_summary(_describe(result, shown), options)
    write.end()
    if interrupted is not None:
        raise interrupted
    complete = result.stop_reason in outputs.COMPLETE
    if options.verify is not None:
        found, interrupted = outputs.partial_on_interrupt(
            lambda: verify(result, digits=options.verify, progress=not options.quiet)
        )
        lines = found.summary().splitlines()
        outputs.print_summary([("verified", line) for line in lines], options)
        if interrupted is not None:
            raise interrupted
        complete = complete and found.holds
    return ExitCode.DONE if complete else ExitCode.INCOMPLETE


def _write_csv(result: Run | StructureRun | RunInSI, path: str) -> None:
    impacts = result.impacts
    columns = {name: impacts[name] for name in impacts.dtype.names or ()}
    outputs.write_columns(path, columns | {"regime": outputs.regime_names(impacts["regime"])})


def _describe(
    result: Run | StructureRun, shown: Run | StructureRun | RunInSI
) -> list[tuple[str, str]]:
    period, end = result.period, shown.final_state
    lines = [("label", result.label)]
    if period.m is not None:
        lines.append(("residual", f"{period.residual:.3g}"))
    lines.append(("evidence", str(period.evidence)))
    lines.append(("impacts", impacts_in_words(result)))
    if shown.time_in_contact:
        lines.append(("contact", f"{shown.time_in_contact:.6g} of the kept time"))
    lines.append(("stopped", result.stop_reason))
    lines.append(("state", f"{_in_words(end)} at t = {end.time!r}"))
    return lines


def _in_words(end: FinalState | StructureState) -> str:
    if isinstance(end, StructureState):
        return f"q = {end.q.tolist()}, v = {end.v.tolist()}"
    return ", ".join(f"{name} = {getattr(end, name)!r}" for name in ("x1", "v1", "x2", "v2"))


def _plot(result: Run | StructureRun, path: Path, units: dict[str, Any]) -> None:
    from .. import plot

    with outputs.figure(path, 7.1, 2.6) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
        # The stops of a structure are told by colour, the impacts of a system by regime.
        marked = {} if isinstance(result, StructureRun) else {"color": "regime", **units}
        plot.time_history(result, ax=left, **marked)
        plot.phase_portrait(result, ax=right, **marked)
