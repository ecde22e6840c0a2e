"""The claim on restitution is computed, and fits the tables; the pages beside the figures."""

import dataclasses
import json
import subprocess
import sys

import numpy as np
import pytest

import vibroimpact as vi
from han_jin_hu_2004 import claims, coexistence, islands, reproduction, restitution

AXES = {"x1": np.linspace(-1.5, 1.5, 40), "velocity_ratio": np.linspace(-2.0, 2.0, 30)}


def made(**changes) -> vi.System:
    return restitution.SYSTEM.replace(**changes)


@pytest.fixture(scope="module")
def computed() -> restitution.Restitution:
    return restitution.compute()


def test_the_first_conclusion_is_reproduced_from_the_spread(computed):
    claim = restitution.judge(computed)
    assert (claim.id, claim.figure, claim.verdict) == ("conclusion-1", None, "reproduced")
    low, high = computed.regimes.spread
    assert claim.found == f"-u_post/u {low:.3f} to {high:.3f}"
    assert high - low > 0.4
    # The reference comes from the integrator in small steps, and agrees to their size.
    assert claim.reference["spread"] == pytest.approx([low, high], abs=0.02)
    assert claim.reference["spread"] != [low, high]
    assert "newton 0.800 to 0.800" in claim.evidence


def test_without_a_spread_the_conclusion_is_refuted(computed):
    # Restitution that newton's law prescribes is constant, and small steps agree that it is.
    prescribed = dataclasses.replace(
        computed,
        regimes=computed.by_law["newton"],
        stepped=vi.impact_regimes(made(law="newton"), steps=30, **AXES),
    )
    assert restitution.judge(prescribed).verdict == "refuted"
    # A spread that the steps do not bear out stays open.
    doubtful = dataclasses.replace(
        computed, stepped=vi.impact_regimes(made(restitution=0.5), **AXES)
    )
    low, high = doubtful.regimes.spread
    apart = max(abs(np.subtract(doubtful.stepped.spread, (low, high))))
    assert apart < high - low < 3 * apart
    assert restitution.judge(doubtful).verdict == "open"


def test_the_command_of_the_claim_prints_the_spread(computed):
    claim = restitution.judge(computed)
    code = claim.command.removeprefix('python -c "').removesuffix('"')
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    low, high = computed.regimes.spread
    assert f"-u_post/u {low:.3g} ... {high:.3g}" in done.stdout


def test_the_claim_fits_the_tables(computed):
    claim = restitution.judge(computed)
    assert json.loads(claims.to_json([claim]))[0]["figure"] is None
    assert "| Conclusion 1 | restitution is not a constant |" in claims.to_markdown([claim])
    assert "## Conclusion 1: reproduced" in claims.to_markdown([claim])
    assert "Conclusion 1" in claims.table([claim])


def test_reproduce_draws_more_pages_with_all_figures(tmp_path, monkeypatch):
    monkeypatch.setattr(reproduction, "FIGURES", ())
    # The islands have tests of their own.
    nothing = islands.Islands(regions=(), settled=(), inside=np.empty(0, dtype=bool))
    monkeypatch.setattr(islands, "compute", lambda **options: nothing)
    # These pages are drawn of what little they need.
    monkeypatch.setattr(coexistence, "FREQUENCIES", 2)
    monkeypatch.setattr(coexistence, "STARTS", 24)
    monkeypatch.setattr(coexistence, "SETTLING", 1000)
    monkeypatch.setattr(restitution, "STEPS", 30)
    made = reproduction.reproduce(tmp_path, formats=("pdf",), frequencies=20, progress=False)
    pages = ["impact-regimes", "impact-incremental"]
    pages += ["orbits-coexistence", "orbits-multipliers", "orbits-portraits", "islands"]
    names = [f"{page}.pdf" for page in pages]
    assert [path.name for path in made.files] == [*names, "claims.json", "claims.md", "index.md"]
    assert all(path.stat().st_size > 300 for path in made.files)
    assert [claim.id for claim in made.claims] == ["conclusion-1"]
    assert all(claim.decided_by for claim in made.claims)
