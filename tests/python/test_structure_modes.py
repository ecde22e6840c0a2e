"""Structures from some of their modes: projection, starts in the span, what is refused."""

import re

import numpy as np
import pytest

import vibroimpact as vi
from two_masses import MASS, beam, structure


def test_a_structure_and_its_modes_are_the_same_to_the_core():
    made = structure(static_load=[0.3, -0.2])
    modal = vi.Structure.from_modes(
        made.frequencies,
        made.shapes,
        made.stops,
        damping_ratios=made.damping_ratios,
        static_load=made.static_load,
        drive_amplitude=made.drive_amplitude,
        drive_frequency=1.2,
    )
    assert modal.mass is modal.stiffness is None
    assert modal != made
    assert modal._compiled.frequencies.tobytes() == made.frequencies.tobytes()
    # There the modes are the coordinates.
    assert modal._compiled.shapes.tolist() == [[1.0, 0.0], [0.0, 1.0]]
    states = np.random.default_rng(1).normal(size=(3, 2, 2))
    modal_states = modal._to_core(states)
    assert np.abs(modal_states - states @ np.array(MASS) @ made.shapes).max() < 1e-15
    assert np.abs(modal._from_core(modal_states) - states).max() < 1e-15
    assert made._from_core(made._to_core(states)).tobytes() == states.tobytes()
    assert made._to_core(states[0]).tobytes() == states[0].tobytes()


def test_the_core_has_the_frequencies_that_are_given():
    # Its stiffness has their rounded squares, and the lowest here is at the limit of rigid-body
    # modes, where what is taken must not become 0.
    draw = np.random.default_rng(3)
    refused = 0
    for highest in draw.uniform(1e-3, 1e3, 300):
        for low in 1e-6 * (1.0 + 2.0**-52 * np.arange(-3, 4)):
            given = highest * np.array([low, *np.sort(draw.uniform(0.1, 1.0, 5)), 1.0])
            try:
                made = vi.Structure.from_modes(given, np.eye(7), [])
            except vi.ParameterError:
                refused += 1
                continue
            assert made._compiled.frequencies.tobytes() == given.tobytes()
    assert 300 <= refused <= 1800


def test_shapes_of_any_length_are_scaled_by_the_modal_mass():
    scaled = beam(shapes=2.0 * beam().shapes * [1.0, 3.0], modal_mass=[4.0, 36.0])
    assert scaled == beam()
    assert beam().coordinates == 3
    assert beam().shapes.shape == (3, 2)
    assert beam().replace(shapes=beam().shapes * 2, modal_mass=[4, 4]) == beam()
    # What underflows to -0.0 is 0.
    light = beam(shapes=[[-1e-200, 1], [0.5, -1], [1, 2]], modal_mass=[1e300, 1])
    assert vi.Structure.from_json(light.to_json()) == light
    with pytest.raises(vi.ParameterError, match=r"^modal_mass = \[4, 4\].*beside shapes="):
        beam().replace(modal_mass=[4, 4])


def test_rows_loads_and_damping_are_projected():
    loads = {"static_load": [1.0, 2.0, 4.0], "drive_amplitude": [1j, 0, 1], "drive_frequency": 2}
    damping = np.diag([1.0, 2.0, 4.0])
    made = beam(shapes=[[1, 0], [0, 1], [0, 1]], damping=damping, **loads)
    basis = made._basis
    assert basis.on("", made.static_load).tolist() == [1.0, 6.0]
    assert basis.on("", made.drive_amplitude).tolist() == [1j, 1.0]
    assert basis.square("", made.damping).tolist() == [[1.0, 0.0], [0.0, 6.0]]
    # One rounding only, in any order of the terms.
    exact = beam(shapes=[[1e16, 0], [1.0, 1.0], [-1e16, 0]])._basis
    assert exact.on("", np.ones(3)).tolist() == [1.0, 1.0]


