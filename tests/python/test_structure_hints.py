"""What refusals say of structures: only what is allowed there, in words that fit in a few lines."""

import re

import numpy as np
import pytest
from matplotlib import pyplot
from scipy.sparse import csr_array

import vibroimpact as vi
from struck import REST, SETTLING, masses_run, orbit
from vibroimpact.cli import main
from vibroimpact.showing import counted

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
    meant = re.search(r"did you mean ([^?]+)\?", said)
    assert {*re.split(", | or ", meant[1])} <= taken if meant else "did you mean" not in said


@pytest.mark.parametrize(("name", "meant"), [("x1", "q_0"), ("v2", "v_1"), ("q1", "q_1")])
def test_basins_offer_the_coordinates_of_the_structure(name, meant):
    said = refusal(GRIDS["basins"], **{name: LINE})
    assert f"did you mean {meant}? what can be swept: q_0, q_1, v_0, v_1" in said


def test_a_grid_says_that_a_function_varies_anything():
    said = refusal(GRIDS["bifurcation_diagram"], drive_amplitude=LINE)
    assert "force_amplitude" not in said
    example = "such as lambda F: structure.replace(drive_amplitude=[F, 0])"
    assert f"a function that makes the structure, {example}; options: initial" in said


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
        "that of the motion, with low < high"
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
        lambda: vi.plot.impact_count(SETTLING),
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
    assert said.endswith(
        "allowed: a range (low, high) around 2.0, that of the motion, with low < high"
    )
    assert len(said) < 340


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


def test_an_axis_names_the_stops_that_have_what_varies():
    curve = vi.RestitutionTable(speeds=[0.1, 0.5, 2.0], values=[0.85, 0.7, 0.5])
    own = [vi.Stop([1], 0.3, curve), vi.Stop([-1], 0.4, 0.8), vi.Stop([1], 0.5, curve)]
    start = {"initial": [[0], [0]], "periods": 20}
    for stops, which in (
        (own[:1], "the stop"),
        (own[:2], "stop 0"),
        (own, "stops 0, 2"),
        ([own[0], own[2]], "all stops"),
    ):
        over = vi.bifurcation_diagram(SETTLING.replace(stops=stops), r_2=[0.5, 0.6], **start)
        assert over.plot().get_xlabel().endswith(f"2 of {which}"), which
    assert orbit().follow(gap=(0.29, 0.31)).plot().get_xlabel() == "gap of the stop"


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


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (
            lambda: TWO.replace(drive_amplitude=1),
            "drive_amplitude = 1 is not allowed; allowed: shape (2,), such as [1, 0]",
        ),
        (
            lambda: TWO.replace(static_load=0.5),
            "static_load = 0.5 is not allowed; allowed: shape (2,), such as [0.5, 0]",
        ),
        (
            lambda: vi.Stop(2, 0.1, 0.5),
            "normal = 2 is not allowed; allowed: one number for each coordinate, such as [0, 0, 1]",
        ),
        (
            lambda: TWO.replace(damping_ratios=[0.1]),
            "damping_ratios of shape (1,) is not allowed; allowed: shape (2,), or one number for "
            "all",
        ),
        (
            lambda: vi.Stop([0, 0], 0.1, 0.5),
            "normal = 2 zeros is not allowed; allowed: at least one entry other than 0",
        ),
        (
            lambda: TWO.replace(mass=[1, 2]),
            "mass of shape (2,) is not allowed; allowed: shape (n >= 1, n >= 1); np.diag(mass) has "
            "these numbers on its diagonal",
        ),
        (
            lambda: TWO.replace(damping=0.1),
            "damping = 0.1 is not allowed; allowed: shape (2, 2); damping_ratios= takes numbers of "
            "the modes",
        ),
        (
            lambda: TWO.replace(stiffness=csr_array(np.eye(2))),
            "stiffness of type csr_array is not allowed; allowed: a matrix of finite numbers: "
            "stiffness.toarray() gives them",
        ),
        (
            lambda: TWO.replace(gap_5=0.1),
            "gap_5 = 0.1 is not allowed; allowed: the number of a stop, 0 to 1",
        ),
        (
            lambda: SETTLING.replace(gap_1=0.1),
            "gap_1 = 0.1 is not allowed; allowed: the number of a stop, 0 to 0",
        ),
    ],
)
def test_a_number_in_place_of_numbers_says_what_to_write(call, words):
    assert refusal(call) == words


def test_one_number_stands_for_those_of_all_modes():
    for of_all, of_each in ((0.05, [0.05, 0.05]), (np.float32(0.25), [0.25, 0.25]), (0, [0, 0])):
        one = TWO.replace(damping_ratios=of_all)
        assert one == TWO.replace(damping_ratios=of_each)
        assert one.damping_ratios.tolist() == of_each
    modes = {"frequencies": [1, 3], "shapes": [[1, 1], [1, -1]], "stops": []}
    one = vi.Structure.from_modes(**modes, modal_mass=4, damping_ratios=0.1)
    assert one == vi.Structure.from_modes(**modes, modal_mass=[4, 4], damping_ratios=[0.1, 0.1])
    assert vi.Structure.from_json(one.to_json()) == one
    with pytest.raises(vi.ParameterError, match=r"^damping_ratios = True is not allowed; "):
        TWO.replace(damping_ratios=True)
    free = {"mass": [[1, 0], [0, 1]], "stiffness": [[1, -1], [-1, 1]], "stops": []}
    with pytest.raises(vi.ParameterError, match=r"damping_ratios\[0\] = 0.1 is not allowed"):
        vi.Structure(**free, damping_ratios=0.1)  # of a rigid body


# What has no structures yet says so, not that another kind of motion is wanted.
PLANE = {"drive_frequency": (1.9, 2.1), "gap": (0.2, 0.4)}


