"""Figs. 5, 6, 9 and 10: the motions that captions name, from the paper's start."""

from dataclasses import replace

from .. import motions
from ..claims import Claim, evaluate
from ..parameters import Motion
from ..theorems import theorem
from .diagrams import MOTION
from .statement import Statement, stated

ERRATA = "theory.md#8-errata-of-the-paper"
PRINTED_LAW = "theory.md#4-impact"


def _statement(motion: Motion) -> Statement:
    says = f"a period {motion.paper_says} motion"
    if motion.paper_says == "chaotic":
        says = "a chaotic motion"
    elif motion.figure == 10:
        says = "the impacts stop after a finite number"
    name = motion.id.replace("(", "-").replace(")", "")

    @stated(
        f"fig{name}",
        motion.place,
        f"{says} at omega = {motion.system.drive_frequency:g}",
        figure=motion.figure,
        page=ERRATA if motion.id in ("9(3)", "9(4)", "10") else "",
        slow=motion.id == "9(3)",
    )
    def judge() -> Claim:
        shown = motions.simulated(motion)
        made = evaluate(motion, shown.run, coexistence=shown.other, long_run=shown.long_run)
        return replace(made, theorem=theorem(shown))

    return judge


STATEMENTS = {name: _statement(motion) for name, motion in MOTION.items()}
