"""Figs. 2 and 3: existence and stability of period n-1 motions, as drawn and as they are.

The paper draws every algebraic solution, with the stability of its criterion (42)-(45). A solution
is a motion only if it is admissible, and its stability is that of its Floquet multipliers
(docs/orbits.md; errata E4, E5). Verdicts on single motions are confirmed by
simulations that start a little off them.
"""

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.ticker import NullLocator
from numpy.typing import NDArray

from vibroimpact import (
    MotionMap,
    PeriodicMotion,
    System,
    motion_map,
    periodic_motions,
    plot,
    simulate,
)

from . import criterion
from .claims import Claim, Verdict
from .layout import Page, values
from .parameters import MOTIONS, Motion, paper_system

PERIODS_PER_ORBIT = {2: 1, 3: 2}
"""n of each figure."""
FREQUENCIES = 561
MOMENTS = np.arange(1, 51) / 20
SLICES = {2: (0.5, 0.95, 1.0, 2.0), 3: (0.95, 1.5, 2.25)}
"""Moment amplitudes at which the branches are drawn: those of the named motions among them."""
WITHIN = (-math.pi / 2, math.pi / 2)
PERTURBATION = 1e-6
"""How far off a motion its simulation starts, in v1."""
RETURNS = 1000
"""Orbits after which a perturbation is looked at."""
SAMPLE = 40
"""Motions of each kind, drawn at random from the grid, that are simulated."""
# Rates of growth per orbit this close to 1 cannot be distinguished from 1 within RETURNS orbits.
_CLEAR = 0.01
# Largest step of x10 along a branch, and how many steps the grid has instead of a larger one.
_RISE = 0.03
_FINER = 20
_SPACE_HEADING = (
    "(a)  angle $x_{10}$ at the impact of all solutions, over drive frequency $\\omega$ and moment "
    "amplitude $f_1$"
)
_ANGLE = "angle $x_{10}$"
_TICKS = (0.2, 0.3, 0.4, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0)
_SHOWN = ("mass_ratio", "frequency_ratio", "restitution", "gap")


@dataclass(frozen=True)
class Quoted:
    """A solution that section 4.1 of the paper quotes, and what it says of its stability."""

    figure: int
    x10: float
    paper_says: str
    system: System


QUOTED = (
    Quoted(2, 0.5369, "stable", paper_system(drive_frequency=0.65, moment_amplitude=0.95)),
    Quoted(3, 0.3300, "unstable", paper_system(drive_frequency=0.65, moment_amplitude=0.95)),
)


@dataclass(frozen=True)
class Trial:
    """What becomes of a perturbation of a motion.

    Attributes
    ----------
    expected, measured
        Factor per orbit: largest modulus of the multipliers, and from the simulation.
    largest, last
        Distance from the motion, its largest and its last value.
    """

    expected: float
    measured: float
    largest: float
    last: float


@dataclass(frozen=True)
class Existence:
    """The computed content of Fig. 2 or 3, with the simulations that confirm it.

    `stable_by_45` is the verdict of the paper's criterion on each solution of the map.
    """

    figure: int
    n: int
    map: MotionMap
    stable_by_45: NDArray[np.bool_]
    stable: tuple[Trial, ...]
    unstable: tuple[Trial, ...]

    @property
    def returned(self) -> int:
        """How many of the stable motions were found again."""
        return sum(trial.last < 0.1 * PERTURBATION for trial in self.stable)

    @property
    def left(self) -> int:
        """How many of the unstable motions were left."""
        return sum(trial.largest > 100.0 * PERTURBATION for trial in self.unstable)


def solve(figure: int, frequencies: int = FREQUENCIES) -> MotionMap:
    """Find all solutions of Fig. 2 or 3 on its grid."""
    if frequencies >= FREQUENCIES:
        grid = np.arange(40, 601) / 200
    else:
        grid = np.linspace(0.2, 3.0, frequencies)
    return motion_map(
        paper_system(),
        PERIODS_PER_ORBIT[figure],
        within=WITHIN,
        drive_frequency=grid,
        moment_amplitude=MOMENTS,
    )