@pytest.mark.parametrize(
    "call",
    [
        lambda: vi.stability_region(orbit(), **PLANE),
        lambda: vi.unstable_manifold(orbit()),
        lambda: vi.bifurcation_curve(orbit(), **PLANE),
        lambda: vi.bifurcation_curve(
            orbit().follow(drive_frequency=(1.9, 2.2)).bifurcations[0], **PLANE
        ),
        lambda: vi.periodic_motions(SETTLING),
        lambda: vi.periodic_motion(SETTLING, initial=[[0], [0]], periods=1),
    ],
)
def test_what_knows_no_structures_says_so(call):
    assert refusal(call).endswith("; not for structures yet")


def test_a_curve_of_bifurcations_says_where_one_is_found():
    for given in (orbit(), 3):
        said = refusal(vi.bifurcation_curve, bifurcation=given, **PLANE)
        assert "a Bifurcation, such as motion.follow(...).bifurcations[0], or" in said


def test_a_branch_names_what_was_given_and_what_its_machine_has():
    assert refusal(orbit().follow, mass=(0.5, 2)) == (
        "unknown argument mass; what can vary: drive_frequency, phase, gap, restitution, friction, "
        "gap_0, restitution_0, friction_0, or with system= an argument of a function that makes "
        "the structure, such as lambda F: structure.replace(drive_amplitude=[F])"
    )
    assert "unknown argument steps, did you mean step?" in refusal(orbit().follow, steps=0.1)
    branch = orbit().follow(drive_frequency=(1.95, 2.05))
    allowed = "allowed: drive_frequency with its value, or the value alone"
    assert refusal(branch.at, gap=0.3) == f"unknown argument gap of at; {allowed}"
    with pytest.raises(vi.ParameterError) as caught:
        branch.at(2.0, drive_frequency=2.01)
    assert str(caught.value) == (
        f"at takes exactly one value, got drive_frequency = 2.0, drive_frequency = 2.01; {allowed}"
    )
    assert refusal(branch.at) == f"at takes exactly one value, got nothing; {allowed}"


def test_of_many_stops_a_message_names_the_first_and_the_last():
    many = vi.Structure([[1]], [[1]], [vi.Stop([1], 1, 1)] * 20)
    said = refusal(vi.sweep, system=many, initial=REST[1], periods=1, mass=LINE)
    assert "gap_0 ... gap_19, restitution_0 ... restitution_19, friction_0" in said
    few = refusal(vi.sweep, system=TWO, initial=REST[2], periods=1, mass=LINE)
    assert ", gap_0, gap_1, restitution_0, restitution_1, friction_0, friction_1, " in few


# On the command line.


@pytest.fixture
def rig(tmp_path):
    path = tmp_path / "rig.toml"
    assert main(["template", "structure", "--out", str(path)]) == 0
    return path


def complaint(capsys, *words):
    capsys.readouterr()
    try:
        code = main([*words])
    except SystemExit as end:
        code = end.code
    assert code == 2
    return capsys.readouterr().err


@pytest.mark.parametrize("option", ["--gap-0", "--gap_0", "--restitution-1"])
def test_numbers_of_one_stop_are_set_by_name(rig, capsys, option):
    said = complaint(capsys, "simulate", "--system", str(rig), option, "0.2")
    assert f"did you mean --set {option[2:].replace('_', '-')} X?" in said
    assert main(["simulate", "--system", str(rig), "--set", option[2:], "0.2"]) == 0


def test_without_a_file_structures_are_named(capsys):
    said = complaint(capsys, "simulate", "--gap", "0.2")
    assert "missing system parameters: drive_frequency, frequency_ratio, mass_ratio, restit" in said
    assert "--system with a file of a system or a structure, such as vibroimpact template" in said
    with pytest.raises(SystemExit):
        main(["simulate", "--help"])
    assert "a structure from a file" in capsys.readouterr().out


def test_stops_in_single_brackets_get_a_hint(rig, capsys):
    text = rig.read_text(encoding="utf-8").replace("[[structure.stops]]", "[structure.stops]")
    rig.write_text(text, encoding="utf-8")
    said = complaint(capsys, "simulate", "--system", str(rig))
    assert "not a TOML file" in said
    assert "each stop is a table [[structure.stops]], in double brackets" in said
    first, _, rest = text.partition("[structure.stops]                      # stop 1")
    rig.write_text(first + rest[rest.index("[run]") :], encoding="utf-8")
    said = complaint(capsys, "simulate", "--system", str(rig))
    assert "allowed: a table [[structure.stops]], in double brackets, for each stop" in said


def test_a_stop_that_is_none_is_told_by_its_number(rig, capsys):
    text = rig.read_text(encoding="utf-8").replace("normal = [0.0, 1.0]", "normal = [0.0, 0.0]")
    rig.write_text(text, encoding="utf-8")
    said = complaint(capsys, "simulate", "--system", str(rig))
    assert "[structure]: stops[1].normal = 2 zeros is not allowed; allowed: at least one" in said


def test_one_damping_ratio_in_a_file_is_that_of_all_modes(rig, capsys):
    text = rig.read_text(encoding="utf-8")
    main(["simulate", "--system", str(rig)])
    both = capsys.readouterr().out
    rig.write_text(text.replace("[0.05, 0.05]", "0.05        "), encoding="utf-8")
    main(["simulate", "--system", str(rig)])
    assert capsys.readouterr().out == both


def test_one_is_no_plural():
    assert [counted(count, "cell") for count in (0, 1, 2)] == ["0 cells", "1 cell", "2 cells"]
    assert [counted(count, "box", ending="es") for count in (1, 2)] == ["1 box", "2 boxes"]
