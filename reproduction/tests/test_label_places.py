"""Labels of regions stand inside if there is room, else beside with a line, and cover nothing."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from han_jin_hu_2004.label_places import Ground

LABEL = (12.0, 7.0)


def rectangle(x0, x1, y0, y1) -> np.ndarray:
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]], dtype=float)


@pytest.fixture
def ax():
    """Axes of 200 by 100 points, on which a point is a unit."""
    figure = Figure(figsize=(300 / 72, 200 / 72))
    ax = figure.add_axes((50 / 300, 50 / 200, 200 / 300, 100 / 200))
    ax.set_xlim(0.0, 200.0)
    ax.set_ylim(0.0, 100.0)
    return ax


def placed(ax, border, *, curves=(), marks=(), others=()):
    ground = Ground(ax, [border, *curves], list(marks), LABEL)
    masks = [ground.inside(other) for other in others]
    return ground.place(ground.inside(border), np.any([*masks, np.zeros((100, 200), bool)], axis=0))


def test_a_wide_region_has_its_label_in_the_middle(ax):
    place = placed(ax, rectangle(20, 120, 30, 90))
    assert place.at == pytest.approx((70, 60), abs=1.5)
    assert place.leads_to is None


def test_curves_that_look_like_one_cover_each_other(ax):
    ground = Ground(ax, [], [], LABEL)
    line = ground.along(np.array([[10.0, 20.0], [190.0, 20.0]]))
    near = ground.along(np.array([[10.0, 22.0], [100.0, 22.0]]))
    away = ground.along(np.array([[10.0, 30.0], [100.0, 30.0]]))
    assert ground.covers(line, near)
    # The longer one goes on where there is nothing of the shorter.
    assert not ground.covers(near, line)
    assert not ground.covers(line, away)
    assert not ground.covers(line, np.zeros_like(line))


def test_a_label_inside_keeps_off_marks_and_curves(ax):
    mark, curve = np.array([[70.0, 60.0]]), np.array([[20.0, 50.0], [120.0, 50.0]])
    x, y = placed(ax, rectangle(20, 120, 30, 90), marks=[mark], curves=[curve]).at
    assert abs(x - 70) > 0.5 * LABEL[0] or abs(y - 60) > 0.5 * LABEL[1]
    assert abs(y - 50) > 0.5 * LABEL[1]
    assert 20 + 0.5 * LABEL[0] < x < 120 - 0.5 * LABEL[0]


def test_beside_a_narrow_region_a_line_leads_to_it(ax):
    place = placed(ax, rectangle(100, 106, 20, 80))
    assert 100 < place.leads_to[0] < 106
    assert 20 < place.leads_to[1] < 80
    assert abs(place.at[0] - 103) > 3 + 0.5 * LABEL[0]
    assert abs(place.at[0] - 103) < 20


def test_a_label_beside_its_region_stands_on_no_other_region_if_it_can(ax):
    narrow, other = rectangle(100, 106, 20, 80), rectangle(60, 99, 0, 100)
    assert placed(ax, narrow, curves=[other], others=[other]).at[0] > 106


def test_labels_keep_off_each_other(ax):
    border = rectangle(20, 60, 30, 60)
    ground = Ground(ax, [border], [], LABEL)
    region, nothing = ground.inside(border), np.zeros((100, 200), bool)
    first, second = (ground.place(region, nothing).at for _ in range(2))
    assert abs(first[0] - second[0]) > LABEL[0] or abs(first[1] - second[1]) > LABEL[1]


def test_what_is_not_in_view_has_no_label(ax):
    assert placed(ax, rectangle(300, 400, 0, 100)) is None


def test_an_open_border_is_what_a_line_leads_to(ax):
    curve = np.array([[10.0, 10.0], [150.0, 90.0]])
    ground = Ground(ax, [curve], [], LABEL)
    place = ground.place(ground.along(curve), np.zeros((100, 200), bool))
    x, y = place.leads_to
    assert y == pytest.approx(10 + (x - 10) * 80 / 140, abs=1.5)
    assert place.at != place.leads_to
