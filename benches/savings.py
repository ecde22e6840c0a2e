"""What a scene does not need and what is not asked of it: what each saves.

    python benches/savings.py [--rounds 7] [--quick]

Two calls that differ in one thing run in alternation, from Python and on one core, in processor
time; ratios are of the same round. Costs are in units of G (yardstick.c) per drive period, and per
impact, since a motion changes with its system; the base scene has one impact per period, and keeps
it where it can. Beside them the instructions of the same run in Rust, by valgrind, start and set-up
included. Writes a table in Markdown and every round as JSON.
"""

import argparse
import json
import shutil
import statistics
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

import instructions
import vibroimpact as vi
from han_jin_hu_2004.parameters import INITIAL, TRANSITIONS
from machine import load, machine
from progress import step
from rounds import measure, ratios, spread, table

OUT = Path(__file__).parent / "out"
PERIODS, KEEP = 600, 100
# Frequencies of the diagram, evenly spread over Fig. 8(b).
POINTS = 96

BASE = vi.System(
    mass_ratio=0.6,
    frequency_ratio=2.0,
    restitution=0.8,
    gap=0.5,
    drive_frequency=1.25,
    moment_amplitude=1.0,
    force_amplitude=0.05,
    # So little that none of the motions repeats to the last bit within the periods.
    damping=(0.002, 0.002),
    friction=0.1,
)


@dataclass(frozen=True)
class Job:
    """A call from Python (None: it cannot be had there), and the same run for instructions.py."""

    call: Callable[[], object] | None
    setup: dict[str, Any] | None
    periods: int
    impacts: int


@dataclass(frozen=True)
class Saving:
    """One thing switched off: the job with it and the one without."""

    name: str
    on: Job
    off: Job

    @property
    def jobs(self) -> dict[str, Job]:
        """Both by name."""
        return {"on": self.on, "off": self.off}


def run(
    system: vi.System = BASE,
    *,
    initial: tuple[float, float, float, float] = INITIAL,
    periods: int,
    keep: int = 0,
    wanted: str = "history",
) -> Job:
    """Return a single run of which this is wanted (see support/setup.rs)."""
    calls: dict[str, Callable[[], object]] = {
        "history": lambda: vi.simulate(system, initial=initial, periods=periods, keep=keep),
        "label": lambda: vi.simulate(system, initial=initial, periods=periods, keep=keep).label,
        "exponents": lambda: vi.lyapunov_spectrum(
            system, initial=initial, periods=periods, keep=keep
        ),
    }
    setup = {"system": system.to_dict(), "initial": initial, "periods": periods, "keep": keep}
    impacts = len(vi.simulate(system, initial=initial, periods=periods).impacts)
    return Job(calls.get(wanted), {**setup, "wanted": wanted}, periods, impacts)


def sweep(call: Callable[..., object], *, periods: int, points: int, **options: Any) -> Job:
    """Return a computation over frequencies of Fig. 8(b), on one core."""
    (system,) = (transition.system for transition in TRANSITIONS if transition.id == "8b")
    given: dict[str, Any] = {"initial": INITIAL, "periods": periods, "workers": 1}
    given["drive_frequency"] = 0.2 + 3.8 * (np.arange(points) + 0.5) / points
    whole = vi.bifurcation_diagram(system, keep=periods, labels=False, **given)
    keep = min(KEEP, periods)
    return Job(
        call=lambda: call(system, keep=keep, **given, **options),
        setup=None,
        periods=periods * points,
        impacts=int(whole.offset[-1]),
    )


def savings(periods: int, points: int) -> list[Saving]:
    """Return what is switched off, one at a time."""
    keep = min(KEEP, periods)

    def scene(name: str, on: vi.System, off: vi.System) -> Saving:
        return Saving(name, run(on, periods=periods), run(off, periods=periods))

    unforced = BASE.replace(force_amplitude=0.0)
    # Chaotic with a wall and without, so that neither repeats.
    near = unforced.replace(gap=0.3, restitution=0.98)
    wall = near.replace(mass_ratio=0.0)
    smooth = BASE.replace(friction=0.0)
    apart = unforced.replace(gap=3.0)
    settling = BASE.replace(damping=(0.02, 0.02))
    everything = run(periods=periods, keep=periods)
    last = run(periods=periods, keep=keep)
    nothing = run(periods=periods)
    labelled = sweep(vi.bifurcation_diagram, periods=periods, points=points)
    # A chart has two axes; its second has one value here.
    along = {"friction": [0.4], "periods": periods, "points": points}
    label_alone = sweep(vi.chart, exponents=False, **along)
    return [
        scene("friction", BASE, smooth),
        scene("damping", BASE, BASE.replace(damping=(0.0, 0.0))),
        scene("force on the second body", BASE, unforced),
        scene("second body that impacts move (a wall)", near, wall),
        scene("oblique geometry (direct contact)", smooth, smooth.replace(contact="direct")),
        scene("contact within reach", unforced, apart),
        Saving(
            "motion of the second body before a hit, out of reach",
            run(apart, initial=(*INITIAL[:2], 0.1, 0.0), periods=periods),
            run(apart, periods=periods),
        ),
        Saving(
            "motion of a wall",
            run(wall, initial=(*INITIAL[:2], 1e-9, 0.0), periods=periods),
            run(wall, periods=periods),
        ),
        scene("periods like those before (damping ten times as strong)", BASE, settling),
        Saving("history, nothing kept", everything, nothing),
        Saving("history before the last periods", everything, last),
        Saving(
            "stroboscopic section",
            run(periods=periods, wanted="sections"),
            run(periods=periods, wanted="events"),
        ),
        Saving("label", run(periods=periods, keep=keep, wanted="label"), last),
        Saving(
            "tangent (four exponents over the second half)",
            run(periods=2 * periods, keep=periods, wanted="exponents"),
            run(periods=2 * periods),
        ),
        Saving(
            "labels of Fig. 8(b)",
            labelled,
            sweep(vi.bifurcation_diagram, periods=periods, points=points, labels=False),
        ),
        Saving("rows of Fig. 8(b), only labels wanted", labelled, label_alone),
        Saving(
            "tangent of Fig. 8(b) (largest exponent)",
            sweep(vi.chart, **along),
            label_alone,
        ),
    ]


