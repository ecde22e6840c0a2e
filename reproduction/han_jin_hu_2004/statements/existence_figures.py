"""Section 4.1, Figs. 2 and 3: where period 1-1 and 2-1 motions exist, and which are stable."""

from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from vibroimpact import motion_map, simulate

from .. import criterion, evidence, existence
from ..claims import Claim, Verdict
from ..parameters import paper_system
from .model import SCATTERED, coarse_map
from .printed_motion import state_39_40
from .statement import Finding, Statement, stated

ERRATA = "theory.md#8-errata-of-the-paper"
PAGE_ALL = "orbits.md#all-motions-with-one-impact"
# Frequencies of the maps of Figs. 2 and 3: `vibroimpact reproduce` takes 561.
COARSE = 141
# A condition is strict, or very difficult, if less than the first part of all choices meet it, and
# not so if more than the second part do.
RARE, COMMON = 0.02, 0.2
# Points at which starts are tried; distance of the frequencies of the coarse maps.
POINTS, STEP = 100, 0.02
# More solutions than a few at one point would not be isolated ones.
FEW = 20
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
        said, size = criterion.verdict(motion)
        settled: Verdict = "reproduced" if off <= PRINTED and said == verdict else "refuted"
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


def by_share(share: float, *, rare: float, common: float) -> Verdict:
    """Judge that something is rare by how often it happens."""
    if share < rare:
        return "reproduced"
    return "refuted" if share > common else "corrected"


def stable_points() -> NDArray[np.bool_]:
    """Whether there is a stable 1-1 or 2-1 motion at each point of the coarse maps."""
    stable = np.zeros(len(coarse_map(1).undecided), dtype=np.bool_)
    for n in (1, 2):
        rows = coarse_map(n).solutions
        stable[rows["point"][rows["stable"]]] = True
    return stable


@stated(
    "strict-values",
    "section 4.1, observation (1)",
    "the appearance of periodic motions depends on strict values of some parameters",
    page=PAGE_ALL,
    slow=True,
)
def strict_values() -> Finding:
    """Count the values of the parameters with stable motions."""
    stable = stable_points()
    plane = stable.reshape([len(axis) for axis in coarse_map(1).grid.values()])
    # Neighbours in omega of a point with such a motion that have one as well.
    both = float((plane[1:] & plane[:-1]).sum() / max(plane[:-1].sum(), 1))
    share = float(stable.mean())
    return Finding(
        f"stable ones at {share:.0%} of the values of (omega, f1)",
        by_share(share, rare=RARE, common=COMMON),
        f"on a grid of {len(stable)} values of (omega, f1) there is a stable 1-1 or 2-1 motion at "
        f"{share:.1%}, and {both:.0%} of these have one at the next frequency, {STEP:g} away, too: "
        f"they fill regions (strict: at less than {RARE:.0%}; refuted: at more than {COMMON:.0%})",
    )


@stated(
    "x10-decides",
    "section 4.1, observation (1)",
    "at given (omega, f1) x10, and the state that it fixes, decide whether a motion is periodic",
    page=PAGE_ALL,
    slow=True,
)
def x10_decides() -> Finding:
    """Count the solutions at each point, and compute their states from x10."""
    most = 0
    off = 0.0
    for n in (1, 2):
        made = coarse_map(n)
        rows = made.solutions
        most = max(most, int(np.bincount(rows["point"]).max()))
        for number in range(len(rows)):
            system = made.system.replace(
                **{name: float(made.parameter(name)[number]) for name in made.grid}
            )
            if system.drive_frequency == system.frequency_ratio:
                continue  # omega = omega0, which (37) excludes
            v1, v2, *_ = state_39_40(system, n, float(rows["x1"][number]))
            size = 1.0 + abs(v1) + abs(v2)
            off = max(off, abs(v1 - rows["v1"][number]) / size, abs(v2 - rows["v2"][number]) / size)
    verdict: Verdict = "reproduced" if off < SCATTERED and most < FEW else "refuted"
    return Finding(
        f"at most {most} values of x10 for each n, each with one state",
        verdict,
        f"for n = 1, 2 there are at most {most} isolated values of x10 at each of "
        f"{len(stable_points())} values of (omega, f1), found by intervals, and velocities by "
        f"(39) agree with theirs to {off:.1g} (omega = omega0 left out, as by (37)); from how many "
        "starts a stable one is reached, see difficult",
    )


@stated(
    "difficult",
    "section 4.1",
    "period n-1 motions in the region of Figs. 2 and 3 are very difficult to realize",
    page=PAGE_ALL,
    slow=True,
)
def difficult() -> Finding:
    """Start at random, at random values of omega and f1."""
    random, starts = np.random.default_rng(3), evidence.random_starts(12)
    stable = stable_points()
    points = [tuple(map(float, point)) for point in product(*coarse_map(1).grid.values())]
    reached: list[float] = []
    chosen = random.permutation(len(points))[:POINTS]
    for number in chosen:
        named = dict(zip(coarse_map(1).grid, points[number], strict=True))
        runs = simulate(paper_system(**named), initial=starts, periods=1500, keep=100)
        reached.append(float(np.mean([run.label in ("1-1", "2-1") for run in runs])))
    share = float(np.mean(reached))
    there = stable[chosen]
    where = float(np.mean(np.array(reached)[there]))
    return Finding(
        f"{share:.0%} of random starts reach one, {where:.0%} where one is stable",
        by_share(share, rare=RARE, common=COMMON),
        f"at {len(chosen)} random points of the plane of Figs. 2 and 3 {share:.1%} of "
        f"{len(starts)} random starts each are on a 1-1 or 2-1 motion after 1500 drive periods, "
        f"and {where:.1%} at the {int(there.sum())} of them at which one is stable (very "
        f"difficult: less than {RARE:.0%}; refuted: more than {COMMON:.0%})",
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
    by_45 = criterion.is_stable(criterion.map_eigenvalues(found))
    counts = {}
    for name, stable in (("stable", found.solutions["stable"]), ("by_45", by_45)):
        there = np.zeros(len(found.undecided), dtype=bool)
        there[found.solutions["point"][stable]] = True
        counts[name] = int((np.diff(there.astype(int)) == 1).sum() + there[0])
    verdict: Verdict = "reproduced" if counts["stable"] >= 3 else "refuted"
    return Finding(
        f"{counts['stable']} intervals with a stable 1-1 motion",
        verdict,
        f"at f1 = 2.25 and 401 frequencies there are {counts['stable']} intervals of omega with a "
        f"stable 1-1 motion by the multipliers, {counts['by_45']} with a solution that is "
        "stable by (45)",
    )
