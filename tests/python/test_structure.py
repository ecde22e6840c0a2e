"""Structure and Stop: validation, identity, round trips, changes, checks of starts."""

import copy
import dataclasses
import inspect
import json
import math
import pickle
import re
import warnings

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import Phase, given, settings

import vibroimpact as vi
from complete_results import assert_complete
from two_masses import MASS, STIFFNESS, STOPS, beam, structure
from vibroimpact import _core, keyword_types
from vibroimpact.structure_fields import CHOICES

NAMES = {"Structure": vi.Structure, "Stop": vi.Stop}

_number = st.floats(-1e3, 1e3)
_row = st.lists(_number, min_size=2, max_size=2)
_ratios = st.lists(st.floats(0.0, 2.0), min_size=2, max_size=2)
_stop = st.builds(
    vi.Stop,
    st.tuples(st.floats(0.1, 10.0), _number),
    _number,
    st.floats(0.0, 1.0),
    friction=st.floats(0.0, 1.0),
    tangent=st.tuples(st.just(0.0), st.floats(0.1, 10.0)),
    amplitude=_number,
    phase=_number,
)
_options = st.fixed_dictionaries(
    {
        "drive_frequency": st.floats(1e-3, 1e3),
        "phase": _number,
        "law": st.sampled_from(["poisson", "newton", "energetic"]),
        "simultaneous": st.sampled_from(["stop", "sequence"]),
        "stops": st.lists(_stop, max_size=3),
    },
    optional={
        "static_load": _row,
        "drive_amplitude": _row
        | st.lists(st.complex_numbers(max_magnitude=1e3), min_size=2, max_size=2),
    },
)
_damped = st.one_of(
    st.just({}),
    _ratios.map(lambda ratios: {"damping_ratios": ratios}),
    st.floats(0.0, 2.0).map(lambda a: {"damping": (a * np.array(MASS)).tolist()}),
)


@st.composite
def structures(draw):
    options = draw(_options) | draw(_damped)
    if draw(st.booleans()):
        return vi.Structure(MASS, STIFFNESS, **options)
    if "damping" in options:
        options["damping"] = np.diag(np.diag(options["damping"])).tolist()
    return vi.Structure.from_modes([1.0, 1.5], np.eye(2), **options)


@given(structures())
def test_every_round_trip_gives_an_equal_structure(made):
    trips = [
        eval(repr(made), NAMES),
        vi.Structure.from_dict(made.to_dict()),
        vi.Structure.from_json(made.to_json()),
        pickle.loads(pickle.dumps(made)),
        copy.copy(made),
        copy.deepcopy(made),
        made.replace(),
    ]
    for trip in trips:
        assert trip == made
        assert hash(trip) == hash(made)
        assert trip.to_dict() == made.to_dict()
        assert trip.frequencies.tobytes() == made.frequencies.tobytes()
        assert trip.shapes.tobytes() == made.shapes.tobytes()


@given(_stop)
def test_every_round_trip_gives_an_equal_stop(stop):
    trips = [
        eval(repr(stop), NAMES),
        vi.Stop.from_dict(stop.to_dict()),
        vi.Stop.from_dict(json.loads(json.dumps(stop.to_dict()))),
        pickle.loads(pickle.dumps(stop)),
        copy.deepcopy(stop),
        stop.replace(),
    ]
    for trip in trips:
        assert trip == stop
        assert hash(trip) == hash(stop)


_any = st.floats() | st.floats(-4, 4) | st.sampled_from([1e-50, 1e50, 1e25, 1e-25])
_any_row = st.lists(_any, min_size=2, max_size=2)
_symmetric = st.tuples(_any, _any, _any).map(lambda abc: [[abc[0], abc[1]], [abc[1], abc[2]]])


