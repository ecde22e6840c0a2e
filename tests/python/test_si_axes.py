"""Quantities in SI that vary: ``replace``, sweeps and continuation against systems by hand."""

import math

import matplotlib.pyplot as plt
import numpy as np
import pytest

import vibroimpact as vi

MACHINE = {
    "pendulum_mass": 0.3,
    "oscillator_mass": 0.5,
    "length": 0.2,
    "torsional_stiffness": 1.5,
    "stiffness": 40.0,
    "torsional_damping": 0.004,
    "damping": 0.05,
    "moment_amplitude": 0.4,
    "force_amplitude": 0.2,
    "static_moment": 0.05,
    "static_force": -0.1,
    "drive_frequency": 12.0,
    "gap": 0.1,
    "restitution": 0.8,
    "friction": 0.2,
    "phase": 0.3,
}
START = (0.1, 1.0, -0.02, 0.1)
PERIODS = {"periods": 60, "keep": 20}


@pytest.fixture(scope="module")
def system():
    return vi.System.from_physical(**MACHINE)


def numbers(system):
    return {name: value for name, value in system.to_dict().items() if isinstance(value, float)}


@pytest.mark.parametrize("law", ["poisson", "newton"])
def test_the_quantities_of_a_system_come_back(law):
    back = vi.System.from_physical(**MACHINE, law=law).to_physical()
    assert (back.pop("contact"), back.pop("law")) == ("oblique", law)
    assert back == pytest.approx(MACHINE, rel=1e-14)


def test_a_wall_and_a_system_without_scales_have_no_quantities(system):
    with pytest.raises(vi.ParameterError, match="from_physical"):
        system.replace(scales=None).to_physical()
    with pytest.raises(vi.ParameterError, match="a wall has no mass"):
        system.replace(mass_ratio=0.0).to_physical()


@pytest.mark.parametrize("name", MACHINE)
def test_a_quantity_is_replaced_in_its_own_unit(system, name):
    value = 0.9 * MACHINE[name]
    changed = system.replace(**{name: value}, units="SI")
    by_hand = vi.System.from_physical(**MACHINE | {name: value})
    assert numbers(changed) == pytest.approx(numbers(by_hand), rel=1e-14)
    for unit in ("length", "mass", "time"):
        assert getattr(changed.scales, unit) == pytest.approx(getattr(by_hand.scales, unit))
    # What does not depend on the quantity stays the same to the last bit.
    for own, number in numbers(system).items():
        if math.isclose(number, numbers(by_hand)[own], rel_tol=1e-12):
            assert numbers(changed)[own] == number


def test_without_units_a_change_is_dimensionless(system):
    assert system.replace(drive_frequency=2.0).drive_frequency == 2.0
    with pytest.raises(vi.ParameterError, match="unknown quantity mass_ratio"):
        system.replace(mass_ratio=0.5, units="SI")


@pytest.mark.parametrize(
    ("name", "values"),
    [("drive_frequency", [11.0, 12.5]), ("stiffness", [35.0, 42.0]), ("friction", [0.0, 0.3])],
)
@pytest.mark.parametrize("start", ["fresh", "forward"])
def test_a_diagram_in_si_is_that_of_systems_by_hand(system, name, values, start):
    diagram = vi.bifurcation_diagram(
        system, initial=START, units="SI", start=start, **PERIODS, **{name: values}
    )
    by_hand = [system.replace(**{name: value}, units="SI") for value in values]
    run = None
    for i, one in enumerate(by_hand):
        assert diagram.system_at(i) == one
        assert diagram.system_at(i).scales == one.scales
        if run is None or start == "fresh":
            run = vi.simulate(one, initial=START, units="SI", **PERIODS)
        else:
            run = vi.simulate(one, initial=run.final_state.state, **PERIODS)
        assert np.array_equal(diagram.final_states[i], run.final_state.state)
    assert diagram.values.tolist() == values