def compute(figure: int, frequencies: int = FREQUENCIES) -> Existence:
    """Solve Fig. 2 or 3 on its grid, and simulate a sample of its motions."""
    found = solve(figure, frequencies)
    rows = found.solutions
    size = rows["largest_multiplier"]
    return Existence(
        figure,
        found.n,
        found,
        criterion.is_stable(criterion.map_eigenvalues(found)),
        _trials(found, rows["admissible"] & (size < 1.0 - _CLEAR)),
        _trials(found, rows["admissible"] & (size > 1.0 + _CLEAR)),
    )


def _trials(found: MotionMap, chosen: NDArray[np.bool_]) -> tuple[Trial, ...]:
    """Simulate from beside a random sample of the chosen motions."""
    numbers = np.flatnonzero(chosen)
    picked = np.random.default_rng(0).permutation(numbers)[:SAMPLE]
    return tuple(trial(found.motion(int(number))) for number in picked)


def nearest(system: System, n: int, x10: float) -> PeriodicMotion:
    """Return the solution whose angle at the impact is closest to x10."""
    return min(
        periodic_motions(system, n, within=(x10 - 0.05, x10 + 0.05)),
        key=lambda motion: abs(motion.state[0] - x10),
    )


def trial(motion: PeriodicMotion, *, returns: int = RETURNS) -> Trial:
    """Simulate from `PERTURBATION` beside a motion, and measure how its distance changes."""
    x1, v1, x2, v2 = motion.initial
    start = (x1, v1 + PERTURBATION, x2, v2)
    run = simulate(motion.system, initial=start, periods=returns * motion.m)
    distance = np.abs(run.stroboscopic[motion.m - 1 :: motion.m] - motion.initial).max(axis=1)
    # The range in which it is above rounding, and small enough to belong to this motion.
    linear = (distance > 1e-11) & (np.maximum.accumulate(distance) < 1e-4)
    end = int(np.argmin(linear)) if not linear.all() else len(linear)
    measured = math.nan
    if end >= 5:
        slope = np.polyfit(np.arange(end), np.log(distance[:end]), 1)[0]
        measured = float(np.exp(slope))
    return Trial(
        expected=float(np.abs(motion.multipliers[0])),
        measured=measured,
        largest=float(distance.max()),
        last=float(distance[-1]),
    )


def judge(computed: Existence) -> list[Claim]:
    """Judge the figure as a whole, the solution quoted from it, and the motions of Fig. 5."""
    quoted = [judge_quoted(item) for item in QUOTED if item.figure == computed.figure]
    shown = [
        _judge_shown(computed.figure, motion.id, motion.system, motion.paper_says)
        for motion in _shown_in_figure_5(computed.n)
    ]
    return [_judge_counts(computed), *quoted, *shown]


def _shown_in_figure_5(n: int) -> list[Motion]:
    """Return the motions of n drive periods per orbit that the paper's Fig. 5 shows."""
    return [motion for motion in MOTIONS if motion.figure == 5 and motion.paper_says == f"{n}-1"]


# Judged and then marked in the figure.
@functools.cache
def _stable(system: System, n: int) -> PeriodicMotion:
    """Return the stable motion of n drive periods and one impact."""
    return next(motion for motion in periodic_motions(system, n) if motion.stable)


