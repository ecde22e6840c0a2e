"""Constant loads: exact identities with systems that have none, in everything that takes a system.

In direct contact a load of each body moves its equilibrium, by c1/omega0^2 and c2: the motions are
those of the system without loads whose gap is smaller by c1/omega0^2 - c2, about the equilibria.
"""

import random

import matplotlib.pyplot as plt
import numpy as np
import pytest
from flint import ctx, fmpq

import vibroimpact as vi
from vibroimpact.plot.given import bodies_of
from vibroimpact.reference.flight import Body, exact
from vibroimpact.sweeps.basins.free_motion import never_strike

# Powers of two: the shifts add no roundings to the numbers of the system.
MOMENT, FORCE = 0.5, -0.25
PLAIN = vi.System(
    mass_ratio=0.6,
    frequency_ratio=2.0,
    restitution=0.8,
    gap=0.25,
    drive_frequency=1.8,
    damping=(0.02, 0.05),
    moment_amplitude=1.0,
    force_amplitude=0.3,
    contact="direct",
)
EQUILIBRIUM = np.array([MOMENT / 4.0, 0.0, FORCE, 0.0])
LOADED = PLAIN.replace(
    static_moment=MOMENT, static_force=FORCE, gap=PLAIN.gap + MOMENT / 4.0 - FORCE
)
START = np.array([0.0, 0.5, 0.0, 0.0])

TABLE = vi.System(
    **{"mass_ratio": 0, "frequency_ratio": 0, "restitution": 0.8, "gap": 0, "contact": "direct"},
    **{"drive_frequency": 2, "force_amplitude": 2, "oscillator_damping": 0.05},
    static_moment=9.81,
)
OBLIQUE = PLAIN.replace(contact="oblique", gap=0.5, static_moment=1.5, static_force=-0.1)


def test_a_run_is_the_one_without_loads_about_the_equilibrium():
    plain = vi.simulate(PLAIN, initial=START, periods=6)
    loaded = vi.simulate(LOADED, initial=START + EQUILIBRIUM, periods=6)
    assert len(plain.impacts) == len(loaded.impacts) > 4
    shift = loaded.stroboscopic - plain.stroboscopic
    assert np.abs(shift - EQUILIBRIUM).max() < 1e-12
    audit = loaded.energy_audit()
    assert audit.residual < 1e-12
    # It misses the work of the loads if they are left out.
    x1, _, x2, _ = (loaded.stroboscopic[-1] - loaded.initial).tolist()
    assert abs(MOMENT * x1 + FORCE * x2 / PLAIN.mass_ratio) > 1e-3


def test_a_diagram_over_a_load_is_one_over_the_gap():
    gaps = PLAIN.gap - np.linspace(0.0, 0.5, 9)
    options = {"periods": 400, "keep": 60}
    start = (-0.75, 0.5, 0.0, 0.0)
    plain = vi.bifurcation_diagram(PLAIN, initial=start, gap=gaps, **options)
    forces = FORCE - (PLAIN.gap - gaps)
    loaded = [
        vi.bifurcation_diagram(
            LOADED,
            initial=start + EQUILIBRIUM + [0, 0, force - FORCE, 0],
            static_force=[force],
            **options,
        ).label[0]
        for force in forces
    ]
    assert plain.label.tolist() == loaded
    assert len(set(loaded)) > 1


def test_a_chart_over_both_loads_is_stored_resumed_and_compared(tmp_path):
    axes = {"static_moment": [-0.25, 0.0, 0.5], "static_force": [-0.125, 0.25]}
    options = {"initial": START - [0, 0, 0.25, 0], "periods": 60, "keep": 20}
    system = LOADED.replace(gap=0.5)
    chart = vi.chart(system, store=tmp_path / "chart", **axes, **options)
    for i, moment in enumerate(axes["static_moment"]):
        for j, force in enumerate(axes["static_force"]):
            run = vi.simulate(system.replace(static_moment=moment, static_force=force), **options)
            assert chart.label[i, j] == run.label
            assert chart.run(i, j).system == run.system
    again = vi.chart(system, store=tmp_path / "chart", **axes, **options)
    assert np.array_equal(again.label, chart.label)
    other = system.replace(gap=0.5 + 1e-9)
    with pytest.raises(ValueError, match="gap"):
        vi.chart(other, store=tmp_path / "chart", **axes, **options)
    assert chart.to_xarray()["largest_exponent"].dims == ("static_moment", "static_force")


