"""Pictures of fits: the motion found, its units, and what is named."""

import numpy as np
import pytest
from matplotlib import pyplot

import vibroimpact as vi
from systems import PAPER

START = (0, 0.5, 0, 0)
RUN = vi.simulate(PAPER, initial=START, periods=8)
LONG = vi.simulate(PAPER.replace(drive_frequency=1.545), initial=START, periods=60)


def _fit(kind, **how):
    record = vi.measure(RUN, kind, **how)
    return vi.fit(record, PAPER, unknown=["restitution"], initial=START, starts=1)


def test_the_motion_is_drawn_between_the_rows_too():
    # Every 6 rows of a period, and a velocity that jumps at each impact.
    found = _fit("v1", noise=0.01, sampling=PAPER.drive_period / 6)
    top, _ = vi.plot.fit(found)
    measured, line = (np.array(each.get_xydata()) for each in top.lines)
    assert len(measured) == len(found.records[0])
    assert len(line) > 4000
    for impact in found.run.impacts[:3]:
        around = np.searchsorted(line[:, 0], impact["time"])
        jump = line[around, 1] - line[around - 1, 1]
        assert jump == pytest.approx(impact["v1_post"] - impact["v1_pre"], rel=1e-6)
    pyplot.close(top.figure)


def test_a_motion_of_several_segments_is_joined_from_row_to_row():
    record = vi.measure(LONG, "x1", noise=0.01, sampling=0.2)
    chaotic = PAPER.replace(drive_frequency=1.545)
    found = vi.fit(record, chaotic, unknown=["restitution"], initial=START, starts=1)
    assert len(found.segments) > 1
    top, _ = vi.plot.fit(found)
    assert np.array_equal(top.lines[1].get_ydata(), found.predicted)
    pyplot.close(top.figure)


@pytest.mark.parametrize(
    ("kind", "label", "size"),
    [
        ("x1", "angle $x_{1}$ of body 1 (rad)", 1.0),
        ("v2", r"velocity $\dot x_{2}$ of body 2 (m/s)", 10.0),
        ("a1", r"acceleration $\ddot x_{1}$ of body 1 (rad/s²)", 1e4),
        ("a2", r"acceleration $\ddot x_{2}$ of body 2 (m/s²)", 1e3),
        ("impact_times", "interval since the impact before (s)", 0.01),
    ],
)
def test_a_picture_in_si(kind, label, size):
    machine = PAPER.replace(scales={"length": 0.1, "mass": 3.0, "time": 0.01})
    how = {} if kind == "impact_times" else {"sampling": 0.1}
    record = vi.measure(RUN, kind, noise=0.01, **how)
    found = vi.fit(record, machine, unknown=["restitution"], initial=START, starts=1)
    (top, bottom), (plain, _) = vi.plot.fit(found, units="SI"), vi.plot.fit(found)
    assert top.get_ylabel() == label
    assert bottom.get_xlabel() == "time $t$ (s)"
    for one, other in zip(top.lines, plain.lines, strict=True):
        assert one.get_xdata() == pytest.approx(0.01 * other.get_xdata(), rel=1e-12)
        assert one.get_ydata() == pytest.approx(size * other.get_ydata(), rel=1e-12)
    pyplot.close("all")


def test_a_picture_in_si_needs_scales():
    with pytest.raises(vi.ParameterError, match=r"^units = 'SI' is not allowed"):
        vi.plot.fit(_fit("x1", noise=0.01, sampling=0.1), units="SI")


def test_band_and_crosses_are_named():
    record = vi.measure(RUN, "x1", noise=0.01, sampling=0.1)
    values = record.values.copy()
    values[40] += 0.2
    far = vi.Record("x1", record.times, values, sigma=0.01)
    found = vi.fit(far, PAPER, unknown=["restitution"], initial=START, loss="huber")
    top, _ = found.plot()
    named = [text.get_text() for text in top.get_legend().get_texts()]
    assert named == ["measured", "fitted machine", r"$\pm 2 \sigma$", r"beyond $4 \sigma$"]
    pyplot.close(top.figure)
