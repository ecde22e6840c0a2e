r"""Maps of the outcome of impacts, and the agreement of the two methods for it.

Axes: the angle x1 and the ratio x1'/u of angular and approach velocity, which together determine an
impact, since every law is homogeneous; theory page, section 4.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import CenteredNorm, ListedColormap
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from ..arguments import naming
from ..impact_results import ImpactAgreement, ImpactRegimes
from .axis_names import STATE_NAMES
from .given import expected
from .style import ANGLE_TICKS, BLACK, GREY, REGIME_STYLES, regime_handles, several_axes

_NO_OUTCOME = "0.85"


@naming
def impact_regimes(
    result: ImpactRegimes, axes: Sequence[Axes] | None = None, *, legend: bool = True
) -> list[Axes]:
    """Draw three maps: regime, effective restitution, energy loss.

    The borders of the regimes are drawn in all three. In the map of the restitution -u_post/u white
    is the coefficient r of the law; impacts without outcome are grey.

    Parameters
    ----------
    result : ImpactRegimes
        Result of `vibroimpact.impact_regimes`.
    axes : sequence of three matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.
    legend : bool
        Name the regimes below the panels.

    Returns
    -------
    list of matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        If the result is of another kind.
    ValueError
        If not three axes are given.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1, friction=0.3)
    >>> regimes = vi.impact_regimes(system, x1=[-0.5, 0.5], velocity_ratio=[-1, 1])
    >>> len(vi.plot.impact_regimes(regimes))
    3
    """
    expected("result", result, ImpactRegimes)
    axes = several_axes(axes, 3, (7.1, 3.1))
    regimes, restitution, energy = axes
    palette = ListedColormap([_NO_OUTCOME, *(style.color for style in REGIME_STYLES.values())])
    _map(regimes, result, result.regime, cmap=palette, vmin=-1.5, vmax=5.5)
    regimes.set_title("(a) regime", pad=4)

    # The law's own r is white, and a colour means the same distance from r on both sides.
    r, (low, high) = result.system.restitution, result.spread
    norm = CenteredNorm(r, halfrange=max(r - low, high - r, 0.01))
    mesh = _map(restitution, result, result.restitution, cmap="RdBu_r", norm=norm)
    bar = _scale(mesh, restitution, rf"$-u_{{+}}/u$ (white: $r = {r:g}$)")
    bar.set_xlim(min(low, r - 0.01), max(high, r + 0.01))
    restitution.set_title("(b) effective restitution", pad=4)

    loss = result.energy_loss
    found = loss[np.isfinite(loss)]
    if found.size:
        gains = float(found.min()) < 0.0
        options: dict[str, Any] = {"cmap": "viridis", "vmin": 0.0, "vmax": float(found.max())}
        if gains:
            widest = max(-float(found.min()), float(found.max()))
            options = {"cmap": "PuOr", "norm": CenteredNorm(0.0, halfrange=widest)}
        mesh = _map(energy, result, loss, **options)
        _scale(mesh, energy, r"$(E-E_{+})/E$" + (", negative: gain" if gains else ""))
    else:
        _map(energy, result, loss, cmap="viridis", vmin=0.0, vmax=1.0)
        energy.annotate(
            r"no energy to compare with ($\bar m = 0$)",
            (0.5, 0.5),
            xycoords="axes fraction",
            ha="center",
            bbox={"facecolor": _NO_OUTCOME, "edgecolor": "none", "pad": 1.5},
        )
    energy.set_title("(c) part of the energy lost", pad=4)
    for ax in axes[1:]:
        ax.set_ylabel("")
    if legend:
        here = [int(number) for number in np.unique(result.regime) if number >= 0]
        handles = regime_handles(here, shapes=False)
        if (result.regime < 0).any():
            grey = Line2D([], [], ls="none", marker="s", markersize=4.5, color=_NO_OUTCOME)
            grey.set_label("no outcome")
            handles.append(grey)
        axes[0].figure.legend(
            handles=handles, loc="outside lower center", ncols=3, handletextpad=0.5
        )
    return axes


def _map(ax: Axes, result: ImpactRegimes, values: NDArray[Any], **options: Any) -> Any:
    """Draw one field with the borders of the regimes and the axes of all three maps."""
    x1, ratio = result.x1, result.velocity_ratio
    ax.set_facecolor(_NO_OUTCOME)
    mesh = ax.pcolormesh(x1, ratio, values, shading="nearest", rasterized=True, **options)
    regimes = np.unique(result.regime)
    if len(x1) > 1 and len(ratio) > 1:
        # Each border is drawn once, as the outline of one of its two regimes.
        for number in regimes[:-1]:
            inside = np.asarray(result.regime == number, dtype=np.float64)
            ax.contour(x1, ratio, inside, levels=[0.5], colors=BLACK, linewidths=0.5)
    low, high = x1.min() - 0.01, x1.max() + 0.01
    ticks = {place: text for place, text in ANGLE_TICKS.items() if low <= place <= high}
    if len(ticks) > 1:
        ax.set_xticks(list(ticks), list(ticks.values()))
    ax.set_xlabel(STATE_NAMES["x1"])
    ax.set_ylabel(r"velocity ratio $\dot x_1/u$")
    return mesh


def _scale(mesh: Any, ax: Axes, label: str) -> Axes:
    bar = ax.figure.colorbar(mesh, ax=ax, location="bottom", aspect=25, pad=0.02)
    bar.set_label(label)
    bar.ax.tick_params(direction="out", top=False)
    scale: Axes = bar.ax
    return scale


@naming
def impact_agreement(
    result: ImpactAgreement, axes: Sequence[Axes] | None = None, *, legend: bool = True
) -> list[Axes]:
    """Draw the difference of exact impulse path and incremental integration against the step.

    One panel for each law, one line for each regime, and the slope of first order (dashed).

    Parameters
    ----------
    result : ImpactAgreement
        Result of `vibroimpact.impact_agreement`.
    axes : sequence of matplotlib.axes.Axes, optional
        As many as there are laws; a new figure if None.
    legend : bool
        Name the regimes below the panels.

    Returns
    -------
    list of matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        If the result is of another kind.
    ValueError
        If there are not as many axes as laws.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1, friction=0.3)
    >>> agreement = vi.impact_agreement(system, steps=(30, 100), cells=5)
    >>> len(vi.plot.impact_agreement(agreement))
    3
    """
    expected("result", result, ImpactAgreement)
    axes = several_axes(axes, len(result.laws), (7.1, 2.9), shared=True)
    order = np.argsort(result.steps)
    step = 1.0 / result.steps[order]
    low, high = float(np.nanmin(result.difference)), float(np.nanmax(result.difference))
    for ax, law, lines in zip(axes, result.laws, result.difference, strict=True):
        ax.plot(step, 2.0 * high * step / step[0], color=GREY, lw=0.8, ls=(0, (4, 2)))
        ax.annotate(
            "slope 1",
            (step[len(step) // 2], 2.0 * high * step[len(step) // 2] / step[0]),
            xytext=(-4, 3),  # above the line, which rises to the right
            textcoords="offset points",
            ha="right",
            fontsize=8,
        )
        for style, line in zip(REGIME_STYLES.values(), lines, strict=True):
            if np.isfinite(line).all():
                ax.plot(
                    step,
                    line[order],
                    color=style.color,
                    marker=style.marker,
                    markersize=3.5,
                    markeredgewidth=0,
                    lw=0.8,
                )
        ax.set_xscale("log")
        ax.set_yscale("log")
        ax.set_ylim(0.5 * low, 4.0 * high)
        # The names of two laws are names of people.
        ax.set_title(law.capitalize() if law in ("poisson", "newton") else law, pad=4)
        ax.set_xlabel(r"largest step $\Delta P/P$")
    axes[0].set_ylabel("difference of velocities / $u$")
    if legend:
        present = [number for number, seen in enumerate(result.impacts) if seen]
        axes[0].figure.legend(
            handles=regime_handles(present),
            loc="outside lower center",
            ncols=3,
            handletextpad=0.5,
        )
    return axes
