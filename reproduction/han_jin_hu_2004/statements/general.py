"""Section 4.2.1, Fig. 7, and what sections 4 and 5 say of all systems: damping and starts."""

import numpy as np
from numpy.typing import NDArray

from vibroimpact import bifurcation_diagram, lyapunov_spectrum, simulate

from .. import evidence, sustained_contact
from ..claims import Claim, Verdict
from ..parameters import INITIAL, KEEP, PERIODS, TRANSITIONS
from .diagrams import BY_ID, MOTION, NO_IMPACTS, changes, diagram, kinds, non_periodic
from .statement import Finding, stated

GALLERY = "gallery.md"
# If more than this part of the choices lead to it, no care is needed.
MOST = 0.5
# "Mainly" means at least this part.
MAINLY = 0.9


@stated(
    "settled",
    "section 4",
    "600 drive periods lead to the steady motion, the last 100 show it",
)
def settled() -> Finding:
    """Compare with ten times as many."""
    labels, residuals = [], []
    for motion in MOTION.values():
        short, long = (
            simulate(motion.system, initial=INITIAL, periods=periods, keep=KEEP)
            for periods in (PERIODS, 10 * PERIODS)
        )
        labels.append(short.label == long.label)
        if short.period.m is not None:
            residuals.append(short.period.residual)
    grid = np.linspace(0.2, 4.0, 191)
    pair = [
        bifurcation_diagram(
            BY_ID["4"].system, initial=INITIAL, periods=periods, keep=KEEP, drive_frequency=grid
        ).label
        for periods in (PERIODS, 10 * PERIODS)
    ]
    share = float((pair[0] == pair[1]).mean())
    verdict: Verdict = "refuted"
    if all(labels) and share > 0.5:
        verdict = "reproduced" if share == 1.0 and max(residuals) < 1e-6 else "corrected"
    return Finding(
        f"labels yes, states not: they still move by up to {max(residuals):.0e}",
        verdict,
        f"after 6000 drive periods {sum(labels)} of {len(labels)} named motions and {share:.0%} of "
        f"{len(grid)} frequencies of Fig. 4 have the label they had after 600; but undamped "
        f"motions converge slowly: after 600 periods the named ones still change by up to "
        f"{max(residuals):.2g} from orbit to orbit",
    )


@stated(
    "insensitive",
    "section 4.2.1",
    "with damping the long-term motion does not depend on the start, unlike without",
    figure=7,
    page="basins.md",
    slow=True,
)
def insensitive() -> Finding:
    """Start again from a dozen states."""
    starts = evidence.random_starts(12)
    grid = np.linspace(0.3, 2.9, 53)
    single: dict[str, float] = {}
    for name in ("4", "7a", "7b"):
        made = bifurcation_diagram(
            BY_ID[name].system,
            initial=starts,
            periods=2000,
            keep=KEEP,
            labels=False,
            drive_frequency=grid,
        )
        labels = made.label.reshape(len(starts), -1)
        single[name] = float(np.mean((labels == labels[0]).all(axis=0)))
    most, least = max(single["7a"], single["7b"]), single["4"]
    verdict: Verdict = "refuted"
    if min(single["7a"], single["7b"]) == 1.0 and least < 1.0:
        verdict = "reproduced"
    elif most > least:
        verdict = "corrected"
    return Finding(
        f"mostly: one motion at {single['7b']:.0%} of the frequencies, undamped {least:.0%}",
        verdict,
        f"{len(starts)} random starts end on motions of one label at {single['4']:.0%} of "
        f"{len(grid)} frequencies without damping, {single['7a']:.0%} with zeta = 0.01 (Fig. 7(a)) "
        f"and {single['7b']:.0%} with 0.1 (Fig. 7(b)); at the others motions coexist, which "
        "damping does not rule out",
    )


