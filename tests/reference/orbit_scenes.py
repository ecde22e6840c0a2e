"""Periodic motions of tests/data/orbits_reference.json, and from where Newton's method starts.

    python -m reference.regenerate orbits_reference.json --write     (in tests)

The paper's named motions, those it shows with lasting contact, unstable ones, and one for each
regime of impact and mode of contact (docs/theory.md, sections 4 and 5). Starts were found by
simulation in double precision, unstable ones by Newton's method from random states. Parameters
are float64. `n` is the number of impacts expected, None with chatter.
"""

from __future__ import annotations

from dataclasses import dataclass

from vibroimpact.reference.flight import System

from .orbits import Orbit, find

#: Sections 4.1 and 4.2 of the paper.
BASE = {
    "mbar": 0.6, "omega0": 2.0, "r": 0.8, "delta": 0.5, "zeta1": 0.0, "zeta2": 0.0,
    "f1": 1.0, "f2": 0.0, "omega": 1.0, "mu": 0.0,
}  # fmt: skip
_FIG7C = {"zeta1": 0.1, "zeta2": 0.1, "f2": 1.5}
_FIG9_3 = {"omega": 1.5752, "mu": 0.5}
_WALL = {"mbar": 0.0, "omega0": 1.0}


@dataclass(frozen=True)
class OrbitScene:
    """Changes to BASE, m, n, a state near the orbit at t = 0; law, contact, forcing phase."""

    changes: dict[str, float]
    m: int
    n: int | None
    start: tuple[float, float, float, float]
    law: str = "poisson"
    contact: str = "oblique"
    phase: float = 0.0

    def parameters(self) -> dict[str, float]:
        """The ten numbers."""
        return BASE | self.changes

    def find(self, *, finer: bool) -> Orbit:
        """The orbit at one of the two settings."""
        return find(
            System.parse(self.parameters(), self.contact),
            self.start,
            self.m,
            phase=self.phase,
            law=self.law,
            finer=finer,
        )


