"""The ring of ten cells with twenty contacts, as docs/other-peoples-systems.md has it.

Structure and time stepping are those of the page; here the steps become finer, and the exact motion
is asked what no stepping can be: free of penetration, with momentum and energy accounted for.
"""

from typing import Any

import numpy as np
import pytest

import repository
import vibroimpact as vi
from test_docs import blocks

PAGE = repository.root() / "docs" / "other-peoples-systems.md"


@pytest.fixture(scope="module")
def ring() -> dict[str, Any]:
    names: dict[str, Any] = {"np": np, "vi": vi}
    for mark in ("ring = vi.Structure(", "def moreau("):
        (block,) = (block for block in blocks(PAGE) if mark in block)
        exec(block, names)
    return names


def differences(ring, periods, steps):
    """The largest difference between stepping and exact motion in the cells, and in the sinks."""
    run = vi.simulate(ring["ring"], initial=ring["start"], periods=periods)
    path = ring["moreau"](ring["ring"], ring["start"], periods, steps)
    exact = run.trajectory(np.linspace(0, run.final_state.time, len(path)))[:, 0]
    away = abs(path - exact).max(axis=0)
    return away[: ring["cells"]].max(), away[ring["cells"] :].max()


def test_the_stepping_comes_to_the_exact_motion_with_the_order_of_its_scheme(ring):
    found = np.array([differences(ring, 4, steps) for steps in (100, 400, 1600)])
    ratios = found[:-1] / found[1:]
    # An impact is late by part of a step: first order. Four times finer, two times over.
    assert found[0].max() > 0.05  # there is something to be seen
    assert (np.sqrt(ratios[0] * ratios[1]) > 3).all(), found


def test_without_impacts_it_is_of_second_order(ring):
    free = ring["ring"].replace(gap=1e3)
    found = []
    for steps in (50, 200):
        run = vi.simulate(free, initial=ring["start"], periods=2)
        path = ring["moreau"](free, ring["start"], 2, steps)
        exact = run.trajectory(np.linspace(0, run.final_state.time, len(path)))[:, 0]
        found.append(abs(path - exact).max())
    assert not len(run.impacts)
    assert found[0] / found[1] == pytest.approx(16, rel=0.1)


def test_the_exact_motion_stays_within_the_cavities_and_keeps_momentum(ring):
    run = vi.simulate(ring["ring"], initial=ring["start"], periods=60)
    assert run.stop_reason == "completed"
    assert len(run.impacts) > 300
    q = run.trajectory(np.linspace(0, run.final_state.time, 60_000))[:, 0]
    within = abs(q[:, : ring["cells"]] - q[:, ring["cells"] :]).max() / ring["G"]
    assert within < 1 + 1e-12
    masses = ring["ring"].mass.diagonal()
    jump = (run.impacts["v_post"] - run.impacts["v_pre"]) * masses
    pairs = jump.reshape(-1, 2, ring["cells"])
    size = abs(jump).max()
    assert abs(pairs.sum(axis=1)).max() < 1e-12 * size  # cell and sink push each other alone
    lost = 0.5 * (masses * (run.impacts["v_pre"] ** 2 - run.impacts["v_post"] ** 2)).sum(axis=1)
    reduced = 1 / (1 / masses[0] + 1 / masses[-1])
    known = 0.5 * reduced * (1 - 0.8**2) * run.impacts["approach_velocity"] ** 2
    assert abs(lost - known).max() < 1e-11 * known.max()
