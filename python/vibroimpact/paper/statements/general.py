"""Section 4.2.1, Fig. 7, and what sections 4 and 5 say of all systems: damping and starts."""

import numpy as np

from ...atlas import bifurcation_diagram, lyapunov_spectrum
from ...simulation import simulate
from .. import evidence, lasting
from ..claims import Claim, Verdict
from ..parameters import INITIAL, KEEP, PERIODS, TRANSITIONS
from .diagrams import BY_ID, MOTION, NO_IMPACTS, changes, diagram, kinds, non_periodic
from .statement import Finding, stated

GALLERY = "gallery.md"
# Above this part of the frequencies a periodic motion needs no care.
MOST = 0.7


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
    """Start anew from a dozen states."""
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
    page="atlas.md",
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
    page="theory.md#5-chatter-lasting-contact-release",
    slow=True,
)
def low_frequencies() -> Claim:
    """Look for complete chatter and lasting contact."""
    (transition,) = [item for item in TRANSITIONS if item.id == "7c"]
    return lasting.evaluate(lasting.observe(transition))


@stated(
    "both-sections",
    "section 4.2.2, Figs. 7 and 8",
    "impact section and stroboscopic section both show m-n and non-periodic motions",
)
def both_sections() -> Finding:
    """Count the different points in either section of the named motions."""
    right, lines, total = 0, [], 0
    for motion in MOTION.values():
        run = simulate(motion.system, initial=INITIAL, periods=20 * PERIODS, keep=KEEP)
        if run.period.m is None or 2 * run.period.m > KEEP:
            continue
        total += 1
        impacts = _different(np.column_stack([run.impacts["x1"], run.impacts["v1_pre"]]))
        strobes = _different(run.stroboscopic)
        right += (strobes, impacts) == (run.period.m, run.period.n)
        lines.append(f"{run.label}: {strobes} and {impacts}")
    chaos = MOTION["9(2)"]
    run = simulate(chaos.system, initial=INITIAL, periods=PERIODS, keep=KEEP)
    many = _different(run.stroboscopic)
    verdict: Verdict = "refuted"
    if right == total and many == KEEP:
        verdict = "reproduced"
    return Finding(
        f"m and n points for {right} of {total} motions",
        verdict,
        f"different points of the stroboscopic and of the impact section: {'; '.join(lines)}; "
        f"Fig. 9(2), chaotic, has {many} in {KEEP} drive periods",
    )


def _different(points: np.ndarray) -> int:
    """Count points that are further apart than a settled orbit leaves them."""
    kept: list[np.ndarray] = []
    for point in points:
        if all(np.abs(point - other).max() > 1e-6 for other in kept):
            kept.append(point)
    return len(kept)


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
    verdict: Verdict = "open"
    if max(shares.values()) < MOST:
        verdict = "reproduced"
    elif max(undamped) < MOST < min(damped):
        verdict = "corrected"
    elif min(shares.values()) > MOST:
        verdict = "refuted"
    listed = ", ".join(f"Fig. {name} {share:.0%}" for name, share in shares.items())
    return Finding(
        f"undamped {max(undamped):.0%} are periodic, damped {min(damped):.0%} and more",
        verdict,
        f"part of the frequencies with impacts whose motion is periodic, from one and the same "
        f"start: {listed}. Without damping it takes care; with damping ratios of 0.01 and more "
        "most frequencies will do",
    )


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
