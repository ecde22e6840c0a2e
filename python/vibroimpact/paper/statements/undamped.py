"""Section 4.1, Figs. 4 to 6: diagram and motions without damping and friction."""

import numpy as np

from ...atlas import bifurcation_diagram
from ...orbits import PeriodicMotion, follow_motion, periodic_motions, stability_region
from ...simulation import simulate
from ...system import System
from ..claims import Verdict
from ..islands import FREQUENCY_RANGE, FROM_RESONANCE, MOMENT_RANGE, PATH, RESONANCE
from ..parameters import INITIAL, KEEP, PERIODS, paper_system
from .diagrams import MOTION, changes, diagram, kinds, non_periodic, span
from .model import coarse_map
from .statement import Finding, stated

# A motion occurs easily if it does at more than this part of the frequencies.
EASILY = 0.2
# How far in omega beyond a period doubling a cascade is looked for.
BEYOND = 0.02


@stated(
    "fig4",
    "Fig. 4 and section 4.1",
    "over omega there are periodic motions of many kinds, chaos, phase locking and bifurcations",
    figure=4,
    page="gallery.md",
    slow=True,
)
def phenomena() -> Finding:
    """Count labels."""
    made, found = diagram("4"), kinds("4")
    periodic = sorted(set(found[(made.m > 0) & (made.n > 0)].tolist()))
    chaotic, quasi = (int((found == name).sum()) for name in ("chaotic", "quasi-periodic"))
    locked = int(((made.m > 2) & (made.n > 0)).sum())
    verdict: Verdict = "open"
    if len(periodic) > 3 and chaotic and quasi and locked:
        verdict = "reproduced"
    elif len(periodic) < 2 or not chaotic:
        verdict = "refuted"
    return Finding(
        f"{len(periodic)} kinds of m-n, chaos at {chaotic / len(found):.0%}",
        verdict,
        f"at {len(found)} frequencies: {len(periodic)} different m-n motions with impacts, chaos "
        f"at {chaotic}, quasi-periodic motion with impacts at {quasi}, motions locked to more than "
        f"two drive periods at {locked}; the label changes {changes('4')} times",
    )


@stated(
    "cascade",
    "section 4.1, on Fig. 4",
    "some period-m motions double their period and become chaotic in narrow ranges of omega",
    figure=4,
    page="islands.md#the-islands-along-the-path-of-fig-4",
    slow=True,
)
def cascade() -> Finding:
    """Follow the 8-6 motion of Fig. 6(c) to its period doubling, and look beyond."""
    motion = simulate(MOTION["6c"].system, initial=INITIAL, periods=3000, keep=KEEP).refine()
    if not isinstance(motion, PeriodicMotion):
        return Finding("no motion found", "open", motion.reason)
    branch = follow_motion(motion, drive_frequency=(2.53, 2.6))
    stable = branch.values[branch.stable]
    doublings = [
        item.value
        for item in branch.of_kind("period_doubling")
        if abs(item.value - stable.max()) < 0.01
    ]
    if not doublings:
        return Finding("no period doubling", "refuted", f"stable from {stable.min():.6g} on")
    end = max(doublings)
    beyond = bifurcation_diagram(
        motion.system,
        initial=motion.initial,
        periods=6000,
        keep=200,
        drive_frequency=np.linspace(end + 1e-5, end + BEYOND, 120),
    )
    labels = beyond.label.tolist()
    double = labels.count("16-12")
    chaotic = labels.count("chaotic")
    verdict: Verdict = "open"
    if double and chaotic:
        verdict = "reproduced"
    elif not chaotic:
        verdict = "refuted"
    return Finding(
        f"8-6 doubles at omega = {end:.6f}, then chaos",
        verdict,
        f"the 8-6 motion of Fig. 6(c) is stable from omega = {stable.min():.6f} to its period "
        f"doubling at {end:.9f}; of {len(labels)} frequencies up to {BEYOND:g} beyond, {double} "
        f"show a 16-12 motion and {chaotic} chaos",
    )