def _judge_counts(computed: Existence) -> Claim:
    """Compare the paper's stable solutions with the stable motions, one by one."""
    rows = computed.map.solutions
    paper, real = computed.stable_by_45, rows["stable"]
    both, missed = int((paper & real).sum()), int((real & ~paper).sum())
    verdict: Verdict = "open"
    confirmed = computed.returned == len(computed.stable) and computed.left == len(
        computed.unstable
    )
    if not (paper ^ real).any():
        verdict = "reproduced"
    elif confirmed and both < 0.5 * paper.sum():
        verdict = "refuted"
    over = " x ".join(f"{len(v)} values of {name}" for name, v in computed.map.grid.items())
    frequency, moment = computed.map.grid.values()
    undecided, empty = int(computed.map.undecided.sum()), int(computed.map.empty.sum())
    return Claim(
        id=f"{computed.figure}",
        figure=computed.figure,
        source=f"Han, Jin & Hu (2004), Fig. {computed.figure} and eqs. (42)-(45)",
        paper_says=f"{int(paper.sum())} stable {computed.n}-1 motions",
        found=f"{both} of them, and {missed} others",
        residual=None,
        reference={
            "label": f"{computed.returned} of {len(computed.stable)} return",
            "stable_returned": [computed.returned, len(computed.stable)],
            "unstable_left": [computed.left, len(computed.unstable)],
        },
        verdict=verdict,
        decided_by=(
            "admissibility and multipliers of each solution, and simulations from "
            f"{PERTURBATION:g} beside motions drawn at random: {computed.returned} of "
            f"{len(computed.stable)} stable ones are found again and {computed.left} of "
            f"{len(computed.unstable)} unstable ones left within {RETURNS} orbits"
        ),
        details=(
            f"{len(rows)} algebraic solutions with |x10| <= pi/2 over {over} (omega "
            f"{frequency[0]:g} to {frequency[-1]:g}, f1 {moment[0]:g} to {moment[-1]:g}), each "
            f"proved by intervals to be one, {undecided} intervals undecided, {empty} points "
            "without isolated solutions (whole turns of an undamped body); "
            f"{int(rows['admissible'].sum())} are admissible; of {int(paper.sum())} stable by "
            f"(45), {int((paper & rows['admissible']).sum())} are admissible and {both} are "
            f"stable motions; {int(real.sum())} motions are admissible and stable, {missed} of "
            "them unstable by (45)"
        ),
        command=_map_command(computed),
    )


def judge_quoted(item: Quoted) -> Claim:
    """Look at a solution that the paper quotes; simulate from its state."""
    n = PERIODS_PER_ORBIT[item.figure]
    motion = nearest(item.system, n, item.x10)
    x1, v1, v2, phase = motion.state
    # From the state that the paper gives as the one before an impact.
    system = item.system.replace(phase=phase)
    start = np.array([x1, v1, float(system.tip(x1)) - system.gap, v2])
    run = simulate(system, initial=start, periods=n)
    at_once = bool((run.impacts["time"] == 0.0).any())
    away = float(np.abs(run.stroboscopic[-1] - start).max())
    paper, size = criterion.verdict(motion)
    says = f"{item.paper_says} {n}-1 at x10 = {item.x10:.4f}"
    verdict: Verdict = "open"
    if motion.admissible:
        verdict = "reproduced" if motion.stable == (item.paper_says == "stable") else "refuted"
    elif not at_once and away > 1e-3:
        verdict = "refuted"
    return Claim(
        id=f"{item.figure} quoted",
        figure=item.figure,
        source="Han, Jin & Hu (2004), section 4.1, (omega, f1) = "
        f"({system.drive_frequency:g}, {system.moment_amplitude:g})",
        paper_says=says,
        found="a motion" if motion.admissible else "no motion",
        residual=motion.residual,
        reference={"label": f"simulated: off by {away:.2g}", "distance": away},
        verdict=verdict,
        decided_by=(
            f"{motion.why_not or 'admissible'}, and started in its state the bodies "
            f"{'collide' if at_once else 'separate without an impact'}"
        ),
        details=(
            f"after {n} drive "
            f"period{'s' if n > 1 else ''} they are {away:.2g} off it; the solution of (38) at "
            f"x10 = {x1:.10f} is {paper} by (45), largest eigenvalue "
            f"{size:.4g}; multipliers up to "
            f"{abs(motion.multipliers[0]):.4g}"
        ),
        command=_motions_command(item.system, n),
    )


