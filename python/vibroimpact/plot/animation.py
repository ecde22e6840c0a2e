"""A run that moves: the machine, or the stops of a structure, beside portrait and history.

The frames are equally spaced in time, but the one nearest to an impact shows the instant of the
impact itself, so that every impact is seen as a contact, with its impulses.
"""

from __future__ import annotations

import math
import os
from typing import Any, Final

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from ..arguments import count, naming, positive, reject
from ..run import Run
from ..structure_run import StructureRun
from .curve import is_driven, orbit_window, shown_window
from .film import Animation, writer_of
from .given import bodies_of, expected
from .machine import Hit, Stage
from .marks import contact_spans
from .motion import phase_portrait, time_history
from .stop_rows import Said, StopRows
from .structure_history import coordinate_style, shown_coordinates
from .structure_portrait import FEW
from .style import BODY_COLORS, REGIME_STYLES, SLIDE_STYLE, STICK_STYLE, VERMILLION

Array = NDArray[np.float64]

MOST_FRAMES: Final = 2000
"""The largest number of frames of an animation."""

# By default: frames in a drive period, without one in a unit of time, and their limits.
_IN_PERIOD, _IN_UNIT, _FEWEST, _USUALLY_MOST = 48, 12, 48, 360
# The impulses of an impact are seen for so many frames.
_FLASH = 7
_SIZE, _DOTS_PER_INCH = (7.2, 3.6), 100.0
_SETTINGS: Final[Any] = {
    "font.size": 9,
    "axes.labelsize": 9,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "legend.fontsize": 8,
    "legend.frameon": False,
}
_TEXTS = {"slide": SLIDE_STYLE.text, "stick": STICK_STYLE.text}


class _Machine:
    """A System on the axes of an animation."""

    def __init__(self, run: Run, times: Array, hits: list[int], step: float) -> None:
        self.run = run
        self._times, self._hits = times, hits
        self._states = run.trajectory(times)
        self.bodies = bodies_of(None, run)
        self.portrait = {"bodies": self.bodies}
        self.colors = [BODY_COLORS[body] for body in self.bodies]

    def begin(self, ax: Axes, window: tuple[float, float]) -> None:
        """Draw what stands still."""
        run = self.run
        inside = (run.impacts["time"] > window[0]) & (run.impacts["time"] <= window[1])
        hits = run.impacts[inside]
        places = np.column_stack([hits["x1"], hits["v1_pre"], hits["x2"], hits["v2_pre"]])
        self._stage = Stage(ax, run.system, self._states, places)
        self._largest = float(hits["impulse_normal"].max(initial=0.0)) or 1.0
        spans = contact_spans(run, window)
        self._modes = [
            next((span.mode for span in spans if span.start <= time < span.end), None)
            for time in self._times.tolist()
        ]

    def dots(self, frame: int) -> list[tuple[float, float]]:
        """Return the points of the portrait."""
        state = self._states[frame].tolist()
        return [(state[2 * body - 2], state[2 * body - 1]) for body in self.bodies]

    def show(self, frame: int) -> Said:
        """Draw a frame in place of the one before; return what happens."""
        system, mode = self.run.system, self._modes[frame]
        hit = self._hit(frame)
        phase = system.drive_frequency * float(self._times[frame]) + system.phase
        driven = is_driven(system)
        self._stage.show(self._states[frame], phase=phase if driven else None, mode=mode, hit=hit)
        if hit is not None and mode is None:
            return Said("impact", hit.time, REGIME_STYLES[hit.regime].text)
        return Said(_TEXTS.get(mode or "", "apart"))

    @property
    def moving(self) -> list[Artist]:
        """What the last `show` has drawn."""
        return self._stage.moving

    def _hit(self, frame: int) -> Hit | None:
        """Return the last impact, while it is seen."""
        recent = self._hits[max(frame - _FLASH + 1, 0) : frame + 1]
        for age, row in enumerate(reversed(recent)):
            if row >= 0:
                impact = self.run.impacts[row]
                normal, tangential = (
                    float(impact[name]) / self._largest
                    for name in ("impulse_normal", "impulse_tangential")
                )
                return Hit(
                    float(impact["x1"]),
                    normal,
                    tangential,
                    int(impact["regime"]),
                    age / _FLASH,
                    float(impact["time"]),
                )
        return None


