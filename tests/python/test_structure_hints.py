"""What refusals say of structures: only what is allowed there, in words that fit in a few lines."""

import re

import numpy as np
import pytest
from matplotlib import pyplot

import vibroimpact as vi
from struck import REST, SETTLING, masses_run, orbit

TWO = masses_run().system
LINE = np.linspace(0.0, 0.1, 3)
# Names that a System has, a structure, neither, and slips of the pen.
NAMES = (
    *("x1", "v1", "x2", "v2", "x", "q", "q0", "v0", "q_9", "gap0", "gaps", "mass", "omega", "phse"),
    *("amplitude", "drive_amplitude", "force_amplitude", "mass_ratio", "stiffnes", "period"),
)
NUMBERS = {"drive_frequency", "phase"} | {
    f"{name}{which}" for name in ("gap", "restitution", "friction") for which in ("", "_0", "_1")
}
STARTS = ("q_0", "q_1", "v_0", "v_1")
GRIDS = {
    "bifurcation_diagram": lambda **axes: vi.bifurcation_diagram(TWO, initial=REST[2], **axes),
    "chart": lambda **axes: vi.chart(TWO, initial=REST[2], gap=LINE, **axes),
    "sweep": lambda **axes: vi.sweep(TWO, initial=REST[2], gap=LINE, **axes),
    "basins": lambda **axes: vi.basins(TWO, q_0=LINE, **axes),
}


@pytest.fixture(autouse=True)
def _no_figure_is_left():
    yield
    pyplot.close("all")


def refusal(call, **options):
    with pytest.raises((vi.ParameterError, TypeError)) as caught:
        call(**options)
    return str(caught.value)


@pytest.mark.parametrize("verb", GRIDS)
@pytest.mark.parametrize("name", NAMES)
def test_a_grid_offers_only_names_that_it_takes(verb, name):
    said = refusal(GRIDS[verb], **{name: LINE})
    assert said.startswith(f"unknown argument {name} of {verb}")
    taken = {"periods", *(() if verb == "basins" else NUMBERS)}
    taken |= {*STARTS} if verb in ("sweep", "basins") else set()
    assert {*re.findall(r"did you mean (\w+)\?", said)} <= taken


@pytest.mark.parametrize(("name", "meant"), [("x1", "q_0"), ("v2", "v_1"), ("q1", "q_1")])
def test_basins_offer_the_coordinates_of_the_structure(name, meant):
    said = refusal(GRIDS["basins"], **{name: LINE})
    assert f"did you mean {meant}? what can be swept: q_0, q_1, v_0, v_1" in said


def test_a_grid_says_that_a_function_varies_anything():
    said = refusal(GRIDS["bifurcation_diagram"], drive_amplitude=LINE)
    assert "force_amplitude" not in said
    assert said.endswith("or an argument of a function that makes the structure")


def test_an_axis_of_a_function_that_is_missing_is_named():
    def coupled(coupling):
        return TWO.replace(stiffness=[[1 + coupling, -coupling], [-coupling, 1.0]])

    said = refusal(lambda: vi.bifurcation_diagram(coupled, initial=REST[2]))
    assert said == "bifurcation_diagram sweeps exactly 1 of coupling; got nothing"


@pytest.mark.parametrize(("name", "meant"), [("omega", "drive_frequency"), ("gaps", "gap")])
def test_a_branch_offers_numbers_of_the_structure(name, meant):
    said = refusal(orbit().follow, **{name: (1.0, 3.0)})
    assert f"did you mean {meant}?" in said
    assert "with system= an argument of a function that makes the structure" in said


def test_a_branch_says_which_range_is_allowed():
    said = refusal(orbit().follow, drive_frequency=(2.5, 3.0))
    assert said == (
        "drive_frequency = (2.5, 3.0) is not allowed; allowed: a range (low, high) around 2.0, "
        "with low < high"
    )
    said = refusal(orbit().follow, drive_frequency=(1.0, 1e200))
    assert said.endswith("ends from -1e+100 to 1e+100")


@pytest.mark.parametrize(
    "call",
    [
        lambda: vi.verify(SETTLING),
        lambda: vi.follow_motion(SETTLING, drive_frequency=(1, 2)),
        lambda: vi.periodic_motions(SETTLING),
        lambda: vi.impact(SETTLING, x1=0.1, v1=1.0, v2=0.0),
        lambda: vi.plot.time_history(SETTLING),
        lambda: vi.plot.machine(SETTLING, (0, 0, 0, 0)),
        lambda: vi.bifurcation_diagram(lambda k: [SETTLING], initial=REST[1], k=[1.0]),
        lambda: orbit().follow(system=lambda k: [SETTLING], k=(0.0, 1.0, 2.0)),
    ],
)
def test_no_refusal_prints_the_matrices_of_a_structure(call):
    said = refusal(call)
    assert "a structure of 1 coordinate with 1 stop" in said or "[Structure(mass=" in said
    assert "drive_frequency=" not in said
    assert len(said) < 400


