"""Figs. 2 and 3: the claims on them, their simulations and their pages."""

import dataclasses
import subprocess
import sys

import matplotlib as mpl
import numpy as np
import pytest

from han_jin_hu_2004 import claims, existence, reproduce
from references import reference


@pytest.fixture(scope="module")
def computed():
    return existence.compute(2, 29)


@pytest.fixture(scope="module")
def judged(computed):
    return existence.judge(computed)


@pytest.fixture(scope="module")
def page(computed, judged):
    return existence.draw(computed, judged)


def test_the_figure_is_refuted_by_its_counts(computed, judged):
    # Of the kind of errata E5, whose grid is another: 118 stable ones, 1 of them right, 210 missed.
    claim, *_ = judged
    rows = computed.map.solutions
    paper, real = computed.stable_by_45, rows["admissible"] & rows["stable"]
    assert claim.paper_says == f"{paper.sum()} stable 1-1 motions"
    assert claim.found == f"{(paper & real).sum()} of them, and {(real & ~paper).sum()} others"
    assert (paper & real).sum() < 0.05 * paper.sum()
    assert (real & ~paper).sum() > 0.9 * real.sum() > 100
    assert claim.verdict == "refuted"
    assert computed.map.undecided.sum() == 0


def test_simulations_confirm_what_the_multipliers_say(computed):
    assert len(computed.stable) == len(computed.unstable) == existence.SAMPLE
    assert computed.returned == computed.left == existence.SAMPLE
    for trial in computed.stable:
        assert trial.expected < 1.0
        # A fit over a few orbits, of a distance that may oscillate.
        assert trial.measured == pytest.approx(trial.expected, abs=0.1)
    for trial in computed.unstable:
        assert trial.expected > 1.0
        assert not trial.measured < 1.0


def test_without_confirmation_the_verdict_is_open(computed):
    lost = dataclasses.replace(computed.stable[0], last=1.0)
    doubtful = dataclasses.replace(computed, stable=(lost, *computed.stable[1:]))
    claim, *_ = existence.judge(doubtful)
    assert claim.verdict == "open"
    assert claim.reference["label"] == f"{existence.SAMPLE - 1} of {existence.SAMPLE} return"


def test_the_quoted_solution_is_no_motion(judged):
    # Errata E4.
    claim = judged[1]
    assert (claim.id, claim.verdict) == ("2 quoted", "refuted")
    assert claim.paper_says == "stable 1-1 at x10 = 0.5369"
    assert "separating before the impact (u = -0.234)" in claim.evidence
    assert "is stable by (45), largest eigenvalue 0.9099" in claim.evidence
    assert "separate without an impact" in claim.evidence


def test_the_motions_of_figure_5_are_stable_against_the_criterion(judged):
    # Errata E5, its numbers.
    known = {"5a by (45)": (1.88, 0.985), "5b by (45)": (1.43, 0.959)}
    found = {claim.id: claim for claim in judged[2:]}
    assert found.keys() == known.keys()
    for name, (paper, true) in known.items():
        claim = found[name]
        assert claim.verdict == "refuted"
        says, number = claim.paper_says.split(", ")
        assert (says, float(number)) == ("unstable", pytest.approx(paper, abs=5.5e-3))
        assert claim.found == f"stable, {true:.3f}"
        assert claim.reference["factor"] == pytest.approx(true, abs=1e-3)


def test_the_page_shows_both_and_the_claims_fit_the_tables(judged, page):
    texts = [text.get_text() for text in page.figure.findobj(mpl.text.Text)]
    assert {"(c)  $f_1 = 0.5$", "quoted", "Fig. 5a", "Fig. 5b"} <= set(texts)
    axes = page.figure.get_axes() or [ax for part in page.figure.subfigs for ax in part.get_axes()]
    assert len(axes) == 2 * (2 + len(existence.SLICES[2]))
    assert f"| Fig. 2 | {judged[0].paper_says} |" in claims.to_markdown(judged)
    assert any("white: none,\nas at $\\omega =$ 0.2, 0.4, 0.5, 1" in text for text in texts)
    (legend,) = page.figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [
        "left: stable by (45)",
        "left: unstable by (45)",
        "right: stable motion",
        "right: unstable motion",
        "right: not admissible",
    ]
    rows = claims.table(judged).splitlines()
    # What is long goes on in rows without a title.
    assert [row.split("  ")[0] for row in rows if not row.startswith(" ")] == [
        "figure or statement",
        "-" * len("Fig. 5(a), stability by eq. (45)"),
        "Fig. 2",
        "Fig. 2, quoted motion",
        "Fig. 5(a), stability by eq. (45)",
        "Fig. 5(b), stability by eq. (45)",
    ]
    assert claims.to_json(judged).count('"figure": 2') == len(judged)


def test_drawn_branches_have_no_gaps_where_they_turn(computed, page):
    coarse = computed.map.at(moment_amplitude=1.0)
    left, _ = page.figure.subfigs[2 + existence.SLICES[2].index(1.0)].get_axes()
    drawn = np.concatenate([np.column_stack(line.get_data()) for line in left.get_lines()])
    known = np.column_stack([coarse.parameter("drive_frequency"), coarse.solutions["x1"]])
    away = np.abs(drawn[:, None] - known[None]).max(axis=2)
    assert away.min(axis=0).max() < 1e-9
    # The loop of 1-1 motions that ends near omega = 2.566: the two that meet there.
    last = drawn[(drawn[:, 0] > 2.4) & (drawn[:, 0] < 2.6)]
    end = last[last[:, 0] == last[:, 0].max()]
    before = known[(known[:, 0] > 2.4) & (known[:, 0] < 2.6)]
    assert np.ptp(end[:, 1]) < 0.5 * np.ptp(before[before[:, 0] == before[:, 0].max()][:, 1])


def test_the_commands_give_the_numbers_again(computed, judged):
    count, quoted, *_ = judged
    for claim, text in ((count, f"{len(computed.map.solutions)} solutions"), (quoted, "0.5369")):
        code = claim.command.removeprefix('python -c "').removesuffix('"')
        done = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        )
        assert text in done.stdout


def test_reproduce_draws_figures_2_and_3(tmp_path):
    made = reproduce(tmp_path, figures=[3], frequencies=8, progress=False)
    assert [path.name for path in made.files] == [
        "fig3.png",
        "claims.json",
        "claims.md",
        "index.md",
    ]
    assert [claim.id for claim in made.claims] == ["3", "3 quoted", "5c by (45)"]
    assert all(claim.decided_by for claim in made.claims)


def test_named_motions_are_those_of_the_reference():
    for item in existence.QUOTED:
        entry = min(
            (e for e in reference("fixed_points.json") if e["params"]["omega"] == 0.65),
            key=lambda e: abs(e["x1"] - item.x10),
        )
        assert entry["x1"] == pytest.approx(item.x10, abs=5e-5)
        assert entry["paper_verdict"] == item.paper_says