@stated(
    "drive-decides",
    "section 4.2.1",
    "with damping, frequency and amplitude of the drive mainly decide the long-term motion",
    figure=7,
    page="basins.md",
    slow=True,
)
def drive_decides() -> Finding:
    """See how often the most frequent motion is reached: at one drive, and over all drives."""
    starts = evidence.random_starts(12)
    grid = np.linspace(0.3, 2.9, 53)
    at_drive: dict[str, float] = {}
    over_all: dict[str, float] = {}
    for name in ("4", "7a", "7b", "7c"):
        tables = []
        for factor in (0.75, 1.0, 1.25):
            base = BY_ID[name].system
            made = bifurcation_diagram(
                base.replace(
                    moment_amplitude=factor * base.moment_amplitude,
                    force_amplitude=factor * base.force_amplitude,
                ),
                labels=False,
                initial=starts,
                periods=2000,
                keep=KEEP,
                drive_frequency=grid,
            )
            tables.append(made.label.reshape(len(starts), -1))
        labels = np.hstack(tables)
        at_drive[name] = float(np.mean([most_frequent(column) for column in labels.T]))
        over_all[name] = most_frequent(labels)
    damped = ("7a", "7b", "7c")
    least = min(at_drive[name] for name in damped)
    spread = max(over_all[name] for name in damped)
    verdict: Verdict = "refuted"
    if least > spread:
        verdict = "reproduced" if least > MAINLY > spread else "corrected"
    return Finding(
        f"{least:.0%} of starts and more agree at one drive, {spread:.0%} over all drives",
        verdict,
        f"part of {len(starts)} random starts on the most frequent motion, at each of {len(grid)} "
        "frequencies and three amplitudes (3/4, 1 and 5/4 of the figure's), in the mean, and over "
        "all of them: "
        + ", ".join(
            f"Fig. {name} {at_drive[name]:.1%} and {over_all[name]:.1%}" for name in at_drive
        )
        + "; the first without damping",
    )


def most_frequent(labels: NDArray[np.str_]) -> float:
    """Part of labels that the most frequent one makes up."""
    counts = np.unique(labels, return_counts=True)[1]
    return float(counts.max() / counts.sum())


@stated(
    "damping-orders",
    "section 4.2.1, Figs. 7(a) and 7(b)",
    "most non-periodic motions become periodic as damping grows from 0.01 to 0.1",
    figure=7,
    page=GALLERY,
)
def damping_orders() -> Finding:
    """Count them."""
    before = non_periodic("7a")
    after = diagram("7b").m[before] > 0
    share = float(after.mean())
    verdict: Verdict = "reproduced" if share > 0.5 else "refuted"
    return Finding(
        f"{int(after.sum())} of {int(before.sum())} do",
        verdict,
        f"of {len(before)} frequencies {int(before.sum())} show non-periodic motion with impacts "
        f"in Fig. 7(a); in Fig. 7(b) {int(after.sum())} of these are periodic",
    )


@stated(
    "damping-calms",
    "section 4.2.1, Fig. 7",
    "many bifurcations disappear as damping grows",
    figure=7,
    page=GALLERY,
)
def damping_calms() -> Finding:
    """Count changes of the label along the diagrams."""
    counts = [changes(name) for name in ("4", "7a", "7b")]
    verdict: Verdict = "reproduced" if counts[0] > counts[1] > counts[2] else "refuted"
    return Finding(
        f"{counts[0]}, {counts[1]}, {counts[2]} changes of the motion",
        verdict,
        f"along {len(kinds('4'))} frequencies the motion changes {counts[0]} times without damping "
        f"(Fig. 4), {counts[1]} times with zeta = 0.01 (Fig. 7(a)), {counts[2]} times with 0.1 "
        "(Fig. 7(b))",
    )


@stated(
    "adjust",
    "section 4.2.1",
    "wanted periodic impacts can be had by adjusting damping and excitation",
    figure=7,
    page="sweeps.md",
    slow=True,
)
def adjust() -> Finding:
    """Look for 1-1 motions at each frequency over a few dampings and amplitudes."""
    grid = np.linspace(0.5, 2.5, 41)
    reached = np.zeros(len(grid), dtype=bool)
    alone = np.zeros(len(grid), dtype=bool)
    for damping in (0.0, 0.01, 0.05, 0.1):
        for force in (0.0, 0.5, 1.0, 1.5):
            made = bifurcation_diagram(
                BY_ID["4"].system.replace(damping=(damping, damping), force_amplitude=force),
                initial=INITIAL,
                periods=PERIODS,
                keep=KEEP,
                labels=False,
                drive_frequency=grid,
            )
            reached |= made.label == "1-1"
            if damping == force == 0.0:
                alone = made.label == "1-1"
    share = float(reached.mean())
    verdict: Verdict = "reproduced" if share > 0.9 else "corrected"
    if share <= float(alone.mean()):
        verdict = "refuted"
    return Finding(
        f"a 1-1 motion at {share:.0%} of the frequencies",
        verdict,
        f"from the paper's start a 1-1 motion is reached at {alone.mean():.0%} of {len(grid)} "
        f"frequencies from 0.5 to 2.5 in Fig. 4's system, and at {share:.0%} with one of 4 damping "
        "ratios up to 0.1 and 4 amplitudes f2 up to 1.5",
    )


