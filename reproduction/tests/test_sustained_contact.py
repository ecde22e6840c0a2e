"""The claim on the low frequencies of Fig. 7(c): computed, and judged by what is computed."""

import dataclasses
import json

import numpy as np
import pytest

import vibroimpact as vi
from han_jin_hu_2004 import INITIAL, KEEP, PERIODS, TRANSITIONS, claims, sustained_contact

BY_ID = {transition.id: transition for transition in TRANSITIONS}


@pytest.fixture(scope="module")
def observed() -> sustained_contact.SustainedContact:
    return sustained_contact.observe(BY_ID["7c"], frequencies=41)


def test_complete_chatter_up_to_the_edge_and_contact_for_a_part_of_the_period(observed):
    # docs/theory.md, section 5: omega <= 0.48; 24 %, 18 %, 9.5 % of the period.
    assert observed.edge == pytest.approx(0.48, abs=1e-9)
    shares = [sustained_contact.contact_share(run) for run in observed.examples]
    assert [run.system.drive_frequency for run in observed.examples] == [0.25, 0.30, 0.45]
    assert (np.abs(np.array(shares) - [0.24, 0.18, 0.095]) <= [5e-3, 5e-3, 5e-4]).all()
    assert [sustained_contact.chattering_periods(run) for run in observed.examples] == [KEEP] * 3


def test_the_claim_says_so_and_can_be_written(observed):
    claim = sustained_contact.evaluate(observed)
    assert (claim.id, claim.figure, claim.verdict) == ("7c-low", 7, "refuted")
    assert claim.found == (
        "1-inf up to omega = 0.48; in contact 24.1% at 0.25, 18.0% at 0.3, 9.5% at 0.45"
    )
    assert claim.residual < 1e-12
    assert "100 of 100 at 0.3" in claim.evidence
    (stored,) = json.loads(claims.to_json([claim]))
    assert stored == dataclasses.asdict(claim)
    assert "## Fig. 7(c), low frequencies: refuted" in claims.to_markdown([claim])
    assert "--vary drive-frequency 0.2 0.6 161" in claim.command
    assert claim.command in claims.to_markdown([claim])


def test_without_chatter_the_paper_is_right():
    # Fig. 7(b) has f2 = 0.5: no chatter at any of these frequencies.
    observed = sustained_contact.observe(BY_ID["7b"], frequencies=5)
    assert observed.edge is None
    claim = sustained_contact.evaluate(observed)
    assert claim.verdict == "reproduced"
    assert claim.found.startswith("no complete chatter at the lowest frequency")


def test_chatter_at_some_frequencies_only_leaves_it_open(observed):
    above = vi.simulate(
        BY_ID["7c"].system.replace(drive_frequency=0.55),
        initial=INITIAL,
        periods=PERIODS,
        keep=KEEP,
    )
    assert sustained_contact.chattering_periods(above) == 0
    mixed = dataclasses.replace(observed, examples=[*observed.examples[:2], above])
    assert sustained_contact.evaluate(mixed).verdict == "open"
