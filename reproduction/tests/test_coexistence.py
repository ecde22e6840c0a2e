"""Coexisting motions of the paper's Fig. 9(3) system: their branches, checked by simulation.

Values of bifurcations come from the continuation; what they are checked against is computed by
other means: simulations with other tolerances, and differences of the simulated map.
"""

import numpy as np
import pytest

import vibroimpact as vi
from han_jin_hu_2004 import coexistence
from han_jin_hu_2004.parameters import MOTIONS

RANGE = (1.5, 1.6)


@pytest.fixture(scope="module")
def motions() -> tuple[vi.PeriodicMotion, ...]:
    system = next(motion.system for motion in MOTIONS if motion.id == "9(3)")
    return vi.search_motions(system, starts=64, periods=3000).motions


@pytest.fixture(scope="module")
def branches(motions) -> list[vi.Branch]:
    return [vi.follow_motion(motion, drive_frequency=RANGE) for motion in motions]


@pytest.fixture(scope="module")
def doubled(branches) -> list[vi.Branch]:
    """The branches of doubled motions, at the period doublings of both stable motions."""
    return [vi.switch_branch(stable_doubling(branch), drive_frequency=RANGE) for branch in branches]


def stable_doubling(branch: vi.Branch) -> vi.Bifurcation:
    """The period doubling at which a branch loses its stability."""
    found = [
        bifurcation
        for bifurcation in branch.of_kind("period_doubling")
        if np.abs(bifurcation.motion.multipliers[1]) < 0.999
    ]
    assert len(found) == 1
    return found[0]


def test_both_motions_of_the_paper_are_found(motions):
    assert [motion.label for motion in motions] == ["4-5", "6-7"]
    assert all(motion.admissible and motion.stable for motion in motions)


def test_no_border_is_passed_where_two_lie_within_a_step(branches):
    # The 4-5 motion grazes at 1.57684; 7e-5 further on its branch would meet the grazing of the 2-2
    # motion, where the same gap is zero again.
    graze = branches[0].of_kind("grazing")[-1]
    assert graze.value == pytest.approx(1.57684048624, abs=1e-11)
    for piece in branches[0].pieces:
        assert all(piece.motion(k).admissible for k in range(1, len(piece.values) - 1))


def test_a_closed_branch_keeps_all_its_borders(branches):
    ring = branches[1]
    assert ring.ends == ("closed", "closed")
    borders = [found for found in ring.bifurcations if hasattr(found.test, "leg")]
    assert len(borders) == len(ring.pieces)
    ends = {round(float(piece.values[k]), 9) for piece in ring.pieces for k in (0, -1)}
    assert ends == {round(found.value, 9) for found in borders}


@pytest.mark.parametrize("which", [0, 1])
def test_doubled_motions_begin_at_the_period_doubling(branches, doubled, which):
    start, branch = stable_doubling(branches[which]), doubled[which]
    first = branch.pieces[0]
    single = start.motion
    assert first.label == f"{2 * single.m}-{2 * single.n}"
    assert first.values[0] == pytest.approx(start.value, abs=1e-12)
    # Stable as soon as its multiplier can be told from 1.
    away = np.flatnonzero(np.abs(first.multipliers[:, 0] - 1.0) > 1e-6)
    assert first.stable[away[:3]].tolist() == [True] * 3


def test_sections_of_a_doubled_branch_begin_with_the_single_motion_twice(branches, doubled):
    for branch, twice in zip(branches, doubled, strict=True):
        m = stable_doubling(branch).motion.m
        sections = twice.pieces[0].sections
        assert sections.shape == (len(twice.pieces[0].values), 2 * m)
        assert np.allclose(sections[0, :m], sections[0, m:], rtol=0, atol=1e-12)
        assert np.abs(sections[-1, :m] - sections[-1, m:]).max() > 1e-3


def test_a_branch_can_be_switched_to_at_either_end_of_it(branches):
    # A branch that ends at a period doubling of a shorter motion begins there, too.
    for end in (branches[0].bifurcations[0], branches[0].bifurcations[-1]):
        assert end.kind == "period_doubling"
        back = vi.switch_branch(end, drive_frequency=RANGE)
        assert {piece.label for piece in back.pieces} == {"4-5", "4-6"}


def test_a_run_that_has_not_settled_is_carried_on_before_it_is_refined(motions):
    # The label of these runs, 12-14, is foretold during transients; Newton's method leads from
    # there to unstable 4-5, 6-8, 12-16 and 12-17 motions, which attract nothing.
    found = vi.search_motions(
        motions[0].system.replace(drive_frequency=1.567), starts=150, periods=4000
    )
    assert [motion.label for motion in found.motions] == ["12-14"]
    assert found.motions[0].stable
    assert found.shares[0] + sum(found.others.values()) == pytest.approx(1.0)


