"""The maps of impacts show their numbers in the colours of the regimes."""

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

import vibroimpact as vi
from systems import ROUGH
from vibroimpact.plot import REGIME_STYLES

AXES = {"x1": np.linspace(-1.5, 1.5, 40), "velocity_ratio": np.linspace(-2.0, 2.0, 30)}


def made(**changes) -> vi.System:
    return ROUGH.replace(**changes)


@pytest.fixture(scope="module")
def result() -> vi.ImpactRegimes:
    return vi.impact_regimes(made(), **AXES)


@pytest.fixture
def axes():
    return Figure(layout="constrained").subplots(1, 3)


def mesh(ax) -> QuadMesh:
    (found,) = [item for item in ax.collections if isinstance(item, QuadMesh)]
    return found


def test_every_panel_shows_its_array(result, axes):
    assert vi.plot.impact_regimes(result, axes, legend=False) == list(axes)
    for ax, values in zip(
        axes, (result.regime, result.restitution, result.energy_loss), strict=True
    ):
        assert np.array_equal(mesh(ax).get_array(), values)
        assert ax.get_xlabel() == "position $x_1$ of body 1"
        assert mesh(ax).get_rasterized()
    assert axes[0].get_ylabel() == r"velocity ratio $\dot x_1/u$"
    assert axes[0].figure.legends == []


def test_regimes_have_their_own_colours(result, axes):
    vi.plot.impact_regimes(result, axes)
    drawn = mesh(axes[0])
    for regime, style in REGIME_STYLES.items():
        assert to_hex(drawn.cmap(drawn.norm(regime))) == to_hex(style.color)
    (legend,) = axes[0].figure.legends
    shown = [text.get_text() for text in legend.get_texts()]
    assert shown == [REGIME_STYLES[number].text for number in np.unique(result.regime)]


def test_the_coefficient_of_the_law_is_white_and_the_borders_are_drawn(result, axes):
    vi.plot.impact_regimes(result, axes)
    drawn = mesh(axes[1])
    assert drawn.norm(0.8) == 0.5
    assert drawn.cmap(0.5)[:3] == pytest.approx((1.0, 1.0, 1.0), abs=0.05)
    # Both sides are scaled alike.
    assert drawn.norm(0.7) + drawn.norm(0.9) == pytest.approx(1.0)
    for ax in axes:
        assert len(ax.collections) == len(np.unique(result.regime))


def test_a_gain_of_energy_is_scaled_about_zero(axes):
    newton = vi.impact_regimes(made(law="newton", friction=1.0), **AXES)
    vi.plot.impact_regimes(newton, axes)
    drawn = mesh(axes[2])
    assert newton.energy_loss.min() < 0.0
    assert drawn.norm(0.0) == 0.5
    labels = [ax.get_xlabel() for ax in axes[2].figure.axes]
    assert any("negative: gain" in label for label in labels)


def test_a_wall_says_that_it_has_no_energy_and_what_has_no_outcome(axes):
    wall = vi.impact_regimes(made(mass_ratio=0.0, friction=1.5), **AXES)
    vi.plot.impact_regimes(wall, axes)
    assert [text.get_text() for text in axes[2].texts] == [
        r"no energy to compare with ($\bar m = 0$)"
    ]
    (legend,) = axes[0].figure.legends
    assert legend.get_texts()[-1].get_text() == "no outcome"


def test_new_figures_are_made_and_a_wrong_number_of_axes_is_named(result, axes):
    mpl.use("Agg")
    from matplotlib import pyplot

    drawn = vi.plot.impact_regimes(result)
    assert len(drawn) == 3
    agreement = vi.impact_agreement(made(), steps=(10, 40), cells=9)
    lines = vi.plot.impact_agreement(agreement)
    assert len(lines) == len(agreement.laws)
    pyplot.close("all")
    with pytest.raises(ValueError, match=r"axes = .* allowed: 3 axes, or None"):
        vi.plot.impact_regimes(result, axes[:2])
    with pytest.raises(ValueError, match=r"axes = .* allowed: 3 axes, or None"):
        vi.plot.impact_agreement(agreement, axes[:1])


def test_agreement_draws_a_line_for_each_regime_and_the_slope(axes):
    agreement = vi.impact_agreement(made(), steps=(40, 10, 160), cells=9)
    vi.plot.impact_agreement(agreement, axes)
    present = np.flatnonzero(agreement.impacts)
    for ax, law, expected in zip(axes, agreement.laws, agreement.difference, strict=True):
        slope, *lines = ax.get_lines()
        x, y = slope.get_data()
        assert np.log(y[-1] / y[0]) / np.log(x[-1] / x[0]) == pytest.approx(1.0)
        assert len(lines) == len(present)
        for line, regime in zip(lines, present, strict=True):
            assert line.get_color() == REGIME_STYLES[regime].color
            assert line.get_xdata().tolist() == [1 / 10, 1 / 40, 1 / 160]
            assert np.array_equal(line.get_ydata(), expected[regime][[1, 0, 2]])
        assert ax.get_title().lower() == law
        assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
        low, high = ax.get_ylim()
        assert low < np.nanmin(expected) < np.nanmax(expected) < high