@stated(
    "force-stirs",
    "section 4.2.1, Fig. 7(c)",
    "a larger f2 makes the transitions more complex and the unstable regions larger",
    figure=7,
    page=GALLERY,
    slow=True,
)
def force_stirs() -> Finding:
    """Count changes of the label, and frequencies without a period."""
    counts = [changes(name) for name in ("7b", "7c")]
    restless = [int(non_periodic(name).sum()) for name in ("7b", "7c")]
    verdict: Verdict = "refuted"
    if counts[1] > counts[0] and restless[1] > restless[0]:
        verdict = "reproduced"
    return Finding(
        f"changes {counts[0]} to {counts[1]}, non-periodic {restless[0]} to {restless[1]}",
        verdict,
        f"from f2 = 0.5 to 1.5 (Figs. 7(b), (c)), along {len(kinds('7b'))} frequencies, the motion "
        f"changes {counts[1]} times in place of {counts[0]}, and {restless[1]} frequencies in "
        f"place of {restless[0]} have non-periodic motion with impacts",
    )


@stated(
    "fig7c-low",
    "section 3 and Fig. 7(c), low frequencies",
    "impacts and free flights are all there is",
    figure=7,
    page="theory.md#5-chatter-sustained-contact-release",
    slow=True,
)
def low_frequencies() -> Claim:
    """Look for complete chatter and sustained contact."""
    (transition,) = [item for item in TRANSITIONS if item.id == "7c"]
    return sustained_contact.evaluate(sustained_contact.observe(transition))


@stated(
    "decoupled",
    "section 4.2.2",
    "without impacts the bodies move periodically, or quasi-periodically where undamped",
)
def decoupled() -> Finding:
    """Simulate both kinds with a gap that is never closed."""
    damped, undamped = (
        BY_ID[name].system.replace(gap=50.0, drive_frequency=2.5**0.5) for name in ("7a", "4")
    )
    labels = [
        simulate(system, initial=INITIAL, periods=6000, keep=KEEP).label
        for system in (damped, undamped)
    ]
    verdict: Verdict = "reproduced" if labels == ["1-0", "quasi-periodic"] else "refuted"
    return Finding(
        f"{labels[0]} with damping, {labels[1]} without",
        verdict,
        f"at omega = sqrt(2.5), no contact: with zeta = 0.01 the motion is {labels[0]}, without "
        f"damping {labels[1]}",
    )


@stated(
    "careful",
    "section 5",
    "parameters and start must be chosen with care for a stable periodic motion",
    page=GALLERY,
    slow=True,
)
def careful() -> Finding:
    """See how often the motions with impacts of the diagrams are periodic."""
    shares = {}
    for transition in TRANSITIONS:
        with_impacts = kinds(transition.id) != NO_IMPACTS
        periodic = diagram(transition.id).m > 0
        shares[transition.id] = float(periodic[with_impacts].mean())
    undamped = [shares[name] for name in ("4", "8a")]
    damped = [share for name, share in shares.items() if name not in ("4", "8a")]
    listed = ", ".join(f"Fig. {name} {share:.0%}" for name, share in shares.items())
    return Finding(
        f"undamped {min(undamped):.0%} and more are periodic, damped {min(damped):.0%} and more",
        with_care(undamped, damped),
        f"part of the frequencies with impacts whose motion is periodic, from one and the same "
        f"start: {listed}. What more than {MOST:.0%} of the frequencies lead to takes no careful "
        "choice; a motion of a given label may",
    )


def with_care(undamped: list[float], damped: list[float]) -> Verdict:
    """Judge "must be chosen with care" by how often a choice at random is periodic."""
    if max(*undamped, *damped) < MOST:
        return "reproduced"
    if min(*undamped, *damped) > MOST:
        return "refuted"
    return "corrected" if max(undamped) < MOST < min(damped) else "open"


@stated(
    "rich",
    "section 5",
    "transitions of stability, bifurcations and chaos occur",
    page=GALLERY,
    slow=True,
)
def rich() -> Finding:
    """Measure the exponent of Fig. 9(2), and count changes."""
    spectrum = lyapunov_spectrum(MOTION["9(2)"].system, initial=INITIAL)
    largest, error = float(spectrum.exponents[0]), float(spectrum.error[0])
    total = sum(changes(transition.id) for transition in TRANSITIONS)
    verdict: Verdict = "reproduced" if largest > 5 * error and total > 10 else "refuted"
    return Finding(
        f"largest exponent {largest:.4f} +- {error:.1g} in Fig. 9(2)",
        verdict,
        f"the motion of Fig. 9(2) has a largest Lyapunov exponent of {largest:.4f} +- {error:.2g} "
        f"per unit time; along the seven diagrams the motion changes {total} times",
    )
