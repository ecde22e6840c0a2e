"""Compare the exponents of a diagram, measured for its labels, with those of long runs.

The differences are counted in standard errors: those of the diagram, over some hundred drive
periods, and of the long run together. Motions that cease to be chaotic in the long run are left
out. The last column is the median of the diagram's errors, as part of the exponent.

    python examples/exponents_of_labels.py [--points 1200]

A thousand points take a few seconds.
"""

import argparse

import numpy as np
from numpy.typing import NDArray

import vibroimpact as vi

START = (0.0, 0.5, 0.0, 0.0)
# Drive periods of the diagram's runs, and of the long ones.
PERIODS, LONG = 600, 20_600
# Growth in the long run, as its logarithm, by which a motion is chaotic throughout.
CHAOTIC = 40.0
SYSTEM = vi.System(
    mass_ratio=0.6,
    frequency_ratio=2.0,
    restitution=0.8,
    gap=0.5,
    drive_frequency=1.0,
    moment_amplitude=1.0,
)
DAMPED = SYSTEM.replace(pendulum_damping=0.01, oscillator_damping=0.01, force_amplitude=0.5)
SYSTEMS = {
    "Fig. 4": SYSTEM,
    "Fig. 8(a)": SYSTEM.replace(friction=0.5),
    "Fig. 7(a)": DAMPED,
    "Fig. 8(b)": DAMPED.replace(friction=0.4),
}


def differences(system: vi.System, points: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return differences of chaotic motions, in standard errors, and these, in exponents."""
    frequencies = np.linspace(0.2, 4.0, points)
    diagram = vi.bifurcation_diagram(
        system,
        initial=START,
        periods=PERIODS,
        keep=100,
        exponents=True,
        drive_frequency=frequencies,
    )
    found, errors = [], []
    for i in np.flatnonzero(diagram.label == "chaotic"):
        chaotic = system.replace(drive_frequency=frequencies[i])
        long = vi.lyapunov_spectrum(chaotic, initial=START, periods=LONG)
        if long.exponents[0] * long.time > CHAOTIC:
            error = np.hypot(diagram.exponent_error[i], long.error[0])
            found.append((diagram.largest_exponent[i] - long.exponents[0]) / error)
            errors.append(diagram.exponent_error[i] / long.exponents[0])
    return np.array(found), np.array(errors)


def main() -> None:
    """Print how many differences lie within one, two and three standard errors."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--points", type=int, default=1200)
    points = parser.parse_args().points
    print("            motions  within 1     2     3 errors   mean   error")
    for name, system in SYSTEMS.items():
        found, errors = differences(system, points)
        parts = [f"{100.0 * (np.abs(found) < most).mean():5.0f}%" for most in (1, 2, 3)]
        print(
            f"{name:<10} {len(found):8}   ",
            *parts,
            f"   {found.mean():+8.2f}{np.median(errors):8.2f}",
        )


if __name__ == "__main__":
    main()