def test_starts_are_in_si_and_so_are_their_axes(system):
    sweep = vi.sweep(
        system, initial=START, units="SI", periods=20, stiffness=[35.0, 42.0], v1=[0.5, 2.0]
    )
    assert sweep.run(1, 0).in_si().initial == pytest.approx((0.1, 0.5, -0.02, 0.1))
    by_hand = vi.simulate(
        system.replace(stiffness=42.0, units="SI"),
        initial=(0.1, 2.0, -0.02, 0.1),
        units="SI",
        periods=20,
    )
    assert np.array_equal(sweep.final_states[1, 1], by_hand.final_state.state)
    several = vi.bifurcation_diagram(
        system, initial=[START, (0, 2, 0, 0)], units="SI", periods=20, drive_frequency=[12.0, 13.0]
    )
    assert several.run(2).in_si().initial == pytest.approx((0, 2, 0, 0))
    moving = vi.sweep(
        system, initial=lambda gap: (gap, 1, 0, 0), units="SI", periods=20, gap=[0.05, 0.1]
    )
    assert moving.run(0).in_si().initial == pytest.approx((0.05, 1, 0, 0))


def test_charts_and_exponents_take_si(system):
    chart = vi.chart(
        system, initial=START, units="SI", periods=20, stiffness=[35.0, 42.0], damping=[0.0, 0.1]
    )
    assert chart.system_at(1, 1) == system.replace(stiffness=42.0, damping=0.1, units="SI")
    options = {"initial": START, "units": "SI", "periods": 60}
    one = vi.lyapunov_spectrum(system.replace(stiffness=42.0, units="SI"), **options)
    many = vi.lyapunov_spectrum(system, **options, stiffness=[35.0, 42.0])
    assert np.array_equal(many.exponents[1], one.exponents)
    constant = system.replace(drive_frequency=0.0)
    seconds = vi.lyapunov_spectrum(constant, initial=START, time=20.0, units="SI")
    plain = vi.lyapunov_spectrum(
        constant, initial=system.scales.from_si(START), time=20.0 / system.scales.time
    )
    assert np.array_equal(seconds.exponents, plain.exponents)


def test_basins_take_starts_in_si(system, tmp_path):
    axes = {"x1": np.linspace(-0.4, 0.2, 5), "v1": np.linspace(-3.0, 3.0, 4)}
    options = {"periods": 100, "scouts": 9, "rounds": 1}
    found = vi.basins(system, initial=START, units="SI", **options, **axes)
    plain = vi.basins(
        system,
        initial=system.scales.from_si(START),
        **options,
        x1=axes["x1"],
        v1=axes["v1"] * system.scales.time,
    )
    assert {name: values.tolist() for name, values in found.axes.items()} == {
        name: values.tolist() for name, values in axes.items()
    }
    assert found.settings.initial == START
    assert np.array_equal(found.status_code, plain.status_code)
    assert np.array_equal(found.attractor, plain.attractor)
    assert np.array_equal(found.settling, plain.settling)
    run = found.run(3, 1)
    assert run.in_si().initial == pytest.approx((0.05, -1.0, -0.02, 0.1))
    found.save(tmp_path / "found.npz")
    back = vi.load(tmp_path / "found.npz")
    assert back.settings == found.settings
    assert np.array_equal(back.axes["v1"], axes["v1"])
    assert back.to_xarray()["v1"].attrs == {"units": "rad/s"}
    assert plain.to_xarray()["v1"].attrs == {"units": "dimensionless"}
    other = vi.basins(
        system, units="SI", **options, x2=np.linspace(0.0, 0.05, 4), v2=np.linspace(-1.0, 1.0, 4)
    )
    ax = vi.plot.basins(other, sections=True)
    assert (ax.get_xlabel(), ax.get_ylabel()) == (
        "position $x_2$ of body 2 (m)",
        r"velocity $\dot x_2$ of body 2 (m/s)",
    )
    assert "0 rad, " in ax.get_legend().get_title().get_text()
    marks = [line for line in ax.lines if len(line.get_xdata())]
    sections = next(each.sections for each in other.attractors if each.kind == "periodic")
    assert marks[0].get_xdata() == pytest.approx(system.scales.to_si(sections)[:, 2])
    plt.close("all")
    with pytest.raises(vi.ParameterError, match="from_physical"):
        vi.basins(system.replace(scales=None), units="SI", **axes)


