"""What a notebook shows of a result: a table of facts and a small picture, as HTML.

The picture is part of the page (a PNG in a data URL); there is no script, and nothing is loaded
from elsewhere. All words are escaped.
"""

import base64
import io
from html import escape
from typing import Any

from matplotlib import rc_context
from matplotlib.figure import Figure

from ..fitting import Fit
from ..impact_results import ImpactAgreement, ImpactRegimes
from ..orbits import Bifurcation, PeriodicMotion
from ..run import Run
from ..showing import Facts, Shown
from ..structure_motion import StructureOrbit
from ..structure_run import StructureRun
from ..sweeps import Diagram, GridResult
from .obvious import draw

# Inches and dots per inch of the picture.
_SIZE, _DPI = (4.6, 3.0), 100
# Results with more numbers than this are not drawn unasked: it would take seconds.
_MOST = 1_000_000
# Facts in a table; a branch may have hundreds of bifurcations.
_MOST_FACTS = 24
_ROW = '<tr><th style="text-align:left">{}</th><td style="text-align:left">{}</td></tr>'


def html(result: Shown, facts: Facts) -> str:
    """Return table and picture of a result as one piece of HTML."""
    name = escape(type(result).__name__)
    shown = [*facts.items()]
    more = len(shown) - _MOST_FACTS
    if more > 0:
        shown = [*shown[:_MOST_FACTS], ("more", f"{more} more lines")]
    rows = "".join(_ROW.format(escape(key), escape(str(fact))) for key, fact in shown)
    image = _image(result)
    picture = (
        ""
        if image is None
        else f'<img src="data:image/png;base64,{image}" alt="picture of the {name}" />'
    )
    return (
        f'<div class="vibroimpact"><table><caption style="text-align:left"><b>{name}</b></caption>'
        f"<tbody>{rows}</tbody></table>{picture}</div>"
    )


def _has_nothing(result: Shown) -> bool:
    """Whether there is nothing to draw though the result has a picture."""
    return isinstance(result, Run | StructureRun) and result.kept_from >= result.final_state.time


def _image(result: Shown) -> str | None:
    """Return the picture as base64 text; None for a result that has none."""
    if not hasattr(type(result), "plot") or _has_nothing(result) or _numbers(result) > _MOST:
        return None
    small: dict[Any, Any] = {"font.size": 8.0, "axes.titlesize": 8.0, "legend.fontsize": 7.0}
    with rc_context({**small, "legend.frameon": False}):
        # Without pyplot, which would keep the figure and might show it.
        figure = Figure(figsize=_SIZE, dpi=_DPI, layout="constrained", facecolor="white")
        try:
            draw(result, **_axes(result, figure))
        except ValueError:
            return None  # There is nothing to draw: no axes, no points, no window.
        file = io.BytesIO()
        figure.savefig(file, format="png")
    return base64.b64encode(file.getvalue()).decode("ascii")


def _axes(result: Shown, figure: Figure) -> dict[str, Any]:
    """Return where to draw a result, as an option of its function."""
    motion = result.motion if isinstance(result, Bifurcation) else result
    if isinstance(result, Fit):
        return {"axes": list(figure.subplots(2, 1, height_ratios=(2, 1)))}
    if isinstance(motion, StructureOrbit):
        return {"axes": list(figure.subplots(1, 2))}
    if isinstance(motion, PeriodicMotion):
        panels = figure.subplot_mosaic([["one", "two"], ["history", "history"]])
        return {"axes": [panels[name] for name in ("one", "two", "history")]}
    if isinstance(result, ImpactRegimes | ImpactAgreement):
        number = 3 if isinstance(result, ImpactRegimes) else len(result.laws)
        figure.set_size_inches(2.2 * number, _SIZE[1])
        return {"axes": list(figure.subplots(1, number, squeeze=False)[0])}
    return {"ax": figure.add_subplot()}


def _numbers(result: Shown) -> int:
    """Return about how many numbers a picture would have to read."""
    if isinstance(result, Diagram):
        return int(result.offset[-1])
    return len(result) if isinstance(result, GridResult) else 0
