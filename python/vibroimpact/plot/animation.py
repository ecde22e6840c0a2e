"""A run that moves: the machine beside its phase portrait and its time history.

The frames are equally spaced in time, but the one nearest to an impact shows the instant of the
impact itself, so that every impact is seen as a contact, with its impulses.
"""

from __future__ import annotations

import io
import math
import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from ..arguments import count, positive, reject
from ..arguments import path as checked_path
from ..interruption import interruptible
from ..run import Run
from ..whole_file import whole_file
from .curve import is_driven, orbit_window, shown_window
from .given import bodies_of, expected
from .machine import Hit, Stage
from .marks import Mode, contact_spans
from .motion import phase_portrait, time_history
from .style import BLACK, BLUE, GREEN, REGIME_STYLES, SKY_BLUE, SLIDE_STYLE, STICK_STYLE, VERMILLION

Array = NDArray[np.float64]

MOST_FRAMES: Final = 2000
"""The largest number of frames of an animation."""

# By default: frames in a drive period, of a constant load in a unit of time, and their limits.
_IN_PERIOD, _IN_UNIT, _FEWEST, _USUALLY_MOST = 48, 12, 48, 360
# The impulses of an impact are seen for so many frames.
_FLASH = 7
_SIZE, _DOTS_PER_INCH = (7.2, 3.6), 100.0
_SETTINGS: Final[Any] = {
    "font.size": 8,
    "axes.labelsize": 8,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": 7,
    "legend.frameon": False,
}
_TEXTS = {"slide": SLIDE_STYLE.text, "stick": STICK_STYLE.text}
_ENDINGS = ".gif, .mp4, .html"


@interruptible
class Animation:
    """A run that moves; what `vibroimpact.plot.animation` and `Run.animate` return.

    In a notebook it shows itself. `save` writes a GIF, an MP4 or a page of HTML.

    Attributes
    ----------
    run : Run
        What is shown.
    times : array of shape (frames,)
        The times of the frames.
    frames_per_second : float
        The speed.
    figure : matplotlib.figure.Figure
        Where it is drawn; `show` draws one frame.
    """

    def __init__(
        self, run: Run, window: tuple[float, float], frames: int, frames_per_second: float
    ) -> None:
        self.run, self.frames_per_second = run, frames_per_second
        start, end = window
        even = start + (end - start) * np.arange(frames) / frames
        self.times, self._hits = _with_impacts(run, even, (end - start) / frames)
        self.times.flags.writeable = False
        self._states = run.trajectory(self.times)
        self._spans = contact_spans(run, window)
        self._modes = [self._mode(time) for time in self.times.tolist()]
        with matplotlib.rc_context(_SETTINGS):
            self.figure = Figure(figsize=_SIZE, dpi=_DOTS_PER_INCH, layout="constrained")
            FigureCanvasAgg(self.figure)
            self._draw(window)
            self.show(0)
        # Arranged once, or it would be arranged for every frame.
        self.figure.draw_without_rendering()
        self.figure.set_layout_engine("none")

    def _mode(self, time: float) -> Mode | None:
        found = [span.mode for span in self._spans if span.start <= time < span.end]
        return found[0] if found else None

    def _draw(self, window: tuple[float, float]) -> None:
        """Draw the curves, and what will move over them."""
        run = self.run
        parts = self.figure.subplot_mosaic(
            [["machine", "portrait"], ["machine", "history"]], width_ratios=(1.1, 1.0)
        )
        bodies = bodies_of(None, run)
        phase_portrait(run, bodies=bodies, window=window, legend=True, ax=parts["portrait"])
        time_history(run, window=window, ax=parts["history"])
        parts["history"].xaxis.set_major_locator(MaxNLocator(nbins=5))
        inside = (run.impacts["time"] > window[0]) & (run.impacts["time"] <= window[1])
        hits = run.impacts[inside]
        places = np.column_stack([hits["x1"], hits["v1_pre"], hits["x2"], hits["v2_pre"]])
        self._stage = Stage(parts["machine"], run.system, self._states, places)
        self._largest = float(hits["impulse_normal"].max(initial=0.0)) or 1.0
        mark: dict[str, Any] = {"marker": "o", "markersize": 5.0, "ls": "none", "zorder": 5}
        self._dots = {
            body: parts["portrait"].plot([], [], color=BLACK if body == 1 else BLUE, **mark)[0]
            for body in bodies
        }
        self._now = parts["history"].axvline(window[0], color=VERMILLION, lw=1.0, zorder=4)
        self._text = parts["machine"].text(
            0.0, 1.0, "", transform=parts["machine"].transAxes, ha="left", va="bottom", fontsize=9
        )

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.times)

    def show(self, frame: int) -> Figure:
        """Draw one frame, 0 ... len - 1, and return the figure.

        Raises
        ------
        ParameterError
            If there is no such frame.
        """
        frame = count("frame", frame, least=0, most=len(self) - 1)
        state, time = self._states[frame], float(self.times[frame])
        system, mode = self.run.system, self._modes[frame]
        hit = self._hit(frame)
        phase = system.drive_frequency * time + system.phase
        driven = is_driven(system)
        self._stage.show(state, phase=phase if driven else None, mode=mode, hit=hit)
        for body, dot in self._dots.items():
            dot.set_data([state[2 * body - 2]], [state[2 * body - 1]])
        self._now.set_xdata([time, time])
        doing = _TEXTS.get(mode or "", "apart")
        if hit is not None and mode is None:
            doing = f"impact, {REGIME_STYLES[hit.regime].text}"
        self._text.set_text(f"$t$ = {time:.2f}: {doing}")
        return self.figure

    @property
    def _moving(self) -> list[Artist]:
        """What is drawn anew in every frame, from below to above."""
        drawn = [*self._stage.moving, *self._dots.values(), self._now, self._text]
        return sorted(drawn, key=lambda artist: artist.get_zorder())

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
                    float(impact["x1"]), normal, tangential, int(impact["regime"]), age / _FLASH
                )
        return None

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the animation: .gif, .mp4 (needs the program ffmpeg), or .html.

        A GIF and a page of HTML run again and again.

        Parameters
        ----------
        path : str or os.PathLike
            The file; its ending says the format. It is written completely or not at all.

        Raises
        ------
        ParameterError
            If the ending is another, or .mp4 where there is no ffmpeg.
        OSError
            If the file cannot be written.
        """
        write = writer_of(path)
        with whole_file(path) as file:
            file.write(write(self))

    def to_html(self) -> str:
        """Return a player of the animation, as HTML with the frames in it."""
        # Beyond its limit of bytes matplotlib would leave frames out.
        with matplotlib.rc_context({"animation.embed_limit": 2.0**20}):
            player = self._matplotlib()
            html: str = player.to_jshtml(fps=self.frames_per_second, default_mode="loop")
        return html

    def _matplotlib(self) -> Any:
        from matplotlib.animation import FuncAnimation

        def update(frame: int) -> tuple[()]:
            self.show(frame)
            return ()

        return FuncAnimation(self.figure, update, frames=len(self), blit=False)

    def _repr_html_(self) -> str:
        return self.to_html()

    def __repr__(self) -> str:
        """Say how long it is, and of what."""
        seconds = len(self) / self.frames_per_second
        return f"<Animation of {len(self)} frames, {seconds:.3g} s, of {self.run!r}>"


def animation(
    run: Run,
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

    Parameters
    ----------
    run : Run
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
    """
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
    return Animation(run, span, frames, speed)


