"""Section 3.3 and Appendix C: stability and bifurcations of period n-1 motions."""

import math
from functools import cache

import numpy as np

from vibroimpact import Bifurcation, PeriodicMotion, follow_motion, periodic_motions, simulate

from ..claims import Verdict
from ..parameters import INITIAL, paper_system
from ..printed_impact import coefficient_slopes, frictionless_coefficients
from . import printed_motion as printed
from .model import coefficients, damped_motions, unknowns
from .printed_roots import apart, characteristic, roots
from .statement import CLEAR, Finding, formula, mended, stated

ERRATA = "theory.md#8-errata-of-the-paper"
RETURN_MAP = "theory.md#7-what-does-not-depend-on-the-integrator"
# Derivatives by complex steps are exact; what is left is the rounding of products.
EXACT = 1e-11


def _y(motion: PeriodicMotion) -> np.ndarray:
    x10, v1, v2, phase = motion.state
    return np.array([x10, v1, v2, phase])


def _parts(motion: PeriodicMotion) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """S, r, and the derivatives of r."""
    system = motion.system
    slope = coefficient_slopes(np.array(motion.state[0]), system.mass_ratio, system.restitution)
    return printed.period(system, motion.m), coefficients(motion), slope


@stated("eq41", "eq. (41)", "the conditions of a fixed point in (x10, x10', x20', phi)")
def fixed_point() -> Finding:
    """Put solutions into them."""
    worst = 0.0
    for motion in damped_motions():
        s, r, _ = _parts(motion)
        off = printed.residual_41(s, r, motion.system.gap, _y(motion))
        worst = max(worst, float(np.abs(off).max() / (1.0 + np.abs(unknowns(motion)).max())))
    return formula(
        worst, f"over {len(damped_motions())} solutions found by intervals", allowed=1e-9
    )


def _exact_jacobian(motion: PeriodicMotion) -> np.ndarray:
    """Derivative of (41) by complex steps."""
    s, system, h = printed.period(motion.system, motion.m), motion.system, 1e-30
    columns = []
    for k in range(4):
        y = _y(motion).astype(complex)
        y[k] += 1j * h
        moved = frictionless_coefficients(y[0], system.mass_ratio, system.restitution)
        columns.append(printed.residual_41(s, moved, system.gap, y).imag / h)
    return np.column_stack(columns)


@stated("eq42-43", "eqs. (42), (43)", "the Jacobian of the fixed-point conditions, entry by entry")
def jacobian() -> Finding:
    """Compare with the derivative of (41)."""
    worst = 0.0
    for motion in damped_motions():
        s, r, slope = _parts(motion)
        exact = _exact_jacobian(motion)
        found = printed.jacobian_43(s, r, slope, _y(motion))
        worst = max(worst, float(np.abs(found - exact).max() / np.abs(exact).max()))
    return formula(
        worst,
        f"from the derivative of (41) by complex steps, relative, at {len(damped_motions())} "
        "solutions",
        allowed=EXACT,
    )


@stated("eq44", "eq. (44)", "derivatives of r_1 to r_4 by the impact angle", page=ERRATA)
def slopes() -> Finding:
    """Compare with complex steps."""
    x1, h, m, r = np.linspace(-1.5, 1.5, 301), 1e-30, 0.6, 0.8
    exact = frictionless_coefficients(x1 + 1j * h, m, r)
    off = float(np.abs(coefficient_slopes(x1, m, r) - exact.imag / h).max())
    return formula(
        off,
        "from complex steps at 301 angles, with r_{2,x1} in the third read as r_{2,x10}, as the "
        "text around it has it (E7)",
    )


@stated(
    "criterion",
    "section 3.3, eqs. (42), (45)",
    "a motion is stable if all eigenvalues of the Jacobian of (41) lie inside the unit circle",
    page=ERRATA,
)
def criterion() -> Finding:
    """Measure how a perturbation of the motions of Fig. 5 changes, and compare."""
    from ..criterion import verdict as verdict_by_45
    from ..existence import PERTURBATION, trial
    from ..parameters import MOTIONS

    agree, lines, measured_off = 0, [], 0.0
    shown = [motion for motion in MOTIONS if motion.figure == 5]
    for item in shown:
        n = int(item.paper_says[0])
        motion = next(motion for motion in periodic_motions(item.system, n) if motion.stable)
        made = trial(motion)
        _, paper = verdict_by_45(motion)
        returned = made.last < 0.1 * PERTURBATION
        agree += (paper < 1.0) == returned
        measured_off = max(measured_off, abs(made.measured - made.expected))
        lines.append(
            f"omega = {item.system.drive_frequency:g}: (45) {paper:.3f}, multiplier "
            f"{made.expected:.4f}, measured {made.measured:.4f}"
        )
    verdict: Verdict = "open"
    if agree == len(shown):
        verdict = "reproduced"
    elif agree == 0 and measured_off < 0.01:
        verdict = "refuted"
    return Finding(
        f"wrong for {len(shown) - agree} of {len(shown)} motions of Fig. 5",
        verdict,
        "largest modulus for the motions of Fig. 5: " + "; ".join(lines) + ". The Jacobian is that "
        "of the map's image minus its point at a fixed flight time; multipliers are the "
        "eigenvalues of the return map's derivative, which also changes the time of arrival (E5)",
    )


