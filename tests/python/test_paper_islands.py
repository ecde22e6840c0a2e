"""The page of islands: what it finds, how it is confirmed, and what is drawn."""

import numpy as np
import pytest

from vibroimpact.paper import islands
from vibroimpact.paper.parameters import INITIAL, paper_system
from vibroimpact.simulation import simulate


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
    drawn = {round(float(x), 9) for line in ax.get_lines() for x in np.atleast_1d(line.get_xdata())}
    for region in found.regions:
        for arc in region.arcs:
            assert {round(float(x), 9) for x in arc.values[:, 0]} <= drawn
    assert sorted(text.get_text() for text in ax.texts) == sorted(
        region.label for region in found.regions
    )
    names = {str(line.get_label()) for line in ax.get_lines()}
    assert {"path of Fig. 4", "saddle-node", "period doubling", "Neimark-Sacker"} <= names
