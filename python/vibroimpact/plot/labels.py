"""Colours of labels: one for each number of drive periods, and for motions without a period.

The palette was found by a search for colours that are far apart for normal vision and under the
three dichromacies (model of Machado, Oliveira & Fernandes 2009): any two of them differ by at least
25 in CIELAB, colours of dots by 22. Cells without a label are hatched, not coloured.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.patches import Patch
from numpy.typing import NDArray

from .._core import MOTION_NAMES
from ..arguments import naming
from ..sweeps.fields import STATUS_NAMES
from ..sweeps.results import GridResult

# Statuses of cells that have come to the end of their run.
_ENDED = [STATUS_NAMES.index(name) for name in ("completed", "restarted", "rest")]
_LONGEST = 8


@dataclass(frozen=True)
class LabelStyle:
    """How one kind of label is drawn and named: cells by a colour or a hatch, points by a colour.

    ``dot`` is the colour of points where that of the cells is too light for them.
    """

    text: str
    color: str
    hatch: str = ""
    dot: str = ""

    @property
    def point_color(self) -> str:
        """Colour of points, to be seen on white."""
        return self.dot or self.color


_PERIODS = (
    "#0063B0",
    "#D67E0F",
    "#B38764",
    "#685F77",
    "#952400",
    "#68ADFF",
    "#59025D",
    "#FAD905",
)
_HATCHES = ("/////", r"\\\\\\", "xxxxx", ".....", "-----", "|||||", "+++++", "ooooo")
HATCH_GREY = "0.5"
NO_LABEL_COLOR = "0.75"
"""Points of motions without a label, which are too small to be hatched."""

LABEL_STYLES = (
    *(LabelStyle(f"$m = {m}$", color) for m, color in enumerate(_PERIODS, start=1)),
    LabelStyle(f"$m > {_LONGEST}$", "#3800A2"),
    LabelStyle(r"chatter ($n = \infty$)", "#B7FFB5", dot="#00E070"),
    LabelStyle("no impact ($n = 0$)", "#FFFFFF", dot="#8F00FF"),
    LabelStyle("quasi-periodic", "#B2BBDD", dot="#7F8CBF"),
    LabelStyle("chaotic", "#1A1A1A"),
)
"""Style of each kind of label that has a colour; the index is the code of `label_codes`."""

MORE, CHATTER, NO_IMPACT, QUASI_PERIODIC, CHAOTIC, UNRESOLVED = range(_LONGEST, _LONGEST + 6)


def label_codes(result: GridResult) -> NDArray[np.int64]:
    """Return the kind of label of each cell, in the shape of the grid.

    A periodic motion is classified by its m, but complete chatter and motions without impact are
    kinds of their own. From `UNRESOLVED` on are the cells without a label: unresolved, then by
    their status.
    """
    m, n = result.columns["m"], result.columns["n"]
    motion, status = result.columns["motion"], result.columns["status"]
    kinds = {"quasi-periodic": QUASI_PERIODIC, "chaotic": CHAOTIC}
    codes = np.full(m.shape, UNRESOLVED, np.int64)
    for name, code in kinds.items():
        codes[motion == MOTION_NAMES.index(name)] = code
    periodic = m > 0
    codes[periodic] = np.minimum(m[periodic] - 1, MORE)
    codes[periodic & (n == 0)] = NO_IMPACT
    codes[periodic & (n == -1)] = CHATTER
    early = ~np.isin(status, _ENDED)
    codes[early] = UNRESOLVED + 1 + status[early]
    return codes


def label_style(code: int) -> LabelStyle:
    """Return how the cells of a kind of label are drawn."""
    if code < UNRESOLVED:
        return LABEL_STYLES[code]
    number = code - UNRESOLVED - 1
    text = "unresolved" if number < 0 else STATUS_NAMES[number].replace("_", " ")
    return LabelStyle(text, NO_LABEL_COLOR, _HATCHES[(number + 1) % len(_HATCHES)])


@naming
def label_handles(codes: Iterable[int], *, points: bool = False) -> list[Artist]:
    """Return one legend entry for each kind of label, in the order of their codes.

    Parameters
    ----------
    codes : iterable of int
        Kinds of labels (`label_codes`), in any order and with repetitions.
    points : bool
        Name the colours of points, which are not hatched, instead of those of cells.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> [handle.get_label() for handle in vi.plot.label_handles([0, 1])]
    ['$m = 1$', '$m = 2$']
    """
    return [
        Patch(
            facecolor=style.point_color if points else "white" if style.hatch else style.color,
            hatch=None if points else style.hatch,
            edgecolor=HATCH_GREY,
            linewidth=0.4,
            label=style.text,
        )
        for style in map(label_style, sorted(set(codes)))
    ]