def test_a_start_outside_the_span_is_told_by_how_much():
    made = beam(shapes=[[1, 1], [0, 1], [1, 0]])
    inside = made._from_core(np.array([[[0.2, -0.4], [1.0, 2.0]]]))
    assert np.abs(made._to_core(inside[0]) - [[0.2, -0.4], [1.0, 2.0]]).max() < 1e-15
    # (2, 1, 1) is inside; (1, 1, 1) is off by (1, -1, -1)/3.
    with pytest.raises(
        vi.StateError,
        match=r"^v of initial lies outside the span of the modes by 0.333 of its size; allowed: sh",
    ):
        made._to_core(np.array([[2.0, 1, 1], [1, 1, 1]]))
    with pytest.raises(vi.StateError, match=r"^q of initial\[1\] lies .* by 0.333 of its size"):
        made._to_core(np.array([np.zeros((2, 3)), [[1, 0, 0], [0, 0, 0]]]))
    huge = np.array([[2e200, 1e200, 1e200], [0, 0, 0]])
    assert np.abs(made._to_core(huge) / 1e200 - [[1, 1], [0, 0]]).max() < 1e-15
    for beyond in (huge * [1, 1, 2], np.array([[1.7e308] * 3, [1.7e308] * 3])):
        with pytest.raises(vi.StateError, match=r"^q of initial lies outside the span"):
            made._to_core(beyond)
    assert made._to_core(np.zeros((0, 2, 3))).shape == (0, 2, 2)


def test_too_few_points_determine_no_modes():
    for made in (beam(shapes=[[1, 1]], stops=[]), beam(shapes=[[1, 2], [2, 4]], stops=[])):
        rest = np.zeros((2, made.coordinates))
        assert made._to_core(rest).tolist() == np.zeros((2, 2)).tolist()
        with pytest.raises(
            vi.StateError, match=r"do not determine 2 modes .* allowed: 0, all modes"
        ):
            made._to_core(rest + 1.0)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"frequencies": []}, "frequencies = [] is not allowed; allowed: at least one number"),
        ({"frequencies": [3, 1]}, "frequencies[1] = 1.0 is not allowed; allowed: at least 3.0"),
        ({"frequencies": [-1, 1]}, "frequencies[0] = -1.0 is not allowed; allowed: 0, or a numb"),
        ({"frequencies": [0, 1e60]}, "frequencies[1] = 1e+60 is not allowed; allowed: 0, or a"),
        ({"frequencies": [1e-7, 1]}, "frequencies[0] = 1e-07 is not allowed; allowed: 0, or at"),
        ({"shapes": np.eye(3)}, "shapes of shape (3, 3) is not allowed; allowed: shape (n >= 1, 2"),
        ({"shapes": np.eye(2)}, "stops[0].normal of shape (3,) is not allowed; allowed: shape (2"),
        ({"modal_mass": [1]}, "modal_mass of shape (1,) is not allowed; allowed: shape (2,)"),
        ({"modal_mass": [1, 0]}, "modal_mass[1] = 0.0 is not allowed; allowed: a finite number >"),
        ({"shapes": np.full((3, 2), 1e200), "modal_mass": [1, 1e-300]}, "shapes[0, 1] = 1e+200 is"),
        ({"damping_ratios": [0.1] * 3}, "damping_ratios of shape (3,) is not allowed; allowed: s"),
        ({"damping": np.eye(2)}, "damping of shape (2, 2) is not allowed; allowed: shape (3, 3)"),
        ({"static_load": [1, 2]}, "static_load of shape (2,) is not allowed; allowed: shape (3,)"),
        ({"static_load": [1e308] * 3}, "static_load in modal coordinates, times shapes, is not f"),
        (
            {"shapes": [[1, 1], [1, 1], [0, 0]]},
            "stops[0].normal = [0.0, 0.0, 1.0] is not allowed; allowed: a row that some mode moves",
        ),
    ],
)
def test_what_are_no_modes_is_refused_by_name(changes, words):
    with pytest.raises(vi.ParameterError, match=f"^{re.escape(words)}"):
        beam(**changes)