def _with_impacts(run: Run, times: Array, step: float) -> tuple[Array, list[int]]:
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


def writer_of(path: Any) -> Callable[[Animation], bytes]:
    """Return what makes the bytes of a file, by the ending of its name.

    Raises
    ------
    ParameterError
        If the ending is another, or .mp4 where there is no ffmpeg.
    """
    name = checked_path("path", path)
    match Path(name).suffix.lower():
        case ".gif":
            return _gif
        case ".html":
            return lambda animation: animation.to_html().encode("utf-8")
        case ".mp4":
            from matplotlib.animation import writers

            if not writers.is_available("ffmpeg"):
                reject("path", name, ".gif or .html: .mp4 needs the program ffmpeg, not found here")
            return _mp4
    reject("path", name, f"a name that ends in {_ENDINGS}")


def _gif(animation: Animation) -> bytes:
    """Return a GIF with one palette, so that what stands still costs nothing."""
    from PIL import Image

    table = Image.new("P", (1, 1))
    table.putpalette(_palette())
    frames = [
        Image.fromarray(pixels).quantize(palette=table, dither=Image.Dither.NONE)
        for pixels in _pictures(animation)
    ]
    file = io.BytesIO()
    # A GIF counts hundredths of a second.
    duration = 10 * max(round(100.0 / animation.frames_per_second), 1)
    options: dict[str, Any] = {"duration": duration, "loop": 0, "optimize": True}
    frames[0].save(file, "GIF", save_all=True, append_images=frames[1:], **options)
    return file.getvalue()


def _pictures(animation: Animation) -> Iterator[NDArray[np.uint8]]:
    """Give the frames as colours of pixels; what stands still is drawn once."""
    canvas: Any = animation.figure.canvas
    moving = animation._moving
    for artist in moving:
        artist.set_visible(False)
    canvas.draw()
    ground = canvas.copy_from_bbox(animation.figure.bbox)
    for artist in moving:
        artist.set_visible(True)
    for frame in range(len(animation)):
        animation.show(frame)
        canvas.restore_region(ground)
        for artist in animation._moving:
            animation.figure.draw_artist(artist)
        yield np.array(canvas.buffer_rgba())[..., :3]


def _palette() -> list[int]:
    """Return the colours of a GIF: greys, and those of the figures on white and on black."""
    colors = [(grey, grey, grey) for grey in np.linspace(0.0, 1.0, 32).tolist()]
    strong = {style.color for style in REGIME_STYLES.values()}
    for name in sorted((strong | {GREEN, SKY_BLUE, VERMILLION, BLUE}) - {BLACK}):
        full = np.array(to_rgb(name))
        for part in (1.0, 0.8, 0.6, 0.4, 0.2, 0.1):
            colors.append(tuple((1.0 - part + part * full).tolist()))
        colors.append(tuple((0.5 * full).tolist()))
    for style in (SLIDE_STYLE, STICK_STYLE):
        colors += [to_rgb(style.band), to_rgb(style.edge)]
    return [round(255.0 * part) for color in colors for part in color]


def _mp4(animation: Animation) -> bytes:
    from matplotlib.animation import FFMpegWriter

    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "animation.mp4"
        # Encoders of H.264 want an even number of pixels.
        even = ["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"]
        speed: Any = animation.frames_per_second  # typed as an int, but any number will do
        writer = FFMpegWriter(fps=speed, extra_args=even)
        animation._matplotlib().save(out, writer=writer)
        return out.read_bytes()
