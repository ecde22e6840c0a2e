"""Section 4.2.2, Figs. 8 to 10: what friction changes, and the sporadic impacts."""

import itertools
from collections.abc import Collection, Sequence
from functools import cache

import numpy as np

from vibroimpact import Diagram, PeriodicMotion, bifurcation_diagram, simulate

from .. import evidence
from ..claims import Verdict
from ..parameters import ENLARGED_RANGE, FREQUENCY_RANGE, INITIAL, KEEP, PERIODS
from .diagrams import BY_ID, MOTION, diagram, kinds, same, span
from .samples import states_before
from .statement import Finding, Statement, stated

ERRATA = "theory.md#8-errata-of-the-paper"
GALLERY = "gallery.md"
LAW = "theory.md#4-impact"
# Half-width of "near" in omega.
NEAR = 0.1


@stated(
    "fig8a",
    "section 4.2.2, Fig. 8(a)",
    "with friction the same kinds of motion appear as in Fig. 4",
    figure=8,
    page=GALLERY,
)
def similar() -> Finding:
    """Count labels of both."""
    counts = {}
    for name in ("4", "8a"):
        made, found = diagram(name), kinds(name)
        periodic = int(((made.m > 0) & (made.n != 0)).sum())
        counts[name] = (periodic, *(int((found == k).sum()) for k in ("chaotic", "quasi-periodic")))
    verdict: Verdict = "reproduced" if min(min(row) for row in counts.values()) > 0 else "refuted"
    listed = "; ".join(
        f"Fig. {name}: periodic {row[0]}, chaotic {row[1]}, quasi-periodic {row[2]}"
        for name, row in counts.items()
    )
    return Finding(
        "periodic, quasi-periodic and chaotic in both",
        verdict,
        f"motions with impacts at {len(kinds('4'))} frequencies: {listed}",
    )


@cache
def _fine(law: str) -> Diagram:
    """Fig. 8(a) on a fine grid, without labels."""
    return bifurcation_diagram(
        BY_ID["8a"].system.replace(law=law),
        initial=INITIAL,
        periods=PERIODS,
        keep=KEEP,
        labels=False,
        drive_frequency=np.linspace(*FREQUENCY_RANGE, 8001),
    )


@cache
def _followed() -> Diagram:
    """The range of Fig. 9(3), each motion followed from its neighbour, up and down."""
    return bifurcation_diagram(
        BY_ID["8a"].system,
        initial=INITIAL,
        periods=PERIODS,
        keep=KEEP,
        labels=False,
        start=["forward", "backward"],
        drive_frequency=np.linspace(*ENLARGED_RANGE, 2001),
    )


def _confirmed(made: Diagram, label: str, *, fresh: bool) -> list[float]:
    """Return up to eight frequencies of a label at which it is that of a stable motion.

    A run ten times as long must keep it, and Newton's method must find a stable motion there.
    """
    places = np.flatnonzero(made.label == label)
    kept = []
    for place in places[np.unique(np.linspace(0, len(places) - 1, 8).astype(int))]:
        omega = float(made.parameter[place])
        run = simulate(
            made.system.replace(drive_frequency=omega),
            initial=INITIAL if fresh else made.final_states[place],
            periods=10 * PERIODS,
            keep=KEEP,
        )
        motion = run.refine() if run.label == label else None
        if isinstance(motion, PeriodicMotion) and motion.label == label and motion.stable:
            kept.append(omega)
    return kept


def named_at(label: str) -> dict[float, str]:
    """Return where the paper names a motion of this label in Fig. 8(a)'s system, and what is there.

    The second is the label from the paper's start, by drive frequency.
    """
    base, there = BY_ID["8a"].system, {}
    for motion in MOTION.values():
        omega = motion.system.drive_frequency
        if motion.paper_says == label and motion.system == base.replace(drive_frequency=omega):
            run = simulate(motion.system, initial=INITIAL, periods=PERIODS, keep=KEEP)
            there[omega] = run.label
    return there


def observed(label: str, *, fresh: bool, other: bool, there: Collection[str]) -> Verdict:
    """Judge that a motion is observed.

    Parameters
    ----------
    label
        Its label.
    fresh, other
        Whether it is reached from the paper's start, or from another one.
    there
        What is reached from the paper's start where the paper names it.
    """
    if not (fresh or other):
        return "refuted"
    return "reproduced" if fresh and all(found == label for found in there) else "corrected"


