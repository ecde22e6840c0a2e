"""A wrong name gets the name that was meant: in calls, in files, on the command line."""

import inspect
import re

import numpy as np
import pytest

import vibroimpact as vi
from small_results import branch, motion
from two_masses import structure
from vibroimpact import hints
from vibroimpact.cli import main
from vibroimpact.restitution import MEANINGS
from vibroimpact.sweeps.machines import machine_of
from vibroimpact.system import SYMBOLS

REQUIRED = {
    "mass_ratio": 0.6,
    "frequency_ratio": 2.0,
    "restitution": 0.8,
    "gap": 0.5,
    "drive_frequency": 1.8,
}
SYSTEM = vi.System(**REQUIRED, moment_amplitude=1.0)
START = (0.0, 0.5, 0.0, 0.0)
RUN = vi.simulate(SYSTEM, initial=START, periods=6)
HEARD = vi.measure(RUN, "impact_times", noise=0.01)
STRUCTURE = structure()
REST = np.zeros((2, STRUCTURE.coordinates))


@pytest.mark.parametrize(
    ("call", "meant"),
    [
        (lambda: vi.simulate(SYSTEM, initial=START, period=3), "periods"),
        (lambda: vi.simulate(SYSTEM, x0=START, periods=3), "initial"),
        (lambda: vi.simulate(SYSTEM, initial=START, duration=3.0), "time"),
        (lambda: vi.simulate(SYSTEM, initial=START, periods=3, threads=2), "workers"),
        (lambda: vi.impact(SYSTEM, x=0.1, v1=1.0, v2=0.0), "x1"),
        (lambda: vi.periodic_motion(SYSTEM, initial=START, period=1), "periods"),
        (lambda: RUN.trajectory([1.0], force=True), "forces"),
        (lambda: RUN.resume(period=3), "periods"),
        (lambda: RUN.plot(perods=3), "periods"),
        (lambda: SYSTEM.plot(phse=0.0), "phase"),
        (lambda: vi.fit(HEARD, SYSTEM, names=["gap"], initial=START), "unknown"),
        (lambda: vi.expected_errors(RUN, HEARD, parameters=["gap"]), "unknown"),
        (lambda: vi.System(**REQUIRED, mu=0.1), "friction"),
        (lambda: SYSTEM.replace(omega=2.0), "drive_frequency"),
        (lambda: vi.System.from_physical(M1=1.0), "pendulum_mass"),
        (lambda: vi.System.from_physical(K1=1.0), "torsional_stiffness"),
        (lambda: vi.System.from_physical(K2=1.0), "stiffness"),
    ],
)
def test_a_call_says_which_keyword_was_meant(call, meant):
    with pytest.raises(
        TypeError, match=rf"unexpected keyword argument '\w+', did you mean {meant}\?$"
    ):
        call()


def test_quantities_in_si_lead_to_the_call_that_takes_them():
    fields = inspect.signature(vi.System).parameters
    physical = inspect.signature(vi.System.from_physical).parameters
    assert {name for name in physical if name not in fields} == hints.IN_SI
    for name in (*hints.IN_SI, "M1", "K2"):
        with pytest.raises(TypeError, match=r"a quantity in SI units: System\.from_physical"):
            vi.System(**{name: 1.0})
        with pytest.raises(vi.ParameterError, match=r"sweeps .* vary it with units='SI'"):
            vi.bifurcation_diagram(SYSTEM, initial=START, **{name: [1.0]})
    # A structure has a stiffness of its own.
    with pytest.raises(TypeError, match="did you mean stiffness"):
        vi.Structure([[1]], K=[[1]], stops=[])


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (
            lambda: vi.simulate(SYSTEM, START, 3),
            "simulate() takes only system without a name, but 3 were given so; "
            "give by name: initial=, periods=, ",
        ),
        (lambda: vi.System(0.6, 2.0), "System() takes no argument without a name, but 2 were"),
        (lambda: RUN.resume(3), "resume() takes no argument without a name, but 1 were given so; "),
        (
            lambda: vi.bifurcation_diagram(SYSTEM, [1.0]),
            "takes only system without a name, but 2 were given so; give by name: initial=, ",
        ),
        (lambda: vi.plot.chart(RUN, "label"), "chart() takes only chart without a name"),
    ],
)
def test_values_without_a_name_are_told_the_names(call, said):
    with pytest.raises(TypeError, match=re.escape(said)):
        call()


