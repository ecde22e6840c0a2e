"""Pictures that move: a figure that is drawn anew for every frame, and the files made of it.

It knows no dynamics: what the frames show comes from a function.
"""

from __future__ import annotations

import io
import os
import re
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ..arguments import count, reject
from ..arguments import path as checked_path
from ..interruption import interruptible
from ..whole_file import whole_file
from .style import (
    BLACK,
    BLUE,
    GREEN,
    REGIME_STYLES,
    SKY_BLUE,
    SLIDE_STYLE,
    STICK_STYLE,
    STOPS,
    VERMILLION,
)

Array = NDArray[np.float64]

# Bits of each of red, green and blue by which the colours of a GIF are looked up.
_BITS = 5
_ENDINGS = ".gif, .mp4, .html"
# The signs on the buttons of matplotlib's player are a font from another host: text instead.
_FONT = re.compile(r"<link\b[^>]*>\s*")
_ICON = re.compile(r'<i class="fa fa-([a-z- ]+)"></i>')
_SIGNS = {
    "minus": "&minus;",
    "fast-backward": "|&#9664;&#9664;",
    "step-backward": "|&#9664;",
    "play fa-flip-horizontal": "&#9664;",
    "pause": "||",
    "play": "&#9654;",
    "step-forward": "&#9654;|",
    "fast-forward": "&#9654;&#9654;|",
    "plus": "+",
}


@interruptible
class Animation:
    """A run that moves; what `vibroimpact.plot.animation` and ``run.animate`` return.

    In a notebook it shows itself. `save` writes a GIF, an MP4 or a page of HTML.

    Attributes
    ----------
    times
        The times of the frames, shape (frames,), dimensionless.
    frames_per_second
        The speed.
    figure
        The matplotlib figure in which it is drawn; `show` draws one frame.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
    >>> moving = vi.plot.animation(run, periods=1, frames=5)
    >>> moving
    <Animation of 5 frames, 0.2 s, of times 2090.88 to 2093.7>
    """

    def __init__(
        self,
        figure: Figure,
        times: Array,
        draw: Callable[[int], list[Artist]],
        frames_per_second: float,
    ) -> None:
        self.figure, self.times, self.frames_per_second = figure, times, frames_per_second
        self._draw = draw

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.times)

    def show(self, frame: int) -> Figure:
        """Draw one frame, 0 ... len - 1, and return the figure.

        Raises
        ------
        ParameterError
            If there is no such frame.

        Examples
        --------
        >>> len(moving.show(0).axes)
        3
        """
        self._draw(count("frame", frame, least=0, most=len(self) - 1))
        return self.figure

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

        Examples
        --------
        >>> moving.save("machine.gif")
        >>> import pathlib
        >>> pathlib.Path("machine.gif").stat().st_size > 0
        True
        """
        write = writer_of(path)
        with whole_file(path) as file:
            file.write(write(self))

    def to_html(self) -> str:
        """Return a player of the animation, as HTML with the frames in it.

        Nothing in it is loaded from elsewhere.

        Examples
        --------
        >>> "<img" in moving.to_html()
        True
        """
        # Beyond its limit of bytes matplotlib would leave frames out.
        with matplotlib.rc_context({"animation.embed_limit": 2.0**20}):
            player = self._matplotlib()
            html: str = player.to_jshtml(fps=self.frames_per_second, default_mode="loop")
        return _ICON.sub(lambda icon: _SIGNS[icon[1]], _FONT.sub("", html))

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
        return (
            f"<Animation of {len(self)} frames, {seconds:.3g} s, "
            f"of times {self.times[0]:.6g} to {self.times[-1]:.6g}>"
        )


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

    palette = _palette()
    nearest = _nearest(palette)
    frames = []
    for pixels in _pictures(animation):
        red, green, blue = (pixels[..., k] >> (8 - _BITS) for k in range(3))
        picture = Image.fromarray(nearest[red, green, blue])
        picture.putpalette(palette.ravel().tolist())
        frames.append(picture)
    file = io.BytesIO()
    # A GIF counts hundredths of a second.
    duration = 10 * max(round(100.0 / animation.frames_per_second), 1)
    options: dict[str, Any] = {"duration": duration, "loop": 0, "optimize": True}
    frames[0].save(file, "GIF", save_all=True, append_images=frames[1:], **options)
    return file.getvalue()


def _pictures(animation: Animation) -> Iterator[NDArray[np.uint8]]:
    """Give the frames as colours of pixels; what stands still is drawn once."""
    canvas: Any = animation.figure.canvas
    moving = animation._draw(0)
    for artist in moving:
        artist.set_visible(False)
    canvas.draw()
    ground = canvas.copy_from_bbox(animation.figure.bbox)
    for artist in moving:
        artist.set_visible(True)
    for frame in range(len(animation)):
        moving = animation._draw(frame)
        canvas.restore_region(ground)
        for artist in moving:
            animation.figure.draw_artist(artist)
        yield np.array(canvas.buffer_rgba())[..., :3]


def _palette() -> NDArray[np.uint8]:
    """Return the colours of a GIF, shape (k, 3): greys, and those of the figures, paler and dark.

    A palette made from the pixels would lose the rare ones, which are those of the impacts.
    """
    colors = [np.full(3, grey) for grey in np.linspace(0.0, 1.0, 32)]
    strong = {style.color for style in REGIME_STYLES.values()} | {color for color, _ in STOPS}
    for name in sorted((strong | {GREEN, SKY_BLUE, VERMILLION, BLUE}) - {BLACK}):
        full = np.array(to_rgb(name))
        colors += [1.0 - part + part * full for part in (1.0, 0.8, 0.6, 0.4, 0.2, 0.1)]
        colors.append(0.5 * full)
    for style in (SLIDE_STYLE, STICK_STYLE):
        colors += [np.array(to_rgb(style.band)), np.array(to_rgb(style.edge))]
    return np.round(255.0 * np.array(colors)).astype(np.uint8)


def _nearest(palette: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the nearest colour of a palette for red, green and blue of a few bits each."""
    levels = (np.arange(2**_BITS) + 0.5) * 2 ** (8 - _BITS)
    cells = np.stack(np.meshgrid(levels, levels, levels, indexing="ij"), axis=-1)
    best = np.full(cells.shape[:3], np.inf)
    found = np.zeros(cells.shape[:3], np.uint8)
    for number, color in enumerate(palette.astype(float)):
        away = ((cells - color) ** 2).sum(axis=-1)
        closer = away < best
        best[closer], found[closer] = away[closer], number
    return found


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