@settings(max_examples=1000, derandomize=True, deadline=None, phases=(Phase.generate,))
@given(
    _symmetric | st.just(MASS),
    _symmetric | st.just(STIFFNESS),
    st.fixed_dictionaries(
        {},
        optional={
            "damping": _symmetric,
            "static_load": _any_row,
            "drive_amplitude": _any_row | st.lists(st.complex_numbers(), min_size=2, max_size=2),
            "drive_frequency": _any,
            "phase": _any,
        },
    ),
)
def test_any_numbers_make_a_structure_with_modes_or_are_refused_by_name(mass, stiffness, options):
    try:
        made = vi.Structure(mass, stiffness, STOPS[:1], **options)
    except vi.ParameterError as error:
        named = re.match(r"(\w+)\b.* = .* is not allowed; allowed: ", str(error))
        if named is None or named[1] not in ("mass", "stiffness", "stops", *options):
            raise
        return
    assert_complete(made)
    # In units in which masses are 1, or small masses would be lost.
    scaled = made.shapes * np.sqrt(np.diag(made.mass))[:, np.newaxis]
    unit = made.mass / np.sqrt(np.outer(np.diag(made.mass), np.diag(made.mass)))
    assert np.abs(scaled.T @ unit @ scaled - np.eye(2)).max() < 1e-9 * np.abs(scaled).max() ** 2


def test_modes_solve_their_equations():
    made = structure()
    mass, stiffness, shapes = np.array(MASS), np.array(STIFFNESS), made.shapes
    assert made.coordinates == 2
    # Column i is the shape of mode i: the residual tells columns from rows, for M is not 1.
    residual = stiffness @ shapes - mass @ shapes * made.frequencies**2
    assert np.abs(residual).max() < 1e-14
    assert np.abs(shapes.T @ mass @ shapes - np.eye(2)).max() < 1e-15
    assert (np.diff(made.frequencies) > 0.0).all()


def test_a_free_body_has_a_rigid_mode():
    free = structure(stiffness=[[1, -1], [-1, 1]], damping_ratios=[0, 0.1])
    assert free.frequencies[0] == 0.0
    with pytest.raises(vi.ParameterError, match=r"^damping_ratios\[0\] = 0.1 .*damping= takes a m"):
        free.replace(damping_ratios=[0.1, 0.1])


def test_defaults():
    plain = vi.Structure(MASS, STIFFNESS, [])
    assert plain.to_dict() == {
        "mass": MASS,
        "stiffness": STIFFNESS,
        "stops": [],
        "static_load": [0.0, 0.0],
        "drive_amplitude": [0.0, 0.0],
        "drive_frequency": 0.0,
        "phase": 0.0,
        "law": "poisson",
        "simultaneous": "stop",
    }
    assert plain.damping is plain.damping_ratios is None
    assert plain.drive_period == math.inf
    assert structure().drive_period == 2.0 * math.pi / 1.2
    assert vi.Stop([1], 0.5, 0.8).to_dict() == {
        "normal": [1.0],
        "gap": 0.5,
        "restitution": 0.8,
        "friction": 0.0,
        "amplitude": 0.0,
        "phase": 0.0,
    }
    assert structure(stops=STOPS[0]).stops == (STOPS[0],)


def test_choices_are_those_of_the_core():
    assert tuple(CHOICES["law"]) == _core.COULOMB_LAWS
    assert tuple(CHOICES["simultaneous"]) == _core.SIMULTANEOUS
    for maker in (vi.Structure, vi.Structure.from_modes):
        signature = inspect.signature(maker).parameters
        assert signature["law"].default == _core.COULOMB_LAWS[0]
        assert signature["simultaneous"].default == _core.SIMULTANEOUS[0]


def test_names_that_replace_completes_are_those_of_the_makers():
    own = {*inspect.signature(vi.Structure).parameters}
    own |= {*inspect.signature(vi.Structure.from_modes).parameters}
    assert {*keyword_types.StructureChanges.__annotations__} == own | {
        "gap",
        "restitution",
        "friction",
    }
    stop = {*inspect.signature(vi.Stop).parameters}
    assert {*keyword_types.StopChanges.__annotations__} == stop


def test_what_simulates_alike_is_equal():
    assert structure(drive_amplitude=[1 + 0j, 2]) == structure(drive_amplitude=[1.0, 2.0])
    assert structure(static_load=[-0.0, 0]) == structure()
    assert structure(stops=tuple(STOPS)) == structure()
    assert structure(mass=np.array(MASS, np.float32)) == structure()
    assert structure() != structure(drive_amplitude=[1, -1j])
    assert structure() != structure(damping_ratios=None)
    assert structure() != 3
    assert vi.Stop([1, 0], 0.5, 0.8) != vi.Stop([1, 0], 0.5, 0.8, tangent=[0, 1])