def test_a_table_tells_how_its_columns_are_read():
    for name, meant in (("v1_pre", "v1_pre"), ("v_pre", "v1_pre"), ("aproach_velocity", None)):
        wanted = meant or "approach_velocity"
        with pytest.raises(AttributeError, match=rf"{name}', did you mean \['{wanted}'\]\?; the"):
            getattr(RUN.impacts, name)
        assert not hasattr(RUN.impacts, name)
    with pytest.raises(AttributeError, match="the columns: time, period"):
        RUN.impacts.zzz  # noqa: B018
    assert RUN.impacts.shape == np.asarray(RUN.impacts).shape


def test_a_figure_that_is_not_there_says_which_was_meant():
    with pytest.raises(AttributeError, match=r"no attribute 'bifurcations', did you mean bifurca"):
        vi.plot.bifurcations  # noqa: B018
    assert not hasattr(vi.plot, "_zzz")


@pytest.mark.parametrize(
    "draw", [vi.plot.time_history, vi.plot.gap_history, vi.plot.phase_portrait]
)
@pytest.mark.parametrize("window", [(500.0, 600.0), (-1.0, 2.0)])
def test_a_window_that_is_not_kept_is_named(draw, window):
    with pytest.raises(vi.ParameterError, match=r"^window = .* times in the kept window"):
        draw(RUN, window=window)


def test_a_proof_says_how_a_run_becomes_a_motion():
    with pytest.raises(vi.ParameterError, match=r"^motion = <Run .* as run\.refine\(\) gives it; "):
        vi.prove(RUN)


# `publication_style` takes nothing.
DRAWING = [
    name
    for name in vi.plot.__all__
    if inspect.isfunction(getattr(vi.plot, name)) and name != "publication_style"
]


@pytest.mark.parametrize("name", DRAWING)
def test_a_drawing_function_says_which_keyword_was_meant(name):
    function = getattr(vi.plot, name)
    known = [*inspect.signature(function).parameters][-1]
    with pytest.raises(TypeError, match=rf"'{known}x', did you mean {known}\?$"):
        function(**{f"{known}x": None})
    with pytest.raises(TypeError, match="unexpected keyword argument 'zzz'; known: "):
        function(zzz=None)


@pytest.mark.parametrize(
    ("call", "meant"),
    [
        (lambda: vi.chart(SYSTEM, initial=START, omega=[1.0], gap=[1.0]), "drive_frequency"),
        (lambda: vi.sweep(SYSTEM, initial=START, mu=[0.1]), "friction"),
        (lambda: vi.bifurcation_diagram(SYSTEM, initial=START, r=[0.1]), "restitution"),
        (lambda: vi.lyapunov_spectrum(SYSTEM, initial=START, delta=[0.1]), "gap"),
        (lambda: vi.bifurcation_diagram(SYSTEM, initial=START, period=9, gap=[1.0]), "periods"),
        (lambda: vi.follow_motion(RUN.refine(), omega=(1.0, 2.0)), "drive_frequency"),
        (lambda: vi.System.from_dict(REQUIRED | {"f1": 1.0}), "moment_amplitude"),
    ],
)
def test_what_varies_is_known_by_its_symbol(call, meant):
    with pytest.raises(vi.ParameterError, match=rf"did you mean {meant}\?"):
        call()


def test_every_symbol_is_known():
    for symbol, name in SYMBOLS.items():
        with pytest.raises(TypeError, match=rf"did you mean {name}\?$"):
            vi.System(**REQUIRED, **{symbol: 1.0})


def test_a_name_that_is_like_none_lists_all():
    with pytest.raises(TypeError, match=r"'qqq'; known: system, initial, periods, time"):
        vi.simulate(SYSTEM, initial=START, qqq=3)


def test_a_type_error_inside_a_call_stays_what_it_is():
    with pytest.raises(TypeError, match="missing 1 required keyword-only argument: 'initial'"):
        vi.simulate(SYSTEM, periods=3)
    with pytest.raises(TypeError, match=r"concatenate|unsupported"):
        vi.sweep(lambda gap: gap + "x", initial=START, gap=[1.0])


def test_other_names_lead_to_arguments_that_exist():
    taken = {
        name
        for call in (
            vi.System,
            vi.System.from_physical,
            vi.Structure,
            vi.Stop,
            vi.simulate,
            vi.sweep,
            vi.fit,
        )
        for name in inspect.signature(call).parameters
    }
    taken |= {*machine_of(structure()).coordinates, *MEANINGS}
    for names in hints._OTHER_NAMES.values():
        assert set(names) <= taken


