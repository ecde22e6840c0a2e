"""Basins of attraction of structures."""

import numpy as np
import pytest

import vibroimpact as vi
from ctrl_c import asks_of, ctrl_c_at
from struck import BEAM, SETTLING

# A mass between two stops strikes both once in every period, or neither: its start decides.
TWO = vi.Structure(
    [[1]],
    [[1]],
    [vi.Stop([1], 0.3, 0.8), vi.Stop([-1], 0.6, 0.7)],
    damping_ratios=[0.05],
    drive_amplitude=[1],
    drive_frequency=3.0,
)
PLANE = {"q_0": np.linspace(-0.5, 0.4, 7), "v_0": np.linspace(-2.0, 2.0, 6)}
ASKED = {"scouts": 42, "periods": 300, "keep": 60}


def found(**options):
    return vi.basins(TWO, **{**ASKED, **PLANE, **options})


@pytest.fixture(scope="module")
def basins():
    return found()


def same(one, other):
    """Check that two basins have the same bits."""
    for name in ("attractor", "status_code", "settling"):
        assert getattr(one, name).tobytes() == getattr(other, name).tobytes()
    for a, b in zip(one.attractors, other.attractors, strict=True):
        assert (a.label, a.kind, a.start) == (b.label, b.kind, b.start)
        assert a.sections.tobytes() == b.sections.tobytes()


def test_the_attractor_of_a_cell_is_where_its_run_ends(basins):
    assert basins.complete
    assert {attractor.label for attractor in basins.attractors} == {"1-0", "1-2"}
    for i in range(7):
        for j in range(6):
            start = [[PLANE["q_0"][i]], [PLANE["v_0"][j]]]
            number = basins.attractor[i, j]
            if basins.status[i, j] == "overlap":
                assert start[0][0] > 0.3
                continue
            assert number >= 0
            run = basins.run(i, j)
            assert run.initial.tolist() == start
            longer = vi.simulate(TWO, initial=start, periods=2000, keep=100)
            assert longer.label == basins.attractors[number].label
            last = longer.stroboscopic[-1]
            off = np.abs(basins.attractors[number].sections - last).max(axis=(1, 2))
            assert off.min() < 1e-6


def test_a_search_from_the_cells_finds_their_attractors(basins):
    cells = np.argwhere(basins.status != "overlap")
    starts = np.array([[[PLANE["q_0"][i]], [PLANE["v_0"][j]]] for i, j in cells])
    search = vi.search_motions(TWO, starts=starts, periods=600)
    assert not search.others
    labels = np.array([motion.label for motion in search.motions])[search.reached]
    assert labels.tolist() == basins.label[tuple(cells.T)].tolist()
    assert search.shares.tolist() == sorted(search.shares, reverse=True)
    for motion in search.motions:
        assert isinstance(motion, vi.StructureOrbit)
        known = next(each for each in basins.attractors if each.label == motion.label)
        assert np.allclose(motion.sections, known.sections, rtol=0, atol=1e-9)
    table = search.to_pandas()
    assert table["q_0"].tolist() == [motion.sections[0, 0, 0] for motion in search.motions]
    assert "1-2" in repr(search)


@pytest.mark.parametrize(
    ("starts", "error", "words"),
    [
        (16, vi.ParameterError, "starts = 16 .* a structure has no usual box"),
        (np.zeros((3, 4)), vi.StateError, r"^starts: initial of shape \(3, 4\)"),
        ([[[0], [0]], [[1], [0]]], vi.StateError, r"^starts\[1\]: .*penetrating"),
        (np.zeros((0, 2, 1)), vi.ParameterError, "at least one initial state"),
    ],
)
def test_starts_of_a_search_are_checked(starts, error, words):
    with pytest.raises(error, match=words):
        vi.search_motions(TWO, starts=starts)


def test_attractors_are_confirmed_with_their_motions(basins):
    for attractor in basins.attractors:
        assert attractor.confirmed
        assert attractor.sections.shape == (attractor.orbit[0], 2, 1)
        motion = attractor.motion
        assert isinstance(motion, vi.StructureOrbit)
        assert motion.label == attractor.label
        assert abs(motion.multipliers[0]) < 1
        assert attractor.region is not None
        assert attractor.region.center.shape == (2,)


@pytest.mark.parametrize("options", [{"workers": 1}, {"workers": 2, "chunk": 5}])
def test_the_bits_depend_on_neither_threads_nor_chunks(basins, options):
    same(basins, found(**options))


