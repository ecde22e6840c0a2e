"""Uncertainty exponent and basin entropy of grids for which they are known."""

import math

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.sweeps import basin_entropy, uncertainty_exponent

SIZE = 400
ROW, COLUMN = np.indices((SIZE, SIZE))


@pytest.mark.parametrize(
    "inside",
    [ROW > 180, ROW + 0.3 * COLUMN > 240, np.hypot(ROW - 200, COLUMN - 200) < 90],
    ids=["line", "slanted line", "circle"],
)
def test_smooth_boundaries_have_the_exponent_1(inside):
    measured = uncertainty_exponent(inside.astype(int))
    assert measured.exponent == pytest.approx(1.0, abs=0.005)
    assert measured.error < 0.05
    assert measured.dimension == 2.0 - measured.exponent
    assert measured.fitted.all()


def test_the_uncertain_part_is_counted_exactly():
    measured = uncertainty_exponent((ROW > 180).astype(int), steps=[1, 2, 7, 30])
    # Within k cells of the line, along one of the axes; 30 at each end cannot be judged.
    assert measured.uncertain.tolist() == [
        2 * k * SIZE / (2 * SIZE * (SIZE - 60)) for k in (1, 2, 7, 30)
    ]


def cantor(generations: int) -> np.ndarray:
    """Label the gaps of the middle-third Cantor set by their generation, odd or even."""
    x = np.arange(3**generations)
    labels = np.full(len(x), -1)
    for generation in range(generations):
        middle = (x // 3 ** (generations - 1 - generation)) % 3 == 1
        labels[(labels == -1) & middle] = generation % 2
    labels[labels == -1] = generations % 2
    return labels


def test_a_cantor_boundary_has_its_exponent():
    labels = np.repeat(cantor(7)[:, None], 729, axis=1)
    expected = 1.0 - math.log(2.0) / math.log(3.0)
    # At powers of 3 the set looks alike.
    alike = uncertainty_exponent(labels, steps=[1, 3, 9, 27, 81])
    assert alike.exponent == pytest.approx(expected, abs=0.005)
    default = uncertainty_exponent(labels)
    assert abs(default.exponent - expected) < 2.0 * default.error
    assert default.error < 0.05


def test_random_labels_stay_uncertain():
    labels = np.random.default_rng(0).integers(0, 2, (SIZE, SIZE))
    measured = uncertainty_exponent(labels)
    assert measured.exponent == pytest.approx(0.0, abs=0.005)
    assert measured.uncertain == pytest.approx(np.full(len(measured.steps), 0.75), abs=0.01)


def test_the_error_is_that_of_the_sample():
    # Islands of random size in random places, smooth: the exponent is 1 but for their sample and
    # for the smallest, which the longer steps pass over.
    draw = np.random.default_rng(5)
    off = []
    for _ in range(12):
        labels = np.zeros((SIZE, SIZE), dtype=int)
        for x, y, r in draw.uniform((0, 0, 25), (SIZE, SIZE, 60), (6, 3)):
            labels[np.hypot(ROW - x, COLUMN - y) < r] = 1
        measured = uncertainty_exponent(labels, steps=[1, 2, 4, 8])
        off.append((measured.exponent - 1.0) / measured.error)
    assert 0.3 < np.sqrt(np.mean(np.square(off))) < 3.0


def test_one_basin_has_no_exponent():
    measured = uncertainty_exponent(np.zeros((50, 50), dtype=int))
    assert math.isnan(measured.exponent)
    assert not measured.uncertain.any()
    assert not measured.fitted.any()


def test_cells_without_attractor_are_left_out():
    labels = (ROW > 180).astype(int)
    labels[:, 300:] = -1
    measured = uncertainty_exponent(labels)
    assert measured.exponent == pytest.approx(1.0, abs=0.005)
    nothing = uncertainty_exponent(np.full((SIZE, SIZE), -1))
    assert math.isnan(nothing.exponent)


def test_bad_grids_and_steps():
    labels = np.zeros((40, 30), dtype=int)
    for steps in (0, 15, 2.5):
        with pytest.raises(vi.ParameterError, match="steps"):
            uncertainty_exponent(labels, steps=[1, steps])
    with pytest.raises(vi.ParameterError, match="at least 3 cells"):
        uncertainty_exponent(labels[:2])
    with pytest.raises(vi.ParameterError, match="evenly spaced"):
        uncertainty_exponent(labels, axes={"x1": np.arange(40.0) ** 2, "v1": np.arange(30.0)})
    with pytest.raises(vi.ParameterError, match="box = 1"):
        basin_entropy(labels, box=1)
    with pytest.raises(vi.ParameterError, match="box = 31"):
        basin_entropy(labels, box=31)


def entropy(*parts: float) -> float:
    return -sum(part * math.log(part) for part in parts)


def test_the_entropy_of_a_chequerboard():
    measured = basin_entropy((ROW + COLUMN) % 2)
    expected = entropy(12 / 25, 13 / 25)
    assert measured.entropy == pytest.approx(expected, rel=1e-12)
    assert measured.boundary_entropy == pytest.approx(expected, rel=1e-12)
    assert measured.boxes == measured.boundary_boxes == 80 * 80
    assert not measured.fractal


def test_the_entropy_of_a_line():
    # Two of five rows of the boxes that it cuts.
    measured = basin_entropy((ROW >= 182).astype(int))
    assert measured.boundary_boxes == 80
    assert measured.boundary_entropy == pytest.approx(entropy(2 / 5, 3 / 5), rel=1e-12)
    assert measured.entropy == pytest.approx(entropy(2 / 5, 3 / 5) / 80, rel=1e-12)
    between = basin_entropy((ROW >= 180).astype(int))
    assert between.entropy == between.boundary_boxes == 0
    assert math.isnan(between.boundary_entropy)


def test_the_entropy_of_random_labels():
    labels = np.random.default_rng(1).integers(0, 2, (1000, 1000))
    measured = basin_entropy(labels)
    # Expectation over the binomial distribution of 25 cells.
    parts = np.arange(1, 25) / 25
    weights = np.array([math.comb(25, k) / 2.0**25 for k in range(1, 25)])
    expected = float((weights * [entropy(p, 1 - p) for p in parts]).sum())
    assert measured.entropy == pytest.approx(expected, abs=5.0 * measured.boundary_error)
    three = basin_entropy(np.random.default_rng(1).integers(0, 3, (1000, 1000)), box=20)
    assert three.entropy == pytest.approx(math.log(3.0), abs=0.005)
    assert three.fractal


def test_boxes_without_attractor_do_not_count():
    labels = (ROW >= 182).astype(int)
    labels[:, 200:] = -1
    labels[181] = -1
    measured = basin_entropy(labels)
    assert measured.boxes == 80 * 40
    # One of the two rows before the line is left.
    assert measured.boundary_entropy == pytest.approx(entropy(1 / 4, 3 / 4), rel=1e-12)


def test_a_measure_says_what_it_found():
    measured = basin_entropy((ROW >= 182).astype(int))
    boxes = f"80 of {measured.boxes} boxes of 5 x 5 cells"
    assert repr(measured) == f"<BasinEntropy 0.008, on the boundary 0.673 +- 0.000, {boxes}>"
    one = basin_entropy(np.zeros((6, 6), int))
    assert repr(one) == "<BasinEntropy 0.000, no boundary, 0 of 1 box of 5 x 5 cells>"
    alone = basin_entropy(np.arange(25).reshape(5, 5) % 2)
    assert repr(alone).startswith("<BasinEntropy 0.692, on the boundary 0.692, 1 of 1 box")
