"""Section 4.1, Figs. 4 to 6: diagram and motions without damping and friction."""

import numpy as np

from vibroimpact import (
    PeriodicMotion,
    Run,
    System,
    bifurcation_diagram,
    follow_motion,
    periodic_motions,
    simulate,
    stability_region,
)

from .. import criterion, evidence
from ..claims import Verdict
from ..islands import FREQUENCY_RANGE, FROM_RESONANCE, MOMENT_RANGE, PATH, RESONANCE
from ..parameters import INITIAL, KEEP, PERIODS, paper_system
from .diagrams import MOTION, changes, diagram, kinds, non_periodic
from .model import coarse_map
from .statement import Finding, stated

# A motion occurs easily if it does at more than this part of the frequencies.
EASILY = 0.2
# "Ubiquitous" means more than this part.
UBIQUITOUS = 0.5
# Starts for "easily": the paper's and random ones.
STARTS = 12
# How far in omega beyond a period doubling a cascade is looked for.
BEYOND = 0.02
# Amplitudes for "easily".
EASY_MOMENTS = (0.5, 1.0, 1.5, 2.0, 2.3)
# A jump: states further apart than this at frequencies closer than that.
JUMP, SHARP = 0.05, 1e-9


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
        "solutions": criterion.is_stable(criterion.map_eigenvalues(coarse_map(1))),
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
            gap = float(off.gap_function(start))
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
    """Count them below both natural frequencies, from the paper's start and from random ones."""
    grid = np.linspace(0.2, 3.0, 281)
    starts = np.vstack([INITIAL, evidence.random_starts(STARTS - 1)])
    sides = {"below 1": grid < 1.0, "below omega0 = 2": grid < 2.0, "above 2": grid > 2.0}
    first: dict[str, list[float]] = {name: [] for name in sides}
    any_start: dict[str, list[float]] = {name: [] for name in sides}
    for moment in EASY_MOMENTS:
        made = bifurcation_diagram(
            paper_system(moment_amplitude=moment),
            labels=False,
            initial=starts,
            periods=PERIODS,
            keep=KEEP,
            drive_frequency=grid,
        )
        reached = (made.label == "1-2").reshape(STARTS, -1)
        for name, side in sides.items():
            first[name].append(float(reached[0, side].mean()))
            any_start[name].append(float(reached.any(axis=0)[side].mean()))
    most = max(max(any_start[name]) for name in ("below 1", "below omega0 = 2"))
    usual = float(np.mean(first["below 1"]))
    beyond = max(any_start["above 2"])
    return Finding(
        f"they occur, but not easily: at {usual:.0%} of the frequencies, at most {most:.0%}",
        easily(usual, most, beyond),
        f"part of {len(grid)} frequencies from 0.2 to 3 at which 1-2 motions are reached at f1 = "
        f"{', '.join(f'{moment:g}' for moment in EASY_MOMENTS)}: "
        + "; ".join(
            f"{name} {_percent(first[name])} from the paper's start, {_percent(any_start[name])} "
            f"from any of {STARTS} starts"
            for name in sides
        )
        + f"; easily would be at more than {EASILY:.0%}, where they are not reached above",
    )


def _percent(shares: list[float]) -> str:
    return ", ".join(f"{share:.0%}" for share in shares)


def easily(usual: float, most: float, beyond: float) -> Verdict:
    """Judge "easily" by the shares from one start, from any start at best, and on the other side.

    With correction: only at the best amplitude and from the best start, or elsewhere as well.
    """
    if most <= EASILY:
        return "refuted"
    return "reproduced" if usual > EASILY and beyond <= EASILY else "corrected"


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
    return Finding(
        f"{periodic:.0%} are periodic; {pieces} 'islands' along Fig. 4 are one region",
        as_islands(periodic, pieces if region.closed else None),
        f"of the motions with impacts along Fig. 4 {periodic:.0%} are periodic, "
        f"{non_periodic('4').sum()} frequencies are not (ubiquitous: more than {UBIQUITOUS:.0%}); "
        f"the region of the 1-1 motion of Fig. 5(b) over omega and f1 is "
        f"{'closed' if region.closed else 'not closed'}, and f1 = 1 cuts it at omega = "
        f"{', '.join(f'{value:.4f}' for value in crossings)}: {pieces} pieces along Fig. 4 are one",
    )