def test_structures_and_their_arrays_are_immutable():
    for made in (structure(), beam()):
        with pytest.raises(dataclasses.FrozenInstanceError):
            made.stops = ()
        with pytest.raises(dataclasses.FrozenInstanceError):
            del made.phase
        again = pickle.loads(pickle.dumps(made))
        for each in (made, again):
            arrays = [each.shapes, each.frequencies, each.static_load, each.drive_amplitude]
            arrays += [stop.normal for stop in each.stops]
            assert not any(array.flags.writeable for array in arrays)
    given = np.array(MASS)
    made = structure(mass=given)
    given[0, 0] = 7.0
    assert made.mass[0, 0] == 2.0


# Changes.


def test_numbers_of_stops_are_changed_by_name():
    made = structure()
    changed = made.replace(gap=0.5, restitution_1=0.4)
    assert [stop.gap for stop in changed.stops] == [0.5, 0.5]
    assert [stop.restitution for stop in changed.stops] == [0.8, 0.4]
    assert changed.replace(gap_0=0.3, gap_1=0.1, restitution_1=0.5) == made
    assert [stop.gap for stop in made.replace(gap_1=1, gap=2).stops] == [2.0, 1.0]
    assert made.replace(stops=STOPS[:1], gap=1).stops == (STOPS[0].replace(gap=1),)
    assert made.replace(friction_1=0) == made.replace(
        stops=[STOPS[0], STOPS[1].replace(friction=0)]
    )


def test_damping_matrix_is_the_one_that_holds():
    ratios = np.array([0.01, 0.2])
    made = structure(damping_ratios=ratios)
    matrix = made.damping_matrix
    # Each mode decays at 2 zeta omega, in the shapes of an independent solver.
    squares, shapes = np.linalg.eig(np.linalg.solve(MASS, STIFFNESS))
    order = squares.argsort()
    shapes = shapes[:, order] / np.sqrt(np.diag(shapes.T @ MASS @ shapes))[order]
    rates = np.diag(2.0 * ratios * np.sqrt(squares[order]))
    assert abs(shapes.T @ matrix @ shapes - rates).max() < 1e-15
    assert (matrix == matrix.T).all()
    assert not matrix.flags.writeable
    given = made.replace(damping=matrix)
    assert given.damping_matrix is given.damping
    start = [[0.0, 0.1], [0.5, 0.0]]
    ends = [vi.simulate(each, initial=start, periods=3).final_state for each in (made, given)]
    assert abs(ends[0].q - ends[1].q).max() < 1e-13
    assert structure(damping_ratios=None).damping_matrix.tolist() == [[0, 0], [0, 0]]
    assert vi.Structure([[1]], [[0]], [], damping_ratios=0).damping_matrix.tolist() == [[0]]
    # Modes have no mass matrix, and without it ratios make no C.
    assert beam(damping_ratios=0.02).damping_matrix is None
    assert beam(damping_ratios=None).damping_matrix.shape == (3, 3)


