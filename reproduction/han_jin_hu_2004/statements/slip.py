"""Sections 1 and 2: what friction does to an impact beyond a law of restitution."""

import numpy as np

from vibroimpact import Regime

from .. import printed_impact as printed
from ..claims import Verdict
from .restitution_laws import (
    ENDING,
    FEW,
    LAW_PAGE,
    ROUGH,
    STEPPED,
    STEPS,
    after_apart,
    energy_gain,
)
from .samples import FRICTION, Table, before, impacts, in_regime
from .statement import CLEAR, ROUNDING, Finding, stated

REVERSING = (Regime.REVERSAL_APPROACH, Regime.REVERSAL_RESTITUTION)
STICKING = (Regime.STICK_APPROACH, Regime.STICK_RESTITUTION)


def given_by(table: Table, form: str) -> float:
    """Part of the impacts of which (14), (16) or (18), corrected, is the outcome."""
    pair = getattr(printed, form)(before(table, FRICTION, absolute=True))
    size = 1.0 + np.abs(table["v1_pre"]) + np.abs(table["v2_pre"])
    off = np.maximum(np.abs(pair[0] - table["v1_post"]), np.abs(pair[1] - table["v2_post"]))
    return float((off / size < 1e-9).mean())


def _share(table: Table) -> np.ndarray:
    """Tangential over normal impulse."""
    return np.asarray(np.abs(table["impulse_tangential"]) / table["impulse_normal"])


@stated(
    "slip-stops",
    "section 1, on ref. [22]",
    "slip can stop during an impact; then it reverses, or the contact goes on without slip",
)
def slip_stops() -> Finding:
    """Count both in impacts that are followed in small steps."""
    table = impacts(steps=STEPS, size=FEW)
    counts = [len(in_regime(table, *kinds)) for kinds in (REVERSING, STICKING)]
    verdict: Verdict = "reproduced" if min(counts) else "refuted"
    return Finding(
        f"reverses in {counts[0]}, sticks in {counts[1]} of {len(table)} impacts",
        verdict,
        f"of {len(table)} random impacts at mu = {FRICTION:g}, each followed in {STEPS} small "
        f"steps, slip stops in {len(in_regime(table, *ENDING))}: it reverses in {counts[0]}, and "
        f"the tip sticks in {counts[1]}",
    )


@stated(
    "force-maxima",
    "section 1, on refs. [27] to [29]",
    "tangential and normal force reach their maxima together if slip keeps its direction",
)
def force_maxima() -> Finding:
    """Compare the impulses: forces within the cone of friction whose impulses are on it are too."""
    table = impacts(steps=STEPS, size=FEW)
    kept, ends = in_regime(table, Regime.SLIP), in_regime(table, *ENDING)
    exact = _share(in_regime(impacts(), Regime.SLIP))
    off = float(np.abs(exact / FRICTION - 1.0).max())
    near = float(np.abs(_share(kept) / FRICTION - 1.0).max())
    below = float((_share(ends) / FRICTION < 1.0 - CLEAR).mean())
    verdict: Verdict = "open"
    if off < ROUNDING and near < STEPPED and below > 0.5:
        verdict = "reproduced"
    elif off > CLEAR:
        verdict = "refuted"
    return Finding(
        f"Pt = mu Pn in all {len(exact)}, and so at each instant",
        verdict,
        f"in {len(exact)} random impacts whose slip keeps its direction Pt = mu Pn to {off:.1g}, "
        f"and to {near:.1g} in {len(kept)} that are followed in {STEPS} small steps: as no force "
        "exceeds mu times the normal one, both are proportional at each instant, whatever the "
        f"course of the normal one; of {len(ends)} impacts in which slip ends {below:.0%} have "
        "Pt < mu Pn. So it is under Coulomb's law of friction; the experiments are those of others",
    )


@stated(
    "instantaneous-friction",
    "section 1",
    "the coefficient of instantaneous friction is hard to define and to measure",
    page=LAW_PAGE,
)
def instantaneous_friction() -> Finding:
    """See whether Pt/Pn, which (2) defines it by, is one number."""
    table = impacts()
    kept, ends = _share(in_regime(table, Regime.SLIP)), _share(in_regime(table, *ENDING))
    same = float(np.abs(kept - FRICTION).max()) < ROUNDING
    varies = float(np.ptp(ends))
    verdict: Verdict = "refuted"
    if varies > CLEAR:
        verdict = "corrected" if same else "reproduced"
    return Finding(
        f"it is mu where slip lasts, and {ends.min():.1g} to {ends.max():.2g} where it ends",
        verdict,
        f"at mu = {FRICTION:g} Pt/Pn is mu in all {len(kept)} random impacts in which slip lasts, "
        f"so that one of them would tell it, and anything from {ends.min():.2g} to "
        f"{ends.max():.4g} in the {len(ends)} in which slip ends: there it is no property of the "
        "bodies. How hard a measurement is, is not judged",
    )


@stated(
    "simple-laws",
    "section 2",
    "no simple law, such as Newton's or Poisson's, gives the velocities after oblique impacts",
    page=LAW_PAGE,
)
def simple_laws() -> Finding:
    """Let each law do without the course of the slip, and Poisson's with it."""
    table = impacts()
    alone = given_by(table, "slipping")
    newton = float(energy_gain(impacts(ROUGH, "newton")).max())
    unresolved = int((~np.isfinite(table["v1_post"])).sum())
    gain = float(energy_gain(table).max())
    off = after_apart(impacts(size=FEW), impacts(steps=STEPS, size=FEW))
    whole = unresolved == 0 and gain < ROUNDING and off < STEPPED
    verdict: Verdict = "reproduced"
    if alone == 1.0:
        verdict = "refuted"
    elif whole:
        verdict = "corrected"
    return Finding(
        f"alone right in {alone:.0%}; Poisson's law with the course of the slip does in all",
        verdict,
        f"of {len(table)} random impacts at mu = {FRICTION:g} a law alone, with friction of one "
        f"direction as in (18), gives {alone:.1%}, and Newton's law creates energy (up to "
        f"{newton:.1%} at mu = {ROUGH:g}); Poisson's law with the slip followed, which is what the "
        f"paper itself does in (11) to (18), leaves {unresolved} without outcome, creates none "
        f"(largest gain {gain:.2g}), and {STEPS} small steps of the impulse agree to {off:.2g}",
    )


@stated(
    "no-single-expression",
    "section 3.1",
    "with friction no single expression gives the velocities after an impact",
)
def no_single_expression() -> Finding:
    """Use each of the three for all impacts."""
    table = impacts()
    forms = {
        "(14)": "reversed_in_approach",
        "(16)": "reversed_in_restitution",
        "(18)": "slipping",
    }
    shares = {name: given_by(table, form) for name, form in forms.items()}
    verdict: Verdict = "refuted"
    if min(shares.values()) > 0.0 and max(shares.values()) < 1.0:
        verdict = "reproduced"
    listed = ", ".join(f"{name} {share:.0%}" for name, share in shares.items())
    return Finding(
        f"right in {listed}",
        verdict,
        f"part of {len(table)} random impacts at mu = {FRICTION:g} of which the expression, with "
        f"|sin theta|, is the outcome: {listed}; the tip sticks in the others (E3)",
    )