def _judge_shown(figure: int, panel: str, system: System, label: str) -> Claim:
    """Apply the paper's criterion to a motion that its Fig. 5 shows as the long-term one."""
    n = PERIODS_PER_ORBIT[figure]
    motion = _stable(system, n)
    made = trial(motion)
    paper, size = criterion.verdict(motion)
    returned = made.last < 0.1 * PERTURBATION
    verdict: Verdict = "open"
    if returned:
        verdict = "reproduced" if paper == "stable" else "refuted"
    return Claim(
        id=f"{panel} by (45)",
        figure=figure,
        source=f"Han, Jin & Hu (2004), (42)-(45) for the motion of Fig. {panel[0]}({panel[1:]})",
        paper_says=f"{paper}, {size:.3f}",
        found=f"stable, {made.expected:.3f}",
        residual=motion.residual,
        reference={"label": f"simulated: {made.measured:.3f}", "factor": made.measured},
        verdict=verdict,
        decided_by=(
            f"Floquet multipliers up to {made.expected:.6f}, and from {PERTURBATION:g} beside the "
            f"{label} motion a simulation comes within {made.last:.1g} of it in {RETURNS} orbits"
        ),
        details=(
            f"that is by a factor of {made.measured:.4f} per orbit; the motion is at omega = "
            f"{system.drive_frequency:g}, f1 = {system.moment_amplitude:g}, with u = "
            f"{motion.approach_velocity:.4g}"
        ),
        command=_motions_command(system, n),
    )


def _arguments(system: System) -> str:
    given = system.to_dict().items()
    return ", ".join(f"{k}={v!r}" for k, v in given if isinstance(v, float) and v != 0.0)


def _motions_command(system: System, n: int) -> str:
    return (
        'python -c "import vibroimpact as vi; '
        f'[print(m, m.state) for m in vi.periodic_motions(vi.System({_arguments(system)}), {n})]"'
    )


def _map_command(computed: Existence) -> str:
    frequency, moment = computed.map.grid.values()
    return (
        'python -c "import numpy as np, vibroimpact as vi; print(vi.motion_map(vi.System('
        f"{_arguments(computed.map.system)}), {computed.n}, within=(-np.pi/2, np.pi/2), "
        f"drive_frequency=np.linspace({frequency[0]:g}, {frequency[-1]:g}, {len(frequency)}), "
        f'moment_amplitude=np.linspace({moment[0]:g}, {moment[-1]:g}, {len(moment)})))"'
    )


def draw(computed: Existence, claims: Sequence[Claim]) -> Page:
    """Draw the paper's figure on the left and the corrected one on the right."""
    slices = SLICES[computed.figure]
    page = Page(
        f"Fig. {computed.figure}: which period {computed.n}-1 motions exist and are stable; "
        f"{values(computed.map.system, _SHOWN)}, undamped, $\\mu = f_2 = 0$.\n"
        "Left: all solutions of the paper's equations, stability by its criterion (45). "
        "Right: those that are motions, stability by Floquet multipliers.\n"
        f"On the grid of (b) the paper's criterion gives {claims[0].paper_says}. "
        f"Found: {claims[0].found}.",
        rows=2 + len(slices),
        row_height=0.0,
        heights=[74.0, 50.0, *[46.0] * len(slices)],
    )
    # Every twentieth of a unit of omega, every fifth of one of f1, or fewer on a coarser grid.
    every = tuple(
        max(1, math.ceil(size / most))
        for size, most in zip(computed.map.shape, (141, 13), strict=True)
    )
    by_45 = (criterion.NAME, computed.stable_by_45)
    for ax, verdicts in zip(page.row(_SPACE_HEADING, projection="3d"), (by_45, None), strict=True):
        plot.motion_space(computed.map, criterion=verdicts, every=every, ax=ax)
        # The heading of the row says what they are.
        space: Any = ax
        for name, symbol in (("x", r"$\omega$"), ("y", "$f_1$"), ("z", _ANGLE)):
            getattr(space, f"set_{name}label")(symbol, labelpad=-6.0)
    for ax, verdicts in zip(
        page.row(
            "(b)  $\\omega$ on a logarithmic scale; coloured: a stable one; grey: unstable ones "
            f"only; white: none{_without_isolated(computed.map)}"
        ),
        (by_45, None),
        strict=True,
    ):
        plot.stability_map(computed.map, criterion=verdicts, ax=ax)
        _spread_low_frequencies(ax)
    for letter, moment in zip("cdefg", slices, strict=False):
        part = _closed_at_folds(computed.map.at(moment_amplitude=moment), moment)
        axes = page.row(f"({letter})  $f_1 = {moment:g}$")
        stable = criterion.is_stable(criterion.map_eigenvalues(part))
        for ax, verdicts in zip(axes, ((criterion.NAME, stable), None), strict=True):
            plot.motion_branches(part, criterion=verdicts, ax=ax)
            ax.set_ylabel(_ANGLE)
            _spread_low_frequencies(ax)
        _mark_named(computed, moment, axes)
    handles: list[Artist] = []
    for side, verdicts in (("left", by_45), ("right", None)):
        for handle in plot.motion_handles(computed.map, criterion=verdicts):
            handle.set_label(f"{side}: {handle.get_label()}")
            handles.append(handle)
    page.legend(handles)
    return page