def test_one_kind_of_damping_takes_the_place_of_the_other():
    proportional = structure().replace(damping=0.1 * np.array(MASS))
    assert proportional.damping_ratios is None
    assert proportional.replace(damping_ratios=[0.01, 0.02]) == structure()
    assert structure().replace(damping_ratios=None) == structure(damping_ratios=None)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"gap_2": 1.0}, "gap_2 = 1.0 is not allowed; allowed: the number of a stop, 0 to 1"),
        ({"restitution": 1.5}, r"stops[0].restitution = 1.5 is not allowed; allowed: a number in"),
        ({"restitution_1": 2}, r"stops[1].restitution = 2.0 is not allowed; allowed: a number in"),
        ({"gap_1": math.nan}, r"stops[1].gap = nan is not allowed; allowed: a finite number"),
        ({"friction": 0.1}, "stops[0].tangent = None is not allowed; allowed: a row, with fric"),
        ({"stops": [], "gap": 1}, "gap = 1 is not allowed; allowed: no such number"),
    ],
)
def test_changes_of_stops_that_are_refused(changes, words):
    with pytest.raises(vi.ParameterError, match=f"^{re.escape(words)}"):
        structure().replace(**changes)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: structure(dampng=1), "'dampng', did you mean damping?"),
        (lambda: structure(zeta=[1, 1]), "'zeta', did you mean damping_ratios?"),
        (lambda: structure(K=STIFFNESS), "'K', did you mean stiffness?"),
        (lambda: structure().replace(dampng=1), "'dampng', did you mean damping?"),
        (lambda: structure().replace(gpa=1), "'gpa', did you mean gap?"),
        (lambda: structure().replace(restituton_1=1), "'restituton_1', did you mean restitution_"),
        (lambda: structure().replace(gap_01=1), "'gap_01', did you mean gap_0?"),
        (lambda: structure().replace(shapes=1), "'shapes'"),
        (lambda: beam().replace(mass=1), "'mass', did you mean modal_mass?"),
        (lambda: beam().replace(stiffness=1), "'stiffness'; known: frequencies, shapes, stops"),
        (lambda: beam(frequency=[1]), "'frequency', did you mean drive_frequency?"),
        (lambda: vi.Stop([1], 0, 1, fricton=0), "'fricton', did you mean friction?"),
        (lambda: STOPS[0].replace(fricton=0), "'fricton', did you mean friction?"),
    ],
)
def test_a_misspelt_name_is_told_the_one_that_was_meant(call, words):
    with pytest.raises(TypeError, match=re.escape(words)):
        call()


# What is refused.

NO_MATRIX = "is not allowed; allowed: shape (n >= 1, n >= 1)"


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"mass": 3}, f"mass = 3 {NO_MATRIX}"),
        ({"mass": [1, 2]}, f"mass of shape (2,) {NO_MATRIX}"),
        ({"mass": np.ones((2, 3))}, f"mass of shape (2, 3) {NO_MATRIX}"),
        ({"mass": np.zeros((0, 0))}, f"mass of shape (0, 0) {NO_MATRIX}"),
        ({"mass": [[1], [1, 2]]}, "mass = [[1], [1, 2]] is not allowed; allowed: a matrix"),
        ({"mass": [[1j, 0], [0, 1]]}, "mass[0, 0] = 1j is not allowed; allowed: a real number"),
        ({"mass": [[1, math.nan], [0, 1]]}, "mass[0, 1] = nan is not allowed; allowed: a finite"),
        ({"mass": [[1, 0.2], [0.1, 1]]}, "mass[1, 0] = 0.1 is not allowed; allowed: mass[0, 1] ="),
        ({"mass": [[1, 2], [2, 1]]}, "mass = a matrix whose leading minor of order 2 is not pos"),
        ({"mass": np.diag([1e60, 1])}, "mass[0, 0] = 1e60 is not allowed; allowed: a number in"),
        ({"mass": np.eye(3)}, "stiffness of shape (2, 2) is not allowed; allowed: shape (3, 3)"),
        ({"stiffness": [[1, 2], [2, 1]]}, "stiffness = a matrix with w^2 = -"),
        ({"stiffness": np.eye(2) * 1e60}, "stiffness = a largest entry 1e60 is not allowed; allo"),
        (
            {"stiffness": [[1, 0], [1, 1]]},
            "stiffness[1, 0] = 1.0 is not allowed; allowed: stiffness",
        ),
        ({"damping": np.eye(2)}, "damping_ratios = [0.01, 0.02] is not allowed; allowed: None bes"),
        ({"damping_ratios": None, "damping": [1, 1]}, "damping of shape (2,) is not allowed"),
        ({"damping_ratios": None, "damping": -np.array(MASS)}, "damping = a matrix with the eige"),
        ({"damping_ratios": [0.1]}, "damping_ratios of shape (1,) is not allowed; allowed: shape"),
        ({"damping_ratios": [0, -1]}, "damping_ratios[1] = -1.0 is not allowed; allowed: a finite"),
        (
            {"damping_ratios": [0, 1.7e308]},
            "damping_ratios[1] = 1.7e308 is not allowed; allowed: a number wh",
        ),
        ({"static_load": [1, math.inf]}, "static_load[1] = inf is not allowed; allowed: a finite"),
        ({"static_load": [1j, 0]}, "static_load[0] = 1j is not allowed; allowed: a real number"),
        ({"drive_amplitude": [1, 2, 3]}, "drive_amplitude of shape (3,) is not allowed; allowed:"),
        ({"drive_amplitude": [1, complex(0, math.nan)]}, "drive_amplitude[1] = nanj is not allow"),
        ({"drive_frequency": -1}, "drive_frequency = -1.0 is not allowed; allowed: a number in [0"),
        ({"phase": math.nan}, "phase = nan is not allowed; allowed: a finite number"),
        ({"law": "paper"}, "law = 'paper' is not allowed; allowed: 'poisson' (ratio of impulses)"),
        ({"law": None}, "law = None is not allowed; allowed: 'poisson'"),
        ({"simultaneous": "now"}, "simultaneous = 'now' is not allowed; allowed: 'stop' (the run"),
        ({"simultaneous": "together"}, "simultaneous = together is not allowed; allowed: stop or"),
        ({"stops": 3}, "stops = 3 is not allowed; allowed: a vibroimpact.Stop or a sequence"),
        ({"stops": [STOPS[0], "stop"]}, "stops[1] = 'stop' is not allowed; allowed: a vibroimpa"),
        ({"stops": [vi.Stop([1], 1, 1)]}, "stops[0].normal of shape (1,) is not allowed; allowed"),
        ({"drive_frequency": 0}, "stops[1].amplitude = 0.05 is not allowed; allowed: 0 with drive"),
        (
            {"stops": [vi.Stop([1, 0], 1, 1, friction=0.1, tangent=[-2, 0])]},
            "stops[0].tangent = one parallel to it is not allowed; allowed: a row that is not par",
        ),
        (
            {"stops": [vi.Stop([1, 0], 1, 1, friction=0.1, tangent=[0, 0])]},
            "stops[0].tangent = a row x with x M^-1 x = 0e0 is not allowed; allowed: a row for",
        ),
        (
            {"stops": [vi.Stop([1e200, 0], 1, 1)]},
            "stops[0].normal = a row x with x M^-1 x = NaN is not allowed; allowed: a row for",
        ),
    ],
)
def test_what_is_no_structure_is_refused_by_name(changes, words):
    with pytest.raises(vi.ParameterError, match=f"^{re.escape(words)}"):
        structure(**changes)