@stated(
    "fig5-different",
    "section 4.1, Fig. 5",
    "the two 1-1 motions have different trajectories",
    figure=5,
)
def different() -> Finding:
    """Compare the phase portraits of Figs. 5(a) and 5(b)."""
    sizes = []
    for name in ("5a", "5b"):
        run = simulate(MOTION[name].system, initial=INITIAL, periods=3000, keep=1)
        t = run.final_state.time - np.linspace(0.0, run.system.drive_period, 400)
        sizes.append(np.ptp(run.trajectory(t), axis=0))
    apart = float(np.abs(sizes[0] - sizes[1]).max())
    verdict: Verdict = "reproduced" if apart > 0.1 else "refuted"
    one, other = (", ".join(f"{value:.2f}" for value in size) for size in sizes)
    return Finding(
        f"their extents differ by {apart:.2f}",
        verdict,
        f"widths of the orbits in x1, x1', x2, x2': {one} at omega = 1.25, {other} at 1.8",
    )


def _disturbed(system: System, by: float, random: np.random.Generator) -> System:
    """Change all parameters of a system by some relative errors."""
    names = ("mass_ratio", "frequency_ratio", "restitution", "gap", "drive_frequency")
    changes = {
        name: getattr(system, name) * (1.0 + by * float(random.uniform(-1.0, 1.0)))
        for name in (*names, "moment_amplitude")
    }
    return system.replace(**changes)


@stated(
    "uncertain",
    "section 4.1, on Figs. 2 and 3",
    "a start on a stable motion gives an uncertain result if parameters err a little",
    page="orbits.md#all-motions-with-one-impact",
    slow=True,
)
def uncertain() -> Finding:
    """Start on stable motions with parameters a little off."""
    by, random = 1e-4, np.random.default_rng(9)
    kept = {"motions": 0, "solutions": 0}
    tried = {"motions": 0, "solutions": 0}
    rows = coarse_map(1).solutions
    choices = {
        "motions": rows["stable"] & (rows["largest_multiplier"] < 0.995),
        "solutions": rows["paper_stable"],
    }
    for name, chosen in choices.items():
        for number in random.permutation(np.flatnonzero(chosen))[:30]:
            frequency, moment = (
                float(coarse_map(1).parameter(axis)[number]) for axis in coarse_map(1).grid
            )
            system = paper_system(drive_frequency=frequency, moment_amplitude=moment)
            x10 = float(rows["x1"][number])
            motion = min(
                periodic_motions(system, 1, within=(x10 - 0.01, x10 + 0.01)),
                key=lambda other: abs(other.state[0] - x10),
            )
            start = np.array(motion.initial)
            off = _disturbed(system, by, random)
            gap = float(np.sin(start[0]) - start[2] - off.gap)
            tried[name] += 1
            if gap <= 0.0:
                run = simulate(off, initial=start, periods=2000, keep=KEEP)
                kept[name] += run.label == "1-1"
    share = kept["motions"] / max(tried["motions"], 1)
    verdict: Verdict = "refuted" if share > 0.9 else "reproduced" if share < 0.5 else "corrected"
    return Finding(
        f"{kept['motions']} of {tried['motions']} stable motions stay",
        verdict,
        f"with all parameters changed by up to {by:g} of their values, {kept['motions']} of "
        f"{tried['motions']} 1-1 motions that are stable by their multipliers are kept over 2000 "
        f"drive periods; of the solutions that (45) calls stable {kept['solutions']} of "
        f"{tried['solutions']}: most of these are no motions at all",
    )