def _spread_low_frequencies(ax: Axes) -> None:
    """Make the frequency axis logarithmic: towards 0 branches come ever closer, as 1/omega does."""
    low, high = ax.get_xlim()
    ax.set_xscale("log")
    ax.set_xlim(low, high)
    ax.set_xticks(_TICKS, [f"{tick:g}" for tick in _TICKS])
    ax.xaxis.set_minor_locator(NullLocator())


def _without_isolated(found: MotionMap) -> str:
    """Return at which frequencies there are no isolated solutions, for a heading."""
    everywhere = found.empty.reshape(found.shape).all(axis=1)
    frequencies = found.grid["drive_frequency"][everywhere]
    if not len(frequencies):
        return ""
    listed = ", ".join(f"{omega:g}" for omega in frequencies)
    return (
        f",\nas at $\\omega =$ {listed}, where an undamped body makes whole turns between impacts "
        "and no solution is isolated"
    )


def _closed_at_folds(part: MotionMap, moment: float) -> MotionMap:
    """Return the solutions at one moment amplitude, on a finer grid where branches turn or rise.

    Between two frequencies with different numbers of solutions a branch turns; without points in
    between it would have a gap there.
    """
    frequency = part.grid["drive_frequency"]
    places, x1 = part.solutions["point"], part.solutions["x1"]
    columns = [np.sort(x1[places == place]) for place in range(len(frequency))]
    grid = [frequency[:1]]
    for place, (left, right) in enumerate(pairwise(columns)):
        coarse = len(left) != len(right) or np.abs(left - right).max(initial=0.0) > _RISE
        steps = _FINER if coarse else 1
        grid.append(np.linspace(frequency[place], frequency[place + 1], steps + 1)[1:])
    return motion_map(
        part.system.replace(moment_amplitude=moment),
        part.n,
        within=WITHIN,
        drive_frequency=np.concatenate(grid),
    )


def _mark_named(computed: Existence, moment: float, axes: Sequence[Axes]) -> None:
    """Point at the quoted solution and at the motions of Fig. 5."""
    named = [(item.system, item.x10, "quoted") for item in QUOTED if item.figure == computed.figure]
    named += [
        (motion.system, _stable(motion.system, computed.n).state[0], f"Fig. {motion.id}")
        for motion in _shown_in_figure_5(computed.n)
    ]
    for system, place, text in named:
        if system.moment_amplitude != moment:
            continue
        for ax in axes:
            # Where there is room beside the branches.
            above, to_left = place < -math.pi / 8, place < 0.0
            height = 14 if above else -28 if text == "quoted" else -20
            ax.annotate(
                text,
                (system.drive_frequency, place),
                xytext=(-10 if to_left else 10, height),
                textcoords="offset points",
                ha="right" if to_left else "left",
                fontsize=8,
                arrowprops={
                    "arrowstyle": "-|>",
                    "color": "black",
                    "linewidth": 0.6,
                    "shrinkB": 3.0,
                },
            )
            # The ring lies around the point.
            ax.plot(
                system.drive_frequency,
                place,
                "o",
                color="black",
                markerfacecolor="none",
                markersize=5,
            )