def test_the_number_of_coordinates_has_a_limit():
    assert vi.Structure(np.eye(3), np.eye(3), []).coordinates == 3
    with pytest.raises(vi.ParameterError, match=r"^mass = 257 rows .* allowed: at most 256 rows"):
        vi.Structure(np.eye(257), np.eye(257), [])


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"normal": [0, 0]}, "normal = 2 zeros is not allowed; allowed: at least one entry other"),
        ({"normal": []}, "normal = [] is not allowed; allowed: at least one number"),
        ({"normal": [[1, 0]]}, "normal of shape (1, 2) is not allowed; allowed: one dimension"),
        ({"normal": [1, math.nan]}, "normal[1] = nan is not allowed; allowed: a finite number"),
        ({"gap": math.inf}, "gap = inf is not allowed; allowed: a finite number"),
        ({"gap": "1"}, "gap = '1' is not allowed; allowed: a finite number"),
        (
            {"restitution": -5e-324},
            "restitution = -5e-324 is not allowed; allowed: a number in [0, 1]",
        ),
        ({"restitution": math.nextafter(1, 2)}, "restitution = 1.0000000000000002 is not allowed"),
        ({"friction": -1}, "friction = -1 is not allowed; allowed: a finite number >= 0"),
        ({"friction": 0.1}, "tangent = None is not allowed; allowed: a row, with friction > 0"),
        ({"friction": 0.1, "tangent": [1]}, "tangent of shape (1,) is not allowed; allowed: sha"),
        ({"amplitude": math.nan}, "amplitude = nan is not allowed; allowed: a finite number"),
        ({"phase": True}, "phase = True is not allowed; allowed: a finite number"),
    ],
)
def test_what_is_no_stop_is_refused_by_name(changes, words):
    with pytest.raises(vi.ParameterError, match=f"^{re.escape(words)}"):
        vi.Stop(**{"normal": [1, 0], "gap": 0.5, "restitution": 0.8} | changes)


