"""Motions of structures followed over a number: derivatives, closed forms, System, simulations."""

import copy
import math
import pickle

import numpy as np
import pytest

import vibroimpact as vi
from ctrl_c import asks_of, ctrl_c_at
from struck import MOVING, PRESSED, REST, SETTLING, orbit
from vibroimpact import _core
from vibroimpact._core import Border, StopCondition, StopLeg

OSCILLATOR = vi.Structure(
    [[1]], [[1]], [vi.Stop([1], 0.5, 0.6)], drive_amplitude=[1], drive_frequency=1.6
)


def random_structure(rng, *, friction):
    """A structure of 1 to 4 coordinates and 1 to 3 stops, some of which move."""
    count = int(rng.integers(1, 5))

    def definite():
        part = rng.normal(size=(count, count))
        return part @ part.T / count + np.eye(count)

    mass, stiffness, damper = definite(), definite(), rng.normal(size=count)
    stops = []
    for _ in range(int(rng.integers(1, 4))):
        normal, more = rng.normal(size=count), {}
        if friction and count > 1:
            more = {"friction": rng.uniform(0.1, 0.5), "tangent": rng.normal(size=count)}
        if rng.random() < 0.4:
            more |= {"amplitude": 0.05, "phase": rng.uniform(0, 6)}
        stops.append(vi.Stop(normal, rng.uniform(0.1, 0.6), rng.uniform(0.4, 0.9), **more))
    # Half of them couple the modes.
    coupled = 0.02 * np.outer(damper, damper) * (rng.random() < 0.5)
    return vi.Structure(
        mass,
        stiffness,
        stops,
        damping=0.1 * stiffness + coupled,
        static_load=0.1 * rng.normal(size=count),
        drive_amplitude=rng.normal(size=count) + 1j * rng.normal(size=count),
        drive_frequency=rng.uniform(0.8, 2.5),
        phase=rng.uniform(0, 6),
    )


