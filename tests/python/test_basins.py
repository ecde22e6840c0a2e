"""Basins of attraction: every cell leads where a long simulation of it leads, or says why not."""

import dataclasses
import json
import pickle
import signal

import numpy as np
import pytest

import vibroimpact as vi
from ctrl_c import ctrl_c_at
from test_docs import first_column
from vibroimpact import _core, sweeps
from vibroimpact.orbits.motion import same_orbit
from vibroimpact.sweeps import Grid
from vibroimpact.sweeps.basins.arrivals import ArrivalTask
from vibroimpact.sweeps.basins.region import Follow
from vibroimpact.sweeps.basins.search import find_attractors, follow_all
from vibroimpact.sweeps.machines import machine_of

# The plane of the tests; beyond x1 = pi/6 the bodies overlap.
PLANE = {"x1": np.linspace(-1.2, 0.6, 24), "v1": np.linspace(-2.5, 2.5, 20)}
COLUMNS = ("attractor", "status_code", "settling")


@pytest.fixture(scope="module")
def coexisting() -> vi.System:
    """Return the system in which a 4-5 and a 6-7 motion coexist (docs/coexistence.md)."""
    return vi.System(
        mass_ratio=0.6,
        frequency_ratio=2,
        restitution=0.8,
        gap=0.5,
        friction=0.5,
        moment_amplitude=1,
        drive_frequency=1.5752,
    )


@pytest.fixture(scope="module")
def found(coexisting) -> vi.Basins:
    return vi.basins(coexisting, **PLANE)


def assert_same(one: vi.Basins, other: vi.Basins) -> None:
    for name in COLUMNS:
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    described = [[json.dumps(a.to_dict()) for a in b.attractors] for b in (one, other)]
    assert described[0] == described[1]


def starts(basins: vi.Basins, cells: np.ndarray) -> np.ndarray:
    """Initial states of cells in the plane of x1 and v1, from a mask or from pairs of places."""
    i, j = np.nonzero(cells) if cells.dtype == bool else cells.T
    rest = np.zeros(len(i))
    return np.column_stack([basins.axes["x1"][i], basins.axes["v1"][j], rest, rest])


def test_both_motions_are_found_and_confirmed(found):
    assert [a.label for a in found.attractors] == ["4-5", "6-7"]
    for attractor in found.attractors:
        assert attractor.kind == "periodic"
        assert attractor.confirmed
        assert attractor.motion.stable
        assert abs(attractor.motion.multipliers[0]) < 1.0
        assert np.array_equal(attractor.sections, attractor.motion.sections)
    assert found.shares.sum() == pytest.approx(1.0)
    assert found.shares[0] > 0.8 > 0.2 > found.shares[1] > 0.02


def test_every_cell_has_an_attractor_or_a_reason(found):
    x1 = found.axes["x1"][:, None]
    overlap = np.broadcast_to(np.sin(x1) - found.system.gap > 0.0, found.attractor.shape)
    assert np.array_equal(found.status == "overlap", overlap)
    assert np.array_equal(found.status == "completed", ~overlap)
    assert np.array_equal(found.attractor >= 0, ~overlap)
    assert (found.settling[~overlap] > 0).all()
    assert found.reasons == {"overlap": int(overlap.sum())}
    assert set(np.unique(found.label)) == {"4-5", "6-7", "overlap"}
    assert found.complete
    assert len(found) == 480
    assert "4-5" in repr(found)
    assert "overlap in" in repr(found)


def test_cells_lead_where_long_simulations_lead(coexisting, found):
    inside = np.argwhere(found.attractor >= 0)
    cells = np.random.default_rng(7).permutation(inside)[:80]
    runs = vi.simulate(coexisting, initial=starts(found, cells), periods=4000, keep=100)
    assert [run.label for run in runs] == found.label[tuple(cells.T)].tolist()
    for run, cell in list(zip(runs, cells, strict=True))[:10]:
        attractor = found.attractors[found.attractor[tuple(cell)]]
        assert same_orbit(run.refine(), attractor.motion)


