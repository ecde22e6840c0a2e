"""Whether the package is as fast as it is meant to be: its cost in units of G, and beside peers.

    python benches/bars.py [--rounds 5] [--quick]

G is what one scalar evaluation of gap and gap rate costs (yardstick.c), measured beside every run.
Sweeps are whole calls from Python on one core, arrays included: 600 drive periods per frequency, of
which the last 100 are kept, no labels. A peer computes the same sections of some of the frequencies
(evenly spread; the slow ones fewer and over fewer periods), and costs per drive period of the same
round are compared; compilation is not counted. Two cores are measured by themselves (two_cores.py).
Errors are those after 25 drive periods against references of 25 digits, the largest over the scenes
of the same system. Writes a table in Markdown and every round as JSON.
"""

import argparse
import functools
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import bars_report
import vibroimpact as vi
from han_jin_hu_2004.parameters import INITIAL, KEEP, MOTIONS, PERIODS, TRANSITIONS
from peers import PEERS
from peers.outcome import Problem
from progress import step
from rounds import Timing, measure
from scenes import read_scenes
from two_cores import TURN, two_cores
from vibroimpact.system import SYMBOLS

OUT = Path(__file__).parent / "out"


@dataclass(frozen=True)
class Case:
    """A sweep, or a single run (one frequency), with what it must reach.

    ``bar`` is in G per drive period; ``factors`` say how many times as fast as a peer; ``scenes``
    are those on which errors are measured.
    """

    name: str
    system: vi.System
    frequencies: tuple[float, ...]
    bar: float | None
    factors: dict[str, float]
    scenes: tuple[str, ...]
    compared: bool = True

    @property
    def single(self) -> bool:
        """Whether it is a run of one motion by ``vi.simulate``."""
        return len(self.frequencies) == 1


@dataclass(frozen=True)
class Share:
    """What part of a case a peer computes: so many frequencies, so many drive periods."""

    sweep: tuple[int, int]
    single: int | None


# The slow ones do less, in proportion to their cost per period.
SHARES = {
    "heyoka.py batch": Share((80, PERIODS), None),
    "heyoka.py": Share((40, PERIODS), PERIODS),
    "Numba": Share((100, PERIODS), PERIODS),
    "CVODE": Share((8, 200), 100),
    "SciPy": Share((4, 25), 25),
}
BEST_BATCH = {"heyoka.py batch": 40.0, "Numba": 7.0, "SciPy": 10_000.0}
BEST_SINGLE = {"heyoka.py": 50.0}


def cases() -> list[Case]:
    """Return the cases of the bars."""
    systems = {transition.id: transition.system for transition in TRANSITIONS}
    fig7b = tuple(f"fig7b_{omega}" for omega in ("0.60", "1.08", "1.56", "2.04"))
    sweeps: tuple[tuple[Any, ...], ...] = (
        ("Fig. 4", "4", (0.2, 4.0, 4000), 3.0, {}, ("fig5a", "fig5b", "fig6b", "fig6c")),
        ("Fig. 7(b)", "7b", (0.6, 3.0, 1000), 3.0, BEST_BATCH, fig7b),
        ("Fig. 8(b)", "8b", (0.2, 4.0, 4000), 4.0, {}, ("fig9_4",)),
    )
    motions = {motion.id: motion.system for motion in MOTIONS}
    singles = {"5a": "fig5a", "6a": "fig6a", "9(1)": "fig9_1", "9(4)": "fig9_4"}
    return [
        Case(
            name=name,
            system=systems[transition],
            frequencies=tuple(np.linspace(*span).tolist()),
            bar=bar,
            factors=factors,
            scenes=scenes,
            compared=bool(factors),
        )
        for name, transition, span, bar, factors, scenes in sweeps
    ] + [
        Case(name, motions[name], (motions[name].drive_frequency,), None, BEST_SINGLE, (scene,))
        for name, scene in singles.items()
    ]


def ours(case: Case, frequencies: tuple[float, ...], periods: int, workers: int = 1) -> Any:
    """Run vibroimpact as a user calls it, and look at its arrays; returns its impacts per point."""
    keep = min(KEEP, periods)
    if case.single:
        run = vi.simulate(case.system, initial=INITIAL, periods=periods, keep=keep, workers=workers)
        assert run.stroboscopic.shape == (keep, 4)
        return [len(run.impacts)]
    diagram = vi.bifurcation_diagram(
        case.system,
        initial=INITIAL,
        periods=periods,
        keep=keep,
        labels=False,
        workers=workers,
        drive_frequency=np.array(frequencies),
    )
    assert len(diagram.x1) == diagram.offset[-1]
    return np.diff(diagram.offset)


def _part(
    case: Case, frequencies: tuple[float, ...], periods: int, workers: int, place: int, step: int
) -> None:
    """Run every so many-th frequency; pickled, so that other processes can do it."""
    ours(case, frequencies[place::step], periods, workers)