def random_legs(rng, structure):
    """Impacts in any order and regime, at nodes that are no motion."""
    count = int(rng.integers(1, 4))
    legs = []
    for stop in rng.integers(len(structure.stops), size=count).tolist():
        if structure.stops[stop].friction:
            regime, direction = vi.Regime(int(rng.integers(1, 6))), int(rng.choice([-1, 1]))
            legs.append(StopLeg.impact(stop, regime, direction))
        else:
            legs.append(StopLeg.impact(stop, vi.Regime.FRICTIONLESS))
    period = structure.drive_period
    times = np.sort(rng.uniform(0, 2 * period, count))
    clocks = (times // period).astype(int)
    states = rng.normal(size=(count, 2 * structure.coordinates))
    nodes = np.column_stack([states, times - clocks * period])
    return _core.StructureItinerary(legs, 2, clocks.tolist()), nodes


def slope(of, step=2e-5):
    """The derivative at 0, of fourth order."""
    near, far = (of(k * step) - of(-k * step) for k in (1, 2))
    return (8 * near - far) / (12 * step)


@pytest.mark.parametrize("seed", range(24))
def test_all_derivatives_of_the_conditions_are_those_of_differences(seed):
    rng = np.random.default_rng(seed)
    structure = random_structure(rng, friction=seed % 2 == 1)
    itinerary, nodes = random_legs(rng, structure)
    names = ["drive_frequency", "phase", "gap", "gap_0", "restitution", "friction"]
    if not all(stop.friction for stop in structure.stops):
        names.remove("friction")
    value, jacobian = itinerary.residual(structure._compiled, nodes, names)
    assert np.isfinite(value).all()

    def at(place, x):
        moved = nodes.copy()
        moved.ravel()[place] += x
        return itinerary.residual(structure._compiled, moved, [])[0]

    def varied(name, x):
        if name in ("gap", "restitution", "friction"):
            new = {f"{name}_{k}": getattr(s, name) + x for k, s in enumerate(structure.stops)}
        elif name == "gap_0":
            new = {name: structure.stops[0].gap + x}
        else:
            new = {name: getattr(structure, name) + x}
        return itinerary.residual(structure.replace(**new)._compiled, nodes, [])[0]

    for place in range(nodes.size):
        wanted = slope(lambda x, place=place: at(place, x))
        assert jacobian[:, place] == pytest.approx(wanted, rel=1e-8, abs=1e-8)
    for place, name in enumerate(names):
        wanted = slope(lambda x, name=name: varied(name, x))
        found = jacobian[:, nodes.size + place]
        assert found == pytest.approx(wanted, rel=1e-8, abs=1e-8), name


def test_the_return_map_is_that_of_newtons_method_along_simulations():
    motion = orbit()
    again = motion.itinerary.return_map(motion.system._compiled, motion.nodes)
    assert again == pytest.approx(motion.derivative, abs=1e-14)
    assert motion.legs == (StopLeg.impact(0, vi.Regime.FRICTIONLESS),)
    assert motion.sections[0] == pytest.approx(motion.state, abs=1e-14)
    run = vi.simulate(motion.system, initial=motion.state, periods=1)
    times = np.linspace(0, run.final_state.time, 7)
    assert motion.trajectory(times) == pytest.approx(run.trajectory(times), abs=1e-13)


def shaw_holmes(omega, delta, r):
    """a, b and G of the 1-1 motion of x'' + x = cos(omega t): (delta + a V)^2 + (b V)^2 = G^2."""
    a = 0.5 * (1 + r) / math.tan(math.pi / omega)
    return a, 0.5 * (1 - r) / omega, 1 / (1 - omega**2)


def discriminant(omega, delta, r):
    a, b, response = shaw_holmes(omega, delta, r)
    return (a * delta) ** 2 - (a**2 + b**2) * (delta**2 - response**2)


def test_the_impact_oscillator_is_its_closed_form():
    delta, r = 0.5, 0.6
    run = vi.simulate(OSCILLATOR, initial=[[0], [0]], periods=3000, keep=50)
    motion = run.refine()
    assert motion.label == "1-1"
    branch = motion.follow(drive_frequency=(1.5, 2.6))
    # The velocity before the impact is a root of the quadratic at every point of the 1-1 piece.
    pieces = [piece for piece in branch.pieces if piece.label == "1-1"]
    for piece in pieces:
        for omega, (speed,) in zip(
            piece.values.tolist(), piece.at_impacts("approach_velocity").tolist(), strict=True
        ):
            a, b, response = shaw_holmes(omega, delta, r)
            off = (delta + a * speed) ** 2 + (b * speed) ** 2 - response**2
            assert abs(off) < 1e-11 * max(1.0, response**2)
        # Undamped, each impact takes r^2 from volumes.
        # (At the graze one multiplier is infinite.)
        tame = np.abs(piece.multipliers).max(axis=1) < 1e4
        assert np.count_nonzero(tame) > len(tame) - 5
        products = np.prod(piece.multipliers[tame], axis=1)
        assert products == pytest.approx(r**2, rel=1e-9)
    # It folds where the discriminant is 0, and grazes where the response just reaches the stop.
    assert len(branch.of_kind("saddle_node")) > 0
    for fold in branch.of_kind("saddle_node"):
        assert abs(discriminant(fold.value, delta, r)) < 1e-10
    touches = [each for each in branch.of_kind("grazing") if each.goes_on == (StopLeg.CIRCUIT,)]
    assert [each.value for each in touches] == pytest.approx([math.sqrt(1 + 1 / delta)], abs=1e-12)


def test_the_example_of_coco():
    start = vi.Structure(
        [[1]], [[1]], [vi.Stop([1], 1, 0.8)], damping_ratios=[0.05], drive_amplitude=[1],
        drive_frequency=1.1,
    )  # fmt: skip
    motion = vi.simulate(start, initial=[[0], [0]], periods=300, keep=50).refine()
    (found,) = motion.follow(drive_frequency=(0.95, 1.15)).at(drive_frequency=1.0)
    run = vi.simulate(found.system, initial=found.state, periods=1)
    assert run.impacts["v_pre"][0, 0] == pytest.approx(1.695732937594882, abs=1e-11)
    assert run.impacts["v_post"][0, 0] == pytest.approx(-1.356586350075906, abs=1e-11)


HEADS = [
    # mass ratio, frequency ratio, r, gap, omega, f1, f2, zeta1, zeta2, phase; what varies.
    ((0.6, 2.0, 0.8, 0.1, 1.1, 1.0, 0.3, 0.05, 0.05, 0.4), {"drive_frequency": (0.9, 1.6)}, 10),
    ((0.6, 2.0, 0.8, 0.5, 1.8, 1.0, 0.0, 0.03, 0.05, 0.0), {"gap": (0.42, 0.8)}, 1),
    ((0.6, 2.0, 0.8, 0.1, 1.1, 1.0, 0.3, 0.05, 0.05, 0.4), {"restitution": (0.3725, 0.95)}, 8),
]


@pytest.mark.parametrize(("numbers", "varied", "least"), HEADS)
def test_head_on_bodies_bifurcate_as_a_system_does(numbers, varied, least):
    ratio, w, r, gap, omega, f1, f2, z1, z2, phase = numbers
    system = vi.System(
        mass_ratio=ratio, frequency_ratio=w, restitution=r, gap=gap, drive_frequency=omega,
        moment_amplitude=f1, force_amplitude=f2, contact="direct", damping=(z1, z2), phase=phase,
    )  # fmt: skip
    structure = vi.Structure(
        np.diag([1, 1 / ratio]),
        np.diag([w * w, 1 / ratio]),
        [vi.Stop([1, -1], gap, r)],
        damping=np.diag([2 * z1 * w, 2 * z2 / ratio]),
        drive_amplitude=[f1, f2 / ratio],
        drive_frequency=omega,
        phase=phase,
    )
    known = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=800, keep=100).refine()
    found = vi.simulate(structure, initial=[[0, 0], [0.5, 0]], periods=800, keep=100).refine()
    theirs, own = known.follow(**varied), found.follow(**varied)
    assert [piece.label for piece in own.pieces] == [piece.label for piece in theirs.pieces]
    assert own.ends == theirs.ends
    kinds = [each.kind for each in theirs.bifurcations]
    assert [each.kind for each in own.bifurcations] == kinds
    assert len(kinds) >= least
    values = [each.value for each in theirs.bifurcations]
    assert [each.value for each in own.bifurcations] == pytest.approx(values, abs=1e-9)


