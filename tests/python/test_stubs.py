"""Types: the stub file names what the compiled core exports, and users see what is promised."""

import ast
import inspect
import re
import subprocess
import sys
import types
from pathlib import Path
from typing import get_args

import pytest

import vibroimpact
from vibroimpact import _core, keyword_types
from vibroimpact.orbits import call_types as orbit_calls
from vibroimpact.sweeps import call_types

STUB = ast.parse((Path(vibroimpact.__file__).parent / "_core.pyi").read_text(encoding="utf-8"))
KNOWN = {node.name: node for node in STUB.body if isinstance(node, ast.ClassDef)}
# Private ones are for type checkers: what several classes have alike.
CLASSES = {name: node for name, node in KNOWN.items() if name[0] != "_"}


def _names(body: list[ast.stmt]) -> set[str]:
    names: set[str] = set()
    for node in body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            names.add(node.target.id)
        elif isinstance(node, ast.Assign):  # members of an enum
            names |= {target.id for target in node.targets if isinstance(target, ast.Name)}
    return names


def _public(names: set[str]) -> set[str]:
    return {name for name in names if not name.startswith("_")}


def _members(name: str) -> set[str]:
    """Return the public names of a class, with those of the private one that it is made of."""
    node = KNOWN[name]
    bases = {base.id for base in node.bases if isinstance(base, ast.Name)}
    alike = (_members(base) for base in bases if base[0] == "_")
    return _public(_names(node.body)).union(*alike)


def test_module_exports():
    exported = set(_core.__all__) if hasattr(_core, "__all__") else set(dir(_core))
    assert _public(exported) == _public(_names(STUB.body))
    assert _core.__version__ == vibroimpact.__version__


@pytest.mark.parametrize("name", sorted(CLASSES))
def test_class_members(name):
    assert _public(set(vars(getattr(_core, name)))) == _members(name)


@pytest.mark.parametrize("name", sorted(CLASSES))
def test_classes_are_final(name):
    with pytest.raises(TypeError):
        types.new_class("Derived", (getattr(_core, name),))


# Slips, and what mypy calls them.
SLIPS = {
    "vi.simulate(system, initial=(0, 0.5, 0, 0), period=3)": "call-overload",
    "vi.colour": "attr-defined",
    "vi.simulate(system, initial=(0, 0, 0, 0), periods=3).refine().multipliers": "union-attr",
    "vi.simulate(system, initial=(0, 0.5, 0, 0), periods=3).labels": "attr-defined",
    "system.gap = 1": "misc",
    "vi.impact(system, x1=0, v1=1)": "call-arg",
    "vi.Regime.SLIPP": "attr-defined",
    "vi.orbits.Leg.impact(vi.Regime.REVERSAL_APROACH, 1, 1)": "attr-defined",
    "vi.orbits.Leg.impact('slip', 1, 1)": "arg-type",
    "vi.orbits.BifurcationKind.PERIOD_DOUBLNG": "attr-defined",
    "vi.System.from_physical(law='stronge', **{})": "arg-type",
    "vi.Structure([[1]], [[1]], [], damping_ratio=[0.1])": "call-arg",
    "vi.Structure([[1]], [[1]], [], law='paper')": "arg-type",
    "vi.Structure.from_modes([1], [[1]], [], mass=[[1]])": "call-arg",
    "vi.Stop([1], 0.5)": "call-arg",
    "vi.chart(system, initial=(0, 0.5, 0, 0), drive_freq=[1], gap=[1])": "call-overload",
    "vi.sweep(system, initial=(0, 0.5, 0, 0), X1=[1])": "call-overload",
    "vi.bifurcation_diagram(system, initial=(0, 0.5, 0, 0), omega=[1])": "call-overload",
    "vi.lyapunov_spectrum(system, initial=(0, 0.5, 0, 0), gaps=[1])": "call-overload",
    "vi.basins(system, x=[1], v1=[1])": "call-overload",
    "vi.motion_map(system, drive_freq=[1])": "call-arg",
    "vi.simulate(system, initial=(0, 0.5, 0, 0), periods=3, units='si')": "call-overload",
}


