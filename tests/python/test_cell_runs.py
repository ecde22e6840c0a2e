"""The run of a cell, made again, has the bits of the cell: of sweeps, charts, diagrams, basins."""

import dataclasses

import numpy as np
import pytest

import sizes
import vibroimpact as vi
from systems import COEXISTING, LOW, PAPER, ROUGH, STICKY

START = (0.0, 0.5, 0.0, 0.0)
SYSTEMS = sizes.either(24, 200)
ROWS = {
    "x1": "x1",
    "v1": "v1_pre",
    "v2": "v2_pre",
    "phase": "phase",
    "approach_velocity": "approach_velocity",
    "energy_loss": "energy_loss",
    "regime": "regime",
}
NO_CAP = 10_000_000


def random_system(draw: np.random.Generator) -> vi.System:
    """Return a system of any contact, law, friction and damping; some have a wall or a rotor."""
    contact = draw.choice(["oblique", "oblique", "direct"])
    return vi.System(
        mass_ratio=draw.choice([0.0, draw.uniform(0.1, 2.0)]),
        frequency_ratio=draw.choice([0.0, draw.uniform(0.5, 3.0)]),
        restitution=draw.choice([0.0, 1.0, draw.uniform(0.2, 0.95)]),
        gap=draw.uniform(0.0, 0.6),
        drive_frequency=draw.uniform(0.3, 3.0),
        damping=tuple(draw.choice([0.0, 0.1], 2)),
        moment_amplitude=draw.uniform(0.2, 2.0),
        force_amplitude=draw.choice([0.0, draw.uniform(0.2, 1.5)]),
        friction=0.0 if contact == "direct" else draw.choice([0.0, draw.uniform(0.05, 0.8)]),
        phase=draw.uniform(0.0, 6.0),
        contact=str(contact),
        law=str(draw.choice(["poisson", "newton", "energetic"])),
    )


def bits(values) -> bytes:
    """The bits of numbers."""
    return np.ascontiguousarray(values).tobytes()


def assert_same_end(run: vi.Run, columns, place) -> None:
    """Check the columns of a cell, without the exponent, against its run."""
    assert bits(run.final_state.state) == bits(columns["final_state"][place])
    window = run.final_state.time - run.kept_from
    if window > 0.0:
        assert bits(run.time_in_contact / window) == bits(columns["contact_fraction"][place])


def assert_same_label(run: vi.Run, columns, place) -> None:
    """Check period, impacts and residual of a cell that was labelled against its run."""
    label = run.period
    m, n = columns["m"][place], columns["n"][place]
    assert (label.m or 0) == m
    if label.m:
        assert n == (-1 if label.n == np.inf else label.n)
        assert bits(label.residual) == bits(columns["residual"][place])


def assert_same_point(diagram: vi.Diagram, i: int) -> None:
    """Check the run of a point against all that the diagram has of it."""
    status = diagram.status[i]
    if status == "failed":
        with pytest.raises(vi.SimulationError):
            diagram.run(i)
        return
    run = diagram.run(i)
    assert status in (run.stop_reason, "restarted")
    rows = slice(diagram.offset[i], diagram.offset[i + 1])
    for name, column in ROWS.items():
        dtype = getattr(diagram, name).dtype
        assert bits(run.impacts[column].astype(dtype)) == bits(getattr(diagram, name)[rows]), name
    rows = slice(diagram.stroboscopic_offset[i], diagram.stroboscopic_offset[i + 1])
    assert bits(run.stroboscopic) == bits(diagram.stroboscopic[rows])
    names = ("m", "n", "residual", "contact_fraction")
    columns = {name: getattr(diagram, name) for name in names}
    columns["final_state"] = diagram.final_states
    assert_same_end(run, columns, i)
    assert_same_label(run, columns, i)
    assert run.label == diagram.label[i]


def test_points_of_random_systems_are_their_runs():
    draw = np.random.default_rng(20041)
    met: set[int] = set()
    for _ in range(SYSTEMS):
        diagram = vi.bifurcation_diagram(
            random_system(draw),
            initial=[(-1.2, draw.uniform(-1, 1), 1.0, 0.0), (-1.0, 0.0, 0.8, 0.3)],
            start=["fresh", "forward", "backward"],
            periods=int(draw.integers(5, 40)),
            keep=int(draw.integers(0, 6)),
            section_phase=draw.uniform(0, 6),
            chatter_tolerance=10.0 ** draw.uniform(-13, -6),
            max_events=int(draw.choice([40, NO_CAP])),
            drive_frequency=draw.uniform(0.3, 3.0, 4),
        )
        for i in range(len(diagram)):
            assert_same_point(diagram, i)
        met |= {*diagram.regime.tolist()}
    assert met == {*map(int, vi.Regime)}