@pytest.mark.parametrize("seed", range(10))
def test_points_of_branches_are_the_motions_that_runs_settle_on(seed):
    rng = np.random.default_rng(100 + seed)
    structure = random_structure(rng, friction=seed % 2 == 1)
    run = vi.simulate(structure, initial=np.zeros((2, structure.coordinates)), periods=400, keep=60)
    motion = run.refine()
    if not isinstance(motion, vi.StructureOrbit) or not motion.legs:
        return
    omega = structure.drive_frequency
    branch = motion.follow(drive_frequency=(0.98 * omega, 1.02 * omega), max_points=60)
    for value in rng.uniform(branch.values.min(), branch.values.max(), 2).tolist():
        for found in branch.at(value):
            if not found.stable:
                continue
            varied = structure.replace(drive_frequency=value)
            periods = 60 * found.m
            settled = vi.simulate(varied, initial=found.state, periods=periods, keep=50 * found.m)
            again = settled.refine()
            assert again.label == found.label
            assert np.abs(again.multipliers) == pytest.approx(np.abs(found.multipliers), abs=1e-9)
            off = [np.abs(again.state - section).max() for section in found.sections]
            assert min(off) < 1e-9


def test_enough_of_them_are_periodic():
    periodic = 0
    for seed in range(10):
        rng = np.random.default_rng(100 + seed)
        structure = random_structure(rng, friction=seed % 2 == 1)
        start = np.zeros((2, structure.coordinates))
        found = vi.simulate(structure, initial=start, periods=400, keep=60).refine()
        periodic += isinstance(found, vi.StructureOrbit) and len(found.legs) > 0
    assert periodic >= 7


def test_the_doubled_branch_is_what_runs_find():
    branch = orbit().follow(drive_frequency=(1.9, 2.2))
    (doubling,) = branch.of_kind("period_doubling")
    doubled = vi.switch_branch(doubling, drive_frequency=(1.9, 2.2))
    assert doubled.values[0] == pytest.approx(doubling.value, abs=1e-9)
    motions = [motion for motion in doubled.motions[1:] if motion.m == 2]
    assert motions
    for motion in motions[:5]:
        assert motion.admissible
        end = vi.simulate(motion.system, initial=motion.state, periods=2, keep=1)
        assert end.stroboscopic[-1] == pytest.approx(motion.state, abs=1e-11)