def counts(job: Job, program: str | None) -> float | None:
    """Return instructions per drive period; None where they are not counted."""
    if program is None or job.setup is None:
        return None
    command = (program, "--run", json.dumps(job.setup))
    return instructions.count(
        instructions.Kernel("run", "drive period", job.periods, (1, 3), None, command)
    )


def measured(
    cases: list[Saving], program: str | None, rounds: int, quick: bool
) -> list[dict[str, Any]]:
    """Measure all savings; everything that the table needs."""
    jobs = {
        f"{saving.name}, {which}": job.call
        for saving in cases
        for which, job in saving.jobs.items()
        if job.call is not None
    }
    with step(f"savings: {len(jobs)} calls in {rounds} rounds"):
        timings = measure(jobs, rounds, shortest=0.0 if quick else 0.05, clock=process_time)

    def result(saving: Saving) -> dict[str, Any]:
        found = {which: timings.get(f"{saving.name}, {which}") for which in saving.jobs}
        both = {which: timing for which, timing in found.items() if all(found.values()) and timing}
        return {
            "name": saving.name,
            "periods": {which: job.periods for which, job in saving.jobs.items()},
            "impacts": {which: job.impacts for which, job in saving.jobs.items()},
            "seconds": {which: list(timing.seconds) for which, timing in both.items()},
            "g": {which: list(timing.g) for which, timing in both.items()},
            "instructions": {which: counts(job, program) for which, job in saving.jobs.items()},
        }

    with step("savings: instructions"):
        return [result(saving) for saving in cases]


def markdown(opening: str, results: list[dict[str, Any]]) -> str:
    """Return the table."""
    head = ["switched off", "impacts per period", "G per period", "G per impact", "times as much"]
    head += ["instructions per period", "times as many"]
    return "\n".join([opening, *table(head, [_row(result) for result in results])]) + "\n"


def _row(result: dict[str, Any]) -> list[str]:
    per_period = {
        name: [s / result["periods"][name] * 1e9 / g for s, g in zip(seconds, g_, strict=True)]
        for name, seconds in result["seconds"].items()
        for g_ in [result["g"][name]]
    }
    rates = {name: n / result["periods"][name] for name, n in result["impacts"].items()}
    per_impact = {
        name: [value / rates[name] for value in values] if rates[name] else []
        for name, values in per_period.items()
    }
    number = result["instructions"]
    counted = all(number.values())
    return [
        result["name"],
        _pair({name: [rate] for name, rate in rates.items()}),
        _pair(per_period),
        _pair(per_impact),
        spread(ratios(per_period["on"], per_period["off"])) if per_period else "-",
        _pair({name: [value] for name, value in number.items()}) if counted else "-",
        f"{number['on'] / number['off']:.3f}" if counted else "-",
    ]


def _pair(values: dict[str, list[float]]) -> str:
    """Medians with and without; a dash where there is none."""
    texts = [_short(statistics.median(found)) if found else "-" for found in values.values()]
    return " -> ".join(texts) or "-"


def _short(value: float) -> str:
    return f"{value:,.0f}" if value >= 1000.0 else f"{value:.3g}"


def main(arguments: list[str] | None = None) -> None:
    """Measure, print the table and write it."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--quick", action="store_true", help="a trial of all parts, no figures")
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args(arguments)
    quick = options.quick
    rounds = 1 if quick else options.rounds
    program, why = None, "not counted in a trial"
    if not quick:
        try:
            program, why = instructions.build(), "valgrind's, set-up included"
            if shutil.which("valgrind") is None:
                program, why = None, "not counted: no valgrind"
        except (instructions.CannotCount, OSError) as error:
            why = f"not counted: {error}"
    title = "# A trial run, no figures" if quick else "# Savings"
    opening = (
        f"{title}\n\n{machine()}; load {load()} at the start. With -> without; medians of {rounds} "
        f"rounds, ranges of ratios. Instructions: {why}.\n"
    )
    cases = savings(30 if quick else PERIODS, 4 if quick else POINTS)
    results = measured(cases, program, rounds, quick)
    text = markdown(opening, results)
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "savings.md").write_text(text, encoding="utf-8")
    written = json.dumps(results, indent=1)
    (options.out / "savings.json").write_text(written + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