def test_basins_are_those_without_loads():
    axes = {"x1": np.linspace(-0.75, 0.25, 9), "v1": np.linspace(-1.0, 1.0, 9)}
    plain = vi.basins(PLAIN, periods=400, **axes)
    shifted = axes | {"x1": axes["x1"] + MOMENT / 4}
    loaded = vi.basins(LOADED, initial=EQUILIBRIUM, periods=400, **shifted)
    assert np.array_equal(loaded.attractor, plain.attractor)
    assert (plain.attractor >= 0).any()
    assert [a.label for a in loaded.attractors] == [a.label for a in plain.attractors]


def test_exponents_are_those_without_loads():
    options = {"periods": 400}
    plain = vi.lyapunov_spectrum(PLAIN, initial=START, **options)
    loaded = vi.lyapunov_spectrum(LOADED, initial=START + EQUILIBRIUM, **options)
    assert np.abs(plain.exponents - loaded.exponents).max() < 1e-10
    # Constant loads are no drive: without one, a perturbation along the flow stays.
    still = LOADED.replace(
        moment_amplitude=0.0, force_amplitude=0.0, restitution=1.0, damping=(0, 0)
    )
    spectrum = vi.lyapunov_spectrum(still, initial=START + EQUILIBRIUM, periods=60)
    assert spectrum.flow is not None


def test_loads_are_saved_with_systems_runs_motions_and_branches(found, tmp_path):
    motion = found[1].motions[0]
    branch = motion.follow(static_force=(FORCE, FORCE + 0.02))
    run = vi.simulate(LOADED, initial=START + EQUILIBRIUM, periods=5)
    for result in (run, motion, branch):
        path = tmp_path / f"{type(result).__name__}.npz"
        result.save(path)
        back = vi.load(path)
        system = back.pieces[0].system if result is branch else back.system
        assert (system.static_moment, system.static_force) == (MOMENT, FORCE)
    assert vi.System.from_json(LOADED.to_json()) == LOADED
    assert vi.load(tmp_path / "Run.npz").resume(periods=2).stroboscopic.tobytes() == (
        run.resume(periods=2).stroboscopic.tobytes()
    )


def test_without_a_drive_frequency_drive_and_load_add():
    still = PLAIN.replace(drive_frequency=0.0, phase=0.4)
    drive = still.replace(moment_amplitude=0.7, force_amplitude=-0.2)
    load = still.replace(
        moment_amplitude=0.0,
        force_amplitude=0.0,
        static_moment=0.7 * np.cos(0.4),
        static_force=-0.2 * np.cos(0.4),
    )
    one, other = (vi.simulate(each, initial=START, time=20.0) for each in (drive, load))
    assert len(one.impacts) == len(other.impacts) > 3
    assert np.abs(one.impacts["time"] - other.impacts["time"]).max() < 1e-11


@pytest.fixture(scope="module")
def found():
    """The searches with and without loads."""
    return [vi.search_motions(system, starts=32, periods=600) for system in (PLAIN, LOADED)]


def test_a_search_starts_about_the_equilibrium(found):
    plain, loaded = found
    assert np.abs(loaded.starts - plain.starts - EQUILIBRIUM).max() < 1e-15
    assert [m.label for m in loaded.motions] == [m.label for m in plain.motions] != []
    assert np.array_equal(loaded.shares, plain.shares)


def test_a_search_has_starts_under_a_load_that_presses_the_bodies_together():
    pressed = PLAIN.replace(gap=0.3, static_moment=8.0)
    assert pressed.gap_function([2.0, 0.0, 0.0, 0.0]) > 1.0
    search = vi.search_motions(pressed, starts=8, periods=50)
    assert (np.abs(search.starts) <= [0.3, 1.0, 0.2, 1.0]).all()


