"""What the commands of `vibroimpact` do with their arguments; cli.py defines those.

Each command takes the parsed arguments and raises the errors of vibroimpact.errors.
"""

import argparse
import csv
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO, TypeVar

import numpy as np
from numpy.typing import NDArray

from .diagrams import Diagram, bifurcation_diagram, orbit_label
from .errors import Interrupted, ParameterError
from .results import Regime, Run
from .simulation import simulate as simulate_motion
from .system import NUMERIC_RANGES, System

_Result = TypeVar("_Result")


def reproduce(options: argparse.Namespace) -> None:
    """Draw the paper's figures and print the table of claims."""
    from . import paper
    from .paper.claims import table

    result = paper.reproduce(
        options.out,
        formats=options.format,
        figures=options.figures,
        frequencies=options.frequencies,
        workers=options.workers,
        progress=not options.quiet,
    )
    if result.claims:
        print(table(result.claims))


def _as_far_as_it_got(compute: Callable[[], _Result]) -> tuple[_Result, Interrupted | None]:
    """Return the result and, if Ctrl-C cut it short, the exception to raise once it is written."""
    try:
        return compute(), None
    except Interrupted as error:
        if error.result is None:
            raise
        return error.result, error


def simulate(options: argparse.Namespace) -> None:
    """Simulate one motion and say what it is; after Ctrl-C write what is done, then raise."""
    run, interrupted = _as_far_as_it_got(
        lambda: simulate_motion(
            System.from_dict(_fields(options)),
            initial=options.initial,
            periods=options.periods,
            time=options.time,
            keep=options.keep,
        )
    )
    if options.csv:
        names = run.impacts.dtype.names or ()
        rows = (
            [
                _regime(value) if name == "regime" else value
                for name, value in zip(names, row, strict=True)
            ]
            for row in run.impacts.tolist()
        )
        _write_csv(options.csv, names, rows)
    if options.save:
        run.save(options.save)
    if options.plot:
        _plot_run(run, options.plot)
    _print_summary(_describe_run(run), options)
    if interrupted is not None:
        raise interrupted


def _describe_run(run: Run) -> list[tuple[str, str]]:
    period, end = run.period, run.final_state
    lines = [("label", run.label)]
    if period.m is not None:
        lines.append(("residual", f"{period.residual:.3g}"))
    if np.isfinite(period.growth):
        lines.append(
            ("growth", f"{period.growth:.3g} +- {period.growth_error:.1g} per drive period")
        )
    lines.append(("confidence", f"{period.confidence:.2f} ({period.method})"))
    lines.append(("impacts", f"{run.impact_count}, {len(run.impacts)} kept"))
    if run.time_in_contact:
        lines.append(("contact", f"{run.time_in_contact:.6g} of the kept time"))
    lines.append(("stopped", run.stop_detail or run.stop_reason))
    state = ", ".join(f"{name} = {getattr(end, name)!r}" for name in ("x1", "v1", "x2", "v2"))
    lines.append(("state", f"{state} at t = {end.time!r}"))
    return lines


def diagram(options: argparse.Namespace) -> None:
    """Sweep one parameter; after Ctrl-C write what is done, then raise Interrupted."""
    name, values = _varied(options.vary)
    fields = _fields(options)
    fields.setdefault(name, float(values[0]))
    swept: dict[str, Any] = {name: values}
    result, interrupted = _as_far_as_it_got(
        lambda: bifurcation_diagram(
            System.from_dict(fields),
            initial=options.initial,
            periods=options.periods,
            keep=options.keep,
            start=options.start,
            progress=not options.quiet,
            workers=options.workers,
            **swept,
        )
    )
    if options.csv:
        columns = (result.impact_parameter, result.x1, result.v1, result.v2, result.phase)
        numbers = np.column_stack(columns).tolist()
        rows = (
            [*row, _regime(regime)]
            for row, regime in zip(numbers, result.regime.tolist(), strict=True)
        )
        _write_csv(options.csv, (name, "x1", "v1", "v2", "phase", "regime"), rows)
    if options.save:
        result.save(options.save)
    if options.plot:
        _plot_diagram(result, options.plot)
    _print_summary(_describe_diagram(result), options)
    if interrupted is not None:
        raise interrupted


def _describe_diagram(diagram: Diagram) -> list[tuple[str, str]]:
    kinds, counts = np.unique(diagram.status, return_counts=True)
    lines = [
        (str(kind), f"{count} of {len(diagram)} values")
        for kind, count in zip(kinds, counts, strict=True)
    ]
    pairs, counts = np.unique(
        np.column_stack([diagram.m, diagram.n])[diagram.m > 0], axis=0, return_counts=True
    )
    for row in np.argsort(-counts, kind="stable")[:10]:
        m, n = pairs[row]
        lines.append((orbit_label(m, n), f"{counts[row]} values"))
    return lines


def _fields(options: argparse.Namespace) -> dict[str, Any]:
    names = (*NUMERIC_RANGES, "contact", "law")
    values = {name: getattr(options, name) for name in names}
    return {name: value for name, value in values.items() if value is not None}


def _varied(words: Sequence[str]) -> tuple[str, NDArray[np.float64]]:
    name = words[0].replace("-", "_")
    if name not in NUMERIC_RANGES:
        raise ParameterError(f"--vary {words[0]}: allowed are {', '.join(NUMERIC_RANGES)}")
    try:
        first, last, count = float(words[1]), float(words[2]), int(words[3])
    except ValueError as error:
        raise ParameterError(f"--vary {' '.join(words)}: {error}") from error
    if count < 1:
        raise ParameterError(f"--vary: COUNT = {count} is out of range: allowed is an integer >= 1")
    return name, np.linspace(first, last, count)


def _regime(value: int) -> str:
    return Regime(value).name.lower()


def _write_csv(path: str, names: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    with _opened(path) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        writer.writerows(rows)


@contextmanager
def _opened(path: str) -> Iterator[TextIO]:
    if path == "-":
        yield sys.stdout
    else:
        with open(path, "w", encoding="utf-8", newline="") as file:
            yield file


def _print_summary(lines: Sequence[tuple[str, str]], options: argparse.Namespace) -> None:
    """Print to standard output, or beside it if the CSV goes there."""
    stream: TextIO = sys.stderr if options.csv == "-" else sys.stdout
    width = max((len(name) for name, _ in lines), default=0)
    for name, text in lines:
        print(f"{name.ljust(width)}  {text}", file=stream)


def _plot_run(run: Run, path: Path) -> None:
    from matplotlib.figure import Figure

    from . import plot

    with plot.publication_style():
        figure = Figure(figsize=(7.1, 2.6), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
        window = None if run.system.drive_frequency else (run.kept_from, run.final_state.time)
        plot.time_history(run, window=window, color="regime", ax=left)
        plot.phase_portrait(run, window=window, color="regime", ax=right)
        _save_figure(figure, path)


def _plot_diagram(diagram: Diagram, path: Path) -> None:
    from matplotlib.figure import Figure

    from . import plot

    with plot.publication_style():
        figure = Figure(figsize=(7.1, 2.8), layout="constrained")
        left, right = figure.subplots(1, 2)
        plot.bifurcation(diagram, color="regime", ax=left)
        plot.bifurcation(diagram, section="stroboscopic", legend=False, ax=right)
        _save_figure(figure, path)


def _save_figure(figure: Any, path: Path) -> None:
    supported = figure.canvas.get_supported_filetypes()
    if path.suffix.lstrip(".").lower() not in supported:
        raise ParameterError(f"--plot {path}: allowed endings are {', '.join(sorted(supported))}")
    figure.savefig(path)