def share(case: Case, peer: Any, quick: bool) -> tuple[tuple[float, ...], int] | None:
    """Return which frequencies and how many periods a peer computes; None: not this case."""
    part = SHARES[peer.NAME]
    if case.single:
        if part.single is None:
            return None
        return case.frequencies, min(part.single, 10) if quick else part.single
    points, periods = part.sweep
    if quick:
        points, periods = min(points, 8), min(periods, 10)
    points = min(points, len(case.frequencies))
    # In the middles of equal parts, so that their drive periods are on average those of the sweep.
    indices = ((np.arange(points) + 0.5) * len(case.frequencies) / points).astype(int)
    return tuple(case.frequencies[index] for index in indices), periods


def run_case(case: Case, rounds: int, quick: bool, workers: int) -> dict[str, Any]:
    """Measure one case; everything that the report needs."""
    problem = Problem(_numbers(case.system), INITIAL)
    periods = 20 if quick else PERIODS
    frequencies = case.frequencies[:: max(1, len(case.frequencies) // 20)] if quick else None
    frequencies = frequencies or case.frequencies
    jobs: dict[str, Callable[[], object]] = {}
    jobs["vibroimpact"] = lambda: ours(case, frequencies, periods)
    peers: dict[str, Any] = {}
    for peer in PEERS if case.compared else ():
        part = share(case, peer, quick)
        if part is None:
            continue
        why = peer.missing()
        peers[peer.NAME] = {"missing": why}
        if why:
            continue
        solve = peer.prepare(problem)
        omegas, length = part
        keep = min(KEEP, length)
        jobs[peer.NAME] = _call(solve, omegas, length, keep)
        peers[peer.NAME] |= {"periods": length * len(omegas), "error": _error(case, peer)}
        peers[peer.NAME]["missed"] = missed(solve(omegas, length, keep), ours(case, omegas, length))
    timings = measure(jobs, rounds, shortest=0.0 if quick else 0.05)
    scaling = {}
    if not case.single and workers > 1:
        call = functools.partial(_part, case, frequencies, periods)
        # More rounds: their ratios scatter, as whoever else uses the machine takes a core or two.
        scaling = two_cores(call, 1 if quick else 4 * rounds + 1, turn=0.0 if quick else TURN)
    return {
        "case": case.name,
        "bar": case.bar,
        "factors": case.factors,
        "periods": periods * len(frequencies),
        "error": _our_error(case),
        "timings": {name: _plain(timing) for name, timing in timings.items()},
        "two cores": {name: _plain(timing) for name, timing in scaling.items()},
        "peers": peers,
    }


def missed(outcomes: list[Any], counts: Any) -> str:
    """Say what of the kept sections a peer missed, as far as it can be seen."""
    found = []
    ended = sum(not outcome.finished for outcome in outcomes)
    differ = sum(
        len(outcome.impact_section) != count
        for outcome, count in zip(outcomes, counts, strict=True)
        if outcome.finished
    )
    inside = sum(outcome.penetration > 1e-6 for outcome in outcomes)
    again = sum(outcome.false_events for outcome in outcomes)
    if differ:
        found.append(f"other number of impacts at {differ} of {len(outcomes)}")
    if inside:
        found.append(f"bodies inside one another at {inside}")
    if again:
        found.append(f"{again} contacts reported again")
    if ended:
        found.append(f"given up at {ended}")
    return "; ".join(found) or "nothing"


def _call(function: Callable[..., object], *arguments: Any) -> Callable[[], object]:
    return lambda: function(*arguments)


def _numbers(system: vi.System) -> dict[str, float]:
    given = system.to_dict()
    return {name: float(given[name]) for name in SYMBOLS.values()}


def _error(case: Case, peer: Any) -> float:
    worst = 0.0
    for scene in read_scenes(case.scenes):
        solve = peer.prepare(scene.problem)
        outcome = solve([scene.problem.frequency], scene.periods, 1)[0]
        worst = max(worst, scene.error(scene.periods, outcome.final_state))
    return worst


def _our_error(case: Case) -> float:
    worst = 0.0
    for scene in read_scenes(case.scenes):
        system = vi.System(**scene.problem.parameters)
        run = vi.simulate(system, initial=scene.problem.initial, periods=scene.periods, keep=1)
        worst = max(worst, scene.error(scene.periods, run.stroboscopic[-1].tolist()))
    return worst


def _plain(timing: Timing) -> dict[str, list[float]]:
    return {"seconds": list(timing.seconds), "g": list(timing.g)}


def main(arguments: list[str] | None = None) -> None:
    """Measure, print the table and write it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--quick", action="store_true", help="a trial of all parts, no figures")
    parser.add_argument("--cases", nargs="+", help='names of cases, e.g. "Fig. 7(b)" 5a')
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args(arguments)
    chosen = [case for case in cases() if not options.cases or case.name in options.cases]
    if not chosen:
        parser.error("no case of that name")
    rounds = 1 if options.quick else options.rounds
    workers = min(2, bars_report.cores())
    head = bars_report.head(rounds, quick=options.quick)
    results = []
    for number, case in enumerate(chosen, 1):
        with step(f"bars {number}/{len(chosen)}: {case.name}"):
            results.append(run_case(case, rounds, options.quick, workers))
    text = bars_report.markdown(head, results, PEERS)
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "bars.md").write_text(text, encoding="utf-8")
    (options.out / "bars.json").write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
