"""`vibroimpact template`: example system files with comments, to begin with."""

import argparse
from pathlib import Path
from typing import Any

from ..errors import ParameterError
from . import options as shared
from .exit_codes import ExitCode

ABOUT = """\
Print an example of a system file, with comments. It is complete: `simulate`
runs with it as it is, and the other commands with what they need besides."""
MORE = """\
which example:
  structure   two masses that meet each other and a wall, from matrices: any
              linear structure with rigid stops (default)
  modes       a beam at a stop, from its modes: finite elements, measurements
  system      the pendulum and the mass, in dimensionless numbers
  physical    the same in SI units

example, a first bifurcation diagram:
  vibroimpact template --out rig.toml
  vibroimpact diagram --system rig.toml --vary drive-frequency 0.9 1.5 60 \\
      --quiet --plot rig.png"""

STRUCTURE = """\
# Two masses in a row. They meet each other, and the second one meets a wall.
#
#   M q'' + C q' + K q = c + Re(F e^(i (omega t + phase))) - contact forces
#
# in any consistent units. A stop is met where normal . q grows to its gap.
#
#   vibroimpact simulate --system FILE.toml --plot motion.png
#   vibroimpact diagram --system FILE.toml --vary drive-frequency 0.9 1.5 60 --plot diagram.png

[structure]
mass = [[1.0, 0.0], [0.0, 2.0]]          # M, symmetric, positive definite
stiffness = [[2.0, -1.0], [-1.0, 1.0]]   # K, symmetric, positive semidefinite
damping_ratios = [0.05, 0.05]            # of the modes; or damping = C, a matrix as K
# static_load = [0.0, 0.0]               # c
drive_amplitude = [1.0, [0.0, 1.0]]      # F, each a number or [real, imaginary part]: the
                                         # second force runs a quarter period ahead
drive_frequency = 1.06                   # omega, radians per unit of time
# phase = 0.0                            # of the drive at t = 0, radians
# law = "poisson"                        # or "newton", "energetic"; alike without friction
# simultaneous = "stop"                  # several stops met at one instant: the run ends;
                                         # or "sequence", "together"

[[structure.stops]]                      # stop 0: mass 0 meets mass 1
normal = [1.0, -1.0]
gap = 0.3
restitution = 0.7

[[structure.stops]]                      # stop 1: mass 1 meets a wall
normal = [0.0, 1.0]
gap = 0.6
restitution = 0.8
# friction = 0.2                         # Coulomb's coefficient; needs a tangent:
# tangent = [0.0, 0.0]                   # tangent . q' is the velocity of slip
# amplitude = 0.0                        # of a stop that moves, amplitude cos(omega t + phase)
# phase = 0.0                            # of its motion, radians

[run]                                    # flags come before it: --periods 50 ...
initial = [[0.0, 0.0], [0.0, 0.0]]       # rows q and v at t = 0
periods = 300                            # of the drive
keep = 100                               # the last of them are shown and written
"""

MODES = """\
# A beam on two supports that meets a stop at midspan: three modes, known at three points.
# Frequencies and shapes come from finite elements or a measurement, in any consistent units.
#
#   vibroimpact simulate --system FILE.toml --plot motion.png
#   vibroimpact diagram --system FILE.toml --vary gap-0 0.001 0.02 60 --plot diagram.png

[structure]
frequencies = [9.8696, 39.4784, 88.8264] # radians per unit of time, ascending; 0: rigid body
shapes = [                               # a row for each point, a column for each mode
  [0.7071, 1.0, 0.7071],
  [1.0, 0.0, -1.0],
  [0.7071, -1.0, 0.7071],
]
modal_mass = [0.5, 0.5, 0.5]             # phi . M phi; none where shapes are orthonormal in M
damping_ratios = [0.02, 0.02, 0.02]      # of the modes
drive_amplitude = [1.0, 0.0, 0.0]        # at the points, as all rows: each a number, or
                                         # [real, imaginary part]
drive_frequency = 8.0                    # radians per unit of time

[[structure.stops]]
normal = [0.0, 1.0, 0.0]                 # at midspan
gap = 0.01
restitution = 0.6

[run]
initial = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]   # rows q and v at t = 0, at the points
periods = 300
keep = 100
"""

SYSTEM = """\
# A pendulum whose tip strikes a mass on a spring, in dimensionless numbers.
#
#   vibroimpact simulate --system FILE.toml --plot motion.png
#   vibroimpact diagram --system FILE.toml --vary drive-frequency 1.5 2 60 --plot diagram.png

[system]
mass_ratio = 0.6          # M1/M2, pendulum to mass
frequency_ratio = 2.0     # natural frequency of the pendulum, of that of the mass
damping = [0.01, 0.01]    # ratios of pendulum and mass
restitution = 0.8
friction = 0.0            # Coulomb's coefficient in the impact
gap = 0.5                 # at rest, in lengths of the pendulum
drive_frequency = 1.8     # of the natural frequency of the mass
moment_amplitude = 1.0    # on the pendulum
# force_amplitude = 0.0   # on the mass; also static_moment, static_force, phase
# contact = "oblique"     # or "direct"
# law = "poisson"         # or "newton", "energetic", "paper"

[run]
initial = [0.0, 0.5, 0.0, 0.0]   # x1, v1, x2, v2 at t = 0
periods = 600
keep = 100
"""

PHYSICAL = """\
# A pendulum whose tip strikes a mass on a spring, in SI units.
#
#   vibroimpact simulate --system FILE.toml --units SI --plot motion.png
#   vibroimpact diagram --system FILE.toml --units SI --vary drive-frequency 12 18 60 \\
#       --plot diagram.png

[physical]
pendulum_mass = 0.3          # kg
oscillator_mass = 0.5        # kg
length = 0.2                 # m
torsional_stiffness = 1.5    # N m/rad
stiffness = 40.0             # N/m
gap = 0.1                    # m
restitution = 0.8
drive_frequency = 16.0       # rad/s
moment_amplitude = 0.9       # N m

[run]
initial = [0.0, 0.0, 0.0, 0.0]   # rad, rad/s, m, m/s with --units SI
periods = 300
keep = 100
"""

EXAMPLES = {"structure": STRUCTURE, "modes": MODES, "system": SYSTEM, "physical": PHYSICAL}


def add(subparsers: Any) -> None:
    """Add the command."""
    command = shared.command(
        subparsers,
        "template",
        summary="an example of a system file, with comments",
        about=ABOUT,
        more=MORE,
        needs="[structure | modes | system | physical]",
    )
    command.add_argument(
        "example",
        nargs="?",
        choices=[*EXAMPLES],
        default="structure",
        help="which (default: structure)",
    )
    command.add_argument(
        "--out", type=Path, metavar="FILE.toml", help="write it there, unless there is a file"
    )
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> ExitCode:
    """Print the example, or write it to a new file."""
    text = EXAMPLES[options.example]
    if options.out is None:
        print(text, end="")
        return ExitCode.DONE
    try:
        with options.out.open("x", encoding="utf-8", newline="\n") as file:
            file.write(text)
    except FileExistsError as error:
        raise ParameterError(
            f"--out {options.out}: there is such a file; allowed: a new one"
        ) from error
    print(f"written: {options.out}")
    return ExitCode.DONE
