"""The diagrams of Figs. 4, 7 and 8, for several statements of section 4, computed once."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from vibroimpact import Diagram, bifurcation_diagram

from ..parameters import (
    FREQUENCY_RANGE,
    INITIAL,
    KEEP,
    MOTIONS,
    PERIODS,
    TRANSITIONS,
    Motion,
    Transition,
)

FREQUENCIES = 381
"""Values of each diagram, 0.01 apart."""
BY_ID: dict[str, Transition] = {transition.id: transition for transition in TRANSITIONS}
MOTION: dict[str, Motion] = {motion.id: motion for motion in MOTIONS}
NO_IMPACTS = "no impacts"


@cache
def diagram(name: str) -> Diagram:
    """Return the diagram of a figure, with labels."""
    return bifurcation_diagram(
        BY_ID[name].system,
        initial=INITIAL,
        periods=PERIODS,
        keep=KEEP,
        drive_frequency=np.linspace(*FREQUENCY_RANGE, FREQUENCIES),
    )


def kinds(name: str) -> NDArray[np.str_]:
    """Return the label at each frequency; one word for all motions without impacts."""
    made = diagram(name)
    return np.where(np.diff(made.offset) == 0, NO_IMPACTS, made.label)


def changes(name: str) -> int:
    """Count the neighbouring frequencies whose motions differ."""
    found = kinds(name)
    return int((found[1:] != found[:-1]).sum())


def non_periodic(name: str) -> NDArray[np.bool_]:
    """Whether the motion at each frequency has impacts and no period."""
    return np.asarray((diagram(name).m == 0) & (kinds(name) != NO_IMPACTS))


def same(one: str, other: str) -> float:
    """Part of the frequencies at which two diagrams show the same motion."""
    return float((kinds(one) == kinds(other)).mean())


def span(values: NDArray[np.float64]) -> str:
    """Return the range of some frequencies, as text."""
    return f"{values.min():.6g} to {values.max():.6g}" if len(values) else "nowhere"
