"""Ranges of one quantity each: random cases at random places and at the ends of the range.

A range is a function that draws a case at a given value of its quantity; everything else is drawn
around it. More is tried than is said to hold: docs/stress.md tells what is seen beyond. Names and
symbols as in docs/notation.md; all quantities are dimensionless.
"""

import math
import zlib
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes

import vibroimpact as vi
from exact import Case, Outcome, State, judge, shortened
from vibroimpact.plot.style import BLUE, GREY, ORANGE, PURPLE, VERMILLION

Draw = Callable[[np.random.Generator, float], Case]

# Errors beyond these are drawn at them, as are outcomes without an error.
SMALLEST, LARGEST = 1e-4, 1e4
MARKS = {
    Outcome.WITHIN: ("o", BLUE),
    Outcome.ILL_CONDITIONED: ("^", ORANGE),
    Outcome.STOPPED: ("|", GREY),
    Outcome.EARLY: ("v", "black"),
    Outcome.UNDECIDED: ("_", PURPLE),
    Outcome.WRONG: ("X", VERMILLION),
}


@dataclass(frozen=True)
class Range:
    """What is varied: name, axis label, the values at and between the ends, how to draw a case.

    `holds` are the ends of the part in which no case may be wrong; 0 is a case of its own.
    """

    name: str
    symbol: str
    low: float
    high: float
    draw: Draw
    ends: tuple[float, ...] = ()
    holds: tuple[float, float] = (0.0, math.inf)

    def inside(self, value: float) -> bool:
        """Whether no case may be wrong at this value."""
        return value == 0 or self.holds[0] <= value <= self.holds[1]

    def values(self, rng: np.random.Generator, count: int) -> list[float]:
        """Return a quarter of the values at the ends, the others anywhere between them."""
        ends = [*self.ends, self.low, self.high]
        at_ends = [ends[i % len(ends)] for i in range(count // 4)]
        between = rng.uniform(0.0, 1.0, count - len(at_ends))
        ratio = math.log(self.high / self.low)
        return at_ends + (self.low * np.exp(ratio * between)).tolist()


def base(rng: np.random.Generator, **given: Any) -> dict[str, Any]:
    """Draw a moderate system; `given` takes the place of what would be drawn."""
    drawn: dict[str, Any] = {
        "mass_ratio": 10 ** rng.uniform(-1, 1),
        "frequency_ratio": rng.uniform(0.3, 3),
        "restitution": rng.uniform(0.3, 1),
        "gap": rng.uniform(0, 0.6),
        "drive_frequency": rng.uniform(0.3, 3),
        "pendulum_damping": rng.choice([0.0, rng.uniform(0, 0.2)]),
        "oscillator_damping": rng.choice([0.0, rng.uniform(0, 0.2)]),
        "moment_amplitude": rng.uniform(0, 2),
        "force_amplitude": rng.uniform(0, 1),
        "friction": rng.choice([0.0, rng.uniform(0, 0.6)]),
        "phase": rng.uniform(0, 2 * math.pi),
        "contact": "direct" if rng.uniform() < 0.2 else "oblique",
    }
    drawn |= given
    if drawn["contact"] == "direct":
        drawn["friction"] = 0.0
    return drawn


def start(rng: np.random.Generator, values: dict[str, Any], x1: float | None = None) -> State:
    """Draw a start with the bodies 0.01 ... 0.3 apart."""
    x1 = rng.uniform(-0.5, 0.5) if x1 is None else x1
    tip = x1 if values["contact"] == "direct" else math.sin(x1)
    x2 = tip - values["gap"] + rng.uniform(0.01, 0.3)
    return x1, rng.uniform(-1.5, 1.5), x2, rng.uniform(-1, 1)


def moderate(rng: np.random.Generator, time: float = 15.0, **given: Any) -> Case:
    """Draw a case with some parameters given."""
    values = base(rng, **given)
    return Case(vi.System(**values), start(rng, values), time)


def resonance(rng: np.random.Generator, detuning: float) -> Case:
    """Omega = omega0 (1 + detuning) or omega = 1 + detuning, without damping."""
    sign = rng.choice([-1.0, 1.0])
    undamped = {"pendulum_damping": 0.0, "oscillator_damping": 0.0}
    if rng.uniform() < 0.5:
        natural = rng.choice([0.5, 1.0, 2.0, rng.uniform(0.3, 3)])
        drive = natural + sign * detuning
        return moderate(rng, frequency_ratio=natural, drive_frequency=drive, **undamped)
    return moderate(rng, drive_frequency=1.0 + sign * detuning, **undamped)


def weak_damping(rng: np.random.Generator, zeta: float) -> Case:
    """Both bodies damped this weakly, often near resonance."""
    near = {} if rng.uniform() < 0.5 else {"drive_frequency": 1.0 + rng.choice([0.0, zeta])}
    return moderate(rng, pendulum_damping=zeta, oscillator_damping=zeta, **near)


def critical_damping(rng: np.random.Generator, distance: float) -> Case:
    """Zeta = 1 +- distance for both bodies."""
    zeta = 1.0 + rng.choice([-1.0, 1.0]) * distance
    return moderate(rng, pendulum_damping=zeta, oscillator_damping=zeta)


def strong_damping(rng: np.random.Generator, zeta: float) -> Case:
    """Damping far above critical; a start so close, and so short a run, that they decay in it."""
    other = {"oscillator_damping": zeta} if rng.uniform() < 0.5 else {}
    values = base(rng, pendulum_damping=zeta, **other)
    x1, v1, x2, v2 = start(rng, values)
    tip = x1 if values["contact"] == "direct" else math.sin(x1)
    x2 = tip - values["gap"] + rng.uniform(0.01, 0.3) / zeta
    return Case(vi.System(**values), (x1, v1, x2, v2), min(15.0, 50.0 / zeta))


def mass_ratio(rng: np.random.Generator, mbar: float) -> Case:
    """Mbar = M1/M2."""
    return moderate(rng, mass_ratio=mbar)


def large_angle(rng: np.random.Generator, angle: float) -> Case:
    """A pendulum turned by `angle`, free, weakly held, or thrown back fast."""
    stiffness = rng.choice([0.0, 0.01, rng.uniform(0.3, 2)])
    values = base(rng, contact="oblique", frequency_ratio=stiffness)
    x1 = rng.choice([-1.0, 1.0]) * angle
    # A tip that turns often within a flight meets body 2 at any height of it.
    return Case(vi.System(**values), start(rng, values, x1), 10.0)


def steep_contact(rng: np.random.Generator, cosine: float, **given: Any) -> Case:
    """A pendulum nearly at pi/2, or -pi/2, met by body 2: cos x1 about `cosine` in the impact."""
    values = base(rng, contact="oblique", moment_amplitude=0.0, frequency_ratio=0.0, **given)
    x1 = rng.choice([-1.0, 1.0]) * (math.pi / 2 + rng.choice([-1.0, 1.0]) * cosine)
    distance, speed = rng.uniform(0.01, 0.1), rng.uniform(0.3, 2)
    x2 = math.sin(x1) - values["gap"] + distance
    # It turns so slowly that cos x1 keeps its order until the impact.
    v1 = rng.choice([0.0, rng.uniform(-1, 1) * cosine / (distance / speed)])
    return Case(vi.System(**values), (x1, v1, x2, -speed), 4.0)


def steep_wall(rng: np.random.Generator, cosine: float) -> Case:
    """The same with a moving wall, mbar = 0: it throws the tip aside at u/cos x1."""
    return steep_contact(rng, cosine, mass_ratio=0.0)


def slide_past_the_end(rng: np.random.Generator, mbar: float) -> Case:
    """Body 2 presses the tip past sin x1 = -1, in contact: x1' rises to |x2'|/sqrt(mbar) there."""
    values = base(rng, contact="oblique", mass_ratio=mbar, restitution=0.0, friction=0.0)
    values |= {"moment_amplitude": 0.0, "frequency_ratio": 0.0, "drive_frequency": 1.0}
    x1 = rng.uniform(-1.4, -1.1)
    x2 = math.sin(x1) - values["gap"] + rng.uniform(0.01, 0.05)
    return Case(vi.System(**values), (x1, 0.0, x2, -rng.uniform(1.5, 3)), 0.5)


def friction(rng: np.random.Generator, mu: float) -> Case:
    """Coulomb's coefficient."""
    return moderate(rng, friction=mu, contact="oblique")


def restitution_near_0(rng: np.random.Generator, r: float) -> Case:
    """R near 0: contact at once, or after few impacts."""
    return moderate(rng, restitution=r, time=8.0)


def restitution_near_1(rng: np.random.Generator, loss: float) -> Case:
    """As close to elastic as 1 - r = loss."""
    return moderate(rng, restitution=1.0 - loss)


def small_gap(rng: np.random.Generator, distance: float) -> Case:
    """A start this close to the contact."""
    case = moderate(rng)
    x1, v1, _, v2 = case.initial
    tip = x1 if case.system.contact == "direct" else math.sin(x1)
    return replace(case, initial=(x1, v1, tip - case.system.gap + distance, v2))


def fast(rng: np.random.Generator, speed: float) -> Case:
    """A pendulum this fast."""
    case = moderate(rng, time=4.0)
    x1, _, x2, v2 = case.initial
    return replace(case, initial=(x1, rng.choice([-1.0, 1.0]) * speed, x2, v2))


def several(rng: np.random.Generator, size: float) -> Case:
    """Each parameter ordinary, or extreme by up to a factor `size` either way, or at an end."""

    def wild(usual: float) -> float:
        return usual * float(rng.choice([1.0, 1.0, size, 1 / size, size ** rng.uniform(-1, 1)]))

    values = base(rng)
    for name in ("mass_ratio", "moment_amplitude", "force_amplitude", "friction", "gap"):
        values[name] = wild(values[name])
    slow = {"frequency_ratio": 30.0, "drive_frequency": 30.0}
    for name, most in slow.items():
        values[name] = float(min(wild(values[name]), most))
    for name in ("pendulum_damping", "oscillator_damping"):
        values[name] = float(min(wild(rng.uniform(0, 1)), 100.0))
    values["restitution"] = float(rng.choice([0.0, 1.0, values["restitution"], 1 - 1e-3 / size]))
    if values["contact"] == "direct":
        values["friction"] = 0.0
    x1, v1, x2, v2 = start(rng, values)
    fastest = max(1.0, *(values[name] for name in slow))
    return Case(vi.System(**values), (x1, wild(v1), x2, v2), 15.0 / fastest)


RANGES = (
    Range("resonance", r"$|\omega-\omega_0|$", 1e-16, 0.1, resonance, ends=(0.0,)),
    Range(
        "weak damping",
        r"$\zeta_1=\zeta_2$",
        1e-300,
        0.1,
        weak_damping,
        ends=(0.0, 1e-150, 1e-17),
    ),
    Range("critical damping", r"$|\zeta-1|$", 1e-16, 0.5, critical_damping, ends=(0.0,)),
    Range("strong damping", r"$\zeta_1$", 1.0, 1e4, strong_damping),
    Range("mass ratio", r"$\bar m$", 1e-12, 1e12, mass_ratio),
    Range("large angle", r"$|x_1|$", 1.0, 1e3, large_angle),
    Range("steep contact", r"$|\cos x_1|$", 1e-16, 0.3, steep_contact),
    Range(
        "steep contact with a wall",
        r"$|\cos x_1|$",
        1e-16,
        0.3,
        steep_wall,
        ends=(1e-13,),
        holds=(1e-13, 1.0),
    ),
    Range(
        "slide past the end",
        r"$\bar m$",
        1e-5,
        10.0,
        slide_past_the_end,
        holds=(1e-3, math.inf),
    ),
    Range("friction", r"$\mu$", 1e-3, 1e3, friction),
    Range("restitution near 0", r"$r$", 1e-16, 0.3, restitution_near_0, ends=(0.0,)),
    Range("restitution near 1", r"$1-r$", 1e-16, 0.3, restitution_near_1, ends=(0.0,)),
    Range("start near contact", r"$-g(0)$", 1e-16, 0.1, small_gap),
    Range("fast pendulum", r"$|\dot x_1(0)|$", 1.0, 1e3, fast),
    Range("several at once", "factor", 1.0, 1e4, several, holds=(1.0, 100.0)),
)


def seed(name: str) -> list[int]:
    """Return the seed of a range: one of its own, so that another range changes none of it."""
    return [6, zlib.crc32(name.encode())]


def measure(chosen: Range, count: int) -> list[dict[str, Any]]:
    """Draw and judge `count` cases of a range."""
    rng = np.random.default_rng(seed(chosen.name))
    rows = []
    for value in chosen.values(rng, count):
        case = shortened(chosen.draw(rng, value))
        verdict = judge(case)
        row = {"range": chosen.name, "value": value, "inside": chosen.inside(value)}
        rows.append(row | asdict(verdict) | {"case": case})
    return rows


def plot_range(chosen: Range, rows: list[dict[str, Any]], ax: Axes) -> None:
    """The error in units of the bound, over the quantity; a 0 at the left edge."""
    smallest = min(row["value"] for row in rows if row["value"] > 0)
    for outcome, (marker, color) in MARKS.items():
        own = [row for row in rows if row["outcome"] == outcome]
        if not own:
            continue
        x = [row["value"] or smallest / 10 for row in own]
        units = [row["units"] if math.isfinite(row["units"]) else LARGEST for row in own]
        if outcome in (Outcome.STOPPED, Outcome.EARLY, Outcome.UNDECIDED):
            units = [SMALLEST] * len(own)
        y = np.clip(units, SMALLEST, LARGEST)
        ax.plot(x, y, marker, ms=3.5, color=color, label=f"{outcome.value} ({len(own)})")
    ax.axhline(1, color="black", lw=0.7)
    for end in chosen.holds:
        if smallest < end < math.inf and end < max(row["value"] for row in rows):
            ax.axvline(end, color="black", lw=0.7, ls="--")
    ax.set(xscale="log", yscale="log", ylim=(SMALLEST / 2, LARGEST * 2))
    ax.set(xlabel=chosen.symbol, ylabel="error / allowed error")
    ax.legend(loc="best")
