"""Motions of many kinds with the branches on which they lie, and simulations beside a motion."""

import functools

import numpy as np

import vibroimpact as vi
from references import reference, scene_system

REFERENCE = reference("orbits_reference.json")
PAPER = {
    "mass_ratio": 0.6,
    "frequency_ratio": 2.0,
    "restitution": 0.8,
    "gap": 0.5,
    "moment_amplitude": 1.0,
}
DAMPED = {**PAPER, "damping": (0.1, 0.1), "force_amplitude": 1.5}


def settled(**parameters):
    """Return the motion on which a run from the paper's initial state settles."""
    run = vi.simulate(vi.System(**parameters), initial=(0, 0.5, 0, 0), periods=600, keep=100)
    motion = run.refine()
    assert motion, motion
    return motion


def known(name):
    """Return a motion of the reference."""
    scene = REFERENCE[name]
    system = scene_system(scene).replace(contact=scene["contact"], law=scene["law"])
    initial = [float(value) for value in scene["stroboscopic"][0]]
    return vi.periodic_motion(system, initial=initial, periods=scene["m"])


# A motion, and the parameter over which it is followed.
CASES = {
    "one_one": (lambda: settled(**PAPER, drive_frequency=1.8), {"drive_frequency": (1.4, 2.5)}),
    "four_five": (lambda: known("9_3_four_five"), {"drive_frequency": (1.5, 1.65)}),
    "six_seven": (lambda: known("9_3_six_seven"), {"drive_frequency": (1.5, 1.65)}),
    "chatter": (lambda: known("7c_0.45"), {"drive_frequency": (0.44, 1.0)}),
    "chatter_friction": (
        lambda: settled(**DAMPED, drive_frequency=0.44, friction=0.5),
        {"drive_frequency": (0.43, 0.48)},
    ),
    "slides_and_sticks": (lambda: known("slide_crossing"), {"drive_frequency": (0.38, 0.6)}),
    "chatter_into_stick": (lambda: known("chatter_into_stick"), {"friction": (0.5, 1.5)}),
    "force": (lambda: settled(**DAMPED, drive_frequency=0.75), {"force_amplitude": (0.45, 2.85)}),
    "damping": (lambda: settled(**DAMPED, drive_frequency=0.75), {"pendulum_damping": (0, 0.5)}),
    "gap": (lambda: known("slip_reversals_stick"), {"gap": (-0.5, 0.0)}),
    "restitution": (lambda: known("slip_reversal_approach"), {"restitution": (0.36, 1.0)}),
    "friction": (lambda: known("slip_stick_restitution"), {"friction": (0.0, 2.0)}),
    "mass_ratio": (lambda: known("reversal_stick_stick"), {"mass_ratio": (0.5, 2.0)}),
    "newton": (lambda: known("newton_reversals"), {"drive_frequency": (1.535, 3.0)}),
    "direct": (lambda: known("direct"), {"drive_frequency": (0.7, 2.5)}),
    "no_impact": (lambda: known("no_impact"), {"drive_frequency": (1.45, 3.0)}),
}


@functools.cache
def motion_of_case(name):
    return CASES[name][0]()


@functools.cache
def branch_of(name):
    return vi.follow_motion(motion_of_case(name), **CASES[name][1])


def gap_of(system, states):
    tip = np.sin(states[:, 0]) if system.contact == "oblique" else states[:, 0]
    return tip - states[:, 2] - system.gap


def room_at(motion):
    """Size of the gap at t = 0."""
    return abs(gap_of(motion.system, np.array([motion.initial]))[0])


def returns(motion, perturbation):
    start = np.add(motion.initial, (0.0, perturbation, 0.0, 0.0))
    run = vi.simulate(motion.system, initial=start, periods=200 * motion.m, keep=0)
    off = np.abs(np.array(run.final_state.state) - motion.initial).max()
    return off < 1e-11 * max(1.0, np.abs(motion.return_map).max(), np.abs(start).max())