SCENES: dict[str, OrbitScene] = {
    # the paper's named motions
    "5a": OrbitScene(
        {"omega": 1.25},
        1, 1, (0.8127442368, 0.4453097774, 0.8919958019, 0.2302807255),
    ),
    "5b": OrbitScene(
        {"omega": 1.8},
        1, 1, (0.424518319, -0.5349425608, -0.06225144382, 0.4240095989),
    ),
    "5c": OrbitScene(
        {"omega": 2.75, "f1": 1.5},
        2, 1, (0.4013764522, 0.3542788692, 1.517664123, 0.1615887278),
    ),
    "6a": OrbitScene(
        {"omega": 0.73, "f1": 2.3},
        1, 2, (0.3359894943, -0.03082310066, 0.4059719961, 0.009312991673),
    ),
    "6b": OrbitScene(
        {"omega": 1.1},
        2, 4, (0.2284681489, -0.5661789524, 1.239813652, 0.5175102811),
    ),
    "6c": OrbitScene(
        {"omega": 2.56},
        8, 6, (-0.1811608986, -0.07836682372, 1.672189183, 0.1849891707),
    ),
    "9_1": OrbitScene(
        _FIG7C | {"omega": 0.75},
        1, 3, (0.2147551385, 0.2779909204, 1.469085511, 0.6718197496),
    ),
    "9_3_six_seven": OrbitScene(
        _FIG9_3,
        6, 7, (-0.5719297421, -0.3530153819, -0.3548360593, 0.443044194),
    ),
    "9_3_four_five": OrbitScene(
        _FIG9_3,
        4, 5, (-0.5481382498, -0.08276153366, -0.3299137735, 0.2340987269),
    ),
    # unstable motions beside them
    "9_3_one_one": OrbitScene(
        _FIG9_3,
        1, 1, (0.194516234, -0.55137899, -0.1431971605, 0.5212731334),
    ),
    "9_3_two_three": OrbitScene(
        _FIG9_3,
        2, 3, (0.6119516884, -0.505675378, 0.2397655727, 1.193100991),
    ),
    "6b_one_two": OrbitScene(
        {"omega": 1.1},
        1, 2, (0.3091551539, -0.2765791107, 1.346425511, 0.5147998364),
    ),
    "6b_one_one": OrbitScene(
        {"omega": 1.1},
        1, 1, (0.6285191789, 0.137476527, 0.6414825226, 0.08034662916),
    ),
    "6c_one_one": OrbitScene(
        {"omega": 2.56},
        1, 1, (-0.7853633992, 0.06928881867, 0.4156073995, -0.01824809196),
    ),
    "6c_two_one": OrbitScene(
        {"omega": 2.56},
        2, 1, (-0.4433596684, 0.08843197293, 0.04756164404, 0.1288938121),
    ),
    # impacts of every regime, damped, both bodies driven
    "slip": OrbitScene(
        {"mbar": 2.0, "omega0": 1.5, "r": 0.6, "delta": -0.2, "zeta1": 0.05, "zeta2": 0.05,
         "f1": 1.3, "f2": 0.1, "omega": 1.06, "mu": 0.2},
        1, 3, (1.021548823, 0.318743152, 1.315240563, 0.1198378209),
    ),
    "slip_reversal_approach": OrbitScene(
        {"omega0": 2.5, "r": 0.7, "delta": -0.2, "zeta1": 0.02, "zeta2": 0.05, "f1": 0.8,
         "f2": 0.2, "omega": 1.92, "mu": 0.9},
        1, 2, (-0.1927372348, 0.4621369935, 0.2193874515, 0.1887746359),
    ),
    "slip_stick_restitution": OrbitScene(
        {"mbar": 2.0, "omega0": 1.5, "r": 0.5, "delta": -0.2, "zeta1": 0.1, "zeta2": 0.1,
         "f1": 3.9, "f2": 1.3, "omega": 1.05, "mu": 1.3},
        1, 2, (1.541826339, 1.765896346, 2.199846962, 1.324858301),
    ),
    "reversal_stick_stick": OrbitScene(
        {"omega0": 1.0, "r": 0.7, "delta": 0.0, "zeta1": 0.02, "zeta2": 0.05, "f1": 3.0,
         "f2": 1.4, "omega": 0.59, "mu": 1.3},
        1, 3, (4.590134555, 2.487687599, 1.80254902, 0.382405753),
    ),
    "slip_reversals_stick": OrbitScene(
        {"mbar": 0.2, "omega0": 2.5, "r": 0.9, "delta": -0.2, "zeta1": 0.05, "zeta2": 0.02,
         "f1": 2.4, "f2": 1.2, "omega": 1.06, "mu": 0.2},
        2, 7, (0.7550688014, 0.1271887872, 1.3868457, -0.01407241465),
    ),
    # the other laws
    "newton_reversals": OrbitScene(
        {"mbar": 0.2, "omega0": 2.5, "r": 0.5, "delta": -0.2, "zeta1": 0.1, "zeta2": 0.02,
         "f1": 3.1, "f2": 0.3, "omega": 1.83, "mu": 0.9},
        1, 3, (-0.2823062669, 1.243075503, 0.03528815188, 0.150067512), law="newton",
    ),
    "newton_reversal": OrbitScene(
        {"mbar": 0.2, "omega0": 2.5, "r": 0.3, "zeta1": 0.02, "zeta2": 0.05, "f1": 3.9,
         "f2": 0.1, "omega": 2.11, "mu": 0.4},
        1, 1, (0.4234382239, -0.5966253293, 0.09487251443, 0.4932213871), law="newton",
    ),
    "newton_stick_approach": OrbitScene(
        {"omega0": 2.5, "r": 0.7, "delta": 0.0, "zeta1": 0.1, "zeta2": 0.02, "f1": 3.0,
         "f2": 0.3, "omega": 2.89, "mu": 0.4},
        2, 2, (-0.1102590401, 3.428728789, 1.780613425, -1.27330346), law="newton",
    ),
    "newton_stick_restitution": OrbitScene(
        {"mbar": 0.2, "omega0": 2.5, "r": 0.7, "zeta1": 0.1, "zeta2": 0.1, "f1": 1.6, "f2": 1.1,
         "omega": 1.37, "mu": 0.6},
        1, 3, (-0.2805650189, 2.947356781, -0.7204386055, 1.82707052), law="newton",
    ),
    "energetic_reversals": OrbitScene(
        {"omega0": 1.0, "r": 0.6, "delta": 0.3, "zeta1": 0.1, "zeta2": 0.05, "f1": 3.3,
         "f2": 1.6, "omega": 0.62, "mu": 0.4},
        1, 3, (3.384929402, 3.326764665, 2.299828781, 1.580042996), law="energetic",
    ),
    "energetic_stick_approach": OrbitScene(
        {"mbar": 0.2, "omega0": 1.5, "r": 0.6, "delta": 0.1, "zeta1": 0.1, "zeta2": 0.1,
         "f1": 3.4, "f2": 1.2, "omega": 1.16, "mu": 1.3},
        1, 2, (1.485635096, 2.437460573, 1.074420152, 1.054044845), law="energetic",
    ),
    "energetic_stick_restitution": OrbitScene(
        {"mbar": 0.2, "r": 0.7, "zeta1": 0.1, "zeta2": 0.05, "f1": 3.2, "f2": 1.4,
         "omega": 0.87, "mu": 0.4},
        1, 3, (1.140305048, 0.6328621774, 1.509917143, 1.033964626), law="energetic",
    ),
    # no impact
    "no_impact": OrbitScene(
        {"omega": 2.7, "f1": 1.2, "f2": 0.7, "zeta1": 0.03, "zeta2": 0.06, "mu": 0.1},
        1, 0, (-0.2533722996, 0.7017979922, -0.08120914082, 0.2048669611), phase=0.7,
    ),
    # direct contact, and walls at rest
    "direct": OrbitScene(
        {"f2": 0.5, "zeta1": 0.05, "zeta2": 0.05, "omega": 1.7},
        1, 1, (0.0009570318896, -0.6412658672, -0.3477273583, 0.6719853666), contact="direct",
    ),
    "wall_direct": OrbitScene(
        _WALL | {"zeta1": 0.05, "omega": 1.6},
        1, 1, (-0.402544793, 2.542675751, 0.0, 0.0), contact="direct",
    ),
    "wall_oblique": OrbitScene(
        _WALL | {"zeta1": 0.05, "omega": 2.4, "mu": 0.4},
        2, 1, (0.3618097297, 0.4153691539, 0.0, 0.0),
    ),
    # chatter and contact: Fig. 7(c) at low frequency, then every mode
    "7c_0.25": OrbitScene(
        _FIG7C | {"omega": 0.25},
        1, None, (0.2602207792, -0.01710633776, 1.504374142, 5.971404877e-05),
    ),
    "7c_0.3": OrbitScene(
        _FIG7C | {"omega": 0.3},
        1, None, (0.2570808276, 0.01496568213, 1.663808775, -0.1417255305),
    ),
    "7c_0.45": OrbitScene(
        _FIG7C | {"omega": 0.45},
        1, None, (0.3244686056, -0.007644185735, 2.032996578, 0.2711892969),
    ),
    "slide_stick": OrbitScene(
        {"zeta1": 0.1, "zeta2": 0.1, "f2": 2.3, "mu": 0.3, "r": 0.3, "omega": 0.23, "f1": 1.8,
         "delta": 0.1, "omega0": 2.5},
        1, None, (0.1627926086, -0.06023515441, 1.537263517, -0.4817033541), phase=1.0,
    ),
    "slide_crossing": OrbitScene(
        {"zeta1": 0.1, "zeta2": 0.1, "mu": 0.3, "r": 0.2, "omega": 0.51, "f1": 2.8, "f2": 2.3,
         "delta": -0.2, "mbar": 1.0},
        1, None, (0.6511232353, 0.1255685732, 2.712251694, 0.7858652029),
    ),
    "plastic": OrbitScene(
        _FIG7C | {"omega": 0.25, "r": 0.0},
        1, 1, (0.2605779113, -0.01509734922, 1.500428533, 0.001270899031),
    ),
    "plastic_friction": OrbitScene(
        _FIG7C | {"omega": 0.25, "r": 0.0, "mu": 0.9},
        1, 1, (0.2567191317, -0.03214240381, 1.536020962, -0.01081836945),
    ),
    "chatter_into_stick": OrbitScene(
        {"zeta1": 0.1, "zeta2": 0.1, "mu": 0.9, "r": 0.7, "omega": 0.39, "f1": 3.3, "f2": 1.7,
         "delta": 0.1, "omega0": 2.5, "mbar": 0.2},
        1, None, (0.5856861585, -0.1643065366, 2.144603678, 0.05398189558),
    ),
    "reversals_then_chatter": OrbitScene(
        {"mbar": 0.2, "r": 0.3, "delta": 0.3, "zeta1": 0.02, "zeta2": 0.02, "f1": 1.7,
         "f2": 1.2, "omega": 0.68, "mu": 0.9},
        1, None, (0.764291684, -0.554856911, 1.73963957, 1.395172564),
    ),
    "stick_then_chatter": OrbitScene(
        {"mbar": 0.2, "r": 0.6, "delta": 0.1, "zeta1": 0.02, "zeta2": 0.02, "f1": 1.3,
         "f2": 2.0, "omega": 0.6, "mu": 0.4},
        1, None, (-0.001803662812, -0.1523225472, 2.882589352, 1.005890884),
    ),
    "newton_chatter": OrbitScene(
        {"mbar": 1.0, "omega0": 1.5, "r": 0.5, "delta": 0.1, "zeta1": 0.02, "zeta2": 0.1,
         "f1": 0.8, "f2": 1.8, "omega": 0.56, "mu": 0.2},
        1, None, (0.5704845062, -0.4399889495, 2.307182072, 1.0599227), law="newton",
    ),
    "energetic_chatter": OrbitScene(
        {"mbar": 2.0, "omega0": 2.5, "r": 0.3, "zeta1": 0.05, "zeta2": 0.1, "f1": 1.5,
         "f2": 1.9, "omega": 0.98, "mu": 0.4},
        1, None, (0.06832066798, -0.03586764776, 1.708545458, 1.556234989), law="energetic",
    ),
    "direct_chatter": OrbitScene(
        {"zeta1": 0.1, "zeta2": 0.1, "f2": 1.5, "omega": 0.5, "r": 0.6, "f1": 2.0,
         "delta": 0.3},
        1, None, (0.5213789901, 0.1605370387, 2.018450681, 0.43518923), contact="direct",
    ),
    "moving_wall": OrbitScene(
        _WALL | {"zeta1": 0.1, "zeta2": 0.1, "f1": 2.0, "f2": 0.3, "omega": 0.4, "r": 0.5,
         "mu": 0.3},
        1, None, (-0.1805634786, -0.9131981206, -0.1166374502, -0.1343429638), phase=2.0,
    ),
    # unstable ones with chatter
    "unstable_chatter": OrbitScene(
        {"mbar": 0.2, "omega0": 1.5, "r": 0.5, "delta": 0.1, "f1": 2.9, "f2": 0.1,
         "omega": 0.94},
        1, None, (-0.9006539523, 0.1877686208, 0.8636691545, 0.9291121408),
    ),
    "unstable_chatter_spiral": OrbitScene(
        {"mbar": 2.0, "omega0": 2.5, "r": 0.3, "delta": 0.0, "f1": 2.3, "f2": 0.8,
         "omega": 1.19},
        1, None, (0.01693760515, -0.3737412361, 1.925340074, 0.4850247435),
    ),
}  # fmt: skip