def motion_at(motion: vi.PeriodicMotion, frequency: float) -> vi.PeriodicMotion:
    """The motion followed to a frequency, exactly."""
    away = 1e-3 * np.sign(motion.system.drive_frequency - frequency)
    span = sorted((motion.system.drive_frequency + away, frequency))
    way = 1 if away < 0 else -1
    branch = vi.follow_motion(motion, both=False, direction=way, drive_frequency=tuple(span))
    assert branch.values[-1] == frequency
    return branch.pieces[-1].motion(-1)


def distances(motion: vi.PeriodicMotion, away: float, orbits: int) -> np.ndarray:
    """How far a simulation is from a motion after each orbit, if it starts a little off it."""
    start = np.array(motion.initial) + away * np.array([0.5, 0.5, 0.5, 0.5])
    run = vi.simulate(motion.system, initial=start, periods=motion.m * orbits)
    return np.linalg.norm(run.stroboscopic[motion.m - 1 :: motion.m] - motion.sections[0], axis=1)


@pytest.mark.parametrize(
    ("which", "kind", "inside"),
    [(0, "period_doubling", 1), (1, "period_doubling", 1), (1, "neimark_sacker", -1)],
)
def test_perturbations_decay_inside_a_limit_and_grow_outside(
    motions, branches, which, kind, inside
):
    limit = (
        stable_doubling(branches[which])
        if kind == "period_doubling"
        else branches[which].of_kind(kind)[0]
    )
    # Beyond the Neimark-Sacker point the regime border is 1.2e-5 away.
    step = 2e-5 if kind == "period_doubling" else 8e-6
    for side in (inside, -inside):
        motion = motion_at(motions[which], limit.value + side * step)
        assert motion.stable == (side == inside)
        # A pair turns as it shrinks: the largest distance of five turns.
        orbits, turns = (200, 1) if kind == "period_doubling" else (1000, 31)
        size = distances(motion, 1e-7, 40 + orbits + turns)
        first, last = size[40 : 40 + turns].max(), size[40 + orbits :].max()
        rate = (last / first) ** (1.0 / orbits)
        assert rate == pytest.approx(np.abs(motion.multipliers[0]), abs=2e-4)


def test_of_two_motions_at_the_saddle_node_one_attracts(branches):
    fold = branches[0].of_kind("saddle_node")[1]
    # Both sides of the branch, sought where they are: from 2e-5 before the saddle-node.
    near = vi.follow_motion(
        branches[0].pieces[2].motion(0),
        both=False,
        direction=1,
        drive_frequency=RANGE,
        step=1e-3,
        max_step=2e-3,
        max_points=500,
    )
    piece = near.pieces[0]
    below = np.abs(piece.values - (fold.value - 2e-5))
    for stable in (True, False):
        motion = piece.motion(int(np.argmin(np.where(piece.stable == stable, below, 1.0))))
        assert motion.stable == stable
        size = distances(motion, 1e-7, 400)
        assert (size[-1] < 1e-10) == stable
        assert (size[-1] > 1e-3) != stable
    # Beyond there is none: the simulation passes where it was, and goes to the 2-2 motion.
    gone = vi.simulate(
        motion.system.replace(drive_frequency=fold.value + 1e-5),
        initial=fold.motion.initial,
        periods=8000,
        keep=200,
    )
    assert gone.label == "2-2"


def test_the_simulated_gap_closes_at_the_grazing_that_ends_the_upper_motion(branches):
    ring = branches[1]
    graze = max(ring.of_kind("grazing"), key=lambda found: found.value)
    (upper,) = (
        piece for piece in ring.pieces if piece.label == "6-7" and piece.values[0] == graze.value
    )
    assert upper.stable[:3].all()
    frequencies = graze.value - np.array([4e-6, 7e-6, 1e-5])
    largest = []
    for frequency in frequencies:
        system = upper.system.replace(drive_frequency=float(frequency))
        run = vi.simulate(system, initial=upper.motion(1).initial, periods=6000, keep=6)
        assert run.label == "6-7"
        time = np.linspace(run.kept_from, run.final_state.time, 60_000)[1:-1]
        state = run.trajectory(time)
        gap = system.gap_function(state)
        peak = np.flatnonzero((gap[1:-1] > gap[:-2]) & (gap[1:-1] > gap[2:])) + 1
        far = [k for k in peak if np.abs(run.impacts["time"] - time[k]).min() > 1e-3]
        k = max(far, key=lambda k: gap[k])
        # The vertex of the parabola through the three highest samples.
        a, b, c = gap[k - 1 : k + 2]
        largest.append(b - (c - a) ** 2 / (8 * (a - 2 * b + c)))
    assert max(largest) < 0.0
    closed = np.polynomial.Polynomial.fit(largest, frequencies, 2)(0.0)
    assert closed == pytest.approx(graze.value, abs=1e-8)
    beyond = upper.system.replace(drive_frequency=graze.value + 2e-6)
    run = vi.simulate(beyond, initial=graze.motion.initial, periods=12_000, keep=200)
    assert run.label in ("2-2", "4-5")