@pytest.mark.parametrize("options", [{"workers": 1, "chunk": 7}, {"workers": 2, "chunk": 100}])
def test_the_bits_do_not_depend_on_the_division_of_work(coexisting, found, options):
    assert_same(vi.basins(coexisting, **PLANE, **options), found)


def test_the_order_of_axes_is_that_of_the_arrays(coexisting, found):
    turned = vi.basins(coexisting, v1=PLANE["v1"], x1=PLANE["x1"])
    assert list(turned.axes) == ["v1", "x1"]
    assert np.array_equal(turned.settling.T, found.settling)


def test_other_planes_start_from_the_values_given(coexisting):
    initial = (0.1, -0.3, 9.0, 9.0)
    basins = vi.basins(coexisting, x2=[-0.4, 0.0], v2=[0.7], initial=initial, scouts=2)
    runs = vi.simulate(
        coexisting, initial=[(0.1, -0.3, -0.4, 0.7), (0.1, -0.3, 0.0, 0.7)], periods=4000, keep=100
    )
    assert basins.label.ravel().tolist() == [run.label for run in runs]


def test_trapping_regions_trap(coexisting, found):
    # Other random states than those that confirmed them, and only two cycles to arrive.
    draw = np.random.default_rng(11)
    for number, attractor in enumerate(found.attractors):
        region = attractor.region
        direction = draw.standard_normal((2000, 4))
        direction /= np.linalg.norm(direction, axis=1)[:, None]
        states = region.center + direction @ np.linalg.inv(region.factor).T
        cycles = Follow(2 * len(attractor.sections), 8, None, 1e-12)
        ends = follow_all(coexisting, states, found.attractors, cycles)
        assert (ends.attractor == number).all()
        assert (region.extents > 1e-3).all()


def test_motions_of_one_label_are_told_apart(coexisting):
    # Four motions are stable here, two of them 6-7 (docs/coexistence.md).
    system = coexisting.replace(drive_frequency=1.57685)
    plane = {"x1": np.linspace(-1.0, 0.5, 50), "v1": np.linspace(-2.0, 2.0, 50)}
    basins = vi.basins(system, **plane, scouts=4)
    assert sorted(a.label for a in basins.attractors) == ["2-2", "4-5", "6-7", "6-7"]
    one, other = (a for a in basins.attractors if a.label == "6-7")
    assert one.confirmed
    assert other.confirmed
    assert not same_orbit(one.motion, other.motion)
    # Each of them is where a long run from its cells ends, to rounding.
    for number, attractor in enumerate(basins.attractors):
        cells = np.argwhere(basins.attractor == number)[:3]
        assert len(cells) > 0
        for run in vi.simulate(system, initial=starts(basins, cells), periods=6000, keep=100):
            assert same_orbit(run.refine(), attractor.motion)


def test_cells_left_over_are_followed_for_longer(coexisting, found):
    short = {"periods": 8, "keep": 8, "scouts": 1}
    left = vi.basins(coexisting, **PLANE, **short, rounds=0)
    assert left.reasons["unresolved"] > 0.9 * np.count_nonzero(found.attractor >= 0)
    assert (left.attractor[left.status == "unresolved"] == -1).all()
    # 8 periods, doubled eight times.
    settled = vi.basins(coexisting, **PLANE, **short, rounds=8)
    assert "unresolved" not in settled.reasons
    assert np.array_equal(settled.label, found.label)


def test_a_chaotic_attractor_is_recognised_by_its_cloud(coexisting):
    system = coexisting.replace(drive_frequency=1.545)
    basins = vi.basins(
        system, x1=np.linspace(-0.4, 0.4, 6), v1=[-1.0, 0.5], periods=600, keep=200, scouts=12
    )
    (attractor,) = basins.attractors
    assert (attractor.label, attractor.kind, attractor.confirmed) == ("chaotic", "chaotic", True)
    assert attractor.cloud.covered >= 0.99
    assert (basins.attractor == 0).all()
    assert (basins.settling == -1).all()


