"""Solutions over a grid: the same as one by one, their figures, and the claims on Figs. 2 and 3."""

import dataclasses
import math
import subprocess
import sys

import matplotlib as mpl
import numpy as np
import pytest

import vibroimpact as vi
from references import reference
from vibroimpact.paper import claims, existence, reproduce
from vibroimpact.paper.parameters import paper_system
from vibroimpact.single_impact.results import SOLUTION_DTYPE

mpl.use("Agg")
SYSTEM = paper_system()
FREQUENCIES = np.array([0.65, 1.0, 1.25, 1.8, 2.0, 2.75])
MOMENTS = np.array([0.5, 0.95, 1.5])


@pytest.fixture(scope="module", params=[1, 2])
def grid(request):
    return vi.motion_map(
        SYSTEM,
        request.param,
        within=(-1.5, 1.5),
        drive_frequency=FREQUENCIES,
        moment_amplitude=MOMENTS,
    )


def test_rows_are_the_motions_of_every_point(grid):
    assert grid.shape == (6, 3)
    rows = iter(grid.solutions)
    for i, omega in enumerate(FREQUENCIES):
        for j, moment in enumerate(MOMENTS):
            system = SYSTEM.replace(drive_frequency=omega, moment_amplitude=moment)
            alone = vi.periodic_motions(system, grid.n, within=(-1.5, 1.5))
            assert grid.undecided[3 * i + j] == len(alone.undecided)
            assert grid.empty[3 * i + j] == alone.note.startswith("no isolated")
            for motion, row in zip(alone, rows, strict=False):
                assert row["point"] == 3 * i + j
                state = [row[name] for name in ("x1", "v1", "v2", "phase")]
                growth = max(1.0, np.abs(motion.return_map).max())
                assert np.abs(np.array(state) - motion.state).max() <= 1e-14 * growth
                assert row["admissible"] == motion.admissible
                assert row["stable"] == motion.stable
                assert row["paper_stable"] == motion.paper_stable
                size = abs(motion.multipliers[0])
                assert row["largest_multiplier"] == pytest.approx(size, rel=1e-9)
                size = abs(motion.paper_eigenvalues[0])
                assert row["largest_paper_eigenvalue"] == pytest.approx(size, rel=1e-9)
    assert next(rows, None) is None
    assert len(grid.solutions) >= 20