def _observed(label: str) -> Statement:
    @stated(
        f"fig8a-{label}",
        "section 4.2.2, Fig. 8(a), enlarged",
        f"a period {label} motion is observed",
        figure=8,
        page="coexistence.md",
        slow=True,
    )
    def judge() -> Finding:
        made = _fine("poisson")
        fresh = _confirmed(made, label, fresh=True) if (made.label == label).any() else []
        here = _followed()
        other = _confirmed(here, label, fresh=False) if (here.label == label).any() else []
        printed = _fine("paper")
        literal = printed.parameter[printed.label == label]
        there = named_at(label)
        found = "nowhere"
        if fresh:
            found = f"omega = {fresh[0]:.6g} to {fresh[-1]:.6g}"
        elif other:
            found = f"omega = {min(other):.6g} to {max(other):.6g}, from other starts"
        at = "the paper names no frequency of it, so that any will do"
        if there:
            at = ", ".join(f"{name} at {omega:g}" for omega, name in there.items())
            found += f"; {at}"
            at = f"where the paper names it, there is {at} from its start"
        return Finding(
            found,
            observed(label, fresh=bool(fresh), other=bool(other), there=there.values()),
            f"of {len(made)} frequencies from the paper's start {int((made.label == label).sum())} "
            f"have this label, and {len(fresh)} of those tried keep it over 6000 drive periods, on "
            f"a stable motion of this label (by Newton's method); {at}; of "
            f"motions followed up and down from {ENLARGED_RANGE[0]:g} to {ENLARGED_RANGE[1]:g}, "
            f"{int((here.label == label).sum())} of {len(here)}, {len(other)} of those tried keep "
            f"it; the law as printed, with the signed sine, gives it from the paper's start at "
            f"{len(literal)} frequencies ({span(literal)})",
        )

    return judge


OBSERVED = {label: _observed(label) for label in ("2-2", "6-6", "4-5", "8-10")}


@stated(
    "friction-some",
    "section 4.2.2, Figs. 8(b), (c)",
    "friction changes stability in places, and makes regions of periodic motion larger or smaller",
    figure=8,
    page=GALLERY,
)
def some_influence() -> Finding:
    """Compare the widths of the most frequent motions."""
    widths = {
        label: [int((kinds(name) == label).sum()) for name in ("7a", "8b", "8c")]
        for label in ("1-1", "1-2", "2-1", "2-2")
    }
    larger = [label for label, row in widths.items() if row[2] > row[0]]
    smaller = [label for label, row in widths.items() if row[2] < row[0]]
    verdict: Verdict = "reproduced" if larger and smaller else "refuted"
    listed = "; ".join(f"{label} {', '.join(map(str, row))}" for label, row in widths.items())
    return Finding(
        f"larger: {', '.join(larger)}; smaller: {', '.join(smaller)}",
        verdict,
        f"number of frequencies (0.01 apart) in Figs. 7(a), 8(b), 8(c), mu = 0, 0.4, 0.8: {listed}",
    )


@cache
def _near(name: str, omega: float, law: str = "poisson") -> Diagram:
    return bifurcation_diagram(
        BY_ID[name].system.replace(law=law),
        initial=INITIAL,
        periods=PERIODS,
        keep=KEEP,
        labels=False,
        drive_frequency=np.linspace(omega - NEAR, omega + NEAR, 81),
    )


def _shares(label: str, omega: float, law: str = "poisson") -> list[float]:
    """Part of the frequencies near omega with this label, for Figs. 7(a), 8(b), 8(c)."""
    return [float((_near(name, omega, law).label == label).mean()) for name in ("7a", "8b", "8c")]


def is_new(before: float, after: Sequence[float]) -> Verdict:
    """Judge that a motion is new with friction by its shares without and with.

    Refuted as well where it is there without friction, and as common as with.
    """
    if max(after) == 0 or before >= max(after):
        return "refuted"
    if min(after) == 0:
        return "open"
    return "reproduced" if before == 0 else "corrected"


def _influence(label: str, omega: float, *, appears: bool) -> Statement:
    change = "is new with" if appears else "disappears with"

    @stated(
        f"fig8-{label}-{omega:g}",
        "section 4.2.2, Figs. 7(a), 8(b), 8(c)",
        f"the stable {label} motion near omega = {omega:g} {change} friction",
        figure=8,
        page=LAW,
    )
    def judge() -> Finding:
        shares, printed = _shares(label, omega), _shares(label, omega, "paper")
        before, *after = shares
        verdict: Verdict = "open"
        if appears:
            verdict = is_new(before, after)
        elif before > 0:
            if max(after) == 0:
                verdict = "reproduced"
            elif min(after) > 0:
                verdict = "refuted"
        failed = [
            int((_near(name, omega, "paper").status == "law_failed").sum())
            for name in ("7a", "8b", "8c")
        ]
        listed, literal = (", ".join(f"{share:.0%}" for share in row) for row in (shares, printed))
        return Finding(
            f"{listed} of the frequencies nearby (mu = 0, 0.4, 0.8)",
            verdict,
            f"of 81 frequencies within {NEAR:g} of {omega:g}, {listed} have it at mu = 0, 0.4, 0.8 "
            f"(Figs. 7(a), 8(b), 8(c)); under the law as printed {literal}, and runs fail at "
            f"{', '.join(map(str, failed))} of the 81, where friction of the printed sign drives "
            "the slip (E1)",
        )

    return judge