@pytest.mark.parametrize("system", [PAPER, ROUGH, COEXISTING, LOW, STICKY])
def test_points_of_known_systems_are_their_runs(system):
    diagram = vi.bifurcation_diagram(
        system,
        initial=START,
        start=["fresh", "forward", "backward"],
        periods=120,
        keep=40,
        exponents=True,
        drive_frequency=np.linspace(0.9, 1.1, 5) * system.drive_frequency,
    )
    for i in range(len(diagram)):
        assert_same_point(diagram, i)


def test_a_followed_state_that_does_not_fit_is_left_as_the_branch_left_it():
    diagram = vi.bifurcation_diagram(
        PAPER,
        initial=(-1.5, 0.0, 1.0, 0.0),
        start="forward",
        periods=20,
        keep=5,
        gap=[1.0, -0.5, -1.0, 0.5],
    )
    assert "restarted" in diagram.status
    for i in range(len(diagram)):
        assert_same_point(diagram, i)


def test_the_point_after_one_that_was_not_reached_says_so(monkeypatch):
    def stopped(*arguments, **options):
        raise AssertionError

    diagram = vi.bifurcation_diagram(
        ROUGH, initial=START, start=["forward", "fresh"], periods=10, keep=5, gap=[0.4, 0.5, 0.6]
    )
    arrays = {name: diagram.columns[name].copy() for name in diagram.columns.names}
    arrays["status"][0, 1] = 0
    arrays["final_state"][0, 1] = np.nan
    cut = vi.Diagram(
        type(diagram.columns)(diagram.columns.layout, lambda name, place: arrays[name][place])
    )
    assert cut.status[1] == "pending"
    assert bits(cut.run(1).final_state.state) == bits(diagram.run(1).final_state.state)
    monkeypatch.setattr("vibroimpact.sweeps.cell_runs.simulated", stopped)
    with pytest.raises(vi.ParameterError, match=r"i = 2 .* followed from point 1, .*pending"):
        cut.run(2)


@pytest.mark.parametrize("number", range(sizes.either(6, 40)))
def test_cells_of_sweeps_and_charts_are_their_runs(number):
    draw = np.random.default_rng(number)
    options = {
        "initial": (-1.2, 0.3, 1.0, 0.0),
        "periods": int(draw.integers(5, 60)),
        "section_phase": draw.uniform(0, 6),
        "chatter_tolerance": 10.0 ** draw.uniform(-13, -6),
        "max_events": int(draw.choice([30, NO_CAP])),
    }
    axes = {"restitution": draw.uniform(0, 1, 2), "drive_frequency": draw.uniform(0.3, 3, 3)}
    starts = {"v1": draw.uniform(-1, 1, 2), "x2": draw.uniform(0.5, 1.5, 2)}
    system = random_system(draw)
    for result in (
        vi.chart(system, **axes, **options),
        vi.sweep(system, labels=False, **axes, **starts, **options),
    ):
        shape = tuple(len(values) for values in result.axes.values())
        for place in np.ndindex(shape):
            status = result.status[place]
            if status in ("failed", "overlap"):
                wanted = vi.SimulationError if status == "failed" else vi.StateError
                with pytest.raises(wanted):
                    result.run(*place)
                continue
            run = result.run(*place)
            assert run.stop_reason == status
            assert_same_end(run, result.columns, place)
            last = tuple(k - length for k, length in zip(place, shape, strict=True))
            assert bits(result.run(*last).final_state.state) == bits(run.final_state.state)
            if isinstance(result, vi.Chart):
                assert_same_label(run, result.columns, place)
                assert run.label == result.label[place]


def test_a_cell_of_exponents_is_the_run_before_the_measurement():
    grid = vi.lyapunov_spectrum(PAPER, initial=START, periods=80, keep=20, gap=[0.4, 0.5])
    run = grid.run(1)
    assert run.system == PAPER.replace(gap=0.5)
    assert run.final_state.period == 60
    assert bits(run.final_state.state) == bits(grid.columns["final_state"][1])


