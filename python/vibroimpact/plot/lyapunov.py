"""Lyapunov exponents: their convergence over time, or their values over a parameter.

theory page, section 7; per unit time, natural logarithm, without the zero of the drive's phase.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from ..arguments import naming, reject
from ..structure_motion import StructureSpectrum
from ..sweeps import Diagram, GridResult, LyapunovSpectrum, LyapunovSweep
from .axis_names import EXPONENTS, LARGEST_EXPONENT
from .diagram import branch_color, branch_names
from .mesh import strip
from .parameter_units import along_parameter, grid_label
from .style import BLACK, BLUE, GREEN, GREY, VERMILLION, curve_legend, new_axes

Array = NDArray[np.float64]

_COLORS = (VERMILLION, BLACK, BLUE, GREEN)
_DASHES = ("-", "-", (0.0, (5.0, 1.5)), (0.0, (1.5, 1.2)))
# Exponents of a structure that are drawn and named, of more than these.
_MOST = 12
_BAND = 0.25
_RUG_HEIGHT = 0.03


@naming
def lyapunov(
    result: LyapunovSpectrum | StructureSpectrum | GridResult,
    *,
    legend: bool = True,
    ax: Axes | None = None,
) -> Axes:
    r"""Draw Lyapunov exponents over the time of their measurement, or over a parameter.

    Of one motion: the exponents as they were after each time. The bands reach from the final values
    one standard error to either side, as it would be after that time: the error of a mean falls as
    t^(-1/2). Of a structure at most the largest twelve are drawn.

    Over a parameter: all exponents, or the largest of each branch of a diagram, in bands of
    one standard error to either side, and a line at zero. Where an exponent is -\infty, the bottom
    axis is marked in its colour; where it could not be computed, the line has a gap.

    Parameters
    ----------
    result : LyapunovSpectrum, StructureSpectrum, LyapunovSweep, Diagram or Sweep
        Result of `vibroimpact.lyapunov_spectrum`, or of a diagram or a sweep over one parameter
        with ``exponents=True``.
    legend : bool
        Name the exponents, with the values of a single motion, above the axes.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        If the result is something else, has no exponents, or more than one parameter.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> spectrum = vi.lyapunov_spectrum(system, initial=(0, 0.5, 0, 0), periods=200)
    >>> vi.plot.lyapunov(spectrum).get_xlabel()
    'time $t$ since the measurement began'
    """
    if isinstance(result, LyapunovSpectrum | StructureSpectrum):
        ax = new_axes(ax)
        _convergence(ax, result)
    else:
        allowed = "a LyapunovSpectrum, or Lyapunov exponents over one parameter"
        if not isinstance(result, GridResult):
            reject("result", result, allowed)
        if "largest_exponent" not in result.columns and not isinstance(result, LyapunovSweep):
            reject("result", result, f"{allowed}; this one was computed without exponents")
        if len(result.axes) != 1 and not isinstance(result, Diagram):
            reject("result", result, f"{allowed}; a chart is drawn by plot.chart")
        ax = new_axes(ax)
        _along(ax, _Curves.of(result))
    ax.axhline(0.0, color=GREY, lw=0.6, zorder=1)
    curve_legend(ax, legend)
    return ax


def _convergence(ax: Axes, spectrum: LyapunovSpectrum | StructureSpectrum) -> None:
    flow = spectrum.flow if isinstance(spectrum, LyapunovSpectrum) else None
    for k in range(min(len(spectrum.exponents), _MOST)):
        text, color, dashes = _style(k)
        value, error = float(spectrum.exponents[k]), float(spectrum.error[k])
        text += " (of the flow)" if k == flow else ""
        if np.isfinite(value):
            half = error * np.sqrt(spectrum.time / spectrum.history_time)
            ax.fill_between(
                spectrum.history_time,
                value - half,
                value + half,
                color=color,
                alpha=_BAND,
                lw=0.0,
            )
            digits = _digits(error)
            text += rf" $= {value:.{digits}f} \pm {error:.{digits}f}$"
        else:
            text += r" $= -\infty$" if value < 0.0 else ": left out"
        ax.plot(
            spectrum.history_time,
            np.where(np.isfinite(spectrum.history[:, k]), spectrum.history[:, k], np.nan),
            color=color,
            ls=dashes,
            lw=1.0,
            label=text,
        )
    if len(spectrum.history_time):
        ax.set_xlim(0.0, float(spectrum.history_time[-1]))
    ax.set_xlabel("time $t$ since the measurement began")
    ax.set_ylabel("Lyapunov exponents up to $t$")


def _style(k: int) -> tuple[str, str, Any]:
    """Return symbol, colour and dashes of an exponent, from 0."""
    again, hue = divmod(k, len(_COLORS))
    number = f"{k + 1}" if k < 9 else f"{{{k + 1}}}"
    return rf"$\lambda_{number}$", _COLORS[hue], _DASHES[(hue + again) % len(_DASHES)]


def _digits(error: float) -> int:
    """Return after how many decimals to cut a value with this error: two digits of the error."""
    return min(max(1 - math.floor(math.log10(error)), 0), 8) if error > 0.0 else 6


@dataclass(frozen=True)
class _Curves:
    """Exponents over a parameter and their errors, shape (curves, values), with line styles.

    ``name`` is the label of its axis.
    """

    name: str
    values: Array
    exponents: Array
    errors: Array
    texts: Sequence[str] = ("_nolegend_",)
    colors: Sequence[str] = (BLACK,)
    dashes: Sequence[Any] = ("-",)
    # Whether they are those of one spectrum at each value.
    whole: bool = False

    @classmethod
    def of(cls, result: GridResult) -> "_Curves":
        if isinstance(result, LyapunovSweep):
            ((axis, values),) = result.axes.items()
            name = grid_label(result, axis)
            exponents, errors = result.exponents.T[:_MOST], result.error.T[:_MOST]
            styles = [_style(k) for k in range(len(exponents))]
            texts, colors, dashes = ([style[i] for style in styles] for i in range(3))
            return cls(name, values, exponents, errors, texts, colors, dashes, whole=True)
        axis, values = [*result.axes.items()][-1]
        name = grid_label(result, axis)
        exponents, errors = (
            result.columns[column].reshape(-1, len(values))
            for column in ("largest_exponent", "exponent_error")
        )
        if len(exponents) == 1 or not isinstance(result, Diagram):  # one branch needs no name
            return cls(name, values, exponents, errors)
        colors = [branch_color(number) for number in range(len(exponents))]
        dashes = ["-"] * len(exponents)
        return cls(name, values, exponents, errors, branch_names(result), colors, dashes)


def _along(ax: Axes, curves: _Curves) -> None:
    name, values = curves.name, curves.values
    order = np.argsort(values, kind="stable")
    for k, (exponent, error) in enumerate(zip(curves.exponents, curves.errors, strict=True)):
        color = curves.colors[k]
        finite = np.where(np.isfinite(exponent), exponent, np.nan)[order]
        half = np.where(np.isfinite(finite), error[order], np.nan)
        band: dict[str, Any] = {"color": color, "alpha": _BAND, "lw": 0.0}
        # Of several each has the colour of its curve.
        text = "standard error" if len(curves.exponents) == 1 else "_nolegend_"
        ax.fill_between(values[order], finite - half, finite + half, label=text, **band)
        ax.plot(
            values[order], finite, color=color, ls=curves.dashes[k], lw=0.8, label=curves.texts[k]
        )
        _mark_infinite(ax, values, np.isneginf(exponent), k, color)
    along_parameter(ax, values, name)
    ax.set_ylabel(EXPONENTS if curves.whole else LARGEST_EXPONENT)


def _mark_infinite(
    ax: Axes, values: Array, infinite: NDArray[np.bool_], row: int, color: str
) -> None:
    """Mark where an exponent is -inf along the bottom axis, in a row of its own."""
    if infinite.any():
        heights = (row * _RUG_HEIGHT, (row + 1) * _RUG_HEIGHT)
        strip(ax, values, infinite, heights, color, gid=f"minus-infinity-{row}")