def test_the_restitution_of_a_curve_has_numbers():
    table = vi.RestitutionTable([0.1, 1], [0.9, 0.5])
    run = vi.simulate(SYSTEM.replace(restitution=table), initial=START, periods=2)
    with pytest.raises(vi.ParameterError, match=r"did you mean r_0\?"):
        run.sensitivity("restitution")


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        ("simulate --restituton 0.3", "--restituton, did you mean --restitution?"),
        ("simulate --sytem a.toml", "--sytem, did you mean --system?"),
        ("simulate --omega=2", "--omega, did you mean --drive-frequency?"),
        ("diagram --vry gap 0 1 2", "--vry, did you mean --vary?"),
        ("simulate --max_evnts 3", "--max-evnts, did you mean --max-events?"),
        ("diagrm --vary gap 0 1 2", "'diagrm', did you mean diagram?"),
        ("lyapunow", "'lyapunow', did you mean lyapunov?"),
    ],
)
def test_the_command_line_says_what_was_meant(words, hint, capsys):
    with pytest.raises(SystemExit) as caught:
        main(words.split())
    assert caught.value.code == 2
    assert hint in capsys.readouterr().err


def test_abbreviations_and_negative_numbers_are_no_wrong_options(capsys):
    numbers = "--mass-r 0.6 --frequency-r 2 --restit 0.8 --gap 0.5 --drive-f 1.8 --phase -1e-1"
    assert main(f"simulate {numbers} --initial -1e-1 0 0 0 --periods 3".split()) == 0
    assert "unrecognized" not in capsys.readouterr().err


def test_a_system_file_knows_the_symbols(tmp_path, capsys):
    path = tmp_path / "a.toml"
    path.write_text("[system]\nomega = 2.0\n", encoding="utf-8")
    assert main(["simulate", "--system", str(path), "--initial", "0", "0", "0", "0"]) == 2
    assert "omega, did you mean drive_frequency?" in capsys.readouterr().err


def test_hints_do_not_change_what_a_call_gives():
    again = vi.simulate(SYSTEM, initial=START, periods=6)
    assert np.array_equal(again.impacts, RUN.impacts)
    assert re.fullmatch(r"[\d-]+|unresolved", RUN.label)


@pytest.mark.parametrize(
    "name",
    ["impact_agreement", "impact_regimes", "motion_branches", "motion_space", "stability_map"],
)
def test_a_drawing_of_another_kind_of_result_names_what_draws_it(name):
    with pytest.raises(vi.ParameterError, match=r"what draws a Run in vibroimpact\.plot: time_h"):
        getattr(vi.plot, name)(RUN)


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("solve", "simulate"),
        ("lyapunov", "lyapunov_spectrum"),
        ("basins_of_attraction", "basins"),
        ("find_periodic_orbit", "periodic_motion"),
        ("animate", "plot.animation, or run.animate()"),
        ("poincare", "plot.impact_section or plot.stroboscopic"),
        ("ImpactOscillator", "System"),
        ("bifurcation_diagramm", "bifurcation_diagram"),
    ],
)
def test_a_name_that_the_package_does_not_have_is_answered_by_one_that_it_has(name, meant):
    with pytest.raises(AttributeError, match=re.escape(f"{name!r}, did you mean {meant}?")):
        getattr(vi, name)
    for each in re.findall(r"(?:plot\.)?[a-zA-Z_]+", meant.split(",")[0].replace(" or ", " ")):
        found = vi
        for part in each.split("."):
            found = getattr(found, part)


def test_a_name_that_means_nothing_gets_no_hint():
    with pytest.raises(AttributeError, match=r"has no attribute 'zzz'$"):
        _ = vi.zzz
    assert not hasattr(vi, "__wrapped__")


def test_completion_shows_public_names_only():
    assert {name for name in dir(vi) if name[:2] != "__"} == set(vi.__all__) - {"__version__"}


def diagram():
    return vi.bifurcation_diagram(SYSTEM, initial=START, periods=20, gap=[0.5, 0.6])


@pytest.mark.parametrize(
    ("name", "attribute", "meant"),
    [
        ("run", "t", "trajectory(times)"),
        ("run", "states", "trajectory(times)"),
        ("run", "imapcts", "impacts"),
        ("motion", "eigenvalues", "multipliers"),
        ("diagram", "to_csv", "to_pandas().to_csv(path)"),
        ("diagram", "at", "run"),
        ("diagram", "states", "final_states"),
        ("system", "omega", "drive_frequency"),
    ],
)
def test_an_attribute_that_an_object_does_not_have_is_answered_by_one_that_it_has(
    name, attribute, meant
):
    made = {"run": lambda: RUN, "motion": motion, "diagram": diagram, "system": lambda: SYSTEM}
    thing = made[name]()
    kind = type(thing).__name__
    said = f"{kind!r} object has no attribute {attribute!r}, did you mean {meant}?"
    with pytest.raises(AttributeError, match=f"^{re.escape(said)}$"):
        getattr(thing, attribute)
    assert not hasattr(thing, attribute)
    assert hasattr(thing, meant.partition("(")[0])