def test_starts_of_basins_lead_to_their_attractors():
    basins = vi.basins(
        COEXISTING,
        periods=100,
        keep=80,
        scouts=9,
        rounds=3,
        x1=np.linspace(-0.2, 0.2, 3),
        v1=np.linspace(-1, 1, 4),
    )
    assert {*basins.label.ravel()} >= {"4-5", "6-7"}
    for place in np.ndindex(basins.attractor.shape):
        run = basins.run(*place)
        x1, v1 = (values[k] for values, k in zip(basins.axes.values(), place, strict=True))
        assert run.initial == (x1, v1, 0.0, 0.0)
        settling = basins.settling[place]
        if settling < 0:
            continue
        assert run.final_state.period >= settling
        # Over an orbit of the attractor, the run stays beside its sections.
        region = basins.attractors[basins.attractor[place]].region
        whole = vi.simulate(COEXISTING, initial=run.initial, periods=int(settling))
        assert np.linalg.norm(region.factor @ (whole.final_state.state - region.center)) <= 1.0


@pytest.mark.parametrize(
    ("indices", "words"),
    [
        ((0,), "run\\(0\\) .* one index for each of gap, friction"),
        ((0, 0, 0), "one index for each of gap, friction"),
        ((2, 0), "index of gap = 2 is not allowed; allowed: an integer from -2 to 1"),
        ((0, -2), "index of friction = -2 .* from -1 to 0"),
        ((0, 0.5), "index of friction = 0.5"),
        ((True, 0), "index of gap = True"),
    ],
)
def test_a_cell_that_is_not_there_is_refused(indices, words):
    chart = vi.chart(ROUGH, initial=START, periods=2, gap=[0.4, 0.5], friction=[0.1])
    with pytest.raises(vi.ParameterError, match=words):
        chart.run(*indices)


def test_a_saved_result_leads_to_the_same_run(tmp_path):
    diagram = vi.bifurcation_diagram(
        ROUGH, initial=START, start="backward", periods=20, keep=10, gap=[0.4, 0.5, 0.6]
    )
    diagram.save(tmp_path / "diagram.npz")
    again = vi.load(tmp_path / "diagram.npz")
    assert dataclasses.asdict(again.settings) == dataclasses.asdict(diagram.settings)
    assert bits(again.run(0).stroboscopic) == bits(diagram.run(0).stroboscopic)
    refined = vi.bifurcation_diagram(
        ROUGH, initial=START, periods=30, keep=10, refine=2, drive_frequency=[1.4, 1.9, 2.4]
    )
    assert len(refined) > 3
    for i in range(len(refined)):
        assert_same_point(refined, i)


def test_the_run_of_a_cell_has_the_system_and_the_start_that_functions_made():
    def stiff(stiffness: float) -> vi.System:
        return vi.System.from_physical(
            pendulum_mass=0.3,
            oscillator_mass=0.5,
            length=0.2,
            torsional_stiffness=1.5,
            stiffness=stiffness,
            gap=0.1,
            restitution=0.8,
            drive_frequency=12.0,
            moment_amplitude=0.4,
        )

    def start(stiffness: float) -> tuple[float, float, float, float]:
        return 0.0, 0.01 * stiffness, 0.0, 0.0

    few = {"periods": 20, "keep": 10, "stiffness": [30.0, 40.0, 50.0]}
    swept = vi.sweep(stiff, initial=start, v2=[0.0, 0.1], **few)
    for place in np.ndindex(swept.label.shape):
        run = swept.run(*place)
        at = dict(zip(swept.axes, place, strict=True))
        stiffness = float(swept.axes["stiffness"][at["stiffness"]])
        assert run.initial == (0.0, 0.01 * stiffness, 0.0, swept.axes["v2"][at["v2"]])
        assert run.system == stiff(stiffness)
        assert run.system.scales == stiff(stiffness).scales
        assert_same_end(run, swept.columns, place)
    for kind in ("fresh", "forward", "backward"):
        diagram = vi.bifurcation_diagram(stiff, initial=start, start=kind, **few)
        for i, stiffness in enumerate(diagram.values.tolist()):
            run = diagram.run(i)
            assert run.system == stiff(stiffness)
            assert run.system.scales == stiff(stiffness).scales
            assert bits(run.final_state.state) == bits(diagram.final_states[i])
            if kind == "fresh":
                assert run.initial == start(stiffness)