def test_every_solution_knows_its_parameters(grid):
    points = grid.solutions["point"]
    assert np.array_equal(grid.parameter("drive_frequency"), FREQUENCIES[points // 3])
    assert np.array_equal(grid.parameter("moment_amplitude"), MOMENTS[points % 3])
    assert grid.solutions.dtype == SOLUTION_DTYPE
    assert f"period {grid.n}-1 over 6 drive_frequency x 3 moment_amplitude" in repr(grid)


def test_part_of_a_map_is_the_map_of_that_part(grid):
    part = grid.at(moment_amplitude=0.95)
    whole = vi.motion_map(
        SYSTEM.replace(moment_amplitude=0.95),
        grid.n,
        within=(-1.5, 1.5),
        drive_frequency=FREQUENCIES,
    )
    assert part.system == whole.system
    assert part.solutions.tobytes() == whole.solutions.tobytes()
    assert np.array_equal(part.undecided, whole.undecided)
    assert np.array_equal(part.empty, whole.empty)
    other = grid.at(drive_frequency=1.8)
    assert list(other.grid) == ["moment_amplitude"]
    assert set(other.solutions["point"]) <= {0, 1, 2}


def test_a_wall_at_rest_over_its_place():
    system = vi.System(
        mass_ratio=0.0,
        frequency_ratio=1.0,
        restitution=0.8,
        gap=1.0,
        drive_frequency=1.0,
        pendulum_damping=0.05,
        moment_amplitude=1.0,
        contact="direct",
    )
    found = vi.motion_map(system, gap=[0.5, 1.0])
    (row,) = found.solutions[(found.solutions["point"] == 1) & found.solutions["admissible"]]
    assert row["approach_velocity"] == pytest.approx(1.695732937594882, rel=1e-12)
    assert math.isnan(row["largest_paper_eigenvalue"])
    assert not row["paper_stable"]


@pytest.mark.parametrize(
    ("system", "arguments", "match"),
    [
        (SYSTEM, {}, "varied parameters must be one or two of mass_ratio.*got nothing"),
        (SYSTEM, {"colour": [1.0]}, "got colour"),
        (SYSTEM, {"contact": ["direct"]}, "got contact"),
        (SYSTEM, {"gap": [0.1], "restitution": [0.5], "phase": [0.0]}, "one or two of"),
        (SYSTEM, {"gap": []}, r"gap = \[\] is not allowed; allowed: an array of at least one"),
        (SYSTEM, {"gap": [0.1, math.nan]}, r"gap\[1\] = nan is not allowed"),
        (SYSTEM, {"drive_frequency": [1.0, 0.0]}, "drive_frequency = 0.0 is not allowed"),
        (SYSTEM, {"restitution": [0.5, 1.5]}, "restitution = 1.5 is not allowed"),
        (SYSTEM, {"friction": [0.0, 0.1]}, "friction = 0.1 is not allowed"),
        (SYSTEM, {"gap": [0.1], "n": 0}, "n = 0 is not allowed"),
        (SYSTEM, {"gap": [0.1], "within": (1, 0)}, "within = .* is not allowed"),
        (3, {"gap": [0.1]}, "system = 3 is not allowed"),
    ],
)
def test_bad_input(system, arguments, match):
    with pytest.raises(vi.ParameterError, match=match):
        vi.motion_map(system, **arguments)


def test_a_part_that_is_not_there(grid):
    with pytest.raises(vi.ParameterError, match=r"moment_amplitude = 0\.7 is not allowed"):
        grid.at(moment_amplitude=0.7)
    with pytest.raises(vi.ParameterError, match="one of two varied parameters"):
        grid.at(gap=0.5)
    with pytest.raises(vi.ParameterError, match="one of two varied parameters"):
        grid.at(moment_amplitude=0.5).at(drive_frequency=1.8)


def points(ax):
    """Drawn points by the name of their kind."""
    return {line.get_label(): np.column_stack(line.get_data()) for line in ax.get_lines()}


def expected(part, chosen):
    x1 = part.solutions["x1"]
    return np.column_stack([part.parameter("drive_frequency"), x1])[chosen]


def test_branches_hold_every_solution_under_either_verdict(grid):
    part = grid.at(moment_amplitude=1.5)
    rows = part.solutions
    drawn = points(vi.plot.motion_branches(part, paper=True))
    assert np.array_equal(drawn["stable by (45)"], expected(part, rows["paper_stable"]))
    assert np.array_equal(drawn["unstable by (45)"], expected(part, ~rows["paper_stable"]))
    drawn = points(vi.plot.motion_branches(part))
    real, stable = rows["admissible"], rows["stable"]
    assert np.array_equal(drawn["stable motion"], expected(part, real & stable))
    assert np.array_equal(drawn["unstable motion"], expected(part, real & ~stable))
    assert np.array_equal(drawn["not admissible"], expected(part, ~real))
    names = [handle.get_label() for handle in vi.plot.motion_handles(part)]
    assert names == ["stable motion", "unstable motion", "not admissible"]
    mpl.pyplot.close("all")


def test_the_space_leaves_out_what_is_no_motion(grid):
    ax = vi.plot.motion_space(grid)
    drawn = sum(len(line.get_data_3d()[0]) for line in ax.get_lines())
    assert drawn == grid.solutions["admissible"].sum()
    ax = vi.plot.motion_space(grid, paper=True, every=(2, 1))
    shown = grid.solutions["point"] // 3 % 2 == 0
    drawn = sum(len(line.get_data_3d()[0]) for line in ax.get_lines())
    assert drawn == shown.sum()
    mpl.pyplot.close("all")


@pytest.mark.parametrize("paper", [True, False])
def test_the_map_has_three_levels(grid, paper):
    (mesh,) = vi.plot.stability_map(grid, paper=paper).collections
    rows = grid.solutions
    counted = np.ones(len(rows), bool) if paper else rows["admissible"]
    stable = rows["paper_stable"] if paper else rows["admissible"] & rows["stable"]
    for point, level in enumerate(np.asarray(mesh.get_array()).T.ravel()):
        here = rows["point"] == point
        assert level == (counted & here).any().astype(int) + (stable & here).any()
    assert len(vi.plot.stability_handles(paper=paper)) == 2
    mpl.pyplot.close("all")


def test_a_figure_needs_its_number_of_parameters(grid):
    with pytest.raises(ValueError, match="one varied parameter is needed"):
        vi.plot.motion_branches(grid)
    with pytest.raises(ValueError, match="two varied parameters are needed"):
        vi.plot.stability_map(grid.at(moment_amplitude=0.5))


@pytest.fixture(scope="module")
def computed():
    return existence.compute(2, 29)


def test_the_figure_is_refuted_by_its_counts(computed):
    # Of the kind of errata E5, whose grid is another: 118 stable ones, 1 of them right, 210 missed.
    claim, *_ = existence.judge(computed)
    rows = computed.map.solutions
    paper, real = rows["paper_stable"], rows["admissible"] & rows["stable"]
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


def test_the_quoted_solution_is_no_motion(computed):
    # Errata E4.
    claim = existence.judge(computed)[1]
    assert (claim.id, claim.verdict) == ("2 quoted", "refuted")
    assert claim.paper_says == "stable 1-1 at x10 = 0.5369"
    assert "separating before the impact (u = -0.234)" in claim.evidence
    assert "is stable by (45), largest eigenvalue 0.9099" in claim.evidence
    assert "separate without an impact" in claim.evidence


def test_the_motions_of_figure_5_are_stable_against_the_criterion(computed):
    # Errata E5, its numbers.
    known = {"5a by (45)": (1.88, 0.985), "5b by (45)": (1.43, 0.959)}
    found = {claim.id: claim for claim in existence.judge(computed)[2:]}
    assert found.keys() == known.keys()
    for name, (paper, true) in known.items():
        claim = found[name]
        assert claim.verdict == "refuted"
        says, number = claim.paper_says.split(", ")
        assert (says, float(number)) == ("unstable", pytest.approx(paper, abs=5.5e-3))
        assert claim.found == f"stable, {true:.3f}"
        assert claim.reference["factor"] == pytest.approx(true, abs=1e-3)


def test_the_page_shows_both_and_the_claims_fit_the_tables(computed):
    judged = existence.judge(computed)
    page = existence.draw(computed, judged)
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
    assert "2 quoted" in claims.table(judged)
    assert claims.to_json(judged).count('"figure": 2') == len(judged)


def test_drawn_branches_have_no_gaps_where_they_turn(computed):
    coarse = computed.map.at(moment_amplitude=1.0)
    page = existence.draw(computed, existence.judge(computed))
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


def test_the_commands_give_the_numbers_again(computed):
    count, quoted, *_ = existence.judge(computed)
    for claim, text in ((count, f"{len(computed.map.solutions)} solutions"), (quoted, "0.5369")):
        code = claim.command.removeprefix('python -c "').removesuffix('"')
        done = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        )
        assert text in done.stdout


def test_reproduce_draws_figures_2_and_3(tmp_path):
    made = reproduce(tmp_path, figures=[3], frequencies=8, progress=False)
    assert [path.name for path in made.files] == ["fig3.png", "claims.json", "claims.md"]
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
