"""Very long motions: elastic impacts, a stable orbit, an orbit that grazes in every period.

- Energy, which undamped and unforced motion with r = 1 and mu = 0 keeps exactly. It is computed
  from the final states with rational arithmetic, so that what is seen is the simulation's.
- Distance from a stable orbit, refined to rounding (`Run.refine`), on which the run starts; and
  from the exact motion, followed for as many periods as there is time.
- A steady free motion that comes to the contact within a height h of the gap, h = 0 a graze.

Rows are dictionaries; plot functions draw them into given axes. All quantities are dimensionless.
"""

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from flint import arb, ctx
from matplotlib.axes import Axes

import vibroimpact as vi
from exact import ALLOWED, EPS, Case, Outcome, State, judge, reference_system
from vibroimpact.plot.style import BLUE, ORANGE, VERMILLION
from vibroimpact.reference.hybrid import follow, sections
from vibroimpact.reference.slide import Settings

Row = dict[str, Any]


@dataclass(frozen=True)
class Elastic:
    """An elastic motion, and its start."""

    name: str
    system: vi.System
    initial: State


def elastic(mass_ratio: float, frequency_ratio: float, contact: str) -> vi.System:
    """Return a conservative system; the drive only counts periods, nothing is driven."""
    return vi.System(
        mass_ratio=mass_ratio,
        frequency_ratio=frequency_ratio,
        restitution=1.0,
        gap=0.1,
        drive_frequency=1.0,
        contact=contact,
    )


START = (0.0, 0.5, 0.0, 0.0)
ELASTIC = (
    Elastic("oblique", elastic(0.6, 2.0, "oblique"), START),
    Elastic("direct", elastic(0.6, 2.0, "direct"), START),
    Elastic("oblique, wall", elastic(0.0, 1.5, "oblique"), START),
)


def energy(system: vi.System, state: State) -> Fraction:
    """E of a state, exactly; that of the pendulum alone where body 2 is a wall at rest."""
    x1, v1, x2, v2 = map(Fraction, state)
    found = (v1**2 + (Fraction(system.frequency_ratio) * x1) ** 2) / 2
    if system.mass_ratio == 0:
        return found
    return found + (v2**2 + x2**2) / (2 * Fraction(system.mass_ratio))


def drift_bound(impacts: int) -> float:
    """Largest relative drift that rounding leaves: eight walks of one eps a step, and a bias.

    Rounding to nearest has one where exact results lie half-way between two numbers by rule: with
    mbar = 0.6 and k = 1 the impulse is 1.25 u but for 1e-17 of it, which decides all ties alike.
    """
    return EPS * (8 * math.sqrt(impacts) + impacts / 128)


def energy_drift(case: Elastic, impacts: int) -> list[Row]:
    """Relative change of energy after about 10, 15, 22 ... `impacts` impacts of a motion."""
    per_period = vi.simulate(case.system, initial=case.initial, periods=1000, keep=0).impact_count
    steps = 1 + round(6 * math.log10(impacts / 10))
    counts = np.geomspace(10, impacts, steps)
    ends = np.unique(np.ceil(counts * 1000 / per_period).astype(int)).tolist()
    first = energy(case.system, case.initial)
    rows, run = [], None
    for before, end in zip([0, *ends], ends, strict=False):
        if run is None:
            run = vi.simulate(
                case.system, initial=case.initial, periods=end, keep=0, max_events=10**12
            )
        else:
            run = run.resume(periods=end - before, keep=0)
        if run.stop_reason != "completed":
            raise RuntimeError(f"{case.name}: {run.stop_detail}")
        drift = float(energy(case.system, run.final_state.state) / first - 1)
        rows.append({"motion": case.name, "impacts": run.impact_count, "drift": drift})
    return rows


def plot_energy_drift(rows: list[Row], ax: Axes) -> None:
    """|E/E(0) - 1| over the number of impacts, with a random walk of rounding beside it."""
    marks = zip(ELASTIC, ("o", "s", "^"), (BLUE, VERMILLION, ORANGE), strict=True)
    for case, marker, color in marks:
        own = [row for row in rows if row["motion"] == case.name]
        n = np.array([row["impacts"] for row in own])
        drift = np.abs([row["drift"] for row in own])
        ax.loglog(n, np.maximum(drift, EPS / 10), marker, ms=3, color=color, label=case.name)
    ends = np.array([10.0, max(row["impacts"] for row in rows)])
    ax.loglog(ends, EPS * np.sqrt(ends), "k--", lw=0.8, label=r"$\varepsilon\sqrt{n}$")
    ax.set(xlabel=r"impacts $n$", ylabel=r"$|E/E(0)-1|$")
    ax.legend()


# Fig. 5(a): its 1-1 motion; with damping and friction, a slip in every impact.
ORBITS = (
    ("1-1, Fig. 5(a)", {"drive_frequency": 1.25}),
    (
        "1-1, damped, with friction",
        {"drive_frequency": 1.8, "damping": (0.01, 0.02), "friction": 0.2},
    ),
)