def as_islands(periodic: float, pieces: int | None) -> Verdict:
    """Judge "isolated islands among ubiquitous non-periodic motions".

    Parameters
    ----------
    periodic
        Part of the motions with impacts that is periodic.
    pieces
        Pieces along the path of Fig. 4 that belong to one region; None if it is not known whole.
    """
    if periodic > UBIQUITOUS:
        return "refuted"
    if pieces is None:
        return "open"
    return "corrected" if pieces > 1 else "reproduced"


def _apart(one: Run, other: Run) -> float:
    """Distance of two periodic motions: of the sets of their stroboscopic states."""
    sets = [run.stroboscopic[-(run.period.m or 1) :] for run in (one, other)]
    away = np.abs(sets[0][:, None] - sets[1][None]).max(axis=2)
    return float(max(away.min(axis=0).max(), away.min(axis=1).max()))


@stated(
    "fig4-jumps",
    "section 4.1, on Fig. 4",
    "the motion jumps as the frequency changes",
    figure=4,
    page="gallery.md",
    slow=True,
)
def jumps() -> Finding:
    """Halve the steps of the diagram at which one periodic motion follows another."""
    made, found = diagram("4"), kinds("4")
    periodic = (made.m > 0) & (made.n > 0)
    pairs = np.flatnonzero(periodic[:-1] & periodic[1:] & (found[:-1] != found[1:]))

    def at(omega: float) -> Run:
        system = made.system.replace(drive_frequency=omega)
        run: Run = simulate(system, initial=INITIAL, periods=PERIODS, keep=KEEP)
        return run

    places = []
    for number in pairs:
        low, high = (float(made.parameter[number + k]) for k in (0, 1))
        left, right = at(low), at(high)
        while high - low > SHARP:
            middle = at(0.5 * (low + high))
            if middle.period.m is None or not middle.period.n:
                break
            if _apart(left, middle) > _apart(middle, right):
                high, right = 0.5 * (low + high), middle
            else:
                low, left = 0.5 * (low + high), middle
        away = _apart(left, right)
        inside = low > made.parameter[number] and high < made.parameter[number + 1]
        if high - low <= SHARP and inside and away > JUMP:
            places.append((high, left.label, right.label, away))
    followed = bifurcation_diagram(
        made.system,
        labels=False,
        initial=INITIAL,
        periods=PERIODS,
        keep=KEEP,
        start=["forward", "backward"],
        drive_frequency=made.parameter,
    )
    up, down = followed.label.reshape(2, -1)
    m, n = (column.reshape(2, -1) for column in (followed.m, followed.n))
    both = ((m > 0) & (n > 0)).all(axis=0)
    apart = int((both & (up != down)).sum())
    verdict: Verdict = "reproduced" if places else "refuted"
    listed = "; ".join(
        f"{one} to {other} at {omega:.6f}, by {away:.2g}" for omega, one, other, away in places
    )
    return Finding(
        f"{len(places)} jumps between periodic motions",
        verdict,
        f"of {len(pairs)} steps of the diagram from one periodic motion with impacts to another "
        f"{len(places)} remain, halved down to {SHARP:g} in omega, with states more than {JUMP:g} "
        f"apart: {listed or 'none'}; followed up and down in omega, {apart} of {int(both.sum())} "
        "frequencies at which both ways are periodic have two different motions",
    )


@stated(
    "other-motions",
    "section 4.1, on Fig. 6",
    "other stable periodic motions may occur where the condition for period n-1 motions fails",
    figure=6,
    page="gallery.md",
    slow=True,
)
def other_motions() -> Finding:
    """Look for n-1 motions where a motion with more impacts is stable."""
    made = diagram("4")
    rows = np.flatnonzero((made.m > 0) & (made.n > 1))
    none_stable = none = 0
    for number in rows:
        system = made.system.replace(drive_frequency=float(made.parameter[number]))
        motions = [
            motion
            for n in range(1, int(made.m[number]) + 1)
            for motion in periodic_motions(system, n, within=(-1.57, 1.57))
            if motion.admissible
        ]
        none += not motions
        none_stable += not any(motion.stable for motion in motions)
    verdict: Verdict = "refuted"
    if none:
        verdict = "reproduced"
    elif none_stable:
        verdict = "corrected"
    return Finding(
        f"no n-1 motion at {none} of {len(rows)} such frequencies, no stable one at {none_stable}",
        verdict,
        f"of {len(made)} frequencies of Fig. 4 {len(rows)} show a stable m-n motion with n > 1; at "
        f"{none} of these no n-1 motion up to n = m exists, at {none_stable} none is stable",
    )