def test_multipliers_at_the_limits_agree_with_differences_of_the_simulated_map(branches):
    kinds = ("saddle_node", "period_doubling", "neimark_sacker")
    found = [item for branch in branches for kind in kinds for item in branch.of_kind(kind)]
    compared = 0
    for item in found:
        motion = item.motion
        if np.abs(motion.multipliers[0]) > 5.0:
            continue  # next to a grazing differences are of no use
        step = 1e-6
        shifts = step * np.vstack([np.eye(4), -np.eye(4)])
        runs = vi.simulate(
            motion.system, initial=np.array(motion.initial) + shifts, periods=motion.m, keep=0
        )
        ends = np.array([run.final_state.state for run in runs])
        values = np.linalg.eigvals((ends[:4] - ends[4:]).T / (2 * step))
        apart = np.abs(values[:, None] - motion.multipliers[None, :])
        assert apart.min(axis=0).max() < 1e-6
        compared += 1
    assert compared == 8


@pytest.fixture(scope="module")
def computed() -> coexistence.Coexistence:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(coexistence, "FREQUENCIES", 3)
        return coexistence.compute(24)


def test_the_pages_are_computed_from_the_motions_found(computed, branches):
    assert [motion.label for motion in computed.motions] == ["4-5", "6-7"]
    for known, found in zip(branches, computed.branches, strict=True):
        values = sorted(item.value for item in known.bifurcations)
        again = sorted(item.value for item in found.bifurcations)
        assert again == pytest.approx(values, abs=1e-12)
    low, high = computed.window
    stable = np.concatenate([branch.values[branch.stable] for branch in computed.branches])
    assert low < stable.min() < stable.max() < high
    assert (computed.zoom.parameter[0], computed.zoom.parameter[-1]) == computed.window
    assert np.sum(list(computed.shares.values()), axis=0) == pytest.approx(1.0)
    # In the middle of the window the 4-5 motion prevails, later the 2-2.
    assert computed.shares["4-5"][1] > 0.9
    assert computed.shares["2-2"][2] > 0.9


def axes_of(page) -> list:
    return [ax for part in page.figure.subfigs for ax in part.get_axes()]


def test_the_page_of_branches_holds_branches_diagram_and_shares(computed):
    page = coexistence.draw_branches(computed)
    whole, left, right, shares = axes_of(page)
    assert shares.get_xlim() == computed.window
    # Side by side they are the window; the right one is wider for its range.
    assert left.get_xlim()[1] == right.get_xlim()[0]
    assert (left.get_xlim()[0], right.get_xlim()[1]) == computed.window
    assert np.ptp(right.get_xlim()) < np.ptp(left.get_xlim())
    for ax, branches in (
        (whole, computed.branches),
        (left, computed.windows),
        (right, computed.windows),
    ):
        graze = next(line for line in ax.lines if line.get_gid() == "grazing").get_xdata()
        wanted = {item.value for branch in branches for item in branch.of_kind("grazing")}
        if ax is whole:
            # Those of the window would cover each other here.
            low, high = computed.window
            inside = {value for value in wanted if low <= value <= high}
            assert inside
            wanted -= inside
        assert set(graze.tolist()) == wanted
    (legend,) = page.figure.legends
    names = [text.get_text() for text in legend.get_texts()]
    assert names[:2] == ["4-5 (beyond a grazing 4-6)", "6-7 (beyond a grazing 6-8)"]
    bars = {part.get_label(): [bar.get_height() for bar in part] for part in shares.containers}
    assert {label: list(share) for label, share in computed.shares.items()} == bars
    # Each label has its name, and no mark means one thing in a panel and another in the next.
    assert set(computed.shares) <= {text.get_text() for text in shares.texts}
    assert not shares.lines


@pytest.mark.parametrize(
    ("label", "family"),
    [("4-5", 1), ("8-10", 1), ("12-14", 2), ("96-112", 2), ("2-2", 0), ("12-15", 0), ("4-6", 0)],
)
def test_a_doubling_belongs_to_its_motion(computed, label, family):
    assert coexistence._family(label, computed.motions) == family


@pytest.mark.parametrize("label", ["chaotic", "quasi-periodic", "4-inf", "unresolved"])
def test_other_labels_are_doublings_of_none(computed, label):
    assert coexistence._family(label, computed.motions) == 0


def test_the_pages_of_multipliers_and_portraits_have_both_motions_side_by_side(computed):
    panels = axes_of(coexistence.draw_multipliers(computed))
    titles = [ax.get_title(loc="left") for ax in panels]
    assert titles[:2] == ["branch of the 4-5 motion", "branch of the 6-7 motion"]
    page = coexistence.draw_portraits(computed)
    left, right, *rest = axes_of(page)
    assert left.get_title(loc="left").startswith("4-5, ")
    assert right.get_title(loc="left").startswith("6-7, ")
    assert len(rest) == 4
    for ax, motion in zip(rest[2:], computed.motions, strict=True):
        period = motion.m * motion.system.drive_period
        assert ax.get_xlim() == (0.0, pytest.approx(period, rel=1e-15))
