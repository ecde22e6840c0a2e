"""Proofs of short branches, made once: for tests of what they show, and of their certificates."""

from functools import cache

import numpy as np

import vibroimpact as vi

START = (0, 0.5, 0, 0)
KNOWN = {"mass_ratio": 0.6, "frequency_ratio": 2, "restitution": 0.8, "gap": 0.5}


@cache
def branch(damping: float = 0.0, low: float = 1.5, high: float = 1.9, friction: float = 0.0):
    """The 1-1 motions of the paper's system over the drive's frequency."""
    system = vi.System(
        **KNOWN,
        drive_frequency=1.8,
        moment_amplitude=1,
        damping=(damping, damping),
        friction=friction,
    )
    motion = vi.simulate(system, initial=START, periods=600, keep=100).refine()
    return motion.follow(drive_frequency=(low, high))


@cache
def damped_proof():
    """One that is stable throughout."""
    return vi.prove(branch(0.05, 1.797, 1.803))


@cache
def gap_branch():
    """A branch of a structure over the place of its stop."""
    structure = vi.Structure(
        [[1, 0], [0, 1]],
        [[2, -1], [-1, 2]],
        [vi.Stop([0, 1], 0.3, 0.7)],
        damping_ratios=[0.05, 0.05],
        drive_amplitude=[1, 0],
        drive_frequency=1.3,
    )
    motion = vi.simulate(structure, initial=np.zeros((2, 2)), periods=600, keep=100).refine()
    return motion.follow(gap_0=(0.29, 0.31))


@cache
def gap_proof():
    """Two masses and one stop, over a short range."""
    return vi.prove(gap_branch(), within=(0.29999, 0.30001))


@cache
def neimark_sacker_proof():
    """About a Neimark-Sacker bifurcation of the undamped system."""
    value = branch().bifurcations[6].value
    return vi.prove(branch(), within=(value - 1e-8, value + 1e-8))


@cache
def short_proof():
    """Two tubes at the beginning of a branch of a structure."""
    return vi.prove(gap_branch(), max_tubes=2)


@cache
def turned_proof():
    """From the saddle-node of the undamped system to its period doubling, on both sides."""
    turn, doubling = (branch().bifurcations[k].value for k in (3, 4))
    return vi.prove(branch(), within=(turn - 1e-7, doubling + 1e-6))


@cache
def grazing_proof():
    """An oscillator with one stop, through where it does not reach it any more."""
    oscillator = vi.Structure(
        [[1]],
        [[1]],
        [vi.Stop([1], 0.3, 0.8)],
        damping_ratios=[0.05],
        drive_amplitude=[1],
        drive_frequency=2.0,
    )
    motion = vi.simulate(oscillator, initial=[[0], [0]], periods=200, keep=50).refine()
    return vi.prove(motion.follow(gap=(0.28, 0.34)), within=(0.33, 0.34))