def test_symmetric_motions_graze_both_stops_at_once():
    stops = [vi.Stop([1], 1.0, 0.7), vi.Stop([-1], 1.0, 0.7)]
    between = vi.Structure(
        [[1]], [[1]], stops, damping_ratios=[0.05], drive_amplitude=[1], drive_frequency=2.0
    )
    motion = vi.simulate(between, initial=[[0], [0]], periods=300, keep=20).refine()
    assert motion.label == "1-0"
    branch = motion.follow(drive_frequency=(1.3, 2.2))
    (touch, *_) = branch.of_kind("grazing")
    # |G| = 1: (1 - w^2)^2 + (0.1 w)^2 = 1.
    place = math.sqrt(1.99)
    assert touch.value == pytest.approx(place, abs=1e-12)
    assert {leg.stop for leg in touch.goes_on} == {0, 1}
    assert "1-2" in [piece.label for piece in branch.pieces]


def test_a_function_is_followed_as_the_number_it_sets():
    motion = orbit()
    by_name = motion.follow(gap=(-0.2, 0.6))
    by_function = motion.follow(system=lambda d: SETTLING.replace(gap=d), d=(-0.2, 0.3, 0.6))
    names = [str(each.kind) for each in by_name.bifurcations]
    assert [str(each.kind) for each in by_function.bifurcations] == names
    assert names
    values = [each.value for each in by_name.bifurcations]
    assert [each.value for each in by_function.bifurcations] == pytest.approx(values, abs=1e-11)
    (found,) = by_function.at(d=0.25)
    (known,) = by_name.at(gap=0.25)
    assert found.state == pytest.approx(known.state, abs=1e-11)
    with pytest.raises(vi.ParameterError, match="file holds no function"):
        by_function.save("never.npz")
    same = pickle.loads(pickle.dumps(found.system))
    assert type(same) is vi.Structure
    assert same == SETTLING.replace(gap=0.25)
    assert type(copy.copy(found.system)) is vi.Structure


def test_a_stiffness_at_the_end_of_its_range_has_a_derivative():
    def damped(c):
        return vi.Structure(
            [[1]], [[1]], [vi.Stop([1], 0.3, 0.8)], damping=[[c]], drive_amplitude=[1],
            drive_frequency=2.0,
        )  # fmt: skip

    motion = vi.simulate(damped(0.1), initial=[[0], [0]], periods=200, keep=50).refine()
    branch = motion.follow(system=damped, c=(0.0, 0.1, 0.2))
    assert branch.ends[0] == "bound"
    assert branch.values.min() == 0.0


def test_regimes_of_friction_change_along_a_branch():
    structure = vi.Structure(
        np.diag([1.0, 0.4]),
        [[1.0, 0], [0, 0.5]],
        [vi.Stop([1, 0.5], 0.2, 0.7, friction=0.3, tangent=[0.4, 1])],
        damping_ratios=[0.05, 0.05],
        drive_amplitude=[1, 0.5],
        drive_frequency=1.6,
    )
    motion = vi.simulate(structure, initial=np.zeros((2, 2)), periods=400, keep=50).refine()
    branch = motion.follow(friction=(0.01, 1.2))
    borders = branch.of_kind("regime_border")
    assert borders
    for border in borders:
        assert isinstance(border.test, StopCondition)
        assert abs(border.test_value) < 1e-10
    regimes = {leg.regime for piece in branch.pieces for leg in piece.itinerary.legs}
    assert len(regimes) >= 2
    for piece in branch.pieces:
        middle = piece.motion(len(piece.values) // 2)
        assert middle.admissible, middle.why_not
        run = vi.simulate(middle.system, initial=middle.state, periods=middle.m)
        assert sorted(run.impacts["regime"].tolist()) == sorted(
            int(leg.regime) for leg in middle.legs
        )


def test_what_is_no_sequence_of_impacts_is_refused_by_name():
    run = vi.simulate(PRESSED, initial=REST[2], periods=60, keep=20)
    motion = run.refine()
    if isinstance(motion, vi.StructureOrbit) and not motion.legs:
        with pytest.raises(vi.ParameterError, match=r"only events are impacts: .* contact"):
            motion.follow(drive_frequency=(0.9, 1.1))
    run = vi.simulate(MOVING, initial=REST[1], periods=60, keep=20)
    rests = run.refine()
    assert isinstance(rests, vi.StructureOrbit)
    assert rests.legs == ()
    with pytest.raises(vi.ParameterError, match="only events are impacts"):
        rests.follow(drive_frequency=(0.6, 0.8))


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({}, "exactly one parameter"),
        ({"mass": (1, 2)}, "mass.*drive_frequency, phase, gap"),
        ({"gap_1": (0.2, 0.4)}, "unknown argument gap_1, did you mean gap_0"),
        ({"gap": (0.4, 0.5)}, "around 0.3"),
        ({"gap": (math.nan, 0.5)}, "around 0.3"),
        ({"drive_frequency": (1.9, 2.1), "direction": 0}, "1 or -1"),
        ({"drive_frequency": (1.9, 2.1), "units": "SI"}, "units of its numbers"),
        ({"drive_frequency": (1.9, 2.1), "max_points": 1}, "max_points"),
        ({"friction": (0.0, 0.5)}, "> 0 at the start"),
        ({"system": lambda d: SETTLING.replace(gap=d), "d": (0.1, 0.2, 0.4)}, "gap"),
        ({"system": lambda d: d, "d": (0.1, 0.3, 0.4)}, "allowed: a vibroimpact.Structure"),
    ],
)
def test_bad_input(keywords, message):
    with pytest.raises(vi.ParameterError, match=message):
        orbit().follow(**keywords)


