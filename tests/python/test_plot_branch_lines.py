"""Lines of several branches in one picture: which coincide, their looks and their names."""

from itertools import combinations

import numpy as np
import pytest
from matplotlib.figure import Figure

import vibroimpact as vi
from struck import MIRRORED, REST
from test_plot_colors import SEEN_BY, lab, linear
from test_symmetric_motions import WIDE, long_sides, sides, symmetric
from vibroimpact.plot.branch_lines import BRANCH_COLORS, line_style


@pytest.fixture
def ax():
    return Figure().subplots()


def drawn(ax):
    """The segments of stable and unstable lines, one entry for each branch that has its own."""
    found = {"stable": [], "unstable": []}
    for collection in ax.collections:
        segments = collection.get_segments()
        if segments:
            found[collection.get_gid()].append(segments)
    return found


def names(ax):
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    return texts[: next(k for k, text in enumerate(texts) if text.endswith("stable"))]


@pytest.mark.parametrize(
    "pair", [lambda: sides(0), lambda: sides(1), long_sides], ids=["low", "high", "long"]
)
def test_mirror_images_with_the_same_curves_are_drawn_once_and_named_together(ax, pair):
    one, image = pair()
    vi.plot.branches([symmetric(), one, image], ax=ax)
    alone = Figure().subplots()
    vi.plot.branches([symmetric(), one], ax=alone)
    # Dashes of a line on another one would fill its gaps.
    for kind, segments in drawn(ax).items():
        assert [len(each) for each in segments] == [len(each) for each in drawn(alone)[kind]]
    assert names(ax)[1] == f"{names(alone)[1]} (a, b)"
    colors = {handle.get_color() for handle in ax.get_legend().get_lines()[:2]}
    assert colors == set(BRANCH_COLORS[:2])


@pytest.mark.parametrize("number", [0, 1])
def test_where_they_differ_both_are_drawn(ax, number):
    vi.plot.branches([*sides(number)], section="stroboscopic", coordinate=1, ax=ax)
    assert len(drawn(ax)["stable"]) == 2
    assert [name[-3:] for name in names(ax)] == ["(a)", "(b)"]


def test_a_branch_with_both_sides_has_each_curve_once(ax):
    both = vi.switch_branch(symmetric().of_kind("branch_point")[0], **WIDE)
    vi.plot.branches(both, ax=ax)
    alone = Figure().subplots()
    vi.plot.branches(sides(0)[0], ax=alone)
    counts = [
        {kind: sum(map(len, parts)) for kind, parts in drawn(axes).items()} for axes in (ax, alone)
    ]
    assert counts[0] == counts[1]


def test_of_two_that_coincide_the_longer_one_is_seen(ax):
    point = symmetric().of_kind("branch_point")[1]
    ways = [
        vi.switch_branch(point, both=False, direction=way, drive_frequency=(0.9, end))
        for way, end in ((1, 2.0), (-1, 2.2))
    ]
    vi.plot.branches(ways, ax=ax)
    (unstable,) = drawn(ax)["unstable"]
    assert max(line[:, 0].max() for line in unstable) == 2.2
    (name, *_) = (text.get_text() for text in ax.get_legend().get_texts())
    assert name == "1-2, 1-3 (a, b), stable"


def test_motions_close_to_each_other_are_not_taken_for_one(ax):
    # Gaps differ by a thousandth: the curves are nearer to each other than their lines are wide.
    found = []
    for gap in (0.4, 0.4004):
        start = vi.simulate(MIRRORED.replace(gap=gap), initial=REST[2], periods=600, keep=100)
        found.append(start.refine().follow(drive_frequency=(1.2, 1.4)))
    vi.plot.branches(found, ax=ax)
    assert len(drawn(ax)["stable"]) == 2
    assert names(ax) == ["1-2 (a)", "1-2 (b)"]


@pytest.mark.parametrize("reader", SEEN_BY)
@pytest.mark.parametrize(("one", "other"), [*combinations(BRANCH_COLORS, 2)])
def test_colours_of_branches_stay_apart_for_every_reader(reader, one, other):
    seen = [lab(np.array(SEEN_BY[reader]) @ linear(color)) for color in (one, other)]
    assert np.linalg.norm(seen[0] - seen[1]) > 28.0


def test_twice_as_many_branches_as_colours_look_different():
    looks = [line_style(number) for number in range(2 * len(BRANCH_COLORS))]
    colors = [
        look["path_effects"][0]._gc["foreground"] if "path_effects" in look else look["color"]
        for look in looks
    ]
    assert colors == [*BRANCH_COLORS, *BRANCH_COLORS]
    assert {look["color"] for look in looks[len(BRANCH_COLORS) :]} == {"white"}