def test_the_cloud_of_one_attractor_is_not_that_of_another(coexisting):
    follow = Follow(600, 200, None, 1e-12)
    start = np.array([[0.0, 0.5, 0.0, 0.0]])
    systems = [coexisting.replace(drive_frequency=omega) for omega in (1.545, 1.2)]
    clouds = [find_attractors(system, start, follow)[0] for system in systems]
    assert [a.kind for a in clouds] == ["chaotic", "quasi-periodic"]
    tails = follow_all(systems[0], start, [], follow).tails
    assert [a.holds(tails).tolist() for a in clouds] == [[True], [False]]


def test_motions_that_are_not_isolated_are_one_family(coexisting):
    plane = {"x1": np.linspace(-0.4, 0.4, 4), "v1": [-0.2, 0.3]}
    free = vi.basins(coexisting.replace(gap=3.0), **plane, periods=400, keep=100)
    (family,) = free.attractors
    assert (family.kind, family.label, family.confirmed) == ("family", "quasi-periodic", False)
    assert family.why_not
    assert (free.attractor == 0).all()
    damped = coexisting.replace(gap=3.0, damping=(0.1, 0.1))
    (settled,) = vi.basins(damped, **plane, periods=400, keep=100).attractors
    assert (settled.kind, settled.label, settled.confirmed) == ("periodic", "1-0", True)


def test_bodies_at_rest_under_friction_are_one_family(coexisting):
    system = coexisting.replace(moment_amplitude=0.0, damping=(0.1, 0.1), gap=-0.2)
    basins = vi.basins(system, x1=[-0.4, -0.3, 0.0], v1=[-0.1, 0.1], periods=400, keep=100)
    (rest,) = basins.attractors
    assert (rest.kind, rest.label) == ("family", "1-0")
    assert basins.status[:, 0].tolist() == ["completed", "completed", "overlap"]


def test_a_system_without_losses_has_no_attractor_that_is_confirmed(coexisting):
    system = coexisting.replace(restitution=1.0, friction=0.0)
    basins = vi.basins(system, x1=[0.0, 0.1], v1=[0.5], periods=400, keep=100)
    assert not any(attractor.confirmed for attractor in basins.attractors)


def test_a_rotor_has_one_attractor_whatever_its_turns(coexisting):
    system = coexisting.replace(frequency_ratio=0.0)
    x1 = [-0.3, -0.3 + 2.0 * np.pi, -0.3 - 4.0 * np.pi]
    basins = vi.basins(system, x1=x1, v1=[0.5, -0.5], periods=600, keep=200)
    assert len(basins.attractors) == 1
    assert (basins.attractor == 0).all()


def test_a_cap_on_events_is_the_reason(coexisting):
    basins = vi.basins(coexisting, x1=[0.0, 0.55], v1=[0.5], max_events=20)
    assert basins.attractors == ()
    assert basins.status.ravel().tolist() == ["event_cap", "overlap"]
    assert basins.label.ravel().tolist() == ["event_cap", "overlap"]


def interrupt_after(monkeypatch, n):
    """Let Ctrl-C come after n chunks."""
    done = []
    plain = ArrivalTask.compute

    def compute(self, *arguments, **options):
        if len(done) == n:
            signal.raise_signal(signal.SIGINT)
        done.append(arguments)
        return plain(self, *arguments, **options)

    monkeypatch.setattr(ArrivalTask, "compute", compute)
    return done


def test_ctrl_c_gives_what_is_done(coexisting, found, monkeypatch):
    interrupt_after(monkeypatch, 3)
    with pytest.raises(vi.Interrupted, match="interrupted after 120 of 480") as caught:
        vi.basins(coexisting, **PLANE, chunk=40)
    part = caught.value.result
    done = part.status != "pending"
    assert np.count_nonzero(done) == 120
    assert not part.complete
    assert np.array_equal(part.attractor[done], found.attractor[done])
    assert (part.attractor[~done] == -1).all()


def test_ctrl_c_ends_the_search_for_attractors(coexisting):
    with ctrl_c_at(1000) as caught:
        vi.basins(coexisting, **PLANE, periods=5_000_000, max_events=10**9)
    assert "searched" in str(caught.value)
    assert caught.value.result.reasons == {"pending": 480}