def test_motions_and_their_multipliers_are_those_without_loads(found):
    plain, loaded = (search.motions[0] for search in found)
    assert np.abs(loaded.sections - plain.sections - EQUILIBRIUM).max() < 1e-12
    assert np.abs(loaded.multipliers - plain.multipliers).max() < 1e-11
    assert loaded.admissible


@pytest.mark.parametrize("name", ["static_moment", "static_force"])
def test_a_branch_over_a_load_is_one_over_the_gap(found, name):
    plain, loaded = (search.motions[0] for search in found)
    per_load = {"static_moment": 0.25, "static_force": -1.0}[name]
    start, end = getattr(LOADED, name), getattr(LOADED, name) + 0.05 / per_load
    branch = loaded.follow(**{name: tuple(sorted((start, end)))})
    assert branch.ends
    (one,) = branch.at(**{name: start + 0.03 / per_load})
    (other,) = plain.follow(gap=(PLAIN.gap - 0.05, PLAIN.gap)).at(gap=PLAIN.gap - 0.03)
    assert one.label == other.label
    assert np.abs(one.multipliers - other.multipliers).max() < 1e-10


def test_the_unstable_direction_of_a_saddle_is_that_without_loads(found):
    directions = []
    for search in found:
        branch = search.motions[0].follow(drive_frequency=(1.5, 1.8))
        (saddle,) = branch.at(drive_frequency=1.55)
        manifold = vi.unstable_manifold(saddle, length=0.2, settle=300, section_phase=0.7)
        directions.append(manifold.direction)
    assert np.abs(directions[0] - directions[1]).max() < 1e-9


@pytest.mark.parametrize("name", ["static_moment", "static_force"])
@pytest.mark.parametrize("wall", [False, True])
def test_a_branch_of_oblique_impacts_meets_the_runs_on_its_way(name, wall):
    system = OBLIQUE.replace(static_moment=0.4, friction=0.2)
    if wall:
        system = system.replace(mass_ratio=0.0, force_amplitude=0.0, static_force=0.25)
    value = getattr(system, name)
    start = (0.0, 0.5, system.static_force, 0.0)
    motion = vi.simulate(system, initial=start, periods=600, keep=100).refine()
    assert (motion.stable, motion.wall_at_rest) == (True, wall)
    (met,) = motion.follow(**{name: (value, value + 0.01)}).at(**{name: value + 0.01})
    there = system.replace(**{name: value + 0.01})
    near = np.array(met.initial) - [1e-4, 0, 0, 0]
    run = vi.simulate(there, initial=near, periods=1500 * met.m, keep=100)
    assert met.label == run.label
    assert np.abs(run.stroboscopic[-1] - met.initial).max() < 1e-9
    h = 1e-6
    # A wall at rest has no state that could be changed.
    vary = np.eye(4)[: 2 if wall else 4]

    def later(shift):
        state = np.array(met.initial) + h * shift
        return np.array(vi.simulate(there, initial=state, periods=met.m).final_state.state)

    matrix = np.array([(later(unit) - later(-unit)) / (2 * h) for unit in vary])[:, : len(vary)]
    assert np.abs(np.poly(matrix) - np.poly(met.multipliers)).max() < 1e-6


@pytest.mark.parametrize("contact", ["direct", "oblique"])
def test_what_never_strikes_under_loads_does_not(contact):
    generator = np.random.default_rng(5)
    system = LOADED.replace(
        **{"contact": contact, "gap": 0.85, "drive_frequency": 3.1, "damping": (0.0, 1.5)},
        **{"moment_amplitude": 0.3, "force_amplitude": 0.05},
    )
    starts = generator.uniform(-0.5, 0.5, (200, 4)) * [0.5, 1.0, 0.3, 0.3]
    starts = starts[system.gap_function(starts) < 0.0]
    bounded = never_strike(system, starts)
    assert 20 < np.count_nonzero(bounded) < len(starts) - 20
    for start in starts[bounded][:30]:
        assert vi.simulate(system, initial=start, periods=2000, keep=1).impact_count == 0