def test_a_store_is_resumed_and_files_keep_all(tmp_path, basins):
    asks = asks_of(lambda: found(workers=1, chunk=6))
    with ctrl_c_at(asks * 9 // 10) as caught:
        found(workers=1, chunk=6, store=tmp_path / "s")
    assert not caught.value.result.complete
    same(basins, found(store=tmp_path / "s"))
    basins.save(tmp_path / "b.npz")
    again = vi.load(tmp_path / "b.npz")
    same(basins, again)
    assert again.system == TWO
    assert again.settings == basins.settings
    for a, b in zip(again.attractors, basins.attractors, strict=True):
        assert a.motion.state.tobytes() == b.motion.state.tobytes()
        assert (a.motion.legs, a.motion.clocks) == (b.motion.legs, b.motion.clocks)
        assert a.motion.nodes.tobytes() == b.motion.nodes.tobytes()
    assert again.run(2, 2).final_state.q == basins.run(2, 2).final_state.q


def test_a_plane_may_be_of_any_two_coordinates():
    chain = vi.Structure(
        np.eye(3),
        [[2, -1, 0], [-1, 2, -1], [0, -1, 1]],
        [vi.Stop([0, 0, 1], 0.4, 0.6)],
        damping_ratios=[0.05] * 3,
        drive_amplitude=[0, 0, 0.5],
        drive_frequency=1.9,
    )
    initial = [[0.01, 0.02, 0.03], [0.04, 0.05, 0.06]]
    basins = vi.basins(
        chain, initial=initial, q_2=[-0.1, 0.1, 0.5], v_0=[0.0, 0.3], scouts=4, periods=400, keep=60
    )
    assert basins.status[2].tolist() == ["overlap"] * 2
    assert (basins.attractor[:2] >= 0).all()
    assert basins.run(1, 1).initial.tolist() == [[0.01, 0.02, 0.1], [0.3, 0.05, 0.06]]
    assert (
        basins.label[0, 0]
        == vi.simulate(chain, initial=basins.run(0, 0).initial, periods=800).label
    )
    ax = basins.plot(sections=True)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("coordinate $q_2$", r"velocity $\dot q_0$")
    names = basins.attractors[0].plot(x="q_1", y="v_2")
    assert (names.get_xlabel(), names.get_ylabel()) == ("coordinate $q_1$", r"velocity $\dot q_2$")


def test_a_structure_from_all_its_modes_has_the_basins_of_its_matrices():
    stops = [vi.Stop([1, 0], 0.3, 0.8), vi.Stop([-1, 0], 0.6, 0.7)]
    drive = {"drive_amplitude": [1, 0], "drive_frequency": 3.0, "damping_ratios": [0.05, 0.05]}
    matrices = vi.Structure(np.eye(2), [[1.2, -0.2], [-0.2, 0.5]], stops, **drive)
    modes = vi.Structure.from_modes(matrices.frequencies, matrices.shapes, stops, **drive)
    one, other = (
        vi.basins(system, **PLANE, scouts=42, periods=400, keep=60) for system in (matrices, modes)
    )
    assert one.complete
    assert {*one.label.ravel()} == {"1-2", "1-0", "overlap"}
    assert one.label.tolist() == other.label.tolist()
    for a, b in zip(one.attractors, other.attractors, strict=True):
        assert b.confirmed
        assert np.allclose(a.sections, b.sections, rtol=0, atol=1e-9)
        # The region is that of the modal coordinates.
        center = b.region.center.reshape(2, 2) @ modes.shapes.T
        assert np.abs(b.sections - center).max(axis=(1, 2)).min() < 1e-9


def test_a_plane_outside_the_span_of_the_modes_is_refused_before_any_work():
    with pytest.raises(vi.StateError, match=r"over q_0, v_0: .* outside the span of the modes"):
        vi.basins(BEAM, q_0=[0.0, 0.1], v_0=[0.0, 0.1])


def test_motions_that_do_not_repeat_are_recognised_in_long_states():
    lively = vi.Structure(
        [[1, 0], [0, 2]],
        [[2, -1], [-1, 1]],
        [vi.Stop([1, -1], 0.2, 0.7), vi.Stop([0, 1], 0.5, 0.8)],
        damping_ratios=[0.01, 0.02],
        drive_amplitude=[1, 1j],
        drive_frequency=1.28,
    )
    basins = vi.basins(lively, q_0=[0.0], v_1=[0.0, 0.1], scouts=2, periods=300, rounds=0)
    assert basins.attractors[0].kind == "chaotic"
    assert basins.attractors[0].confirmed


@pytest.mark.parametrize(
    ("asked", "error", "words"),
    [
        ({"x1": [0.1], "v1": [0.2]}, vi.ParameterError, "unknown argument x1 of basins.*q_0, v_0"),
        ({"q_0": [0.1]}, vi.ParameterError, "exactly 2 of q_0, v_0; got q_0"),
        ({"q_0": [0.1], "gap": [0.2]}, vi.ParameterError, "unknown argument gap of basins"),
        ({"q_0": [np.nan], "v_0": [0.0]}, vi.ParameterError, r"q_0\[0\] = nan"),
        ({**PLANE, "units": "SI"}, vi.ParameterError, "units = 'SI'"),
        ({**PLANE, "initial": (0, 0, 0, 0)}, vi.StateError, r"shape \(2, 1\)"),
        ({**PLANE, "periods": 3}, vi.ParameterError, "periods = 3"),
    ],
)
def test_bad_input_is_refused_by_name(asked, error, words):
    with pytest.raises(error, match=words):
        vi.basins(SETTLING, **asked)


def test_what_has_no_basins_is_refused_by_name():
    with pytest.raises(vi.ParameterError, match=r"drive_frequency = 0\.0"):
        vi.basins(SETTLING.replace(drive_frequency=0.0), q_0=[0.0], v_0=[0.0])