def test_ctrl_c_within_a_chunk(coexisting):
    task = ArrivalTask(
        machine_of(coexisting),
        (0.0,) * 4,
        Follow(10**6, 8, 10**9, 1e-12),
        (),
        Grid(PLANE | {"v1": [0.5]}),
    )
    _core._interrupt_at(100)
    try:
        part = task.compute(0, 24, workers=2, progress=None)
    finally:
        _core._interrupt_at(None)
    assert part.interrupted
    assert (part.columns["attractor"] == -1).all()
    assert set(part.columns["status"].tolist()) <= {
        sweeps.STATUS_NAMES.index(name) for name in ("pending", "overlap")
    }


def test_a_false_of_the_progress_ends_the_kernel(coexisting):
    asked = []
    arrivals = _core.arrivals(
        coexisting._compiled,
        np.zeros((4, 4)),
        centers=np.zeros((0, 4)),
        factors=np.zeros((0, 4, 4)),
        counts=[],
        periods=10**12,  # it ends by the answer, or never
        keep=8,
        progress=lambda done: bool(asked.append(done)),
    )
    assert asked
    assert arrivals.interrupted
    assert (arrivals.status == sweeps.STATUS_NAMES.index("pending")).all()


def test_a_store_is_gone_on_with(coexisting, found, monkeypatch, tmp_path):
    pytest.importorskip("zarr")
    with monkeypatch.context() as patch:
        interrupt_after(patch, 3)
        with pytest.raises(vi.Interrupted):
            vi.basins(coexisting, **PLANE, chunk=40, store=tmp_path / "basins")
    computed = interrupt_after(monkeypatch, -1)
    assert_same(vi.basins(coexisting, **PLANE, store=tmp_path / "basins"), found)
    assert len(computed) == 9
    assert_same(vi.basins(coexisting, **PLANE, store=tmp_path / "basins"), found)
    assert len(computed) == 9
    with pytest.raises(ValueError, match="one of the stores of basins"):
        vi.load(tmp_path / "basins" / "cells")
    with pytest.raises(vi.ParameterError, match="another computation"):
        vi.basins(coexisting, **PLANE, periods=1000, store=tmp_path / "basins")


def test_a_task_can_be_sent_to_another_process(coexisting, found):
    light = tuple(attractor.light() for attractor in found.attractors)
    follow = found.settings.follow
    task = ArrivalTask(machine_of(coexisting), (0.0,) * 4, follow, light, Grid(PLANE))
    again = pickle.loads(pickle.dumps(task))
    result = again.compute(100, 140, workers=1, progress=None)
    assert np.array_equal(result.columns["attractor"], found.attractor.ravel()[100:140])


def test_a_cluster_gives_the_same_bits(coexisting, found):
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=":0", processes=True
        ) as processes,
        distributed.Client(processes) as client,
    ):
        assert_same(vi.basins(coexisting, **PLANE, chunk=50, client=client), found)


def test_a_data_set_has_labelled_axes(found):
    pytest.importorskip("xarray")
    data = found.to_xarray()
    assert data["attractor"].dims == ("x1", "v1")
    assert np.array_equal(data["attractor"], found.attractor)
    assert np.array_equal(data["x1"], PLANE["x1"])
    assert np.array_equal(data["label"], found.label)
    assert [a["label"] for a in json.loads(data.attrs["attractors"])] == ["4-5", "6-7"]
    assert vi.System.from_dict(json.loads(data.attrs["system"])) == found.system


def assert_same_attractors(one: vi.Basins, other: vi.Basins) -> None:
    for a, b in zip(one.attractors, other.attractors, strict=True):
        for name in ("label", "kind", "start", "confirmed", "why_not", "rotor"):
            assert getattr(a, name) == getattr(b, name)
        assert np.array_equal(a.sections, b.sections)
        assert (a.motion is None) == (b.motion is None)
        if a.motion is not None:
            assert np.array_equal(a.motion.multipliers, b.motion.multipliers)
            assert a.motion.stable == b.motion.stable


