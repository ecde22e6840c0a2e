"""From SI quantities to the dimensionless parameters, and back (theory page, section 1).

Time is measured in 1/omega_2 and length in l, with the natural frequencies of the two bodies

    omega_1 = sqrt(K1 / (M1 l^2)),    omega_2 = sqrt(K2 / M2).

Source: Han, Jin & Hu (2004), eq. (23).
"""

import math
from collections.abc import Mapping
from typing import Any

from .arguments import not_negative, number, positive, reject
from .errors import ParameterError
from .hints import close_to
from .restitution import in_units, restitution_of
from .scales import Scales

# What `dimensionless` takes; the other arguments of `System.from_physical` are pure numbers.
WITH_UNITS = (
    "pendulum_mass",
    "oscillator_mass",
    "length",
    "torsional_stiffness",
    "stiffness",
    "torsional_damping",
    "damping",
    "moment_amplitude",
    "force_amplitude",
    "static_moment",
    "static_force",
    "drive_frequency",
    "gap",
)
PURE = ("restitution", "friction", "phase")
QUANTITIES = (*WITH_UNITS, *PURE)


def dimensionless(
    *,
    pendulum_mass: float,
    oscillator_mass: float,
    length: float,
    torsional_stiffness: float,
    stiffness: float,
    torsional_damping: float,
    damping: float,
    moment_amplitude: float,
    force_amplitude: float,
    static_moment: float,
    static_force: float,
    drive_frequency: float,
    gap: float,
) -> dict[str, Any]:
    """Return the parameters of a System that depend on physical units, and its scales.

    Parameters
    ----------
    pendulum_mass
        M1 in kg, > 0.
    oscillator_mass
        M2 in kg, > 0.
    length
        Length l of the pendulum in m, > 0.
    torsional_stiffness
        K1 in N m/rad, >= 0.
    stiffness
        K2 in N/m, > 0: it sets the unit of time.
    torsional_damping
        C1 in N m s/rad, >= 0, and 0 where K1 = 0 (the damping ratio does not exist).
    damping
        C2 in N s/m, >= 0.
    moment_amplitude
        f10 in N m.
    force_amplitude
        f20 in N.
    static_moment
        C10 in N m.
    static_force
        F20 in N.
    drive_frequency
        Omega in rad/s, >= 0.
    gap
        Delta in m.

    Raises
    ------
    ParameterError
        Names the quantity, its value and its range.
    """
    m1 = positive("pendulum_mass", pendulum_mass)
    m2 = positive("oscillator_mass", oscillator_mass)
    l = positive("length", length)  # noqa: E741  the paper's letter
    k1 = not_negative("torsional_stiffness", torsional_stiffness)
    k2 = positive("stiffness", stiffness)
    c1 = not_negative("torsional_damping", torsional_damping)
    c2 = not_negative("damping", damping)
    if k1 == 0.0 and c1 > 0.0:
        reject("torsional_damping", torsional_damping, "0 where torsional_stiffness = 0")

    f1 = number("moment_amplitude", moment_amplitude)
    f2 = number("force_amplitude", force_amplitude)
    static_1 = number("static_moment", static_moment)
    static_2 = number("static_force", static_force)
    omega = not_negative("drive_frequency", drive_frequency)
    delta = number("gap", gap)

    omega_1 = math.sqrt(k1 / m1) / l
    omega_2 = math.sqrt(k2 / m2)
    inertia = m1 * l * l
    moment_unit = inertia * omega_2 * omega_2
    critical_1 = 2.0 * inertia * omega_1  # = 2 sqrt(M1 K1 l^2)
    critical_2 = 2.0 * math.sqrt(m2 * k2)
    # All positive in exact arithmetic, but a product may leave the range of a float64.
    scales = [omega_2, inertia, moment_unit, critical_2, k2 * l] + [critical_1] * (k1 > 0.0)
    if not all(0.0 < scale < math.inf for scale in scales):
        names = "(pendulum_mass, oscillator_mass, length, torsional_stiffness, stiffness)"
        reject(names, (m1, m2, l, k1, k2), "quantities whose products a float64 can hold")
    return {
        "mass_ratio": m1 / m2,
        "frequency_ratio": omega_1 / omega_2,
        # zeta1 = C1 / (2 sqrt(M1 K1 l^2)), zeta2 = C2 / (2 sqrt(M2 K2))
        "pendulum_damping": c1 / critical_1 if c1 > 0.0 else 0.0,
        "oscillator_damping": c2 / critical_2,
        # f1 = f10 / (M1 l^2 omega_2^2), f2 = f20 / (K2 l)
        "moment_amplitude": f1 / moment_unit,
        "force_amplitude": f2 / (k2 * l),
        "static_moment": static_1 / moment_unit,
        "static_force": static_2 / (k2 * l),
        "drive_frequency": omega / omega_2,
        "gap": delta / l,
        "scales": Scales(length=l, mass=m1, time=1.0 / omega_2),
    }