@stated(
    "one-two",
    "section 4.1, on Fig. 6",
    "stable 1-2 motions occur easily where the drive is slower than the natural frequency",
    figure=6,
    page="islands.md#the-islands-along-the-path-of-fig-4",
)
def one_two() -> Finding:
    """Count them below and above the oscillator's and the pendulum's frequency."""
    grid = np.linspace(0.2, 3.0, 561)
    below = above = 0
    size = [0, 0]
    where = []
    for moment in (1.0, 2.3):
        made = bifurcation_diagram(
            paper_system(moment_amplitude=moment),
            labels=False,
            initial=INITIAL,
            periods=PERIODS,
            keep=KEEP,
            drive_frequency=grid,
        )
        found = made.parameter[made.label == "1-2"]
        below += int((found < 1.0).sum())
        above += int((found > 2.0).sum())
        size[0] += int((grid < 1.0).sum())
        size[1] += int((grid > 2.0).sum())
        where.append(f"{len(found)} ({span(found)}) at f1 = {moment:g}")
    share = below / size[0]
    verdict: Verdict = "refuted"
    if share > EASILY:
        verdict = "reproduced"
    elif below and share > above / size[1]:
        verdict = "corrected"
    return Finding(
        f"they occur there, at {share:.0%} of the frequencies; above 2 at {above / size[1]:.0%}",
        verdict,
        f"of {len(grid)} frequencies from 0.2 to 3, from the paper's start, 1-2 motions are "
        f"reached at {'; '.join(where)}: {below} of {size[0]} below omega = 1, {above} of "
        f"{size[1]} above omega0 = 2",
    )


@stated(
    "sensitive",
    "section 4.1, on Fig. 6",
    "a tiny change of a parameter may change the kind or the stability of an m-n motion",
    figure=6,
    slow=True,
)
def sensitive() -> Finding:
    """Change one parameter at a time of the motions of Figs. 5 and 6."""
    lost: dict[float, int] = {}
    tried = 0
    for by in (1e-4, 1e-3, 1e-2):
        lost[by] = tried = 0
        for name in ("5a", "5b", "5c", "6a", "6b", "6c"):
            motion = MOTION[name]
            for parameter in (
                "mass_ratio",
                "frequency_ratio",
                "restitution",
                "gap",
                "drive_frequency",
                "moment_amplitude",
            ):
                for sign in (-1.0, 1.0):
                    value = getattr(motion.system, parameter) * (1.0 + sign * by)
                    run = simulate(
                        motion.system.replace(**{parameter: value}),
                        initial=INITIAL,
                        periods=3000,
                        keep=KEEP,
                    )
                    tried += 1
                    lost[by] += run.label != motion.paper_says
    verdict: Verdict = "open"
    if lost[1e-3]:
        verdict = "reproduced"
    elif lost[1e-2]:
        verdict = "corrected"
    else:
        verdict = "refuted"
    listed = ", ".join(f"{count} of {tried} at {by:g}" for by, count in lost.items())
    return Finding(
        f"another motion in {listed}",
        verdict,
        "one parameter of the motions of Figs. 5 and 6 changed by a part of its value, from the "
        f"paper's start, 3000 drive periods: another label in {listed}",
    )


@stated(
    "islands",
    "section 4.1",
    "periodic motions are isolated islands among ubiquitous non-periodic ones",
    page="islands.md",
    slow=True,
)
def islands() -> Finding:
    """Walk round the 1-1 motion of Fig. 5(b) in the plane of omega and f1."""
    motion = simulate(MOTION["5b"].system, initial=INITIAL, periods=3000, keep=KEEP).refine()
    if not isinstance(motion, PeriodicMotion):
        return Finding("no motion found", "open", motion.reason)
    region = stability_region(
        motion,
        max_points=150,
        drive_frequency=(RESONANCE + FROM_RESONANCE, FREQUENCY_RANGE[1]),
        moment_amplitude=MOMENT_RANGE,
    )
    crossings = sorted(item.value for item in region.crossings(moment_amplitude=PATH))
    pieces = len(crossings) // 2
    impacting = kinds("4") != "no impacts"
    periodic = float(((diagram("4").m > 0) & impacting).sum() / impacting.sum())
    verdict: Verdict = "open"
    if region.closed:
        verdict = "corrected" if pieces > 1 else "reproduced"
    return Finding(
        f"{pieces} 'islands' along Fig. 4 are one region of the plane",
        verdict,
        f"the region of the 1-1 motion of Fig. 5(b) over omega and f1 is "
        f"{'closed' if region.closed else 'not closed'}, and f1 = 1 cuts it at omega = "
        f"{', '.join(f'{value:.4f}' for value in crossings)}: {pieces} pieces along Fig. 4 are "
        f"one; of the motions with impacts along Fig. 4 {periodic:.0%} are periodic, "
        f"{non_periodic('4').sum()} frequencies are not",
    )
