"""What errors say about the mistakes of a first hour with masses and springs of one's own."""

import numpy as np
import pytest
from scipy.optimize import nnls

import vibroimpact as vi
from vibroimpact.structure_rest import gaps_at, rest_on_stops

MASS, STIFFNESS = [[1.5, 0], [0, 1.5]], [[8000, -4000], [-4000, 4000]]
START = np.zeros((2, 2))


def made(**changes):
    stop = vi.Stop([0, 1], 0.002, 0.6)
    fields = {"mass": MASS, "stiffness": STIFFNESS, "stops": [stop], "damping_ratios": 0.02}
    return vi.Structure(**(fields | {"drive_amplitude": [0, 5], "drive_frequency": 25} | changes))


def over(**axis):
    return vi.bifurcation_diagram(made(), initial=START, periods=20, **axis)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: made(mass=1.5), "mass = 1.5 is not allowed; allowed: .*, such as [[1.5]]"),
        (
            lambda: made(mass=[[1.5, 0], [0]]),
            "mass = [[1.5, 0], [0]] .*; its rows have 2, 1 entries",
        ),
        (lambda: made(mass=[[1.5, 0], 0]), "its rows have 2, no entries"),
        (lambda: made(mass=[["1.5", 0], [0, 1]]), "mass[0, 0] = '1.5' .*: a real number, not text"),
        (lambda: made(static_load=[0, None]), "static_load[1] = None is not allowed; .*: a real"),
        (lambda: made(drive_frequency=[20, 25]), "[20, 25] .*; vibroimpact.bifurcation_diagram("),
        (
            lambda: made().replace(gap=np.ones(20)),
            "gap = array([1., .*; vibroimpact.",
        ),
        (lambda: vi.Stop("x2", 0.002, 0.6), "normal = 'x2' .*: one number for each coordinate"),
        (lambda: vi.Stop([0, 1], 0.002, 60), "60 per cent are 0.6"),
        (lambda: made(stops=[([0, 1], 0.1, 0.6)]), "a vibroimpact.Stop(normal, gap, restitution)"),
        (lambda: over(drive_frequency=["10", "20"]), "drive_frequency[0] = '10' .*, not text"),
        (
            lambda: vi.simulate(made(drive_frequency=0), initial=START, periods=9),
            "periods = 9 .*: None, as drive_frequency = 0 has no drive period; give time=",
        ),
    ],
)
def test_an_error_says_what_is_wrong_and_what_to_do(call, said):
    with pytest.raises(vi.ParameterError) as caught:
        call()
    for part in said.split(" .*"):
        assert part in str(caught.value)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: made(force=[0, 5]), "did you mean drive_amplitude?"),
        (lambda: made(weight=[0, 5]), "did you mean static_load?"),
        (lambda: vi.System(mass=1, stiffness=2), "a vibroimpact.Structure takes masses, springs"),
        (lambda: vi.System(m1=1, m2=2), "other masses and springs are a vibroimpact.Structure"),
        (lambda: vi.Wall, "did you mean Stop?"),
        (lambda: vi.Spring, "did you mean Structure?"),
    ],
)
def test_a_name_of_another_package_leads_to_the_own_one(call, said):
    with pytest.raises((TypeError, AttributeError)) as caught:
        call()
    assert said in str(caught.value)


def test_a_range_of_many_numbers_is_answered_with_its_ends():
    motion = vi.simulate(made(), initial=START, periods=100).refine()
    with pytest.raises(vi.ParameterError, match=r"of these numbers \(24, 26\)$"):
        motion.follow(drive_frequency=np.linspace(24, 26, 10))


def test_files_of_other_kinds_say_what_reads_and_writes_them(tmp_path):
    (tmp_path / "own.json").write_text(made().to_json(), encoding="utf-8")
    with pytest.raises(ValueError, match="from_json of System, Structure and Stop reads the text"):
        vi.load(tmp_path / "own.json")
    with pytest.raises(vi.ParameterError, match=r"a file \.npz; to_pandas\(\) gives tables"):
        vi.simulate(made(), initial=START, periods=5).save(tmp_path / "run.csv")
    assert not (tmp_path / "run.csv").exists()


def test_a_start_inside_a_contact_says_where_one_may_begin():
    with pytest.raises(vi.StateError, match=r"g <= 0, which is normal \. q <= 0\.002 there$"):
        vi.simulate(made(), initial=[[0, 0.005], [0, 0]], periods=1)
    pressed = made(stops=[vi.Stop([0, 1], -0.004, 0.6)])
    said = r"stops press on it at q = 0: it rests at q = \[-0\.002, -0\.004\]$"
    with pytest.raises(vi.StateError, match=said):
        vi.simulate(pressed, initial=START, periods=1)
    vi.simulate(pressed, initial=[[-0.002, -0.004], [0, 0]], periods=1)
    free = vi.Structure([[1]], [[0]], [vi.Stop([1], -1, 0.5)], static_load=[-1])
    with pytest.raises(
        vi.StateError, match=r"stops press on it at q = 0, which is not where it rests$"
    ):
        vi.simulate(free, initial=[[0], [0]], time=1)
    two = {"mass_ratio": 0.6, "frequency_ratio": 2, "restitution": 0.8, "drive_frequency": 1.8}
    for contact in ("oblique", "direct"):
        system = vi.System(**two, gap=-0.1, contact=contact)
        with pytest.raises(vi.StateError, match=r"g <= 0, which is x2 >= 0\.1 there$"):
            vi.simulate(system, initial=(0, 0, 0, 0), periods=1)
        vi.simulate(system, initial=(0, 0, 0.1, 0), periods=1)


def test_where_a_structure_rests_is_the_minimum_under_its_stops():
    rng = np.random.default_rng(3)
    touched = set()
    for _ in range(200):
        size, count = rng.integers(1, 5), rng.integers(1, 5)
        root = rng.normal(size=(size, size))
        stiffness = root @ root.T + 0.1 * np.eye(size)
        stops = [
            vi.Stop(rng.normal(size=size), gap, 0.5) for gap in rng.uniform(-0.5, 0.3, size=count)
        ]
        load = rng.normal(size=size)
        structure = vi.Structure(np.eye(size), stiffness, stops, static_load=load)
        rows, gaps = np.array([stop.normal for stop in stops]), [stop.gap for stop in stops]
        rest = rest_on_stops(structure._basis, stops, load)
        if rest is None:
            # No place fits all stops: forces on them that balance do work (Farkas).
            _, left = nnls(np.vstack([rows.T, -np.array(gaps)]), np.append(np.zeros(size), 1.0))
            assert left < 1e-9
            continue
        there = gaps_at(stops, rest)
        assert there.max() < 1e-9
        touching = there > -1e-9
        # Springs and loads balance forces of the stops that it touches, which only press.
        pushed = load - stiffness @ rest
        left = nnls(rows[touching].T, pushed)[1] if touching.any() else np.linalg.norm(pushed)
        assert left < 1e-9 * (1.0 + abs(stiffness @ rest).max())
        touched.add(int(touching.sum()))
    assert touched >= {0, 1, 2, 3}