def quantities(ratios: Mapping[str, Any], scales: Scales) -> dict[str, float]:
    """Return the quantities in SI from which `dimensionless` makes these ratios, to rounding.

    Parameters
    ----------
    ratios
        The numeric parameters of a System by their names.
    scales
        Its scales.

    Raises
    ------
    ParameterError
        If ``mass_ratio`` is 0: a wall has no mass, spring and damper of its own.
    """
    if ratios["mass_ratio"] == 0.0:
        reject("mass_ratio", 0.0, "a number > 0, for SI quantities: a wall has no mass")
    m1, length, omega_2 = scales.mass, scales.length, scales.frequency
    m2 = m1 / ratios["mass_ratio"]
    omega_1 = ratios["frequency_ratio"] * omega_2
    inertia = m1 * length * length
    k2 = m2 * omega_2 * omega_2
    moment_unit = inertia * omega_2 * omega_2
    return {
        "pendulum_mass": m1,
        "oscillator_mass": m2,
        "length": length,
        "torsional_stiffness": inertia * omega_1 * omega_1,
        "stiffness": k2,
        "torsional_damping": ratios["pendulum_damping"] * 2.0 * inertia * omega_1,
        "damping": ratios["oscillator_damping"] * 2.0 * m2 * omega_2,
        "moment_amplitude": ratios["moment_amplitude"] * moment_unit,
        "force_amplitude": ratios["force_amplitude"] * k2 * length,
        "static_moment": ratios["static_moment"] * moment_unit,
        "static_force": ratios["static_force"] * k2 * length,
        "drive_frequency": ratios["drive_frequency"] * omega_2,
        "gap": ratios["gap"] * length,
    }


def changed(
    ratios: Mapping[str, Any], scales: Scales, changes: Mapping[str, Any]
) -> dict[str, Any]:
    """Return ratios and scales after some quantities have changed, given in SI.

    A number that none of the changes touches stays the same to the last bit.

    Raises
    ------
    ParameterError
        Names a quantity that does not exist, or its value and range.
    """
    for name in changes:
        if name not in QUANTITIES:
            hint = close_to(name, QUANTITIES)
            raise ParameterError(
                f"unknown quantity {name}{hint}; with units='SI' the names are those of "
                f"System.from_physical: {', '.join(QUANTITIES)}"
            )
    own = quantities(ratios, scales)
    wanted = {name: changes[name] for name in changes if name in WITH_UNITS}
    before, after = dimensionless(**own), dimensionless(**own | wanted)
    there = {name: after[name] for name in after if after[name] != before[name]}
    there |= {name: changes[name] for name in changes if name in PURE}
    # The speeds of a curve are in m/s, and stay so where the scales change.
    old, new = before["scales"].speed, after["scales"].speed
    if "restitution" in changes:
        there["restitution"] = in_units(restitution_of(changes["restitution"]), 1.0 / new)
    elif new != old:
        there["restitution"] = in_units(ratios["restitution"], old / new)
    return there