@pytest.fixture(scope="module")
def complaints(tmp_path_factory):
    """Return file, line and kind of what mypy --strict says of two programs of a user."""
    sources = Path(vibroimpact.__file__).parents[1]
    folder = tmp_path_factory.mktemp("user")
    # The editable install leads to the sources by a path that mypy does not follow; a package
    # that is installed as others are, it finds by itself, and does not want to be told. Read with
    # the options, and so from the cache, of `make lint`, the sources need not be read again.
    if sources.name == "site-packages":
        where = ["--strict", "--config-file=", "--follow-imports=silent"]
        cache = folder / "cache"
    else:
        root = sources.parent
        where, cache = [f"--config-file={root / 'pyproject.toml'}"], root / ".mypy_cache"
    start = "import vibroimpact as vi\n\nsystem = vi.System.from_dict({})\n"
    (folder / "slips.py").write_text(start + "\n".join(SLIPS) + "\n", encoding="utf-8")
    good = Path(__file__).with_name("typed_use.py")
    options = [*where, f"--cache-dir={cache}"]
    done = subprocess.run(
        [sys.executable, "-m", "mypy", *options, str(good), str(folder / "slips.py")],
        cwd=sources.parent,
        capture_output=True,
        text=True,
        check=False,
    )
    assert not done.stderr, done.stderr
    found = re.findall(r"(\w+\.py):(\d+): error: .*\[([\w-]+)\]$", done.stdout, re.M)
    return [(name, int(line), kind) for name, line, kind in found]


def test_what_a_user_writes_has_the_types_that_are_promised(complaints):
    assert [each for each in complaints if each[0] != "slips.py"] == []


def test_slips_of_a_user_are_found(complaints):
    expected = {("slips.py", line, kind) for line, kind in enumerate(SLIPS.values(), start=4)}
    assert {each for each in complaints if each[0] == "slips.py"} == expected


def _callables() -> dict[str, object]:
    """Everything public that can be called: functions, classes, and the methods of these."""
    modules = (vibroimpact, vibroimpact.plot, vibroimpact.sweeps, vibroimpact.orbits)
    public = {name: getattr(module, name) for module in modules for name in module.__all__}
    found = {name: thing for name, thing in public.items() if inspect.isfunction(thing)}
    for cls in filter(inspect.isclass, public.values()):
        for name, member in vars(cls).items():
            bare = getattr(member, "__func__", getattr(member, "fget", member))
            is_own = inspect.isfunction(bare) and bare.__module__.startswith("vibroimpact")
            if is_own and (not name.startswith("_") or name == "__init__"):
                found[f"{cls.__name__}.{name}"] = bare
    return found


def test_every_parameter_and_result_has_a_type():
    callables = _callables()
    assert len(callables) > 100
    for name, function in callables.items():
        signature = inspect.signature(function)
        bare = [
            parameter.name
            for parameter in signature.parameters.values()
            if parameter.name not in ("self", "cls") and parameter.annotation is parameter.empty
        ]
        assert bare == [], name
        assert signature.return_annotation is not signature.empty, name


def _keywords(function: object) -> set[str]:
    return {
        parameter.name
        for parameter in inspect.signature(function).parameters.values()
        if parameter.kind is parameter.KEYWORD_ONLY
    }


@pytest.mark.parametrize(
    ("function", "call", "apart"),
    [
        (vibroimpact.sweep, call_types.SweepCall, {"initial", "units"}),
        (vibroimpact.chart, call_types.ChartCall, {"initial", "units"}),
        (vibroimpact.bifurcation_diagram, call_types.DiagramCall, {"initial", "units"}),
        (vibroimpact.lyapunov_spectrum, call_types.LyapunovCall, {"initial", "units"}),
        (vibroimpact.follow_motion, orbit_calls.FollowCall, {"system", "units"}),
        (vibroimpact.switch_branch, orbit_calls.SwitchCall, {"system", "units"}),
        (vibroimpact.bifurcation_curve, orbit_calls.CurveCall, {"system", "units"}),
        (vibroimpact.stability_region, orbit_calls.CurveCall, {"system", "units"}),
    ],
)
def test_keywords_for_type_checkers_are_those_of_the_call(function, call, apart):
    assert set(call.__annotations__) == _keywords(function) - apart


def test_what_can_be_varied_is_listed_for_completion():
    listed = set(_core.PARAMETERS)
    for function in (vibroimpact.chart, vibroimpact.follow_motion, vibroimpact.System.replace):
        assert listed <= _keywords(function)
    assert listed | {"x1", "v1", "x2", "v2"} <= _keywords(vibroimpact.sweep)
    assert set(keyword_types.Parameters.__annotations__) == listed
    assert set(keyword_types.Ranges.__annotations__) == listed
    assert get_args(keyword_types.Law) == _core.LAWS
    assert get_args(keyword_types.CoulombLaw) == _core.COULOMB_LAWS
    assert get_args(keyword_types.Simultaneous) == _core.SIMULTANEOUS
    assert get_args(keyword_types.Contact) == _core.CONTACTS