def test_a_file_holds_everything(found, tmp_path):
    path = tmp_path / "basins.npz"
    found.save(path)
    for again in (vi.load(path), vi.Basins.load(path)):
        assert_same(again, found)
        assert_same_attractors(again, found)
        assert again.settings == found.settings
        assert again.system == found.system
    with pytest.raises(ValueError, match="holds a basins, not a diagram"):
        vi.Diagram.load(path)


def test_a_file_holds_a_cloud(coexisting, tmp_path):
    system = coexisting.replace(drive_frequency=1.545)
    chaotic = vi.basins(system, x1=[0.0, 0.1], v1=[0.5], periods=600)
    chaotic.save(tmp_path / "chaotic.npz")
    again = vi.load(tmp_path / "chaotic.npz")
    assert_same(again, chaotic)
    assert_same_attractors(again, chaotic)


def test_the_arrays_are_read_only(found):
    for name in COLUMNS:
        with pytest.raises(ValueError, match="read-only"):
            getattr(found, name)[0, 0] = 1


def test_by_default_a_short_search_keeps_all_its_sections(system):
    plane = {"x1": [0.0], "v1": [0.5]}
    for periods, keep in ((50, 50), (201, 200)):
        found = vi.basins(system, **plane, periods=periods, rounds=0, scouts=1)
        assert (found.settings.periods, found.settings.keep) == (periods, keep)


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ({"x1": [0.0]}, "basins sweeps exactly 2 of x1, v1, x2, v2; got x1"),
        ({"x1": [0.0], "v1": [0.0], "x2": [0.0]}, "exactly 2"),
        (
            {"x1": [0.0], "gap": [0.5]},
            "unknown argument gap of basins; .* x1, v1, x2, v2; options: ",
        ),
        ({"x1": [0.0], "v1": []}, "v1 = "),
        ({"x1": [0.0], "v1": [np.nan]}, r"v1\[0\] = nan"),
        ({"periods": 7}, "periods = 7"),
        ({"keep": 2001}, "keep = 2001"),
        ({"keep": 7}, "keep = 7"),
        ({"scouts": 0}, "scouts = 0"),
        ({"rounds": -1}, "rounds = -1"),
        ({"chatter_tolerance": 0.0}, r"chatter_tolerance = 0\.0"),
        ({"max_events": 0}, "max_events = 0"),
        ({"workers": 0}, "workers = 0"),
        ({"chunk": 0}, "chunk = 0"),
        ({"progress": 1}, "progress = 1"),
        ({"client": 3}, "client = 3"),
        ({"store": 3}, "store = 3"),
    ],
)
def test_bad_arguments(coexisting, monkeypatch, arguments, match):
    monkeypatch.setattr(_core, "arrivals", None)  # nothing may run
    plane = {} if {"x1", "v1"} & set(arguments) else {"x1": [0.0], "v1": [0.5]}
    with pytest.raises(vi.ParameterError, match=match):
        vi.basins(coexisting, **plane, **arguments)


def test_a_store_of_something_else_is_refused(coexisting, monkeypatch, tmp_path):
    monkeypatch.setattr(_core, "arrivals", None)  # nothing may run
    (tmp_path / "zarr.json").write_text("{}")
    for path in (tmp_path, tmp_path / "zarr.json"):
        with pytest.raises(vi.ParameterError, match="one of basins"):
            vi.basins(coexisting, **PLANE, store=path)
    assert [found.name for found in tmp_path.iterdir()] == ["zarr.json"]


def test_bad_starts_and_systems(coexisting):
    with pytest.raises(vi.StateError, match="finite"):
        vi.basins(coexisting, **PLANE, initial=(0, 0, np.inf, 0))
    with pytest.raises(vi.ParameterError, match="drive_frequency"):
        vi.basins(coexisting.replace(drive_frequency=0.0), **PLANE)
    with pytest.raises(vi.ParameterError, match="system"):
        vi.basins("system", **PLANE)


def test_notation_names_every_attribute():
    assert first_column("Basins of attraction") == [
        field.name for kind in (vi.Basins, vi.Attractor) for field in dataclasses.fields(kind)
    ]
