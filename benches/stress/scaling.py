"""Direct contact with gap, amplitudes and start scaled together: the motion must scale with them.

With x1, x2 and delta, f1, f2 multiplied by s the equations of direct contact do not change (docs/
theory.md, section 1): same times, states s times as large. For s a power of two not even the
rounding may change. Only where chatter is completed there is an absolute tolerance, in time and
state: completed early or late, the motion is the same to that tolerance.
"""

from typing import Any

import numpy as np
from matplotlib.axes import Axes

import vibroimpact as vi
from ranges import base, start
from vibroimpact.plot.style import BLUE, VERMILLION

Row = dict[str, Any]
LENGTHS = ("gap", "moment_amplitude", "force_amplitude")
STATES = ("x1", "v1_pre", "v1_post", "x2", "v2_pre", "v2_post", "impulse_normal")
# Powers of two from 1e-8 to 1e8, and far beyond.
EXPONENTS = (*range(-27, 28, 3), -240, -100, -50, 50, 100, 240)
PERIODS = 10
TOLERANCE = 1e-12


def scaling(cases: int, seed: int = 6) -> list[Row]:
    """One row for each random case and scale.

    `equal`: same bits of all times and scaled states. `difference`: of the stroboscopic states,
    as a part of the largest, with the tolerance scaled too; `fixed`: with its default.
    """
    rng = np.random.default_rng(seed)
    return [row for _ in range(cases) for row in _case(rng)]


def _case(rng: np.random.Generator) -> list[Row]:
    restitution = rng.choice([0.0, rng.uniform(0, 0.5), rng.uniform(0.5, 1), 1.0])
    mass_ratio = rng.choice([0.0, 10 ** rng.uniform(-1, 1), 10 ** rng.uniform(-1, 1)])
    values = base(rng, contact="direct", restitution=restitution, mass_ratio=mass_ratio)
    system, initial = vi.System(**values), start(rng, values)
    plain = _run(system, initial, TOLERANCE)
    rows = []
    for exponent in EXPONENTS:
        s = 2.0**exponent
        scaled = system.replace(**{name: s * values[name] for name in LENGTHS})
        there = tuple(s * x for x in initial)
        along, fixed = (_run(scaled, there, t) for t in (TOLERANCE * s, TOLERANCE))
        rows.append(
            {
                "exponent": exponent,
                "contact": bool(len(plain.contacts)),
                "equal": _equal(plain, along, s),
                "difference": _difference(plain, along, s),
                "fixed": _difference(plain, fixed, s),
            }
        )
    return rows


def _run(system: vi.System, initial: tuple[float, ...], tolerance: float) -> vi.Run:
    return vi.simulate(
        system, initial=initial, periods=PERIODS, chatter_tolerance=tolerance, max_events=20_000
    )


def _equal(plain: vi.Run, other: vi.Run, s: float) -> bool:
    """Whether impacts and sections agree bit for bit."""
    a, b = plain.impacts, other.impacts
    return (
        plain.stop_reason == other.stop_reason
        and len(a) == len(b)
        and np.array_equal(a["time"], b["time"])
        and all(np.array_equal(s * a[name], b[name]) for name in STATES)
        and np.array_equal(s * plain.stroboscopic, other.stroboscopic)
    )


def _difference(plain: vi.Run, other: vi.Run, s: float) -> float:
    """Of the sections, as a part of the largest state; 1 where the runs end differently."""
    a, b = plain.stroboscopic, other.stroboscopic / s
    if plain.stop_reason != other.stop_reason or len(a) != len(b):
        return 1.0
    return float(np.abs(a - b).max() / np.abs(a).max()) if len(a) else 0.0


def plot_scaling(rows: list[Row], ax: Axes) -> None:
    """The largest difference at each scale, with and without lasting contact."""
    exponents = sorted({row["exponent"] for row in rows if abs(row["exponent"]) <= 50})
    kinds = (
        ("impacts only", False, "difference", "o", BLUE),
        ("with chatter, tolerance scaled", True, "difference", "s", "black"),
        (r"with chatter, tolerance $10^{-12}$", True, "fixed", "^", VERMILLION),
    )
    for text, contact, key, marker, color in kinds:
        worst = [
            max(
                (r[key] for r in rows if r["exponent"] == k and r["contact"] == contact),
                default=0.0,
            )
            for k in exponents
        ]
        scales = [2.0**k for k in exponents]
        ax.plot(scales, worst, marker, ms=4, mfc="none", color=color, label=text)
    ax.set_xscale("log")
    ax.set_yscale("symlog", linthresh=1e-16)
    ax.set_ylim(-2e-17, 1e-12)
    ax.set(xlabel=r"scale $s$ of $\delta, f_1, f_2$ and start", ylabel="largest relative change")
    ax.legend()
