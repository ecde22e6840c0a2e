"""Section 4.1, Figs. 2 and 3: where period 1-1 and 2-1 motions exist, and which are stable."""

import math
from dataclasses import replace
from functools import cache

import numpy as np

from ...orbits import motion_map
from .. import existence
from ..claims import Claim, Verdict
from ..parameters import paper_system
from .model import coarse_map
from .statement import Finding, Statement, stated

ERRATA = "theory.md#8-errata-of-the-paper"
PAGE_ALL = "orbits.md#all-motions-with-one-impact"
# Frequencies of the maps of Figs. 2 and 3: `vibroimpact reproduce` takes 561.
COARSE = 141
# Half the last digit of x10 as it is quoted.
PRINTED = 5e-5


@cache
def figure_claims(figure: int) -> dict[str, Claim]:
    """Return the claims of Fig. 2 or 3, by id."""
    return {made.id: made for made in existence.judge(existence.compute(figure, COARSE))}


def _figure(figure: int, n: int) -> Statement:
    @stated(
        f"fig{figure}",
        f"Fig. {figure}",
        f"where stable and unstable period {n}-1 motions exist over omega, f1 and x10",
        figure=figure,
        slow=True,
        page=ERRATA,
    )
    def judge() -> Claim:
        made = figure_claims(figure)[f"{figure}"]
        return replace(made, found=f"{made.paper_says} by (45): stable are {made.found}")

    return judge


def _quoted(figure: int, n: int, x10: str, verdict: str) -> Statement:
    @stated(
        f"fig{figure}-quoted",
        "section 4.1, (omega, f1) = (0.65, 0.95)",
        f"{'a' if verdict == 'stable' else 'an'} {verdict} period {n}-1 motion at x10 = {x10}",
        figure=figure,
        page=ERRATA,
    )
    def judge() -> Claim:
        (item,) = [item for item in existence.QUOTED if item.figure == figure]
        return existence.judge_quoted(item)

    return judge


def _digits(figure: int, n: int, x10: str, verdict: str) -> Statement:
    @stated(
        f"fig{figure}-digits",
        "section 4.1, (omega, f1) = (0.65, 0.95)",
        f"x10 = {x10} solves (38) for n = {n}, {verdict} by (45)",
        figure=figure,
    )
    def judge() -> Finding:
        (item,) = [item for item in existence.QUOTED if item.figure == figure]
        motion = existence.nearest(item.system, n, item.x10)
        off = abs(motion.state[0] - float(x10))
        eigenvalues = motion.paper_eigenvalues
        size = math.nan if eigenvalues is None else float(np.abs(eigenvalues).max())
        agrees = motion.paper_stable == (verdict == "stable")
        settled: Verdict = "reproduced" if off <= PRINTED and agrees else "refuted"
        return Finding(
            f"x10 = {motion.state[0]:.6f}, |lambda| = {size:.2f}",
            settled,
            f"the nearest solution is x10 = {motion.state[0]:.10f}, {off:.1g} from the printed "
            f"value; the largest root of (45) has modulus {size:.4f}. It is an algebraic solution; "
            "whether it is a motion is another statement",
            residual=motion.residual,
        )

    return judge


FIG2, FIG3 = _figure(2, 1), _figure(3, 2)
QUOTED_2, QUOTED_3 = _quoted(2, 1, "0.5369", "stable"), _quoted(3, 2, "0.3300", "unstable")
DIGITS_2, DIGITS_3 = _digits(2, 1, "0.5369", "stable"), _digits(3, 2, "0.3300", "unstable")


@stated(
    "strict-values",
    "section 4.1, observation (1)",
    "periodic motions appear for strict values of the parameters and of x10 only",
    page=PAGE_ALL,
    slow=True,
)
def strict_values() -> Finding:
    """Count solutions and stable motions over the plane."""
    made = [coarse_map(n) for n in (1, 2)]
    points = len(made[0].undecided)
    most = max(int(np.bincount(part.solutions["point"]).max()) for part in made)
    stable = np.zeros(points, dtype=bool)
    for part in made:
        stable[part.solutions["point"][part.solutions["stable"]]] = True
    share = float(stable.mean())
    verdict: Verdict = "reproduced" if share < 0.5 else "refuted"
    return Finding(
        f"stable ones at {share:.0%} of the values of (omega, f1)",
        verdict,
        f"on a grid of {points} values of (omega, f1) there are at most {most} isolated values of "
        f"x10 for n = 1, 2 at each, and at {share:.1%} of them a stable 1-1 or 2-1 motion",
    )


@stated(
    "regions-grow",
    "section 4.1, observation (2)",
    "with growing f1 the regions of periodic motions become larger and meet",
    page=PAGE_ALL,
    slow=True,
)
def regions_grow() -> Finding:
    """Count the frequencies with solutions, and with motions, at each f1."""
    lines, verdicts = [], []
    for column in ("solutions", "motions"):
        shares: list[float] = []
        pieces: list[int] = []
        for f1 in coarse_map(1).grid["moment_amplitude"]:
            part = coarse_map(1).at(moment_amplitude=float(f1))
            rows = part.solutions
            rows = rows if column == "solutions" else rows[rows["admissible"]]
            there = np.zeros(len(part.undecided), dtype=bool)
            there[rows["point"]] = True
            shares.append(float(there.mean()))
            pieces.append(int((np.diff(there.astype(int)) == 1).sum() + there[0]))
        verdicts.append(bool((np.diff(shares) >= 0).all() and pieces[-1] < max(pieces)))
        lines.append(
            f"{column} at {', '.join(f'{share:.0%}' for share in shares)} of the frequencies, in "
            f"{', '.join(map(str, pieces))} intervals"
        )
    verdict: Verdict = "refuted"
    if all(verdicts):
        verdict = "reproduced"
    elif any(verdicts):
        verdict = "corrected"
    word = {True: "yes", False: "no"}
    return Finding(
        f"solutions: {word[verdicts[0]]}; motions: {word[verdicts[1]]}",
        verdict,
        "for n = 1 and f1 = 0.5, 1, 1.5, 2, 2.5: " + "; ".join(lines),
    )


@stated(
    "again-and-again",
    "section 4.1, observation (3)",
    "at large f1 stability is lost and found again and again for omega from 0.2 to 1.2",
    page=PAGE_ALL,
    slow=True,
)
def again_and_again() -> Finding:
    """Count the intervals with a stable motion."""
    found = motion_map(
        paper_system(moment_amplitude=2.25),
        1,
        within=existence.WITHIN,
        drive_frequency=np.linspace(0.2, 1.2, 401),
    )
    counts = {}
    for name in ("stable", "paper_stable"):
        there = np.zeros(len(found.undecided), dtype=bool)
        there[found.solutions["point"][found.solutions[name]]] = True
        counts[name] = int((np.diff(there.astype(int)) == 1).sum() + there[0])
    verdict: Verdict = "reproduced" if counts["stable"] >= 3 else "refuted"
    return Finding(
        f"{counts['stable']} intervals with a stable 1-1 motion",
        verdict,
        f"at f1 = 2.25 and 401 frequencies there are {counts['stable']} intervals of omega with a "
        f"stable 1-1 motion by the multipliers, {counts['paper_stable']} with a solution that is "
        "stable by (45)",
    )