@pytest.mark.parametrize(
    ("name", "attribute", "meant"),
    [
        ("run", "x1", "impacts['x1']"),
        ("run", "u", "impacts['approach_velocity']"),
        ("motion", "v1", "impacts['v1_pre']"),
        ("motions", "x1", "motions[0].impacts['x1']"),
        ("map", "v1_pre", "solutions['v1']"),
    ],
)
def test_a_column_of_a_table_is_no_attribute_of_what_has_the_table(name, attribute, meant):
    made = {"run": lambda: RUN, "motion": motion, "motions": lambda: vi.periodic_motions(SYSTEM)}
    made["map"] = lambda: vi.motion_map(SYSTEM, drive_frequency=[1.8])
    with pytest.raises(AttributeError, match=re.escape(f"did you mean {meant}?")):
        getattr(made[name](), attribute)


def fresh(kind):
    """A result whose table nobody has asked for yet."""
    made = {
        "run": lambda: vi.simulate(SYSTEM, initial=START, periods=6),
        "structure": lambda: vi.simulate(STRUCTURE, initial=REST, periods=6),
        "motion": lambda: RUN.refine(),
        "diagram": lambda: vi.bifurcation_diagram(
            STRUCTURE, initial=REST, periods=20, drive_frequency=[1.2, 1.3], labels=False
        ),
    }
    return made[kind]()


@pytest.mark.parametrize("kind", ["run", "structure", "motion", "diagram"])
def test_a_name_that_is_none_builds_no_table(kind, monkeypatch):
    thing = fresh(kind)
    column = "regime"
    with monkeypatch.context() as patch:
        # A table that is built is either kept, or built by this property again.
        patch.setattr(type(thing), "impacts", property(lambda _: pytest.fail("built")))
        assert not hasattr(thing, "nonsense")
        with pytest.raises(AttributeError, match=rf"did you mean impacts\['{column}'\]\?$"):
            getattr(thing, column)
    assert "impacts" not in vars(thing)
    # What the hint knows is what the table has.
    assert set(thing._columns()["impacts"]) == set(thing.impacts.dtype.names)


def test_a_name_that_is_none_judges_no_motion_of_a_branch(monkeypatch):
    found = branch()
    with monkeypatch.context() as patch:
        patch.setattr(type(found.pieces[0]), "motion", lambda *_: pytest.fail("judged"))
        assert not hasattr(found, "nonsense")
        with pytest.raises(AttributeError, match=r"did you mean motions\[0\]\.impacts\['x1'\]"):
            found.x1  # noqa: B018
    assert found.motions[0].impacts["x1"].ndim == 1


def test_derivatives_of_impacts_are_no_table():
    with pytest.raises(AttributeError, match=r"no attribute 'x1'$"):
        RUN.sensitivity("gap").x1  # noqa: B018


def test_an_attribute_that_means_nothing_gets_no_hint():
    for name in ("zzz", "_impacts_", "__array__"):
        with pytest.raises(AttributeError, match=f"no attribute '{name}'$"):
            getattr(RUN, name)


def test_a_property_that_fails_keeps_its_own_error():
    class Broken(type(RUN)):
        @property
        def lable(self):
            raise AttributeError("of the inside")

    with pytest.raises(AttributeError, match=r"^of the inside$"):
        getattr(Broken.__new__(Broken), "lable")  # noqa: B009


@pytest.mark.parametrize(
    ("kind", "meant"),
    [
        *[("fold", "saddle_node"), ("LP", "saddle_node"), ("flip", "period_doubling")],
        *[("Flip", "period_doubling"), ("pd", "period_doubling"), ("period doubling", None)],
        *[("hopf", "neimark_sacker"), ("NS", "neimark_sacker"), ("pitchfork", "branch_point")],
    ],
)
def test_a_kind_of_bifurcation_is_known_by_its_other_names(kind, meant):
    motion = RUN.refine()
    said = rf"did you mean {meant or 'period_doubling'}\?$"
    for asked in (kind, ["grazing", kind]):
        with pytest.raises(vi.ParameterError, match=said):
            motion.follow(drive_frequency=(1.79, 1.81), stop_at=asked)
    branch = motion.follow(drive_frequency=(1.799, 1.801), max_points=2)
    with pytest.raises(vi.ParameterError, match=said):
        branch.of_kind(kind)
    for wrong in (5, [5], None):
        with pytest.raises(vi.ParameterError, match="one or several of saddle_node"):
            motion.follow(drive_frequency=(1.79, 1.81), stop_at=wrong)
