"""How verdicts follow from shares and counts, and that wrong numbers change them."""

import numpy as np
import pytest

import vibroimpact as vi
from han_jin_hu_2004.statements import (
    STATEMENTS,
    existence_figures,
    explicit,
    frictional,
    general,
    planar,
    sections,
    slip,
    undamped,
)


@pytest.mark.parametrize(
    ("share", "verdict"), [(0.01, "reproduced"), (0.1, "corrected"), (0.396, "refuted")]
)
def test_what_is_strict_must_be_rare(share, verdict):
    rare, common = existence_figures.RARE, existence_figures.COMMON
    assert existence_figures.by_share(share, rare=rare, common=common) == verdict


@pytest.mark.parametrize(
    ("usual", "most", "beyond", "verdict"),
    [
        (0.04, 0.14, 0.0, "refuted"),
        (0.04, 0.3, 0.0, "corrected"),
        (0.3, 0.5, 0.0, "reproduced"),
        (0.3, 0.5, 0.4, "corrected"),
    ],
)
def test_easily_needs_a_share(usual, most, beyond, verdict):
    assert undamped.easily(usual, most, beyond) == verdict


@pytest.mark.parametrize(
    ("periodic", "pieces", "verdict"),
    [
        (0.64, 3, "refuted"),
        (0.64, None, "refuted"),
        (0.3, 3, "corrected"),
        (0.3, 1, "reproduced"),
        (0.3, None, "open"),
    ],
)
def test_islands_need_a_sea(periodic, pieces, verdict):
    assert undamped.as_islands(periodic, pieces) == verdict


@pytest.mark.parametrize(
    ("fresh", "other", "there", "verdict"),
    [
        (True, True, [], "reproduced"),
        (True, True, ["4-5"], "reproduced"),
        (True, True, ["6-7"], "corrected"),
        (False, True, [], "corrected"),
        (False, False, ["6-7"], "refuted"),
    ],
)
def test_a_motion_is_judged_where_the_paper_names_it(fresh, other, there, verdict):
    assert frictional.observed("4-5", fresh=fresh, other=other, there=there) == verdict


def test_the_place_of_a_motion_comes_from_the_captions():
    assert frictional.named_at("4-5") == {1.5752: "6-7"}
    assert frictional.named_at("6-6") == {}


@pytest.mark.parametrize(
    ("before", "after", "verdict"),
    [
        (0.0, [0.5, 0.4], "reproduced"),
        (0.2, [0.5, 0.4], "corrected"),
        (1.0, [1.0, 0.79], "refuted"),
        (0.0, [0.0, 0.0], "refuted"),
        (0.0, [0.5, 0.0], "open"),
    ],
)
def test_what_is_new_was_not_there_before(before, after, verdict):
    assert frictional.is_new(before, after) == verdict


@pytest.mark.parametrize(
    ("undamped_shares", "damped_shares", "verdict"),
    [
        ([0.64, 0.63], [0.77, 1.0], "refuted"),
        ([0.4, 0.3], [0.77, 1.0], "corrected"),
        ([0.4, 0.3], [0.2, 0.4], "reproduced"),
        ([0.6, 0.3], [0.7, 0.4], "open"),
    ],
)
def test_care_is_needed_where_most_choices_fail(undamped_shares, damped_shares, verdict):
    assert general.with_care(undamped_shares, damped_shares) == verdict


def test_the_most_frequent_label_is_counted():
    assert general.most_frequent(np.array(["1-1", "2-1", "1-1", "1-1"])) == 0.75


def test_different_points_are_counted():
    points = np.array([[0.0, 1.0], [1e-9, 1.0], [0.5, 1.0], [0.0, 1.0]])
    assert sections.different(points) == 2


def test_no_wrong_state_of_39_passes(monkeypatch):
    right = existence_figures.state_39_40
    monkeypatch.setattr(existence_figures, "state_39_40", lambda *given: right(*given) * 1.001)
    assert STATEMENTS["x10-decides"].evaluate().verdict == "refuted"