def test_the_bound_of_free_motions_is_that_without_loads():
    generator = np.random.default_rng(6)
    starts = generator.uniform(-0.5, 0.5, (300, 4)) * [0.5, 1.0, 0.3, 0.3]
    fast = {"drive_frequency": 3.1, "moment_amplitude": 0.3, "force_amplitude": 0.1}
    plain = PLAIN.replace(gap=0.4, **fast)
    loaded = LOADED.replace(gap=0.4 + MOMENT / 4 - FORCE, **fast)
    bounded = never_strike(plain, starts)
    assert 20 < np.count_nonzero(bounded) < 280
    assert np.array_equal(never_strike(loaded, starts + EQUILIBRIUM), bounded)


def test_a_tip_that_passes_a_quarter_turn_is_bounded_by_its_length():
    # The pendulum hangs about pi/2 + 0.1: sin has its largest value inside its range.
    still = PLAIN.replace(
        contact="oblique", moment_amplitude=0.0, force_amplitude=0.0, static_moment=4 * (np.pi / 2)
    )
    start = np.array([[np.pi / 2 + 0.2, 0.0, 0.0, 0.0]])
    assert never_strike(still.replace(gap=1.0 + 1e-9), start).all()
    assert not never_strike(still.replace(gap=1.0 - 1e-9), start).any()


def test_a_wall_under_a_constant_force_rests_at_its_equilibrium():
    wall = PLAIN.replace(mass_ratio=0.0, force_amplitude=0.0, static_force=0.5, gap=-0.4)
    run = vi.simulate(wall, initial=(-0.2, 0.5, 0.5, 0.0), periods=100, keep=20)
    assert set(run.impacts["x2"]) == {0.5}
    assert bodies_of(None, run) == (1,)
    assert run.refine().wall_at_rest
    moved = vi.simulate(wall, initial=(-0.8, 0.5, 0.0, 0.0), periods=3, keep=3)
    assert bodies_of(None, moved) == (1, 2)


def test_constant_loads_have_arrows_of_their_own_colour():
    system = PLAIN.replace(contact="oblique", moment_amplitude=0.0, force_amplitude=0.0)
    bare = vi.plot.machine(system, START, phase=0.0)
    counts = [len(bare.texts)]
    for changes in ({"static_moment": -0.3}, {"static_force": 0.2}, {"contact": "direct"}):
        changes = changes if "contact" not in changes else changes | {"static_moment": 1.0}
        counts.append(len(vi.plot.machine(system.replace(**changes), START).texts))
    assert counts == [0, 1, 1, 1]
    one = vi.plot.machine(system.replace(static_force=0.2), START)
    other = vi.plot.machine(system.replace(force_amplitude=0.2), START, phase=0.0)
    colors = [ax.texts[0].arrow_patch.get_edgecolor() for ax in (one, other)]
    assert colors[0] != colors[1]
    wall = system.replace(mass_ratio=0.0, static_force=0.2)
    assert not vi.plot.machine(wall, START).texts
    plt.close("all")


def test_all_motions_with_one_impact_are_those_about_the_equilibrium():
    plain, loaded = vi.periodic_motions(PLAIN), vi.periodic_motions(LOADED)
    assert len(plain) == len(loaded) > 0 == len(loaded.undecided)
    for one, other in zip(plain, loaded, strict=True):
        shift = np.array(other.state) - one.state
        assert shift == pytest.approx([EQUILIBRIUM[0], 0.0, 0.0, 0.0], abs=1e-12)
        assert one.stability == other.stability