def test_stops_that_differ_have_no_gap_of_all():
    stops = [vi.Stop([1], 0.3, 0.8), vi.Stop([-1], 4.0, 0.8)]
    structure = SETTLING.replace(stops=stops)
    motion = vi.simulate(structure, initial=[[0], [0]], periods=200, keep=50).refine()
    with pytest.raises(vi.ParameterError) as caught:
        motion.follow(gap=(0.1, 0.5))
    assert str(caught.value) == (
        "gap of all stops = [0.3, 4.0] is not allowed; allowed: one value of all, as "
        "replace(gap=0.3) makes it; of one stop say gap_0, gap_1"
    )
    # A diagram has what `replace` makes, one value of all, too.
    rest = {"initial": [[0], [0]], "periods": 20}
    alike = vi.bifurcation_diagram(structure, gap=[0.3, 0.4], **rest)
    assert [stop.gap for stop in alike.system_at(1).stops] == [0.4, 0.4]
    three = structure.replace(stops=[*stops, vi.Stop([-1], 5.0, 0.8)])
    motion = vi.simulate(three, initial=[[0], [0]], periods=200, keep=50).refine()
    with pytest.raises(vi.ParameterError, match=r"of one stop say gap_0 \.\.\. gap_2$"):
        motion.follow(gap=(0.1, 0.5))
    motion = vi.simulate(structure, initial=[[0], [0]], periods=200, keep=50).refine()
    assert motion.follow(gap_0=(0.28, 0.32)).ends == ("bound", "bound")


