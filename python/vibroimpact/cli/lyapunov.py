"""`vibroimpact lyapunov`: the Lyapunov exponents of a motion, or over one parameter."""

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ParameterError
from ..scales import Scales, chosen
from ..structure_motion import StructureSpectrum
from ..sweeps import LyapunovSpectrum, LyapunovSweep, lyapunov_spectrum
from . import cells, outputs
from . import options as shared
from .engine import FLAGS, HELP, add_engine, engine
from .exit_codes import ExitCode

ABOUT = f"""\
The four Lyapunov exponents of the motion from --initial, or the 2 N of a
structure of N coordinates, per unit time with natural logarithm, each with its
standard error; or, with --vary, of one motion for each value of a parameter.
They are those of the state at fixed time, by exact derivatives through
flights, impacts, chatter and contact.

{shared.UNITS}
{shared.SI}"""
MORE = f"""\
printed for one motion:
  label            what the motion is
  exponent 1 ...   descending; -inf where perturbations die out at once; a
                   wall at rest has no perturbations, and so only two
  sum              of all there are: the mean rate at which volumes shrink
  measured         time and impacts they are measured over
With --vary: how many values have each status, and of how many the first
exponent is positive; exit code 3 where a run stopped early.

columns of the CSV of one motion, its convergence:
  time             since the measurement began
  exponent_1, ...  the exponents up to then
and with --vary, one row per value:
  (parameter)      its value, under its name in Python
  exponent_1, ...  the exponents
  error_1, ...     their standard errors
{cells.COLUMNS}
here all that is not periodic is unresolved: its exponents tell what it is.

{HELP}

examples, with the system file of vibroimpact --help:
  vibroimpact lyapunov --system fig5b.toml --friction 0.5 \\
      --drive-frequency 1.545 --periods 2000 \\
      --csv history.csv --plot history.png
  vibroimpact lyapunov --system fig5b.toml --friction 0.5 \\
      --vary drive-frequency 1.5 1.6 8 --quiet --csv spectrum.csv \\
      --plot spectrum.svg"""


# Errors by which an exponent is to differ from 0 to be called positive.
_CLEARLY = 2


def add(subparsers: Any) -> None:
    """Add the command."""
    command = shared.command(
        subparsers, "lyapunov", summary="Lyapunov exponents", about=ABOUT, more=MORE
    )
    shared.add_vary(
        command, what="parameter", example="drive-frequency 1.5 1.6 400", required=False
    )
    shared.add_system(command)
    group = command.add_argument_group("run")
    length = group.add_mutually_exclusive_group()
    length.add_argument("--time", type=float, metavar="T", help="time, without drive period")
    length.add_argument(
        "--periods", type=shared.whole, metavar="N", help="drive periods (default: 2000)"
    )
    group.add_argument(
        "--keep",
        type=shared.whole,
        metavar="K",
        help="measure over the last K periods (default: three quarters)",
    )
    group.add_argument(
        "--most",
        type=shared.whole,
        metavar="K",
        help="of one motion of a structure, the largest K exponents (default: all)",
    )
    shared.add_limits(group, section=False)
    outputs.add_outputs(command, "the convergence, or the spectra")
    add_engine(command)
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> ExitCode:
    """Measure; after Ctrl-C write what is done, then raise Interrupted."""
    for name in FLAGS if not options.vary else ():
        if getattr(options, name) is not None:
            raise ParameterError(f"--{name} goes with --vary only")
    request = shared.Request.of(options)
    swept = shared.grid(options.vary, axes=1, names=request.names) if options.vary else {}
    system = request.system(**{name: float(values[0]) for name, values in swept.items()})
    values = request.values(
        "initial", "time", "max_events", "chatter_tolerance", own=("periods", "keep", "most")
    )
    outputs.check(options)
    with engine(options) as computing:
        result, interrupted = outputs.partial_on_interrupt(
            lambda: lyapunov_spectrum(system, **values, **computing, **request.units, **swept)
        )
    if isinstance(result, LyapunovSpectrum | StructureSpectrum):
        scales = None
        if isinstance(result, LyapunovSpectrum):
            scales = chosen(options.units, result.system.scales)
        columns, code = _history(result, scales), ExitCode.DONE
        lines = _describe(result, scales, options.most is None)
    else:
        columns, lines = _spectra(result, options.units), _describe_all(result)
        code = cells.exit_code(result.status)
    write = outputs.Writing()
    if options.csv:
        write(outputs.write_columns, options.csv, columns)
    if options.plot:
        write(_plot, result, options.plot)
    outputs.print_summary(lines, options)
    write.end()
    if interrupted is not None:
        raise interrupted
    return code


def _plot(result: LyapunovSpectrum | StructureSpectrum | LyapunovSweep, path: Path) -> None:
    from .. import plot

    with outputs.figure(path, 7.1, 3.4) as figure:
        plot.lyapunov(result, ax=figure.subplots())


def _describe(
    result: LyapunovSpectrum | StructureSpectrum, scales: Scales | None, whole: bool
) -> list[tuple[str, str]]:
    lines = [("label", result.label)]
    rate, unit = (1.0, 1.0) if scales is None else (scales.frequency, scales.time)
    pairs = zip(rate * result.exponents, rate * result.error, strict=True)
    for number, (value, error) in enumerate(pairs):
        if np.isnan(value):
            lines.append((f"exponent {number + 1}", "(wall at rest: no exponent)"))
            continue
        text = f"{value:.6g} +- {error:.1g}" if np.isfinite(value) else f"{value}"
        flow = " (that of the flow)" if number == getattr(result, "flow", None) else ""
        lines.append((f"exponent {number + 1}", text + flow))
    if whole:
        lines.append(("sum", f"{rate * result.sum:.9g}"))
    impacts = np.sum(result.impacts)
    lines.append(("measured", f"time {unit * result.time:.6g}, {impacts} impacts"))
    return lines


def _describe_all(result: LyapunovSweep) -> list[tuple[str, str]]:
    positive = result.exponents[:, 0] > _CLEARLY * result.error[:, 0]
    text = f"{np.count_nonzero(positive)} values, by more than {_CLEARLY} errors"
    return [*cells.statuses(result.status), ("exponent 1 > 0", text)]


def _history(result: LyapunovSpectrum | StructureSpectrum, scales: Scales | None) -> dict[str, Any]:
    rate, unit = (1.0, 1.0) if scales is None else (scales.frequency, scales.time)
    return {"time": unit * result.history_time} | _numbered("exponent", rate * result.history)


def _spectra(result: LyapunovSweep, units: str | None) -> dict[str, Any]:
    rates = _numbered("exponent", result.exponents) | _numbered("error", result.error)
    return {
        **result.axes,
        **cells.in_units(result, rates, units),
        **cells.columns_of(result, ("label", "m", "n", "residual", "status")),
    }


def _numbered(name: str, columns: Any) -> dict[str, Any]:
    return {f"{name}_{number}": column for number, column in enumerate(columns.T, start=1)}
