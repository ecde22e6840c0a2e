"""Whole runs against reference data in high precision (tests/data/README.md)."""

import re

import numpy as np
import pytest

import vibroimpact as vi
from references import reference, scene_initial, scene_system

SCENES = reference("paper_scenes.json")
RANDOM = reference("random.json")
# Scene 22 is too ill-conditioned for the tolerance below; tests/oracle.rs measures its growth.
ALL = SCENES | {f"random {i}": scene for i, scene in enumerate(RANDOM) if i != 22}
EPS = np.finfo(np.float64).eps
STATE = ("x1", "v1_pre", "v1_post", "x2", "v2_pre", "v2_post")


def _tolerance(scene) -> np.ndarray:
    """Allowed error in each period: 100 eps max(1, A_k, max over j < k of A_k/A_j).

    A_k is how much a perturbation of the start has grown by the end of period k (1-based);
    docs/notation.md.
    """
    growth = np.array(scene["amplification"])
    least = np.minimum.accumulate(growth)
    return 100 * EPS * np.maximum(1.0, np.maximum(growth, growth / least))


@pytest.mark.parametrize("name", ALL)
def test_every_impact_and_every_section(name):
    scene = ALL[name]
    run = vi.simulate(scene_system(scene), initial=scene_initial(scene), periods=scene["periods"])
    assert run.stop_reason == "completed"
    expected = scene["impacts"]
    assert len(run.impacts) == len(expected)
    tolerance = _tolerance(scene)
    for ours, theirs in zip(run.impacts, expected, strict=True):
        assert vi.Regime(ours["regime"]).name.lower() == theirs["regime"]
        assert ours["period"] == theirs["period"]
        allowed = tolerance[theirs["period"]]
        for column in STATE:
            value = float(theirs[column])
            assert abs(ours[column] - value) <= allowed * max(1.0, abs(value)), column
        approach = ours["v1_pre"] * np.cos(ours["x1"]) - ours["v2_pre"]
        time = float(theirs["t"])
        assert abs(ours["time"] - time) <= allowed * max(1.0, time) / min(1.0, approach)
    rows = np.array(scene["stroboscopic"], dtype=np.float64)
    error = np.abs(run.stroboscopic - rows) / np.maximum(1.0, np.abs(rows))
    assert (error.max(axis=1) <= tolerance).all()


@pytest.fixture(scope="module")
def long_runs() -> dict[str, vi.Run]:
    return {
        name: vi.simulate(scene_system(scene), initial=scene_initial(scene), periods=600, keep=100)
        for name, scene in SCENES.items()
    }


# The transients of these two lie beyond the horizon of double precision (docs/claims.md):
# only the motion they settle on can be compared.
BEYOND_HORIZON = {"fig6a", "fig9_2"}


@pytest.mark.parametrize("name", sorted(set(SCENES) - BEYOND_HORIZON))
def test_six_hundred_periods(name, long_runs):
    scene, run = SCENES[name], long_runs[name]
    assert run.impact_count == scene["impacts_in_600_periods"]
    assert len(run.impacts) == scene["impacts_in_last_100_periods"]


@pytest.mark.parametrize(
    "name", [name for name in SCENES if re.fullmatch(r"\d+-\d+", SCENES[name]["paper_label"])]
)
def test_labels_of_the_periodic_motions(name, long_runs):
    assert long_runs[name].label == SCENES[name]["paper_label"]


def test_labels_of_the_other_motions(long_runs):
    assert long_runs["fig9_2"].label == SCENES["fig9_2"]["paper_label"] == "chaotic"
    # docs/theory.md, section 9: E9 (a 6-7 from this start), E10 (not chaotic
    # from this start).
    assert long_runs["fig9_3"].label == "6-7"
    assert long_runs["fig9_4"].label != "chaotic"


def test_workers_agree_on_many_scenes_bit_for_bit():
    scene = SCENES["fig6c"]
    rng = np.random.default_rng(2004)
    initials = rng.uniform([-0.3, -1, -0.2, -1], [0.3, 1, 0.2, 1], size=(6, 4))
    one, two = (
        vi.simulate(scene_system(scene), initial=initials, periods=200, keep=50, workers=workers)
        for workers in (1, 2)
    )
    for left, right in zip(one, two, strict=True):
        assert left.impacts.tobytes() == right.impacts.tobytes()
        assert left.final_state == right.final_state