def test_ctrl_c_keeps_the_branch_so_far():
    # From a later ask on, so that some points are done; each verdict asks.
    asks = asks_of(lambda: orbit().follow(drive_frequency=(1.5, 2.05), both=False))
    with ctrl_c_at(asks // 2) as caught:
        orbit().follow(drive_frequency=(1.5, 2.05), both=False)
    part = caught.value.result
    assert isinstance(part, vi.Branch)
    assert len(part) > 0
    assert part.ends[1] == "interrupted"


def test_legs_and_conditions_are_values():
    leg = StopLeg.impact(1, vi.Regime.SLIP, -1)
    for same in (StopLeg.from_text(str(leg)), pickle.loads(pickle.dumps(leg)), copy.copy(leg)):
        assert same == leg
        assert hash(same) == hash(leg)
    assert str(leg) == "impact 1:slip:-"
    assert StopLeg.from_text("circuit") == StopLeg.CIRCUIT
    condition = StopCondition(Border.FLIGHT, 2, 1)
    assert pickle.loads(pickle.dumps(condition)) == condition
    assert (condition.leg, condition.stop, condition.kind) == (2, 1, "grazing")
    for text in ("impact", "impact 0:slip", "impact x:slip:+", "impact 0:frictionless:+", "slide"):
        with pytest.raises(vi.ParameterError):
            StopLeg.from_text(text)
    with pytest.raises(vi.ParameterError, match="direction"):
        StopLeg.impact(0, vi.Regime.FRICTIONLESS, 1)
    with pytest.raises(vi.ParameterError, match="legs"):
        _core.StructureItinerary([], 1, [])
    with pytest.raises(vi.ParameterError, match="clocks"):
        _core.StructureItinerary([leg], 1, [0, 1])
    with pytest.raises(vi.ParameterError, match="one of 1 stops"):
        _core.StructureItinerary([leg], 1, [0]).residual(SETTLING._compiled, np.zeros((1, 3)))
    itinerary = orbit().itinerary
    assert pickle.loads(pickle.dumps(itinerary)).legs == itinerary.legs
    with pytest.raises(vi.ParameterError, match="1 rows of 3"):
        itinerary.residual(SETTLING._compiled, np.zeros((1, 4)))


def test_a_branch_is_drawn_by_its_sections():
    branch = orbit().follow(drive_frequency=(1.9, 2.2))
    ax = branch.plot()
    assert ax.get_ylabel() == "approach velocity $u$ at impacts"
    assert ax.get_xlabel() == r"drive frequency $\omega$"
    lines = {each.get_gid() for each in ax.collections} | {each.get_gid() for each in ax.lines}
    assert {"stable", "period_doubling", "grazing"} <= lines
    assert (
        branch.plot(section="stroboscopic", value="v")
        .get_ylabel()
        .startswith("velocity $\\dot q_0$")
    )
    for bad, message in (
        ({"value": "x1"}, "approach_velocity, phase"),
        ({"coordinate": 1}, "coordinate"),
        ({"units": "SI"}, "units of its numbers"),
        ({"diagram": 3}, "StructureDiagram"),
    ):
        with pytest.raises(vi.ParameterError, match=message):
            vi.plot.branches(branch, **bad)
    for name in ("approach_velocity", "phase", "q", "v_pre", "v_post"):
        assert branch.pieces[0].at_impacts(name).shape == (len(branch.pieces[0].values), 1)
    # The first point, against a run.
    motion, piece = branch.pieces[0].motion(0), branch.pieces[0]
    (impact,) = vi.simulate(motion.system, initial=motion.state, periods=1).impacts
    for name in ("approach_velocity", "phase"):
        assert piece.at_impacts(name)[0, 0] == pytest.approx(impact[name], abs=1e-12)
    for name in ("q", "v_pre", "v_post"):
        assert piece.at_impacts(name)[0, 0] == pytest.approx(impact[name][0], abs=1e-12)
    assert piece.at_sections("q")[0, 0] == pytest.approx(motion.state[0, 0], abs=1e-13)


def test_a_branch_comes_back_from_a_file(tmp_path):
    structure = SETTLING.replace(drive_amplitude=[np.exp(0.3j)])
    motion = vi.simulate(structure, initial=[[0], [0]], periods=200, keep=50).refine()
    branch = motion.follow(drive_frequency=(1.9, 2.2))
    assert {str(each.kind) for each in branch.bifurcations} == {"period_doubling", "grazing"}
    branch.save(tmp_path / "branch.npz")
    again = vi.load(tmp_path / "branch.npz")
    assert repr(again) == repr(branch)
    assert [each.test for each in again.bifurcations] == [each.test for each in branch.bifurcations]
    goes_on = [each.goes_on for each in branch.bifurcations]
    assert [each.goes_on for each in again.bifurcations] == goes_on
    for one, other in zip(again.pieces, branch.pieces, strict=True):
        assert one.system == other.system
        assert one.nodes.tobytes() == other.nodes.tobytes()
    assert again.at(2.05)[0].state == pytest.approx(branch.at(2.05)[0].state, abs=1e-13)


def test_curves_in_two_parameters_refuse_structures_by_name():
    (doubling,) = orbit().follow(drive_frequency=(1.9, 2.2)).of_kind("period_doubling")
    with pytest.raises(vi.ParameterError, match="not for structures yet"):
        vi.bifurcation_curve(doubling, drive_frequency=(1.9, 2.2), gap=(0.2, 0.4))
    with pytest.raises(vi.ParameterError, match="PeriodicMotion; not for structures yet"):
        vi.stability_region(orbit(), drive_frequency=(1.9, 2.2), gap=(0.2, 0.4))