class _Stops:
    """The stops of a Structure on the axes of an animation."""

    def __init__(self, run: StructureRun, times: Array, hits: list[int], step: float) -> None:
        self.run = run
        self._times, self._step = times, step
        self._states = run.trajectory(times)
        self._shown = shown_coordinates(None, run.system, few=FEW)
        self.portrait = {"coordinates": [each.name("q") for each in self._shown]}
        self.colors = [coordinate_style(place)["color"] for place in range(len(self._shown))]

    def begin(self, ax: Axes, window: tuple[float, float]) -> None:
        """Draw what stands still."""
        self._rows = StopRows(ax, self.run, self._times, self._states, _FLASH * self._step)

    def dots(self, frame: int) -> list[tuple[float, float]]:
        """Return the points of the portrait."""
        q, v = self._states[frame]
        return [(float(each.of(q)), float(each.of(v))) for each in self._shown]

    def show(self, frame: int) -> Said:
        """Draw a frame in place of the one before; return what happens."""
        return self._rows.show(frame)

    @property
    def moving(self) -> list[Artist]:
        """What the last `show` has drawn."""
        return [*self._rows.moving]


class _Scene:
    """A run on the axes of an animation: the curves, and what moves over them."""

    def __init__(self, run: Run | StructureRun, window: tuple[float, float], frames: int) -> None:
        start, end = window
        step = (end - start) / frames
        even: Array = start + (end - start) * np.arange(frames) / frames
        self.times, hits = _with_impacts(run, even, step)
        self.times.flags.writeable = False
        self._film: Any = (_Machine if isinstance(run, Run) else _Stops)(
            run,  # type: ignore[arg-type]
            self.times,
            hits,
            step,
        )
        with matplotlib.rc_context(_SETTINGS):
            self.figure = Figure(figsize=_SIZE, dpi=_DOTS_PER_INCH, layout="constrained")
            FigureCanvasAgg(self.figure)
            self._curves(run, window)
            self.draw(0)
        # Arranged once, or it would be arranged for every frame.
        self.figure.draw_without_rendering()
        self.figure.set_layout_engine("none")

    def _curves(self, run: Run | StructureRun, window: tuple[float, float]) -> None:
        """Draw the curves, and what will move over them."""
        parts = self.figure.subplot_mosaic(
            [["machine", "portrait"], ["machine", "history"]], width_ratios=(1.1, 1.0)
        )
        phase_portrait(run, window=window, ax=parts["portrait"], **self._film.portrait)
        time_history(run, window=window, ax=parts["history"])
        parts["history"].xaxis.set_major_locator(MaxNLocator(nbins=5))
        self._film.begin(parts["machine"], window)
        mark: dict[str, Any] = {"marker": "o", "markersize": 5.0, "ls": "none", "zorder": 5}
        self._dots = [
            parts["portrait"].plot([], [], color=color, **mark)[0] for color in self._film.colors
        ]
        self._now = parts["history"].axvline(window[0], color=VERMILLION, lw=1.0, zorder=4)
        self._text = parts["machine"].text(
            0.0, 1.0, "", transform=parts["machine"].transAxes, ha="left", va="bottom", fontsize=10
        )

    def draw(self, frame: int) -> list[Artist]:
        """Draw one frame; return what moves, from below to above."""
        time = float(self.times[frame])
        said: Said = self._film.show(frame)
        for dot, (x, v) in zip(self._dots, self._film.dots(frame), strict=True):
            dot.set_data([x], [v])
        self._now.set_xdata([time, time])
        self._text.set_text(f"$t$ = {time:.2f}\n{said.text}")
        drawn = [*self._film.moving, *self._dots, self._now, self._text]
        return sorted(drawn, key=lambda artist: artist.get_zorder())