def test_a_wrong_amplitude_is_no_solution_of_35(monkeypatch):
    right = explicit.amplitude
    monkeypatch.setattr(explicit, "amplitude", lambda *given: right(*given) * 1.001)
    assert STATEMENTS["no-analytic-solution"].evaluate().verdict == "open"


def test_the_amplitude_of_the_simplified_system_is_that_of_38():
    from han_jin_hu_2004.parameters import paper_system
    from han_jin_hu_2004.statements.printed_motion import equation_38

    system = paper_system(drive_frequency=0.65)
    factor = explicit.amplitude(system, 1, 0.4)
    left, right = equation_38(system.replace(moment_amplitude=factor), 1, 0.4)
    assert left == pytest.approx(right, rel=1e-12)


def test_wrong_planar_impacts_are_noticed(monkeypatch):
    right = planar.stepped
    monkeypatch.setattr(planar, "stepped", lambda given: tuple(1.1 * v for v in right(given)))
    assert STATEMENTS["no-closed-forms"].evaluate().verdict == "open"


def test_planar_impacts_of_pendulum_and_mass_are_those_of_the_package():
    from han_jin_hu_2004.statements.samples import FRICTION, impacts

    table = impacts(size=2000)
    cos, sin, ones = np.cos(table["x1"]), np.sin(table["x1"]), np.ones(len(table))
    # The tip leaves the mass with un = x2' - x1' cos x1; it slides with ut = x1' sin x1.
    given = planar.Impacts(
        a=cos**2 + 0.6,
        b=-cos * sin,
        c=sin**2,
        un=table["v2_pre"] - table["v1_pre"] * cos,
        ut=table["v1_pre"] * sin,
        friction=FRICTION * ones,
        restitution=0.8 * ones,
    )
    un, ut = planar.closed(given)
    assert un == pytest.approx(table["v2_post"] - table["v1_post"] * cos, abs=1e-9)
    assert ut == pytest.approx(table["v1_post"] * sin, abs=1e-9)


def test_expressions_that_hold_everywhere_are_noticed(monkeypatch):
    monkeypatch.setattr(slip, "given_by", lambda table, form: 1.0)
    assert STATEMENTS["simple-laws"].evaluate().verdict == "refuted"
    assert STATEMENTS["no-single-expression"].evaluate().verdict == "refuted"


def test_friction_that_depends_on_nothing_is_noticed(monkeypatch):
    monkeypatch.setattr(slip, "_share", lambda table: np.full(len(table), slip.FRICTION))
    assert STATEMENTS["instantaneous-friction"].evaluate().verdict == "refuted"
    # Pt = mu Pn where slip ends, too, would leave nothing to compare with.
    assert STATEMENTS["force-maxima"].evaluate().verdict == "open"


def test_points_that_never_return_refute_the_sections(monkeypatch):
    monkeypatch.setattr(sections, "different", len)
    for name in ("eq48b", "any-coordinate", "both-sections"):
        assert STATEMENTS[name].evaluate().verdict == "refuted"


def test_a_diagram_without_sharp_steps_has_no_jumps(monkeypatch):
    monkeypatch.setattr(undamped, "_apart", lambda one, other: 0.0)
    assert STATEMENTS["fig4-jumps"].evaluate().verdict == "refuted"


def test_motions_of_one_start_only_are_not_decided_by_the_drive(monkeypatch):
    monkeypatch.setattr(general, "most_frequent", lambda labels: 0.5)
    assert STATEMENTS["drive-decides"].evaluate().verdict == "refuted"


def test_impacts_that_end_would_be_those_of_the_figure(monkeypatch):
    def until_400(system, **options):
        run = vi.simulate(system, initial=options["initial"], time=400.0)
        assert run.impact_count == 4
        return run

    monkeypatch.setattr(frictional, "simulate", until_400)
    assert STATEMENTS["fig10-400"].evaluate().verdict == "reproduced"
