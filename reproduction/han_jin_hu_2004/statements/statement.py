"""What a statement of the paper is here: its place, its content, and the function that judges it.

Nothing is a stored answer: the function computes what it says it found, and its verdict follows
from numbers. `reproduced`: as the paper says, to its printed digits. `corrected`: it holds once it
is put right as the finding says. `refuted`: the evidence speaks against it. `open`: nothing that
is computed here can decide it, for the reason given.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from ..claims import Claim, Verdict

SOURCE = "Han, Jin & Hu (2004)"
# Rounding of a formula of some ten operations on numbers of order one.
ROUNDING = 1e-12
# A difference that no rounding makes.
CLEAR = 1e-3


@dataclass(frozen=True)
class Finding:
    """What was computed for a statement, and the verdict on it.

    `found` is a phrase for a table, `evidence` a sentence or two with the numbers behind it.
    """

    found: str
    verdict: Verdict
    evidence: str
    residual: float | None = None
    reference: dict[str, Any] = field(default_factory=lambda: {"label": "-"})


@dataclass(frozen=True)
class Statement:
    """A statement of the paper that is judged.

    Attributes
    ----------
    id
        A word for the command line.
    place
        Equation, figure or section of the paper.
    says
        What it says, in our words.
    judge
        Computes the finding, or a claim that already exists.
    figure
        Number of its figure, if it belongs to one.
    slow
        Whether it takes more than some seconds.
    page
        Where it is explained, relative to the folder of the documentation; mostly "".
    drawn_by
        The command that draws it, for the look of a figure; mostly "".
    """

    id: str
    place: str
    says: str
    judge: Callable[[], Finding | Claim]
    figure: int | None = None
    slow: bool = False
    page: str = ""
    drawn_by: str = ""

    @property
    def command(self) -> str:
        """The command that shows it."""
        return self.drawn_by or f"vibroimpact claims {self.id}"

    def evaluate(self) -> Claim:
        """Compute, and return the claim under the statement's own name."""
        made = self.judge()
        by_hand = made.command if isinstance(made, Claim) else ""
        return Claim(
            id=self.id,
            figure=self.figure,
            source=f"{SOURCE}, {self.place}",
            paper_says=self.says,
            found=made.found,
            residual=made.residual,
            reference=made.reference,
            verdict=made.verdict,
            decided_by=made.decided_by if isinstance(made, Claim) else made.evidence,
            details=made.details if isinstance(made, Claim) else "",
            command=by_hand or self.command,
            theorem=made.theorem if isinstance(made, Claim) else "",
        )


def stated(
    id: str,
    place: str,
    says: str,
    *,
    figure: int | None = None,
    slow: bool = False,
    page: str = "",
    drawn_by: str = "",
) -> Callable[[Callable[[], Finding | Claim]], Statement]:
    """Make a statement of the function that judges it."""

    def made(judge: Callable[[], Finding | Claim]) -> Statement:
        return Statement(id, place, says, judge, figure, slow, page, drawn_by)

    return made


def formula(off: float, where: str, *, allowed: float = ROUNDING) -> Finding:
    """Judge a formula by how far it is from what it should equal."""
    verdict: Verdict = "open"
    if off <= allowed:
        verdict = "reproduced"
    elif not off < CLEAR:  # NaN, too
        verdict = "refuted"
    return Finding(
        f"difference {off:.1g}", verdict, f"largest difference {off:.2g} {where}", residual=off
    )


def mended(
    printed: float, corrected: float, where: str, how: str, *, allowed: float = ROUNDING
) -> Finding:
    """Judge a formula that holds as corrected, and not as printed.

    Parameters
    ----------
    printed, corrected
        How far the formula is off, as printed and as corrected.
    where
        What it was compared with.
    how
        The correction.
    allowed
        Largest difference that rounding explains.
    """
    verdict: Verdict = "open"
    if printed <= allowed:
        verdict = "reproduced"
    elif corrected <= allowed and not printed < CLEAR:
        verdict = "corrected"
    elif not corrected < CLEAR:
        verdict = "refuted"
    return Finding(
        f"off by {_rough(printed)} as printed, {_rough(corrected)} with {how}",
        verdict,
        f"largest difference {printed:.2g} as printed and {corrected:.2g} with {how}, {where}",
        residual=corrected,
    )


def _rough(value: float) -> str:
    """Return one digit, and no exponent for a number above 1."""
    return f"{value:.0f}" if value > 1.0 else f"{value:.1g}"


STATEMENTS: dict[str, Statement] = {}
"""The statements by their id, in the order of the page; the package fills it."""