GONE_11 = _influence("1-1", 1.4, appears=False)
GONE_21 = _influence("2-1", 2.7, appears=False)
NEW_11 = _influence("1-1", 2.2, appears=True)


@stated(
    "friction-less",
    "section 4.2.2",
    "friction matters less than damping: most motions stay as they are when it varies",
    figure=8,
    page=GALLERY,
)
def less_than_damping() -> Finding:
    """Compare the parts of the frequencies at which the motion changes."""
    friction = {
        f"{one} and {other}": 1.0 - same(one, other)
        for one, other in (("4", "8a"), ("7a", "8b"), ("7a", "8c"))
    }
    damping = {
        f"{one} and {other}": 1.0 - same(one, other) for one, other in (("4", "7a"), ("7a", "7b"))
    }
    most = max(friction.values())
    verdict: Verdict = "refuted"
    if most < 0.5:
        verdict = "reproduced" if most < min(damping.values()) else "corrected"
    listed = [
        ", ".join(f"Figs. {name}: {share:.0%}" for name, share in changed.items())
        for changed in (friction, damping)
    ]
    return Finding(
        "most stay, but zeta 0.01 to 0.1 changes no more than mu 0 to 0.8"
        if verdict == "corrected"
        else f"at most {most:.0%} change",
        verdict,
        f"part of {len(kinds('4'))} frequencies at which the motion is another one: with friction "
        f"{listed[0]}; with damping {listed[1]} (Fig. 4 to 7(a) also adds f2 = 0.5)",
    )


@stated(
    "damping-large",
    "section 4.2.2",
    "damping changes the behaviour in large regions",
    figure=8,
    page=GALLERY,
)
def damping_large() -> Finding:
    """Measure the ranges of frequency in which it is another one throughout."""
    lines, widest = [], []
    for one, other in (("4", "7a"), ("7a", "7b")):
        changed = kinds(one) != kinds(other)
        runs = [sum(1 for _ in part) for differs, part in itertools.groupby(changed) if differs]
        widest.append(0.01 * max(runs, default=0))
        lines.append(
            f"Figs. {one} and {other}: {changed.mean():.0%}, the widest range without an exception "
            f"{widest[-1]:.2f} wide"
        )
    verdict: Verdict = "reproduced" if min(widest) > NEAR else "refuted"
    return Finding(
        f"ranges of omega up to {min(widest):.2f} and {max(widest):.2f} wide",
        verdict,
        f"part of {len(kinds('4'))} frequencies, 0.01 apart, whose motion is another one: "
        f"{'; '.join(lines)} (large: wider than {NEAR:g})",
    )


@stated(
    "fig9-typical",
    "section 4.2.2, on Fig. 9",
    "Fig. 9 shows several typical periodic motions",
    figure=9,
    page=ERRATA,
)
def typical() -> Finding:
    """Look at the four motions, beside what the captions call them."""
    motions = [motion for motion in MOTION.values() if motion.figure == 9]
    found = [
        simulate(motion.system, initial=INITIAL, periods=20_000, keep=2000) for motion in motions
    ]
    labels = [run.label for run in found]
    periodic = sum(run.period.m is not None for run in found)
    captions = sum(motion.paper_says != "chaotic" for motion in motions)
    verdict: Verdict = "refuted"
    if periodic:
        verdict = "reproduced" if periodic == captions == len(motions) else "corrected"
    return Finding(
        f"{periodic} of {len(motions)} are periodic, {captions} by the captions",
        verdict,
        f"from the paper's start, after 20,000 drive periods: {', '.join(labels)}; the captions "
        f"say {', '.join(motion.paper_says for motion in motions)}",
    )


@stated(
    "fig10-sporadic",
    "section 4.2.2, Fig. 10",
    "without damping impacts can be sporadic",
    figure=10,
)
def sporadic() -> Finding:
    """Look at the waits between impacts, in drive periods."""
    run = simulate(MOTION["10"].system, initial=INITIAL, periods=PERIODS)
    waits = np.diff(run.impacts["time"]) / run.system.drive_period
    verdict: Verdict = "refuted"
    if len(waits) > 1 and np.median(waits) > 10.0 and np.ptp(waits) > 10.0:
        verdict = "reproduced"
    return Finding(
        f"{run.impact_count} impacts in {PERIODS} drive periods",
        verdict,
        f"{run.impact_count} impacts in {PERIODS} drive periods, {waits.min():.3g} to "
        f"{waits.max():.3g} periods apart (sporadic: most more than ten, and not the same)",
    )


