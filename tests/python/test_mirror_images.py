"""Mirror images of motions, -q half a drive period later, told apart in searches and basins."""

import numpy as np
import pytest
from matplotlib.figure import Figure

import vibroimpact as vi
from branch_cases import PAPER, settled
from struck import MIRRORED, REST
from vibroimpact.orbits.mirror import is_mirror_image, motion_names, own_mirror_image

ASYMMETRIC = MIRRORED.replace(drive_frequency=1.0)


def mirrored(state, structure):
    """The start of the mirror image of the run from a state."""
    half = vi.simulate(structure, initial=state, time=0.5 * structure.drive_period)
    return -half.final_state.state


@pytest.fixture(scope="module")
def search():
    rng = np.random.default_rng(1)
    return vi.search_motions(ASYMMETRIC, starts=rng.uniform(-0.3, 0.3, (8, 2, 2)), periods=1000)


def test_a_search_says_which_motion_is_the_image_of_which(search):
    one, other = search.motions
    assert one.label == other.label == "1-1"
    assert is_mirror_image(one, other)
    assert is_mirror_image(other, one)
    assert not is_mirror_image(one, one)
    assert not one.is_symmetric
    assert search.images == (1, 0)
    assert search.to_pandas()["image"].tolist() == [1, 0]
    assert "1-1 (a) " in repr(search)
    assert "1-1 (b), mirror image of (a) " in repr(search)
    assert search._facts()["end 2"].startswith("1-1 (b), mirror image of (a), stable: ")
    ax = Figure().subplots()
    vi.plot.motion_search(search, ax=ax)
    assert [text.get_text() for text in ax.get_yticklabels()] == [
        "1-1 (a), stable",
        "1-1 (b), mirror image of (a), stable",
    ]
    assert one._facts()["mirror image"] == "another motion"


def test_a_start_and_its_mirror_image_lead_to_a_motion_and_its_image(search):
    start = search.starts[0]
    both = vi.search_motions(
        ASYMMETRIC, starts=np.array([start, mirrored(start, ASYMMETRIC)]), periods=1000
    )
    assert sorted(both.reached.tolist()) == [0, 1]
    assert both.images == (1, 0)


def test_a_motion_whose_image_was_not_reached_is_named(search):
    one = vi.search_motions(ASYMMETRIC, starts=search.starts[:1], periods=1000)
    assert one.images == (None,)
    assert one.to_pandas()["image"].tolist() == [-1]
    assert "1-1, without its mirror image 100.0%" in repr(one)


def test_a_motion_that_is_its_own_image_has_its_label_alone():
    found = vi.search_motions(MIRRORED, starts=np.zeros((1, 2, 2)), periods=1000)
    assert found.images == (0,)
    assert repr(found) == "<MotionSearch from 1 starts: 1-2 100.0%>"
    assert found.motions[0].is_symmetric
    assert found.motions[0]._facts()["mirror image"] == "itself"


# A mass that falls dead on either stop, with an offset of the stops and a load that it rests on.
RESTING = vi.Structure(
    [[1]],
    [[1]],
    [vi.Stop([1], 0.3, 0.0), vi.Stop([-1], 0.3, 0.0)],
    damping_ratios=[0.05],
    drive_amplitude=[2],
    drive_frequency=0.4,
)


def test_motions_whose_stops_stay_closed_have_images_too():
    motion = vi.simulate(RESTING, initial=[[0], [0]], periods=200, keep=50).refine()
    assert not motion.legs
    assert motion.is_symmetric
    loaded = RESTING.replace(static_load=[0.1])
    assert vi.simulate(loaded, initial=[[0], [0]], periods=200, keep=50).refine().is_symmetric is (
        None
    )


@pytest.mark.parametrize(
    "changed",
    [
        {"gap_0": 0.41},
        {"restitution_1": 0.7},
        {"static_load": [0.01, 0]},
        {"stops": MIRRORED.stops[:1]},
        {"stops": [vi.Stop([0, 1], 0.4, 0.75), vi.Stop([0, -1], 0.4, 0.75, amplitude=0.01)]},
    ],
)
def test_structures_that_are_not_their_own_image_have_none(changed):
    run = vi.simulate(MIRRORED.replace(**changed), initial=REST[2], periods=600, keep=100)
    motion = run.refine()
    assert motion
    assert motion.is_symmetric is None
    assert "mirror image" not in motion._facts()


def test_stops_that_move_half_a_period_apart_are_images():
    stops = [
        vi.Stop([0, 1], 0.4, 0.75, amplitude=0.02, phase=0.5),
        vi.Stop([0, -1], 0.4, 0.75, amplitude=0.02, phase=0.5 + np.pi),
    ]
    run = vi.simulate(MIRRORED.replace(stops=stops), initial=REST[2], periods=600, keep=100)
    assert run.refine().is_symmetric
    # With one phase they are no images of each other, and neither is the motion its own.
    still = [stop.replace(phase=0.5) for stop in stops]
    run = vi.simulate(MIRRORED.replace(stops=still), initial=REST[2], periods=600, keep=100)
    motion = run.refine()
    assert motion.is_symmetric is None
    assert not own_mirror_image(motion)


def test_motions_of_two_bodies_have_no_images():
    motion = settled(**PAPER, drive_frequency=1.8)
    assert motion_names(["1-1", "1-1", "chaotic"], [motion, motion, None]) == (
        "1-1 (a)",
        "1-1 (b)",
        "chaotic",
    )


def test_basins_say_which_attractor_is_the_image_of_which():
    axis = np.linspace(-0.3, 0.3, 6)
    basins = vi.basins(ASYMMETRIC, q_0=axis, q_1=axis, scouts=12, periods=800)
    assert [attractor.label for attractor in basins.attractors] == ["1-1", "1-1"]
    assert basins._facts()["attractor 1"].startswith("1-1 (b), mirror image of (a): ")
    assert "1-1 (b), mirror image of (a) " in repr(basins)
    texts = [handle.get_label() for handle in vi.plot.basin_handles(basins)]
    assert texts[1].startswith("1-1 (b), mirror image of (a), ")