def orbit_error(periods: int, reference_periods: int) -> list[Row]:
    """Distance from a refined orbit, and from the exact motion, after 1 ... `periods` periods."""
    rows = []
    for name, given in ORBITS:
        system = vi.System(
            mass_ratio=0.6,
            frequency_ratio=2.0,
            restitution=0.8,
            gap=0.5,
            moment_amplitude=1.0,
            **given,
        )
        settled = vi.simulate(system, initial=(0.0, 0.5, 0.0, 0.0), periods=4000, keep=100)
        motion = settled.refine()
        if not motion:
            raise RuntimeError(f"{name}: no orbit")
        start = motion.initial
        run = vi.simulate(system, initial=start, periods=periods, max_events=10**9)
        distance = np.abs(run.stroboscopic - start).max(axis=1)
        shown = np.unique(np.geomspace(1, periods, 160).astype(int))
        # The largest so far hides no error between the periods that are shown.
        worst = np.maximum.accumulate(distance)
        for k in shown.tolist():
            rows.append({"motion": name, "from": "orbit", "period": k, "error": worst[k - 1]})
        plain = follow(
            reference_system(system),
            start,
            sections(reference_system(system), reference_periods),
            settings=Settings(precision=300),
        )
        with ctx.workprec(300):
            exact = np.array(
                [
                    [float(abs(arb(float(a)) - b)) for a, b in zip(ours, theirs, strict=True)]
                    for ours, theirs in zip(run.stroboscopic, plain.samples, strict=False)
                ]
            )
        worst = np.maximum.accumulate(exact.max(axis=1))
        for k in shown[shown <= reference_periods].tolist():
            rows.append(
                {"motion": name, "from": "exact motion", "period": k, "error": worst[k - 1]}
            )
    return rows


def plot_orbit_error(rows: list[Row], ax: Axes) -> None:
    """The largest error up to period k."""
    styles = {"orbit": ("-", None), "exact motion": ("", "o")}
    for (name, _), color in zip(ORBITS, (BLUE, VERMILLION), strict=True):
        for kind, (line, marker) in styles.items():
            own = [row for row in rows if row["motion"] == name and row["from"] == kind]
            ax.loglog(
                [row["period"] for row in own],
                [max(row["error"], EPS / 10) for row in own],
                linestyle=line,
                marker=marker,
                ms=2.5,
                markevery=4,
                color=color,
                label=f"{name}: from the {kind}",
            )
    ax.set(xlabel=r"drive periods $k$", ylabel=r"$\max_{j\leq k}|X_j-X_j^{\rm exact}|$")
    ax.legend()


HEIGHTS = (
    0.0,
    *(sign * 10.0**exponent for exponent in range(-18, -1) for sign in (1, -1)),
)


def grazing(periods: int, every: int = 1) -> list[Row]:
    """A steady motion x1 = A cos(omega t) whose top comes within h of the gap, for each h.

    h < 0: it must stay free for ever, at its exact state; h > 0: impacts must come, where the gap
    is above rounding. Within rounding it may be either, and is recorded as a graze.
    """
    rows = []
    for contact in ("oblique", "direct"):
        for damping in (0.0, 0.02):
            for height in HEIGHTS[::every]:
                rows.append(_grazing(contact, damping, height, periods))
    return rows


def _grazing(contact: str, damping: float, height: float, periods: int) -> Row:
    omega0, omega = 1.75, 1.0
    # Steady response x1 = A cos(omega t + phi - lag), exact to rounding of A and the lag.
    stiffness = complex(omega0**2 - omega**2, 2 * damping * omega0 * omega)
    amplitude, lag = 0.75, math.atan2(stiffness.imag, stiffness.real)
    top = amplitude if contact == "direct" else math.sin(amplitude)
    system = vi.System(
        mass_ratio=0.6,
        frequency_ratio=omega0,
        restitution=0.8,
        gap=top - height,
        drive_frequency=omega,
        pendulum_damping=damping,
        oscillator_damping=damping,
        moment_amplitude=amplitude * abs(stiffness),
        phase=math.pi / 2 + lag,
        contact=contact,
    )
    # At t = 0 the pendulum passes through 0 towards the other side.
    start = (0.0, -amplitude * omega, 0.0, 0.0)
    run = vi.simulate(system, initial=start, periods=periods, max_events=10**7)
    held = float(np.abs(run.stroboscopic - start).max())
    row: Row = {
        "contact": contact,
        "damping": damping,
        "height": height,
        "impacts": run.impact_count,
        "grazes": len(run.grazes),
        "stop": run.stop_reason,
        "held": held if run.impact_count == 0 else math.nan,
    }
    # The rounding of A and of the lag, and of the start: a few units in the top's height.
    if run.impact_count:
        row["first"] = judge(Case(system, start, 4.5 * 2 * math.pi)).outcome
    if height < -16 * EPS:
        good = run.impact_count == 0 and held <= ALLOWED * math.sqrt(periods)
    elif height > 1e-13:
        good = run.impact_count > 0 and row["first"] in (Outcome.WITHIN, Outcome.ILL_CONDITIONED)
    else:
        good = True
    row["good"] = good and run.stop_reason == "completed"
    return row


def plot_grazing(rows: list[Row], ax: Axes) -> None:
    """Impacts and grazes in a run, over the height of the top."""
    heights = np.array([row["height"] for row in rows])
    for key, marker, color in (("grazes", "o", BLUE), ("impacts", "x", VERMILLION)):
        ax.plot(heights, [row[key] for row in rows], marker, ms=4, color=color, label=key)
    ax.set_xscale("symlog", linthresh=1e-18)
    ax.set_yscale("symlog", linthresh=1)
    ax.set_xticks([-1e-2, -1e-6, -1e-10, -1e-14, 0, 1e-14, 1e-10, 1e-6, 1e-2])
    ax.set(xlabel=r"height $h$ of the top over the contact", ylabel="number in the run")
    ax.legend(loc="center left")
