"""The explorer of machines whose restitution depends on the approach velocity."""

import numpy as np
import pytest
from matplotlib import pyplot

import vibroimpact as vi
from explorer_desk import Desk
from explorer_structures import PAIR, SMALL, arguments
from vibroimpact.explorer import compute
from vibroimpact.explorer.code import python_code
from vibroimpact.explorer.presets import DEFAULT
from vibroimpact.explorer.server import first_state
from vibroimpact.explorer.state import from_query

TABLE = vi.RestitutionTable([0.1, 1.0], [0.9, 0.5])
LAW = vi.RestitutionPowerLaw(0.9, 0.1)
FALLS = PAIR.replace(restitution_0=TABLE, restitution_1=LAW)
MACHINES = {
    "table": DEFAULT.system.replace(restitution=TABLE),
    "law": DEFAULT.system.replace(restitution=LAW),
    "stops": FALLS,
    "equal stops": PAIR.replace(restitution=TABLE),
}


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    """Make every map a small one."""
    monkeypatch.setattr(compute, "FINE", SMALL)
    monkeypatch.setattr(compute, "COARSE", SMALL)


@pytest.mark.parametrize("name", MACHINES)
def test_numbers_of_curves_have_names_ranges_and_an_address(name):
    system = MACHINES[name]
    state = first_state(system, None)
    assert state.system == system
    assert from_query(arguments(state.to_query()), state) == state
    machine = state.machine
    shown = {each for group in machine.groups.values() for each in group} - {*machine.choices}
    assert set(machine.parameters) >= shown
    assert any(each.startswith(("r_", "least_speed")) for each in shown)
    for each in machine.parameters:
        low, high = machine.span(each)
        assert low < high
        assert machine.words(each)
        assert machine.symbol(each) or "factor" in each
    number = next(each for each in machine.parameters if each.startswith("r_"))
    changed = state.replace(**{number: 0.8})
    assert changed.system == system.replace(**{number: 0.8})
    assert from_query(arguments(changed.to_query()), state) == changed


def test_words_and_symbols():
    machine = first_state(FALLS, None).machine
    assert (machine.symbol("r_1_0"), machine.words("r_1_0")) == (
        "r₁,₀",
        "restitution at knot 1 of stop 0",
    )
    assert machine.symbol("least_speed_1") == "u₀,₁"
    # No number that all have but gaps.
    assert machine._of_all == ("gap",)
    machine = first_state(MACHINES["equal stops"], None).machine
    assert machine._of_all == ("gap", "r_0", "r_1", "speed_0", "speed_1")


@pytest.mark.parametrize("name", MACHINES)
def test_sliders_and_code(name, monkeypatch, tmp_path, capsys):
    desk = Desk(first_state(MACHINES[name], None))
    number = next(each for each in desk.page.state.machine.parameters if each.startswith("r_"))
    several = name == "equal stops"
    desk.named(f"{number}_0-slider" if several else f"{number}-slider").value = 0.7
    desk.settle()
    own = f"{number}_0" if several else number
    assert desk.page.state.system == MACHINES[name].replace(**{own: 0.7})
    desk.named(own if several else number).value = "1.5"
    assert "allowed" in desk.named(f"{own}-error").text
    monkeypatch.chdir(tmp_path)
    namespace = {}
    exec(python_code(desk.page.state), namespace)
    pyplot.close("all")
    assert "motion.pdf" in capsys.readouterr().out
    [made] = [namespace[noun] for noun in ("system", "structure") if noun in namespace]
    assert made == desk.page.state.system
    there = compute.motion(desk.page.state).run.impacts["approach_velocity"]
    assert np.array_equal(namespace["run"].impacts["approach_velocity"], there)
