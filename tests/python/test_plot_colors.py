"""Colours of the impact regimes, in figures and on a dark page: how far apart they are, for whom.

Distances are those of CIE 1976 (L*a*b*, white of sRGB): one unit can just be seen side by side.
Deficiencies are simulated as total ones, which are the hardest: matrices of Machado, Oliveira and
Fernandes, IEEE Trans. Vis. Comput. Graph. 15(6), 2009, Table 1, and of Vienot, Brettel and Mollon,
Color Res. Appl. 24(4), 1999, for dichromats that lack red or green. The contrast with the page is
that of the Web Content Accessibility Guidelines 2.2, which ask for 3 of what is drawn, 4.5 of text.
"""

from itertools import combinations

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from vibroimpact.explorer.theme import PALETTES
from vibroimpact.plot import REGIME_STYLES
from vibroimpact.plot.style import STOPS

# From linear red, green and blue.
TO_XYZ = np.array(
    [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ]
)
SEEN_BY = {
    "full colour vision": np.eye(3),
    "protanopia (Machado)": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranopia (Machado)": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
    "tritanopia (Machado)": [
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.303900],
    ],
    "protanopia (Vienot)": [
        [0.11238, 0.88762, 0.0],
        [0.11238, 0.88762, 0.0],
        [0.00401, -0.00401, 1.0],
    ],
    "deuteranopia (Vienot)": [
        [0.29275, 0.70725, 0.0],
        [0.29275, 0.70725, 0.0],
        [-0.02234, 0.02234, 1.0],
    ],
}
LEAST = 30.0
# In print each colour may be all that is left of a shape; a screen has its colours.
LEAST_IN_GREY = {"figures": 10.0, "dark page": 5.0}
LEAST_CONTRAST = 4.5


def linear(color: str) -> np.ndarray:
    """Red, green and blue in proportion to light."""
    encoded = np.array(to_rgb(color))
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def lab(light: np.ndarray) -> np.ndarray:
    part = TO_XYZ @ np.clip(light, 0.0, 1.0) / TO_XYZ.sum(axis=1)
    x, y, z = np.where(part > (6 / 29) ** 3, np.cbrt(part), part / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def luminance(color: str) -> float:
    return float(TO_XYZ[1] @ linear(color))


DARK = PALETTES["dark"]
NAMES = {regime: style.text for regime, style in REGIME_STYLES.items()}
COLORS = {
    "figures": {name: REGIME_STYLES[regime].color for regime, name in NAMES.items()},
    "dark page": {name: DARK.regimes[regime] for regime, name in NAMES.items()},
}
PAIRS = [*combinations(NAMES.values(), 2)]


def test_the_scale_is_that_of_the_standard():
    np.testing.assert_allclose(lab(linear("white")), [100.0, 0.0, 0.0], atol=1e-3)
    # The values of sRGB red in CIE 1976.
    np.testing.assert_allclose(lab(linear("red")), [53.24, 80.09, 67.20], atol=0.02)


@pytest.mark.parametrize("shown", COLORS)
@pytest.mark.parametrize("reader", SEEN_BY)
@pytest.mark.parametrize(("one", "other"), PAIRS)
def test_regimes_stay_apart_for_every_reader(shown, reader, one, other):
    colors = COLORS[shown]
    seen = [lab(np.array(SEEN_BY[reader]) @ linear(colors[name])) for name in (one, other)]
    assert np.linalg.norm(seen[0] - seen[1]) > LEAST


@pytest.mark.parametrize("shown", COLORS)
@pytest.mark.parametrize(("one", "other"), PAIRS)
def test_regimes_stay_apart_in_grey(shown, one, other):
    light, dark = (lab(linear(COLORS[shown][name]))[0] for name in (one, other))
    assert abs(light - dark) > LEAST_IN_GREY[shown]


@pytest.mark.parametrize("name", NAMES.values())
def test_no_regime_is_as_light_as_paper(name):
    assert lab(linear(COLORS["figures"][name]))[0] < 80.0


def test_regimes_and_what_belongs_to_the_motion_are_seen_on_a_dark_page():
    page = luminance(DARK.card)
    for color in (*COLORS["dark page"].values(), DARK.mark):
        assert (luminance(color) + 0.05) / (page + 0.05) > LEAST_CONTRAST, color


@pytest.mark.parametrize("palette", PALETTES.values(), ids=PALETTES)
def test_the_motion_of_the_page_has_another_colour_than_any_regime(palette):
    mark = lab(linear(palette.mark))
    for regime, name in NAMES.items():
        assert np.linalg.norm(lab(linear(palette.regimes[regime])) - mark) > LEAST, name


@pytest.mark.parametrize("palette", PALETTES.values(), ids=PALETTES)
def test_stops_have_the_colours_of_the_figures_and_are_seen(palette):
    assert palette.kinds(stops=True) == [color for color, _ in STOPS]
    numbers = palette.numbers(stops=True)
    assert [f"#{number >> 8:06X}" for number in numbers.tolist()] == palette.kinds(stops=True)
    # Points and lines, not text.
    page, least = luminance(palette.card), 3.0 if palette is DARK else 2.0
    for color in palette.kinds(stops=True):
        light = sorted((luminance(color) + 0.05, page + 0.05))
        assert light[1] / light[0] > least, color