@naming
def animation(
    run: Run | StructureRun,
    *,
    window: tuple[float, float] | None = None,
    periods: float | None = None,
    frames: int | None = None,
    frames_per_second: float = 25.0,
) -> Animation:
    """Let a run move: the machine beside its phase portrait and its time history.

    Oblique contact is drawn to scale. In an impact arrows show the impulses on body 1, and a mark
    its regime; in sustained contact the tip has the colour of the bands in the time history. Green
    arrows are the drive.

    Of a structure the stops are drawn in rows: one for each coordinate, or difference of two, on
    which stops act, with a block between the walls that are its stops. The numbers beside it are
    the ends of its scale. The block is filled while a stop is closed, and a mark shows the regime
    of an impact.

    Parameters
    ----------
    run : Run or StructureRun
        Result of `vibroimpact.simulate`.
    window : (float, float), optional
        Times, within the kept part of the run. By default one orbit of a periodic motion of up to
        eight drive periods, which runs without a seam, else as in `time_history`.
    periods : float, optional
        Length of the window in drive periods, in place of `window`: the last ones.
    frames : int, optional
        Number of frames, 2 to 2000; by default 48 in a drive period, 48 to 360 in all.
    frames_per_second : float
        The speed, up to 100.

    Returns
    -------
    Animation
        It shows itself in a notebook; `Animation.save` writes a GIF, an MP4 or a page of HTML.

    Raises
    ------
    ParameterError
        If an argument is of the wrong kind or out of range, or the window lies outside the kept
        part of the run.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
    >>> moving = vi.plot.animation(run, periods=1, frames=5)
    >>> type(moving).__name__
    'Animation'
    """
    if not isinstance(run, StructureRun):
        run = expected("run", run, Run)
    if window is None and periods is None and is_driven(run.system):
        m = run.period.m
        span = orbit_window(run) if m is not None and m <= 8 else shown_window(run)
    else:
        span = shown_window(run, window, periods)
    if frames is None:
        period = run.system.drive_period if is_driven(run.system) else _IN_PERIOD / _IN_UNIT
        usual = math.ceil(_IN_PERIOD * (span[1] - span[0]) / period - 1e-6)
        frames = min(max(usual, _FEWEST), _USUALLY_MOST)
    frames = count("frames", frames, least=2, most=MOST_FRAMES)
    speed = positive("frames_per_second", frames_per_second)
    if speed > 100.0:
        reject("frames_per_second", frames_per_second, "a number > 0, at most 100")
    scene = _Scene(run, span, frames)
    return Animation(scene.figure, scene.times, scene.draw, speed)


@naming
def animate(
    run: Run | StructureRun,
    path: str | os.PathLike[str] | None = None,
    *,
    window: tuple[float, float] | None = None,
    periods: float | None = None,
    frames: int | None = None,
    frames_per_second: float = 25.0,
) -> Animation:
    """Return the animation of a run, written to a file if there is a path."""
    if path is not None:
        writer_of(path)  # before anything is computed for it
    moving = animation(
        run, window=window, periods=periods, frames=frames, frames_per_second=frames_per_second
    )
    if path is not None:
        moving.save(path)
    return moving


def _with_impacts(run: Run | StructureRun, times: Array, step: float) -> tuple[Array, list[int]]:
    """Return the times, moved to the impacts near to them, and the impact of each, -1 for none.

    Of several impacts near to one frame the strongest is shown.
    """
    times, hits = times.copy(), [-1] * len(times)
    impacts = run.impacts
    inside = np.flatnonzero(
        (impacts["time"] > times[0] - 0.5 * step) & (impacts["time"] < times[-1] + 0.5 * step)
    )
    even = times.copy()
    for row in sorted(inside.tolist(), key=lambda row: float(impacts["impulse_normal"][row])):
        time = float(impacts["time"][row])
        frame = int(np.abs(even - time).argmin())
        if time >= run.kept_from:
            times[frame], hits[frame] = time, row
    return times, hits
