"""The first conclusion of the paper: restitution in an oblique impact is not a constant.

The effective coefficient -u_post/u of every impact, from `vibroimpact.impact_regimes`, beside a
control without friction and the incremental-impulse integrator; docs/theory.md, section 4.
"""

from dataclasses import dataclass

import numpy as np

from vibroimpact import (
    ImpactAgreement,
    ImpactRegimes,
    Regime,
    impact_agreement,
    impact_regimes,
    plot,
)

from .claims import Claim, Verdict
from .layout import Page, values
from .parameters import LAWS, paper_system

SYSTEM = paper_system(friction=0.5)
STEPS = 300
"""Steps of the incremental-impulse integrator for the reference."""
_SHOWN = ("mass_ratio", "restitution", "friction")
# A spread counts if it is this many times the uncertainty.
_CLEAR = 3.0


@dataclass(frozen=True)
class Restitution:
    """The maps behind the claim: as simulated, stepped, without friction, and by the other laws."""

    regimes: ImpactRegimes
    stepped: ImpactRegimes
    frictionless: ImpactRegimes
    by_law: dict[str, ImpactRegimes]


def compute() -> Restitution:
    """Resolve the impacts of the paper's system with friction, and those to compare with."""
    return Restitution(
        regimes=impact_regimes(SYSTEM),
        stepped=impact_regimes(SYSTEM, steps=STEPS),
        frictionless=impact_regimes(SYSTEM.replace(friction=0.0)),
        by_law={law: impact_regimes(SYSTEM.replace(law=law)) for law in LAWS},
    )


def judge(computed: Restitution) -> Claim:
    """Compare the spread of -u_post/u with its uncertainty.

    The uncertainty is the larger of what the control without friction spreads by, where the
    coefficient is r, and of what the incremental integrator differs by at either end.
    """
    low, high = computed.regimes.spread
    stepped = computed.stepped.spread
    control = computed.frictionless.spread
    uncertainty = max(control[1] - control[0], abs(stepped[0] - low), abs(stepped[1] - high))
    verdict: Verdict = "open"
    if high - low > _CLEAR * uncertainty:
        verdict = "reproduced"
    elif high - low <= uncertainty:
        verdict = "refuted"
    given = computed.regimes.system.to_dict().items()
    arguments = ", ".join(
        f"{name}={value!r}" for name, value in given if isinstance(value, float) and value != 0.0
    )
    return Claim(
        id="conclusion-1",
        figure=None,
        source="Han, Jin & Hu (2004), section 5",
        paper_says="restitution is not a constant",
        found=f"-u_post/u {_range(computed.regimes)}",
        residual=None,
        reference={"label": _range(computed.stepped), "steps": STEPS, "spread": list(stepped)},
        verdict=verdict,
        decided_by=f"-u_post/u varies by {high - low:.3f}, known to {uncertainty:.1g}",
        details=_evidence(computed),
        command=(
            'python -c "import vibroimpact as vi; '
            f'print(vi.impact_regimes(vi.System({arguments})))"'
        ),
    )


def _evidence(computed: Restitution) -> str:
    system, result = computed.regimes.system, computed.regimes
    parts = []
    for regime in Regime:
        inside = result.restitution[result.regime == regime]
        if inside.size:
            name = plot.REGIME_STYLES[regime].text
            parts.append(f"{name} {inside.min():.3f} to {inside.max():.3f}")
    laws = ", ".join(f"{law} {_range(found)}" for law, found in computed.by_law.items())
    return (
        f"-u_post/u over {result.regime.size} impacts at mu = {system.friction:g}, "
        f"r = {system.restitution:g}, mbar = {system.mass_ratio:g}, by regime: {', '.join(parts)}; "
        f"without friction {_range(computed.frictionless)}; by law: {laws} (newton prescribes it); "
        f"the reference is the incremental-impulse integrator with {STEPS} steps"
    )


def _range(result: ImpactRegimes) -> str:
    low, high = result.spread
    return f"{low:.3f} to {high:.3f}"


def draw(computed: Restitution, claim: Claim) -> Page:
    """Draw regime, effective restitution and energy loss of every impact, under the verdict."""
    result = computed.regimes
    page = Page(
        f"The paper: {claim.paper_says} in oblique impacts. {claim.verdict.capitalize()}: "
        f"$-u_{{+}}/u$ {_range(result)}.",
        rows=1,
        row_height=76.0,
    )
    axes = page.row(_parameters(result), columns=3)
    plot.impact_regimes(result, axes, legend=False)
    page.legend(plot.regime_handles(result.regime.ravel().tolist(), shapes=False))
    return page


def draw_agreement(agreement: ImpactAgreement) -> Page:
    """Draw the exact impulse path against the incremental integration, by law and regime."""
    page = Page(
        "Impacts in closed form against many small steps of the impulse: order of the difference "
        f"{np.nanmin(agreement.order):.2f} to {np.nanmax(agreement.order):.2f} in the step",
        rows=1,
        row_height=72.0,
    )
    count = int(agreement.impacts.sum())
    axes = page.row(
        f"{values(agreement.system, _SHOWN)}; mean over {count} impacts, by law and regime",
        columns=len(agreement.laws),
    )
    plot.impact_agreement(agreement, axes, legend=False)
    for ax in axes[1:]:
        ax.tick_params(labelleft=False)
    present = [number for number, seen in enumerate(agreement.impacts) if seen]
    page.legend(plot.regime_handles(present))
    return page


def agreement() -> ImpactAgreement:
    """Compare both ways to resolve the impacts of the paper's system with friction."""
    return impact_agreement(SYSTEM)


def _parameters(result: ImpactRegimes) -> str:
    system = result.system
    return (
        f"{values(system, _SHOWN)}, law of {system.law.capitalize()}; "
        r"$u = \dot x_1\cos x_1 - \dot x_2$ before, $u_{+}$ after the impact, $E$ kinetic energy"
    )
