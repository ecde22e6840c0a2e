"""Runs of structures from Python against reference data: matrices in, physical tables out.

Tolerances are those of the Rust tests (tests/data/README.md): 100 eps times the amplification of
the scene, over the approach velocity for times and velocities; 1e-9 for lasting contact.
"""

import numpy as np
import pytest

import vibroimpact as vi
from references import reference

EPS = float(np.finfo(float).eps)
# Some scenes of each file; the Rust tests take all.
SOME = slice(0, None, 5)


def numbers(values) -> np.ndarray:
    return np.array(values, dtype=float)


def complex_numbers(values) -> np.ndarray:
    return np.array([complex(*each) if isinstance(each, list) else each for each in values])


def made(scene) -> vi.Structure:
    stops = [
        vi.Stop(
            stop["normal"],
            stop["gap"],
            stop["restitution"],
            friction=stop["friction"],
            tangent=stop.get("tangent"),
            amplitude=stop["amplitude"],
            phase=stop["phase"],
        )
        for stop in scene["stops"]
    ]
    return vi.Structure(
        scene["mass"],
        scene["stiffness"],
        stops,
        damping_ratios=scene["damping_ratios"],
        static_load=scene["load"],
        drive_amplitude=complex_numbers(scene["drive_amplitude"]),
        drive_frequency=scene["drive_frequency"],
        phase=scene["phase"],
    )


SCENES = [
    pytest.param(scene, id=f"{name}-{place}")
    for name in ("structures", "structures_friction")
    for place, scene in list(enumerate(reference(f"{name}.json")))[SOME]
]


@pytest.mark.parametrize("scene", SCENES)
def test_impacts_and_sections_are_those_of_the_reference(scene):
    run = vi.simulate(made(scene), initial=scene["initial"], periods=scene["periods"])
    found, wanted = run.impacts, scene["impacts"]
    assert len(wanted) > 0
    assert found["stop"].tolist() == [row["stop"] for row in wanted]
    words = [vi.Regime(regime).name.lower() for regime in found["regime"]]
    assert words == [row["regime"] for row in wanted]
    amplification = np.maximum(numbers([row["amplification"] for row in wanted]), 1.0)
    slow = np.minimum(found["approach_velocity"], 1.0)
    time = found["period"] * run.system.drive_period + found["time_in_period"]
    for name, over in {
        "time": slow,
        "q": 1.0,
        "v_pre": slow,
        "v_post": slow,
        "impulse_normal": slow,
        "impulse_tangential": slow,
    }.items():
        exact = numbers([row[name] for row in wanted])
        got = time if name == "time" else found[name]
        level = 100 * EPS * amplification / over
        level = level if exact.ndim == 1 else level[:, None]
        assert (np.abs(got - exact) <= level * np.maximum(np.abs(exact), 1.0)).all(), name
    sections = numbers(scene["stroboscopic"])
    level = 100 * EPS * amplification.max() * np.maximum(np.abs(sections), 1.0)
    assert (np.abs(run.stroboscopic - sections) <= level).all()


CONTACT = [
    pytest.param(scene, id=str(place))
    for place, scene in list(enumerate(reference("structures_contact.json")))[::3]
]


@pytest.mark.parametrize("scene", CONTACT)
def test_contact_lasts_as_the_reference_says(scene):
    stops = []
    for stop in scene["stops"]:
        normal = np.zeros(len(scene["mass"]))
        normal[stop["coordinate"]] = stop["normal_sign"]
        stops.append(vi.Stop(normal, stop["gap"], stop["restitution"]))
    names = ("mass", "stiffness", "damping", "drive_amplitude", "drive_frequency", "phase")
    system = vi.Structure(
        stops=stops, static_load=scene["load"], **{name: scene[name] for name in names}
    )
    run = vi.simulate(system, initial=scene["initial"], periods=scene["periods"])
    sections = numbers(scene["stroboscopic"])
    error = np.abs(run.stroboscopic - sections) / np.maximum(np.abs(sections), 1.0)
    assert error.max() < 1e-9
    releases = run.contacts[run.contacts["kind"] == vi.EventKind.RELEASE]
    wanted = [row for row in scene["events"] if row["kind"] == "release"]
    assert len(wanted) > 0
    times = numbers([row["time"] for row in wanted])
    assert (np.abs(releases["time"] - times) <= 1e-9 * np.maximum(times, 1.0)).all()
    at = [stop["coordinate"] for stop in scene["stops"]]
    assert [at[stop] for stop in releases["stop"]] == [row["stop"] for row in wanted]
    # The column of closed stops tells what is left.
    for row in releases:
        assert not row["closed"][row["stop"]]
    span = run.final_state.time - run.kept_from
    assert run.time_in_contact / span == pytest.approx(scene["share_closed"], abs=1e-4)
