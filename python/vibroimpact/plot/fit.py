"""What a fitted machine predicts, beside what was measured, with the residuals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from ..arguments import count, naming
from ..fitting import Fit
from ..fitting.prediction import predicted
from ..fitting.record import Record, is_heard
from ..scales import Units
from .axis_names import measured_name
from .given import expected
from .style import BLACK, BLUE, GREY, ORANGE, VERMILLION, curve_legend, several_axes
from .units import AxisUnits

Array = NDArray[np.float64]

# The band of residuals is so many standard errors wide to each side. Those beyond the second are
# crosses, at the third at most.
_BAND, _FAR, _MOST = 2.0, 4.0, 10.0
# Height of marks of impacts, in parts of that of the axes.
_MARKS_AT = 0.95
# Instants at which the motion is drawn, beside those of the rows and impacts.
_SAMPLES = 4000
# The motion drawn is that of the predictions, to this part of a standard error.
_SAME = 0.1


@naming
def fit(
    result: Fit,
    *,
    record: int = 0,
    units: Units | None = None,
    legend: bool = True,
    axes: Sequence[Axes] | None = None,
) -> list[Axes]:
    """Draw one record of a fit beside the prediction, and below it the residuals.

    Of times of impacts the intervals between them are drawn, and marks where the machine lacks an
    impact or has one too many; of other records the motion found, and where it was fitted in
    segments, straight lines from row to row. Residuals are in standard errors. Those beyond 4 are
    crosses, drawn at 10 at most.

    Parameters
    ----------
    result : Fit
        Result of `vibroimpact.fit`.
    record : int
        Which record.
    units : str, optional
        "SI" for s, rad, m and their quotients; the system must have scales.
    legend : bool
        Name marks, line and band above the axes.
    axes : sequence of matplotlib.axes.Axes, optional
        Where to draw, two of them; a new figure if None.

    Returns
    -------
    list of matplotlib.axes.Axes
        Of prediction and residuals.

    Raises
    ------
    ParameterError
        If `result` is something else, or has no such record, and for units without scales.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=20)
    >>> heard = vi.measure(run, "impact_times", noise=0.01)
    >>> found = vi.fit(heard, system, unknown=["restitution"], initial=run.initial)
    >>> [ax.get_xlabel() for ax in vi.plot.fit(found)]
    ['', 'time $t$']
    """
    result = expected("result", result, Fit)
    number = count("record", record, least=0, most=len(result.records) - 1)
    shown = AxisUnits(result.machine._chosen(units))
    mine = result.records[number]
    residuals, sigma = result.residuals[number], result.sigmas[number]
    rows = mine.values - residuals
    clock = shown.factor("time")
    top, bottom = several_axes(axes, 2, (7.1, 4.2), mosaic=[[0], [0], [1]])
    if is_heard(mine.kind):
        intervals = [np.diff(each, prepend=0.0) * clock for each in (mine.values, rows)]
        points = top.plot(mine.times * clock, intervals[0], ".", color=GREY, ms=4.0)
        line = top.plot(mine.times * clock, intervals[1], "_", color=BLUE, ms=9.0, mew=1.2)
        top.set_ylabel(shown.label("time", "interval since the impact before"))
    else:
        size = shown.factor(mine.kind)
        times, values = _motion(result, mine, rows, sigma)
        points = top.plot(mine.times * clock, mine.values * size, ".", color=GREY, ms=4.0)
        line = top.plot(times * clock, values * size, color=BLUE, lw=0.9)
        top.set_ylabel(shown.label(mine.kind, measured_name(mine.kind)))
    others = _other_impacts(top, result, mine, clock)
    counted = np.isfinite(sigma)
    times, z = mine.times[counted] * clock, residuals[counted] / sigma[counted]
    far = np.abs(z) > _FAR
    band = bottom.axhspan(-_BAND, _BAND, color="0.92", lw=0.0)
    bottom.axhline(0.0, color=GREY, lw=0.6)
    bottom.plot(times[~far], z[~far], ".", color=BLACK, ms=3.0)
    beyond = bottom.plot(times[far], np.clip(z[far], -_MOST, _MOST), "x", color=VERMILLION, ms=4)
    bottom.set_ylim(-_MOST - 0.5, _MOST + 0.5) if far.any() else bottom.set_ylim(-4.2, 4.2)
    bottom.set_xlabel(shown.label("time"))
    bottom.set_ylabel(r"residual / $\sigma$")
    bottom.set_xlim(top.get_xlim())
    named: list[tuple[Artist, str]] = [
        (points[0], "measured"),
        (line[0], "fitted machine"),
        *others,
    ]
    named.append((band, r"$\pm 2 \sigma$"))
    if far.any():
        named.append((beyond[0], r"beyond $4 \sigma$"))
    for artist, text in named:
        artist.set_label(text)
    curve_legend(top, legend, [artist for artist, _ in named])
    return [top, bottom]


def _other_impacts(
    axes: Axes, result: Fit, record: Record, clock: float
) -> list[tuple[Line2D, str]]:
    """Mark impacts that machine and record do not have in common; return marks and their names."""
    named: list[tuple[Line2D, str]] = []
    if not is_heard(record.kind):
        return named
    lacking = result.missing_impacts[np.isin(result.missing_impacts, record.times)]
    for times, marker, text in (
        (lacking, "^", "measured only"),
        (result.extra_impacts, "v", "of the machine only"),
    ):
        if len(times):
            inside = axes.get_xaxis_transform()
            heights = np.full(len(times), _MARKS_AT)
            marks = axes.plot(times * clock, heights, marker, color=ORANGE, ms=5, transform=inside)
            named.append((marks[0], text))
    return named


def _motion(result: Fit, record: Record, rows: Array, sigma: Array) -> tuple[Array, Array]:
    """Return times and values of the motion found; those of the rows where one run is not it."""
    if len(result.segments) > 1 or result.verdict == "not converged":
        return record.times, rows
    run = result.run
    first, last = record.times[[0, -1]]
    if run.final_state.time < last:
        return record.times, rows
    hits = np.asarray(run.impacts["time"])
    # Before and after an impact, where rates jump.
    instants = (np.linspace(first, last, _SAMPLES), record.times, hits, np.nextafter(hits, 0.0))
    times = np.unique(np.concatenate(instants))
    times = times[(times >= first) & (times <= last)]
    values = predicted(run, record.kind, times)
    own = values[np.searchsorted(times, record.times)]
    counted = np.isfinite(sigma)
    same = (np.abs(own - rows)[counted] <= _SAME * sigma[counted]).all()
    return (times, values) if same else (record.times, rows)