def test_a_branch_is_followed_over_a_quantity(system):
    motion = vi.simulate(system, initial=START, units="SI", periods=600).refine()
    assert motion
    branch = vi.follow_motion(motion, units="SI", drive_frequency=(11.8, 12.2))
    plain = vi.follow_motion(
        motion, drive_frequency=tuple(end * system.scales.time for end in (11.8, 12.2))
    )
    ends = [each.motions[0].system.drive_frequency for each in (branch, plain)]
    assert ends[0] == pytest.approx(ends[1], rel=1e-9)
    assert vi.plot.branches(branch).get_xlabel() == r"drive frequency $\Omega$ (rad/s)"
    with pytest.raises(vi.ParameterError, match="unknown argument x1"):
        vi.follow_motion(motion, units="SI", x1=(0.0, 1.0))
    plt.close("all")


@pytest.mark.parametrize(
    ("axes", "said"),
    [
        ({"mass_ratio": [0.5]}, "mass_ratio is not allowed with units='SI'"),
        ({"drive_frequncy": [12.0]}, "did you mean drive_frequency"),
        ({"x2": [0.0]}, "unknown argument x2"),
        ({"stiffness": [-1.0]}, "at stiffness = -1.0: stiffness = -1.0 is not allowed"),
    ],
)
def test_what_is_no_quantity_is_refused(system, axes, said):
    with pytest.raises(vi.ParameterError, match=said):
        vi.bifurcation_diagram(system, initial=START, units="SI", **axes)


def test_units_that_cannot_be_are_refused(system):
    for given, said in (
        (system.replace(scales=None), "from_physical"),
        (lambda gap: system, "units of its own"),
    ):
        with pytest.raises(vi.ParameterError, match=said):
            vi.bifurcation_diagram(given, initial=START, units="SI", gap=[0.1])
    with pytest.raises(vi.ParameterError, match="starts change with stiffness"):
        vi.bifurcation_diagram(system, initial=[START] * 2, units="SI", stiffness=[40.0])
    with pytest.raises(vi.ParameterError, match="units = 'si'"):
        vi.sweep(system, initial=START, units="si", gap=[0.1])


def test_an_axis_names_the_unit_of_its_quantity(system):
    def label(made, name, values, **options):
        diagram = vi.bifurcation_diagram(made, initial=(0, 0, 0, 0), periods=5, **{name: values})
        text = vi.plot.bifurcation(diagram).get_xlabel()
        plt.close("all")
        return text

    def of(function):
        return lambda drive_frequency: system.replace(
            drive_frequency=function(drive_frequency), units="SI"
        )

    assert label(of(lambda hertz: math.tau * hertz), "drive_frequency", [1.8, 2.0]) == (
        r"drive frequency $\Omega/2\pi$ (Hz)"
    )
    assert (
        label(of(lambda own: own), "drive_frequency", [11.0, 12.0])
        == r"drive frequency $\Omega$ (rad/s)"
    )
    # Of another number, whatever its name, no unit is known.
    assert label(of(lambda per_minute: math.tau / 60 * per_minute), "drive_frequency", [110.0]) == (
        "drive_frequency"
    )
    chart = vi.chart(
        system, initial=START, units="SI", periods=5, stiffness=[35.0, 42.0], damping=[0.0, 0.1]
    )
    ax = vi.plot.chart(chart)
    assert (ax.get_xlabel(), ax.get_ylabel()) == (
        "stiffness $K_2$ (N/m)",
        "damping $C_2$ (N s/m)",
    )
    sweep = vi.sweep(system, initial=START, units="SI", periods=5, v1=[1.0, 2.0])
    assert vi.plot.final_states(sweep).get_xlabel() == r"velocity $\dot x_1$ of body 1 (rad/s)"
    plt.close("all")