def test_a_tangent_may_wait_for_friction():
    # So that friction can be varied from 0; a tangent that is of no use yet may be parallel.
    stop = vi.Stop([1, 0], 0.5, 0.8, tangent=[1, 0])
    assert structure(stops=[stop]).stops[0].friction == 0.0
    with pytest.raises(vi.ParameterError, match=r"^stops\[0\].tangent"):
        structure(stops=[stop]).replace(friction=0.1)


def test_dict_and_json_name_what_is_wrong():
    fields = structure().to_dict()
    with pytest.raises(vi.ParameterError, match=r"unknown structure.*dampng, did you mean damping"):
        vi.Structure.from_dict(fields | {"dampng": 1})
    with pytest.raises(vi.ParameterError, match=r"^missing structure parameters: stiffness, stops"):
        vi.Structure.from_dict({"mass": MASS})
    with pytest.raises(vi.ParameterError, match=r"^missing structure parameters: shapes, stops"):
        vi.Structure.from_dict({"frequencies": [1.0]})
    with pytest.raises(vi.ParameterError, match=r"^stops\[1\].gap = None"):
        vi.Structure.from_dict(fields | {"stops": [STOPS[0], STOPS[1].to_dict() | {"gap": None}]})
    with pytest.raises(vi.ParameterError, match=r"^missing stop parameters: gap"):
        vi.Stop.from_dict({"normal": [1], "restitution": 1})
    for fields in (3, [1], "mass"):
        with pytest.raises(vi.ParameterError, match=r"^fields = "):
            vi.Structure.from_dict(fields)
    text = structure().to_json()
    for bad in ("{", None, "3", "null", text.replace("[0.0, 1.0]", "[0.0]", 1)):
        with pytest.raises(vi.ParameterError):
            vi.Structure.from_json(bad)
    assert '"drive_amplitude": [[1.0, 0.0], [0.0, 1.0]]' in text


def test_a_notebook_shows_the_numbers_of_a_structure():
    text = structure()._repr_html_()
    for word in ("coordinates", "stops[1]", "gap = 0.1, restitution = 0.5, friction = 0.2", "1.2"):
        assert word in text
    many = vi.Structure(np.eye(9), np.diag(np.arange(1.0, 10.0) ** 2), [])
    assert "7, 8 and 1 more" in many._repr_html_()
    assert "[0.0, 1.0]" in STOPS[0]._repr_html_()


@pytest.mark.parametrize(
    ("initial", "words"),
    [
        (3, "initial = 3 is not allowed; allowed: rows q and v of shape (2, 2), or (k, 2, 2)"),
        (np.zeros((2, 3)), "initial of shape (2, 3) is not allowed; allowed: rows q and v"),
        (np.zeros((3, 2)), "initial of shape (3, 2) is not allowed; allowed: rows q and v"),
        (np.zeros((2, 2), bool), "initial[0, 0] = False is not allowed; allowed: a real number"),
        ([[0, 0], [0, math.nan]], "initial[1, 1] = nan is not allowed; allowed: finite numbers"),
    ],
)
def test_starts_are_checked(initial, words):
    with pytest.raises(vi.StateError, match=f"^{re.escape(words)}"):
        structure()._starts(initial)


@pytest.mark.parametrize("ratios", [2, [0.01, 2.0]])
def test_damping_ratios_in_per_cent_are_warned_of(ratios):
    said = r"^damping_ratios\[[01]\] = 2: from 1 on a mode does not oscillate; 2 per cent are 0.02$"
    basis = (np.eye(2), [[2, -1], [-1, 2]], [])
    with pytest.warns(UserWarning, match=said) as caught:
        vi.Structure(*basis, damping_ratios=ratios)
    assert caught[0].filename == __file__
    with pytest.warns(UserWarning, match=said) as caught:
        vi.Structure.from_modes([1.0, 3.0], np.eye(2), [], damping_ratios=ratios)
    assert caught[0].filename == __file__
    with warnings.catch_warnings(action="error"):
        vi.Structure(*basis, damping_ratios=0.99)
