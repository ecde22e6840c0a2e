"""A `System` as the explorer's machine: the pendulum, the mass, and what is special of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from .._core import CONTACTS, LAWS
from ..arguments import state as checked_state
from ..plot.style import REGIME_STYLES
from ..restitution import MEANINGS
from ..sweeps import sweep
from ..system import System
from . import curves
from .axis import Axis, around
from .machine import STROBOSCOPIC, Array, Curve, Machine, Motion, Phase

COORDINATES = ("x1", "v1", "x2", "v2")
SYMBOLS = {
    "mass_ratio": "m̄",
    "frequency_ratio": "ω₀",
    "restitution": "r",
    "gap": "δ",
    "drive_frequency": "ω",
    "pendulum_damping": "ζ₁",
    "oscillator_damping": "ζ₂",
    "moment_amplitude": "f₁",
    "force_amplitude": "f₂",
    "static_moment": "c₁",
    "static_force": "c₂",
    "friction": "μ",
    "phase": "φ",
    "x1": "x₁",
    "v1": "ẋ₁",
    "x2": "x₂",
    "v2": "ẋ₂",
}
"""Symbols, as plain text."""

# What the sliders reach; a number without an entry has the last one.
RANGES: dict[str, tuple[float, float]] = {
    "mass_ratio": (0.0, 2.0),
    "frequency_ratio": (0.0, 4.0),
    "restitution": (0.0, 1.0),
    "gap": (-0.5, 1.5),
    "drive_frequency": (0.0, 4.5),
    "pendulum_damping": (0.0, 0.5),
    "oscillator_damping": (0.0, 0.5),
    "moment_amplitude": (0.0, 3.0),
    "force_amplitude": (0.0, 3.0),
    "static_moment": (-1.0, 1.0),
    "static_force": (-1.0, 1.0),
    "friction": (0.0, 1.5),
    "phase": (0.0, math.tau),
}
USUAL = (-2.0, 2.0)
# Length of a motion without a drive.
TIME = 30.0


@dataclass(frozen=True)
class OfSystem(Machine):
    """A System and its parameters."""

    system: System

    noun = "system"
    maps = ("diagram", "chart", "basins")
    branches = True
    rate = "per unit of time 1/ω₂"
    heights = ("x2",)
    choices: ClassVar = {"contact": CONTACTS, "law": LAWS}
    coordinates = starts = COORDINATES
    shown = ("x1",)
    values: ClassVar = {
        "x1": "x₁ at impact",
        "approach_velocity": "approach velocity",
        "phase": "phase at impact",
        STROBOSCOPIC: "x₁ once per period",
    }
    time = TIME
    effort = 1

    @property
    def groups(self) -> dict[str, tuple[str, ...]]:
        """Machine, impact, and drive with constant loads."""
        restitution = self.system._of_curve or ("restitution",)
        return {
            "Machine": (
                *("mass_ratio", "frequency_ratio", "gap"),
                *("pendulum_damping", "oscillator_damping"),
            ),
            "Impact": ("contact", "law", *restitution, "friction"),
            "Drive and constant loads": (
                *("drive_frequency", "moment_amplitude", "force_amplitude", "phase"),
                *("static_moment", "static_force"),
            ),
        }

    @property
    def parameters(self) -> tuple[str, ...]:
        """Parameters, and the numbers of a curve of restitution."""
        return self.system._numbers_by_name

    def numbers(self) -> dict[str, float | str]:
        """Return all parameters."""
        return {name: getattr(self.system, name) for name in (*self.parameters, "contact", "law")}

    fields = numbers

    def replace(self, **changes: Any) -> Self:
        """Return the machine with some parameters changed."""
        return type(self)(self.system.replace(**changes))

    def flat(self, initial: Any) -> tuple[float, ...]:
        """Return the four numbers of a start."""
        return checked_state(initial)

    def begin(self, initial: Sequence[float]) -> Any:
        """Return the start as it is."""
        return tuple(initial)

    @property
    def first(self) -> dict[str, str]:
        """What says something of the contact: where body 2 is a wall, x1 at impact is constant."""
        return {"value": "approach_velocity" if self.system.is_wall else "x1", "shown": "x1"}

    def span(self, name: str) -> tuple[float, float]:
        """Return the range of a parameter or a coordinate."""
        return RANGES.get(name) or curves.span(name, 1.0) or USUAL

    def axes(self, *, own: bool) -> dict[str, Axis]:
        """Return the paper's ranges, or such around the system's own values."""
        system = self.system
        axes = {
            "vary": Axis(name="drive_frequency", low=0.5, high=3.0),
            "across": Axis(name="drive_frequency", low=0.5, high=3.0),
            "upward": Axis(name="moment_amplitude", low=0.2, high=2.0),
            "right": Axis(name="x1", low=-0.5, high=0.5),
            "up": Axis(name="v1", low=-1.5, high=1.5),
        }
        if own and system.drive_frequency > 0.0:
            axis = around("drive_frequency", system.drive_frequency)
            axes |= {"vary": axis, "across": axis}
        if own and system.moment_amplitude > 0.0:
            axes["upward"] = around("moment_amplitude", system.moment_amplitude)
        return axes

    def symbol(self, name: str) -> str:
        """Return the symbol of the notation page."""
        return SYMBOLS.get(name) or curves.SYMBOLS.get(name, "")

    def words(self, name: str) -> str:
        """Return the name of a parameter."""
        if name in COORDINATES:
            return ""
        return MEANINGS.get(name) or name.replace("_", " ")

    def sampled(self, run: Any, time: Array) -> tuple[Array, Array | None]:
        """Return the states."""
        return run.trajectory(time), None

    def exponent(self, initial: Sequence[float], **options: Any) -> tuple[float, float]:
        """Measure the exponent as a sweep of one point does."""
        cell = sweep(
            self.system,
            initial=self.begin(initial),
            exponents=True,
            drive_frequency=[self.system.drive_frequency],
            **options,
        )
        return float(cell.largest_exponent[0]), float(cell.exponent_error[0])

    def stability(self, periodic: Any) -> str:
        """Return the verdict."""
        return "stable" if periodic.stable else "unstable"

    def family(self, *names: str) -> System:
        """Return the system, all of whose parameters can be varied by name."""
        return self.system

    def curves(self, shown: str) -> tuple[Curve, ...]:
        """Return the two faces of the contact."""
        return Curve("tip", "tip \N{MINUS SIGN} δ"), Curve("x2", "x₂")

    def phases(self, shown: str) -> tuple[Phase, ...]:
        """Return both bodies."""
        return Phase("x1", "v1", "body 1"), Phase("x2", "v2", "body 2")

    def phase_names(self, shown: str) -> tuple[tuple[str, str], ...]:
        """Return the symbols of both bodies."""
        return (SYMBOLS["x1"], SYMBOLS["v1"]), (SYMBOLS["x2"], SYMBOLS["v2"])

    def history_label(self, shown: str) -> str:
        """Return what both curves are."""
        return "displacement"

    def samples(self, motion: Motion) -> dict[str, Array]:
        """Return displacements of the tip, and states."""
        x1, v1, x2, v2 = motion.states.T
        tip = np.asarray(self.system.tip(x1)) - self.system.gap
        return {"tip": tip, "x1": x1, "v1": v1, "x2": x2, "v2": v2}

    def sections(self, run: Any, shown: str) -> Array:
        """Return x1 and v1 of the kept sections."""
        return np.asarray(run.stroboscopic)[:, :2]

    def hits(self, motion: Motion) -> dict[str, Array]:
        """Return where body 2 is at each impact."""
        return {"x2": motion.run.impacts["x2"]}

    def approach(self, run: Any) -> Array:
        """Return the rate of the gap just before each impact."""
        before = [run.impacts[name] for name in ("x1", "v1_pre", "x2", "v2_pre")]
        rates = self.system.gap_rate(np.column_stack(before))
        return np.asarray(rates, dtype=np.float64).reshape(-1)

    def kinds(self, impacts: Any) -> NDArray[np.uint8]:
        """Return the regimes."""
        return np.asarray(impacts["regime"]).astype(np.uint8)

    def kind_words(self, kind: int) -> str:
        """Return the name of a regime."""
        return REGIME_STYLES[kind].text

    def points(
        self, diagram: Any, value: str, shown: str
    ) -> tuple[Array, Array, NDArray[np.uint8] | None]:
        """Return the columns of a Diagram."""
        if value == STROBOSCOPIC:
            return diagram.stroboscopic_parameter, diagram.stroboscopic[:, 0], None
        kinds = np.asarray(diagram.regime).astype(np.uint8)
        return diagram.impact_parameter, np.asarray(getattr(diagram, value)), kinds

    def columns(self, diagram: Any) -> dict[str, NDArray[Any]]:
        """Return the columns of the command line's file."""
        names = ("x1", "v1", "v2", "phase", "approach_velocity", "energy_loss", "regime")
        columns = {name: np.asarray(getattr(diagram, name)) for name in names}
        return {diagram.parameter_name: diagram.impact_parameter} | columns

    def value_label(self, value: str, shown: str) -> str:
        """Return the symbol and the section."""
        return {
            "x1": "x₁ at impact",
            "approach_velocity": "approach velocity u at impact",
            "phase": "phase ψ at impact",
            STROBOSCOPIC: "x₁ once per drive period",
        }[value]

    def start_code(self, initial: Sequence[float]) -> str:
        """Return the four numbers."""
        return repr(tuple(initial))

    def definition(self) -> list[str]:
        """Return the call of System with all of its parameters."""
        rows = [f"    {name}={value!r}," for name, value in self.system.to_dict().items()]
        return ["system = vi.System(", *rows, ")"]

    def exponent_code(self, periods: int, keep: int, max_events: int) -> list[str]:
        """Return the sweep of one point."""
        return [
            "cell = vi.sweep(",
            f"    system, initial=initial, periods={periods}, keep={keep},",
            f"    exponents=True, max_events={max_events},",
            "    drive_frequency=[system.drive_frequency],",
            ")",
            "exponent, error = cell.largest_exponent[0], cell.exponent_error[0]",
            "print(f'largest exponent {exponent:.6g} +- {error:.1g} per unit of time 1/omega_2')",
            "if run.period.m is not None and (motion := run.refine()):",
            "    print('multipliers', ', '.join(f'{one:.4g}' for one in motion.multipliers))",
            "    print('stable' if motion.stable else 'unstable')",
        ]

    def pictures(self, shown: str, periods: int) -> list[str]:
        """Return the package's figures of a run."""
        section = "x='phase', y='approach_velocity'"
        part, size = f"periods={periods}", "2, 2, figsize=(7.1, 5.4)"
        if not self.driven:
            section = "x='time', y='approach_velocity'"
            part, size = "window=(run.kept_from, run.final_state.time)", "1, 3, figsize=(7.1, 2.7)"
        lines = [
            f"figure, axes = plt.subplots({size}, layout='constrained')",
            "panels = axes.flat",
            f"vi.plot.time_history(run, {part}, color='regime', ax=panels[0])",
            f"vi.plot.phase_portrait(run, {part}, ax=panels[1])",
            f"vi.plot.impact_section(run, {section}, color='regime', ax=panels[2])",
        ]
        return [*lines, "vi.plot.stroboscopic(run, ax=panels[3])"] if self.driven else lines

    def family_code(self, *names: str) -> str:
        """Return the system's name."""
        return self.noun

    def drawn_code(self, value: str, shown: str) -> tuple[str, str]:
        """Return the call of the package's diagram."""
        if value == STROBOSCOPIC:
            return "vi.plot.bifurcation", "section='stroboscopic'"
        return "vi.plot.bifurcation", f"value={value!r}, color='regime'"