@pytest.mark.parametrize("contact", ["oblique", "direct"])
def test_no_motion_with_one_impact_is_missed_under_loads(contact):
    random = np.random.default_rng(5)
    settled = 0
    for _ in range(60):
        system = vi.System(
            mass_ratio=random.choice([0.0, 0.4, 1.0]),
            frequency_ratio=random.choice([0.5, 1.0, random.uniform(0.2, 3.0)]),
            restitution=random.uniform(0.2, 0.9),
            gap=random.uniform(-0.2, 0.5),
            drive_frequency=random.uniform(0.6, 3.0),
            damping=(random.choice([0.05, 0.3, 1.2]), random.choice([0.02, 0.3])),
            moment_amplitude=random.uniform(0.2, 2.0),
            force_amplitude=random.choice([0.0, 0.5]),
            static_moment=random.normal(),
            static_force=0.4 * random.normal(),
            contact=contact,
        )
        below = min(system.gap + system.static_force - 0.3, 0.9)
        x1 = np.arcsin(max(below, -0.9)) if contact == "oblique" else below
        start = (x1, 0.0, system.static_force, 0.0)
        run = vi.simulate(system, initial=start, periods=300, keep=20)
        if run.label != "1-1":
            continue
        motion = run.refine()
        if isinstance(motion, vi.PeriodicMotion):
            found = vi.periodic_motions(system)
            if not found.bounded:
                continue
            settled += 1
            assert any(abs(m.state[0] - motion.state[0]) < 1e-8 for m in found), system
    assert settled > 2


def test_the_ball_on_a_table_has_two_bounces_with_one_impact_per_period():
    kappa, gravity, omega = 0.2 / 1.8, 9.81, 2.0
    found = vi.periodic_motions(TABLE.replace(force_amplitude=6.0))
    assert found.bounded
    assert not found.undecided
    assert [motion.admissible for motion in found] == [True, True]
    for motion in found:
        assert motion.state[1] == pytest.approx(np.pi * gravity / omega, rel=1e-12)
        assert motion.state[2] == pytest.approx(-kappa * np.pi * gravity / omega, rel=1e-10)


def test_a_map_over_a_load_has_the_motions_of_each():
    loads = [-0.5, 0.0, 0.5]
    solutions = vi.motion_map(OBLIQUE, static_moment=loads)
    for point, load in enumerate(loads):
        rows = solutions.solutions[solutions.solutions["point"] == point]
        alone = vi.periodic_motions(OBLIQUE.replace(static_moment=load))
        assert rows["x1"] == pytest.approx([m.state[0] for m in alone], abs=1e-12)
    assert solutions.motion(0).system.static_moment == -0.5


def test_three_ways_give_the_exact_flight_of_the_reference():
    draw = random.Random(3)

    def between(low, high):
        return exact(draw.uniform(low, high))

    with ctx.workprec(200):
        for _ in range(60):
            body = Body(
                omega0=draw.choice([fmpq(0), exact(1e-3), between(0, 3)]),
                zeta=draw.choice([fmpq(0), fmpq(1), between(0, 2)]),
                f=draw.choice([fmpq(0), between(-1, 1)]),
                omega=draw.choice([fmpq(0), between(0, 3)]),
                c=between(-2, 2),
            )
            at = (between(0.1, 20), between(-1, 1), between(-1, 1), between(0, 6))
            ways = [way(*at) for way in (body.state, body.state_closed, body.state_quick)]
            assert max(float(value.rad()) for way in ways for value in way) < 1e-40
            for other in ways[1:]:
                assert all(one.overlaps(two) for one, two in zip(ways[0], other, strict=True))


VERIFIED = {
    "free": OBLIQUE.replace(static_moment=0.7),
    "rotor": OBLIQUE.replace(frequency_ratio=0.0, pendulum_damping=0.0, static_moment=0.05),
    "slides": OBLIQUE.replace(drive_frequency=0.3, restitution=0.3),
    "sticks": OBLIQUE.replace(drive_frequency=0.4, restitution=0.3, friction=0.6),
    "wall": OBLIQUE.replace(
        **{"mass_ratio": 0.0, "force_amplitude": 0.0, "static_force": 0.25, "restitution": 0.3}
    ),
    "table": TABLE,
}


@pytest.mark.parametrize("name", VERIFIED)
def test_runs_are_verified_by_the_reference(name):
    system = VERIFIED[name]
    start = (-1.0, 0.0, 0.0, 0.0) if name == "table" else (0.0, 0.5, system.static_force, 0.0)
    lasting = name in ("slides", "sticks", "table")
    run = vi.simulate(system, initial=start, periods=3 if lasting else 6)
    assert len(run.impacts) > 1
    assert (len(run.contacts) > 1) == lasting
    check = vi.verify(run, digits=11)
    assert check.horizon is None
    assert check.stopped == "completed"
