"""What a fitted machine predicts, beside what was measured, with the residuals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from ..arguments import count, naming
from ..fitting import Fit
from ..fitting.record import is_heard
from .axis_names import STATE_NAMES, measured_name
from .given import expected
from .style import BLACK, BLUE, GREY, VERMILLION, curve_legend, several_axes

# Beyond so many standard errors a residual is marked.
_FAR = 4.0


@naming
def fit(
    result: Fit,
    *,
    record: int = 0,
    legend: bool = True,
    axes: Sequence[Axes] | None = None,
) -> list[Axes]:
    """Draw one record of a fit beside the prediction, and below it the residuals.

    Of times of impacts the intervals between them are drawn. Residuals are in standard errors; the
    band is two of them wide to each side. Those beyond 4 are red crosses, drawn at 10 at most.

    Parameters
    ----------
    result : Fit
        Result of `vibroimpact.fit`.
    record : int
        Which record.
    legend : bool
        Name marks and lines above the axes.
    axes : sequence of matplotlib.axes.Axes, optional
        Where to draw, two of them; a new figure if None.

    Returns
    -------
    list of matplotlib.axes.Axes
        Of prediction and residuals.

    Raises
    ------
    ParameterError
        If `result` is something else, or has no such record.

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
    mine = result.records[number]
    residuals, sigma = result.residuals[number], result.sigmas[number]
    predicted = mine.values - residuals
    top, bottom = several_axes(axes, 2, (7.1, 4.2), mosaic=[[0], [0], [1]])
    if is_heard(mine.kind):
        measured, expected_ = (np.diff(times, prepend=0.0) for times in (mine.values, predicted))
        name, style = "interval since the one before", "_"
    else:
        measured, expected_ = mine.values, predicted
        name, style = measured_name(mine.kind), ""
    top.plot(mine.times, measured, ".", color=GREY, ms=4.0, label="measured")
    if style:
        top.plot(mine.times, expected_, style, color=BLUE, ms=9.0, mew=1.2, label="fitted machine")
    else:
        top.plot(mine.times, expected_, color=BLUE, lw=0.9, label="fitted machine")
    top.set_ylabel(name)
    counted = np.isfinite(sigma)
    z = residuals[counted] / sigma[counted]
    far = np.abs(z) > _FAR
    bottom.axhspan(-2.0, 2.0, color="0.92", lw=0.0)
    bottom.axhline(0.0, color=GREY, lw=0.6)
    bottom.plot(mine.times[counted][~far], z[~far], ".", color=BLACK, ms=3.0)
    bottom.plot(mine.times[counted][far], np.clip(z[far], -10.0, 10.0), "x", color=VERMILLION, ms=4)
    bottom.set_ylim(-10.5, 10.5) if far.any() else bottom.set_ylim(-4.2, 4.2)
    bottom.set_xlabel(STATE_NAMES["time"])
    bottom.set_ylabel(r"residual / $\sigma$")
    bottom.set_xlim(top.get_xlim())
    curve_legend(top, legend)
    return [top, bottom]