@stated(
    "fig10-400",
    "caption of Fig. 10(a)",
    "t = 0 to 400 shows the sporadic impacts, ahead of a steady motion",
    figure=10,
    page=ERRATA,
)
def shown_range() -> Finding:
    """List the impacts in that time, and the next ones."""
    end = 400.0
    run = simulate(MOTION["10"].system, initial=INITIAL, periods=PERIODS)
    times = run.impacts["time"]
    before, after = times[times <= end], times[times > end]
    verdict: Verdict = "refuted"
    if len(before):
        verdict = "corrected" if len(after) else "reproduced"
    return Finding(
        f"{len(before)} impacts by t = 400, but {len(after)} more by {PERIODS} drive periods",
        verdict,
        f"impacts at t = {', '.join(f'{t:.2f}' for t in before)}, none from there to 400, then at "
        f"{', '.join(f'{t:.2f}' for t in after)}: the range shows sporadic impacts, and a quiet "
        f"stretch that is not yet the end of them (E11)",
    )


@stated(
    "fig10-mass",
    "section 4.2.2, Fig. 10",
    "after the impacts the mass has reached a steady motion",
    figure=10,
    page=ERRATA,
)
def mass_settles() -> Finding:
    """Follow the amplitude of the mass, which moves freely between impacts."""
    horizons = (600, 2000, 5000, 20000)
    run = simulate(MOTION["10"].system, initial=INITIAL, periods=horizons[-1])
    end = run.stroboscopic
    # Free undamped motion without force: x2^2 + x2'^2 stays until the next impact.
    amplitude = np.hypot(end[:, 2], end[:, 3])
    values = [float(amplitude[horizon - 1]) for horizon in horizons]
    moved = [float(abs(b - a)) for a, b in itertools.pairwise(values)]
    verdict: Verdict = "reproduced" if max(moved) == 0.0 else "refuted"
    return Finding(
        f"its amplitude still changes, by {moved[-1]:.1g} at last",
        verdict,
        "amplitude of the mass after "
        + ", ".join(f"{h}: {v:.6f}" for h, v in zip(horizons, values, strict=True))
        + " drive periods: every impact changes it (E11)",
    )


@stated(
    "fig10-pendulum",
    "section 4.2.2, Fig. 10",
    "the pendulum goes on quasi-periodically for ever",
    figure=10,
    page=ERRATA,
)
def pendulum_repeats() -> Finding:
    """Look for a recurrence of the free motion."""
    system = MOTION["10"].system
    repeats = evidence.recurrence(system)
    irrational = system.replace(drive_frequency=2.98 + 1e-3 * 2.0**0.5)
    other = evidence.recurrence(irrational)
    verdict: Verdict = "open"
    if repeats is None:
        verdict = "reproduced"
    elif other is None:
        verdict = "corrected"
    return Finding(
        f"free, it repeats after {repeats} drive periods",
        verdict,
        f"omega0/omega = 2/2.98 is rational: between impacts the free motion repeats after "
        f"{repeats} drive periods; only an irrational ratio would make it quasi-periodic",
    )


@stated(
    "fig10-graze",
    "section 4.2.2, Fig. 10",
    "later contacts are grazes, which transfer no energy",
    figure=10,
    page=ERRATA,
)
def grazes() -> Finding:
    """Look at the energy that impacts take."""
    run = simulate(MOTION["10"].system, initial=INITIAL, periods=20000)
    u = run.system.gap_rate(states_before(run.impacts))
    period = run.impacts["period"]
    losses = run.impacts["energy_loss"]
    late = losses[period >= 600]
    verdict: Verdict = "open"
    if len(late) == 0 or late.max() == 0.0:
        verdict = "reproduced"
    elif late.min() > 0.0:
        verdict = "refuted"
    return Finding(
        f"{len(run.grazes)} grazes; every later impact takes energy",
        verdict,
        f"of the contacts in 20,000 drive periods {len(run.grazes)} are grazes; the {len(late)} "
        f"impacts after period 600 take energies of {float(late.min()):.2g} to "
        f"{float(late.max()):.2g}, {float(late.sum()):.2g} in all, at approach velocities up to "
        f"{float(u[period >= 600].max(initial=0.0)):.2g}",
    )