@stated("eq45", "eqs. (45), (C.1) to (C.4)", "the characteristic equation, written out")
def characteristic_equation() -> Finding:
    """Compare with those of random matrices."""
    random = np.random.default_rng(7)
    worst = 0.0
    for _ in range(500):
        a = random.normal(size=(4, 4))
        exact = np.poly(a)[:0:-1].real
        # J_k is of the order of the norm to the power 4 - k.
        size = float(np.linalg.norm(a)) ** np.arange(4, 0, -1)
        worst = max(worst, float((np.abs(np.array(characteristic(a)) - exact) / size).max()))
    return formula(worst, "relative, over 500 random matrices")


@stated("eq46-47", "eqs. (46), (47)", "the roots of (45) in closed form", page=ERRATA)
def closed_roots() -> Finding:
    """Compare with the eigenvalues of random matrices."""
    random = np.random.default_rng(8)
    off: dict[bool, list[float]] = {False: [], True: []}
    for _ in range(500):
        a = random.normal(size=(4, 4))
        exact = np.linalg.eigvals(a).astype(np.complex128)
        for corrected, found in off.items():
            found.append(apart(roots(characteristic(a), corrected=corrected), exact))
    return mended(
        float(np.median(off[False])),
        max(off[True]),
        "over 500 random matrices, the median as printed and the largest as corrected (E6)",
        "J2^2 for J2^3, and J3^2/2 - 4 J2/3 in D",
        # Closed roots of a quartic cancel.
        allowed=1e-8,
    )


@cache
def bifurcations() -> tuple[Bifurcation, ...]:
    """Bifurcations along the 1-1 motion of Fig. 5(b)."""
    system = paper_system(drive_frequency=1.8)
    motion = simulate(system, initial=INITIAL, periods=600, keep=100).refine()
    if not isinstance(motion, PeriodicMotion):
        raise RuntimeError(f"no motion at omega = 1.8: {motion.reason}")
    return tuple(follow_motion(motion, drive_frequency=(1.4, 2.2)).bifurcations)


def _at(kind: str, critical: complex | None) -> Finding:
    """Look at the multipliers, and at the roots of (45), where a bifurcation of a kind is found."""
    found = [item for item in bifurcations() if item.kind == kind]
    true, papers = 0.0, math.inf
    for item in found:
        motion = item.motion
        true = max(true, _from_circle(motion.multipliers, critical))
        s, r, slope = _parts(motion)
        eigenvalues = np.linalg.eigvals(printed.jacobian_43(s, r, slope, _y(motion)))
        papers = min(papers, _from_circle(eigenvalues, critical))
    verdict: Verdict = "open"
    if found and true < 1e-6:
        verdict = "corrected" if papers > CLEAR else "reproduced"
    elif found and true > CLEAR:
        verdict = "refuted"
    where = ", ".join(f"{item.value:.6f}" for item in found)
    return Finding(
        f"true of multipliers ({true:.0e}), not of the roots of (45) ({papers:.2g})",
        verdict,
        f"along the 1-1 motion of Fig. 5(b) this bifurcation is located at omega = {where}; a "
        f"multiplier is there within {true:.1g} of the place named, of the roots of (45) none "
        f"comes closer than {papers:.3g} (E5)",
    )


def _from_circle(values: np.ndarray, critical: complex | None) -> float:
    """Distance of the nearest eigenvalue from 1 or -1, or of a complex one from the circle."""
    if critical is not None:
        return float(np.abs(values - critical).min())
    pair = values[np.abs(values.imag) > CLEAR]
    return float(np.abs(np.abs(pair) - 1.0).min()) if len(pair) else math.inf


@stated(
    "saddle-node",
    "section 3.3, bifurcation type 1",
    "saddle-node: a root of (45) passes through +1",
    page=RETURN_MAP,
    slow=True,
)
def saddle_node() -> Finding:
    """Look at the located ones."""
    return _at("saddle_node", 1.0)


@stated(
    "period-doubling",
    "section 3.3, bifurcation type 2",
    "period doubling: a root of (45) passes through -1",
    page=RETURN_MAP,
    slow=True,
)
def period_doubling() -> Finding:
    """Look at the located ones."""
    return _at("period_doubling", -1.0)


@stated(
    "hopf",
    "section 3.3, bifurcation type 3",
    "Hopf: a complex pair of roots of (45) passes through the unit circle",
    page=RETURN_MAP,
    slow=True,
)
def hopf() -> Finding:
    """Look at the located ones."""
    return _at("neimark_sacker", None)