def test_a_structure_is_told_by_its_size():
    said = refusal(lambda: vi.verify(TWO))
    assert said.startswith("run = a structure of 2 coordinates with 2 stops is not allowed")
    assert "a structure of 1 coordinate with 1 stop" in refusal(lambda: vi.verify(SETTLING))


def test_a_long_value_does_not_hide_what_is_allowed():
    said = refusal(lambda: orbit().follow(drive_frequency=list(range(1000))))
    assert said.startswith("drive_frequency = [0, 1, 2, ")
    assert said.endswith("allowed: a range (low, high) around 2.0, with low < high")
    assert len(said) < 320


def test_the_function_of_a_branch_says_where_its_structure_differs():
    def heavier(mass):
        return SETTLING.replace(mass=[[mass]])

    said = refusal(orbit().follow, system=heavier, mass=(0.5, 2.0, 4.0))
    assert said.endswith("makes another structure than the motion has: mass[0][0] is 2.0, not 1.0")


@pytest.mark.parametrize("scales", [[0.0, 0.5, 1.0], [1.0, 0.5, 0.0]])
def test_a_function_may_make_a_drive_of_zeros_of_real_and_of_complex_numbers(scales):
    def driven(scale, gap):
        return TWO.replace(drive_amplitude=scale * np.array([1.0, 1j]), gap_0=gap)

    chart = vi.chart(driven, initial=REST[2], periods=4, scale=scales, gap=[0.3, 0.4])
    for i, scale in enumerate(scales):
        assert chart.system_at(i, 1) == driven(scale, 0.4)
        assert chart.run(i, 1).system == driven(scale, 0.4)


def test_both_sections_of_a_diagram_have_one_axis():
    # Impacts occur in the lower part of the range alone.
    diagram = vi.bifurcation_diagram(
        SETTLING.replace(drive_amplitude=[0.5]),
        initial=REST[1],
        drive_frequency=np.linspace(1.2, 2.6, 8),
        periods=100,
        keep=20,
    )
    struck = np.unique(diagram.impact_parameter)
    assert 0 < len(struck) < 8
    one, other = (
        vi.plot.bifurcation(diagram, section=section) for section in ("impact", "stroboscopic")
    )
    assert one.get_xlim() == other.get_xlim() == pytest.approx((1.186, 2.614))


def test_a_function_that_makes_structures_of_two_sizes_is_told_so():
    said = refusal(
        lambda: vi.sweep(lambda k: TWO if k > 1 else SETTLING, initial=REST[1], k=[1.0, 2.0])
    )
    assert said == (
        "at k = 2.0: the function gave a structure of 2 coordinates with 2 stops is not allowed; "
        "allowed: a structure of 1 coordinate with 1 stop, as for the first values"
    )


def test_a_start_whose_rows_are_columns_is_recognised():
    three = vi.Structure(np.eye(3), np.eye(3), [], drive_frequency=1.0)
    with pytest.raises(vi.StateError, match=r"of shape \(3, 2\) .* did you mean its transpose\?$"):
        vi.simulate(three, initial=np.zeros((3, 2)), periods=1)


def test_a_start_that_is_a_number_is_named_once():
    with pytest.raises(vi.StateError, match=r"^initial = 0 is not allowed; allowed: rows q and v"):
        vi.simulate(SETTLING, initial=0, periods=1)


def test_axes_of_branches_are_named_as_those_of_diagrams():
    branch = orbit().follow(gap_0=(0.29, 0.31))
    assert branch.plot().get_xlabel() == "gap of stop 0"
    made = orbit().follow(
        system=lambda drive: SETTLING.replace(drive_amplitude=[drive]), drive=(0.9, 1.0, 1.1)
    )
    assert made.plot().get_xlabel() == "drive"
    ax = vi.plot.multipliers(branch)
    assert [each.get_ylabel() for each in ax.child_axes] == ["gap of stop 0"]
    # No multiplier crosses the circle: there is nothing to name.
    assert not branch.bifurcations
    assert not ax.get_legend().get_visible()
