"""The page of islands: what it finds, how it is confirmed, and what is drawn."""

import matplotlib.text
import numpy as np
import pytest

import repository
from han_jin_hu_2004 import islands
from han_jin_hu_2004.parameters import INITIAL, paper_system
from vibroimpact import follow_motion, simulate


@pytest.fixture(scope="module")
def found():
    return islands.compute((0.75, 1.0), 139, labels=("1-1", "2-1", "1-2"))


def test_every_run_that_settles_lies_inside_the_border_of_its_motion(found):
    assert len(found.settled) > 25
    assert found.inside.all()
    assert {region.label for region in found.regions} == {"1-1", "2-1", "1-2"}
    assert sum(region.label == "1-1" for region in found.regions) >= 2
    assert all(region.closed for region in found.regions)


def test_the_islands_of_figure_4_end_at_their_bifurcations(found):
    ends = {}
    for region in found.regions:
        ends.setdefault(region.label, []).extend(islands.extents(region))
    # Simulation says the same: settled on the motion on one side, not on the other.
    assert ends["2-1"][0][0] == "neimark_sacker"
    for label, (kind, omega) in (
        ("1-1", min(ends["1-1"], key=lambda end: end[1])),
        ("2-1", ends["2-1"][0]),
    ):
        assert kind == "neimark_sacker"
        inside, outside = (
            simulate(
                paper_system(drive_frequency=omega + off), initial=INITIAL, periods=4000, keep=200
            )
            for off in (0.03, -0.03)
        )
        assert inside.label == label
        assert outside.label != label


def test_the_page_shows_borders_labels_and_the_path(found):
    page = islands.draw(found)
    (ax,) = page.figure.subfigs[0].axes
    (part,) = page.figure.subfigs[1].axes
    drawn = {round(float(x), 9) for line in ax.get_lines() for x in np.atleast_1d(line.get_xdata())}
    for region in found.regions:
        for arc in region.arcs:
            assert {round(float(x), 9) for x in arc.values[:, 0]} <= drawn
    # A name for each region but those of the rectangle, or one for several that cover each other.
    inside = [region for region in found.regions if islands._is_in_the_part(region)]
    names = [text.get_text() for text in ax.texts]
    assert {*names} == {each.label for each in found.regions if each not in inside}
    assert len(names) <= len(found.regions) - len(inside)
    # No label covers another, leaves its panel, or lies on a border.
    page.figure.draw_without_rendering()
    for panel in (ax, part):
        boxes = [matplotlib.text.Text.get_window_extent(text) for text in panel.texts]
        frame = panel.get_window_extent()
        for number, box in enumerate(boxes):
            assert frame.x0 <= box.x0 < box.x1 <= frame.x1
            assert frame.y0 <= box.y0 < box.y1 <= frame.y1
            assert not any(box.overlaps(other) for other in boxes[:number])
            for region in found.regions:
                for arc in region.arcs:
                    pixels = panel.transData.transform(arc.values)
                    assert not box.padded(-0.5).count_contains(pixels)
    names = {text.get_text() for text in page.figure.legends[0].get_texts()}
    assert {"path of Fig. 4", "saddle-node", "period doubling", "Neimark-Sacker"} <= names


def documented() -> list[tuple[str, list[float]]]:
    """Motion and frequencies of each row of the table of docs/islands.md."""
    text = (repository.root() / "docs" / "islands.md").read_text(encoding="utf-8")
    table = text.split("| motion | from |", 1)[1].split("\n\n", 1)[0]
    rows = [line.split("|")[1:-1] for line in table.splitlines()[2:]]
    return [
        (row[0].strip(), [float(cell) for cell in (row[2], row[4]) if "." in cell]) for row in rows
    ]


def test_the_documented_ends_are_those_found(found):
    rows = documented()
    for region in found.regions:
        known = [value for label, ends in rows if label == region.label for value in ends]
        for _, omega in islands.extents(region):
            assert min(abs(omega - value) for value in known) < 6e-11


@pytest.mark.parametrize("label", ["2-4", "8-6"])
def test_the_documented_ends_are_bifurcations_of_a_branch(label):
    (ends,) = (ends for row, ends in documented() if row == label)
    middle = paper_system(drive_frequency=0.5 * (ends[0] + ends[1]))
    motion = simulate(middle, initial=INITIAL, periods=3000, keep=200).refine()
    assert motion.label == label
    branch = follow_motion(motion, drive_frequency=(ends[0] - 0.01, ends[1] + 0.01))
    for end in ends:
        assert min(abs(found.value - end) for found in branch.bifurcations) < 6e-11
