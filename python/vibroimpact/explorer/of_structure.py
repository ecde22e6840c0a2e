"""A `Structure` as the explorer's machine: what is computed and drawn of it, and the code.

Impacts have the colour of their stop, or of their regime where there is one stop.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..plot.style import REGIME_STYLES, STOPS
from ..structure import Structure
from ..sweeps import lyapunov_spectrum
from .machine import STROBOSCOPIC, Array, Curve, Motion, Phase
from .structure_numbers import DAMPING, DRIVE, StructureNumbers, looked_at

# Oscillations of the slowest mode in a motion without a drive; its length without any spring.
_OSCILLATIONS, _TIME = 20.0, 30.0
# For so many coordinates and stops more, maps have half the cells; a quarter at least.
_SIZE, _MOST_EFFORT = 8, 4
# Stops whose impacts are counted in words.
_COUNTED = 8


@dataclass(frozen=True)
class OfStructure(StructureNumbers):
    """A Structure, with factors of the drive and the damping it was given."""

    noun = "structure"
    maps = ("diagram", "chart")
    branches = False
    rate = "per unit of time"
    # They move one by one, and not in the lanes of vector registers.
    haste = 2

    # What is computed.

    @property
    def time(self) -> float:
        """Some oscillations of the slowest mode."""
        slowest = self.base.frequencies[self.base.frequencies > 0.0]
        return _OSCILLATIONS * math.tau / float(slowest[0]) if len(slowest) else _TIME

    @property
    def effort(self) -> int:
        """The more, the more coordinates and stops there are."""
        size = self.base.coordinates + len(self.base.stops)
        return min(_MOST_EFFORT, 1 + size // _SIZE)

    def sampled(self, run: Any, time: Array) -> tuple[Array, Array | None]:
        """Return the states, and the forces in the stops."""
        states, forces = run.trajectory(time, forces=True)
        return states, forces

    def exponent(self, initial: Sequence[float], **options: Any) -> tuple[float, float]:
        """Measure the largest exponent."""
        structure: Any = self.system
        found: Any = lyapunov_spectrum(
            structure,
            initial=self.begin(initial),
            periods=options["periods"],
            max_events=options["max_events"],
            most=1,
        )
        return found.largest, float(found.error[0])

    def stability(self, periodic: Any) -> str:
        """Return the verdict."""
        return str(periodic.stability)

    def family(self, *names: str) -> Structure | Callable[..., Structure]:
        """Return the structure, or what makes it with other factors."""
        if not {DRIVE, DAMPING} & {*names}:
            return self.system

        def made(**values: float) -> Structure:
            return self.replace(**values).system

        return made

    # What is drawn.

    def _drawn(self, shown: str) -> list[int]:
        """Return the coordinates of the time history: those that are looked at, and others."""
        chosen = [place for _, place in looked_at(shown).terms]
        others = [i for i in self.met if i not in chosen]
        return sorted([*chosen, *others][: self.curve_count])

    def curves(self, shown: str) -> tuple[Curve, ...]:
        """Return some coordinates."""
        drawn = self._drawn(shown)
        return tuple(Curve(f"curve{k}", self.symbol(f"q{i}")) for k, i in enumerate(drawn))

    def phases(self, shown: str) -> tuple[Phase, ...]:
        """Return the coordinate that is looked at."""
        return (Phase("place", "speed", self.symbol(shown)),)

    def phase_names(self, shown: str) -> tuple[tuple[str, str], ...]:
        """Return the symbols of the coordinate that is looked at, or of a difference."""
        speed = " - ".join(self.symbol(f"v{place}") for _, place in looked_at(shown).terms)
        return ((self.symbol(shown), speed),)

    def history_label(self, shown: str) -> str:
        """Return what the curves are."""
        return ", ".join(curve.words for curve in self.curves(shown))

    def samples(self, motion: Motion) -> dict[str, Array]:
        """Return the coordinates that are drawn, and what is looked at with its velocity."""
        q, v = motion.states[:, 0], motion.states[:, 1]
        chosen = looked_at(motion.shown)
        curves = {f"curve{k}": q[:, i] for k, i in enumerate(self._drawn(motion.shown))}
        columns = curves | {"place": chosen.of(q), "speed": chosen.of(v)}
        return {name: np.ascontiguousarray(column) for name, column in columns.items()}

    def sections(self, run: Any, shown: str) -> Array:
        """Return the coordinate that is looked at."""
        return looked_at(shown).of(np.asarray(run.stroboscopic))

    def hits(self, motion: Motion) -> dict[str, Array]:
        """Return where the coordinates on which a stop acts are at its impacts."""
        impacts = motion.run.impacts
        normals = np.array([stop.normal for stop in self.base.stops])
        columns: dict[str, Array] = {}
        for name, i in zip(self.heights, self._drawn(motion.shown), strict=True):
            place = np.array(impacts["q"][:, i])
            if len(place):
                place[normals[impacts["stop"], i] == 0.0] = np.nan
            columns[name] = place
        return columns

    def approach(self, run: Any) -> Array:
        """Return the column of the impacts."""
        return np.asarray(run.impacts["approach_velocity"])

    @property
    def by_stop(self) -> bool:
        """Whether there are several stops."""
        return len(self.base.stops) != 1

    def kinds(self, impacts: Any) -> NDArray[np.uint8]:
        """Return the colours of the stops, or the regimes at a single one."""
        if not len(impacts):
            return np.zeros(0, dtype=np.uint8)
        if not self.by_stop:
            return np.asarray(impacts["regime"]).astype(np.uint8)
        return (np.asarray(impacts["stop"]) % len(STOPS)).astype(np.uint8)

    def kind_words(self, kind: int) -> str:
        """Return the stops of a colour, or the name of a regime."""
        if not self.by_stop:
            return REGIME_STYLES[kind].text
        stops = [str(stop) for stop in range(kind, len(self.base.stops), len(STOPS))]
        return f"{'stop' if len(stops) == 1 else 'stops'} {', '.join(stops)}"

    def points(
        self, diagram: Any, value: str, shown: str
    ) -> tuple[Array, Array, NDArray[np.uint8] | None]:
        """Return the columns of a StructureDiagram."""
        if value == STROBOSCOPIC:
            sections = diagram.stroboscopic
            column = looked_at(shown).of(sections[:, 0]) if len(sections) else np.empty(0)
            return diagram.stroboscopic_parameter, np.ascontiguousarray(column), None
        impacts, at = diagram.impacts, diagram.impact_parameter
        if not len(at):
            return at, np.empty(0), np.zeros(0, dtype=np.uint8)
        column = looked_at(shown).of(impacts["q"]) if value == "q" else impacts[value]
        return at, np.ascontiguousarray(column), self.kinds(impacts)

    def columns(self, diagram: Any) -> dict[str, NDArray[Any]]:
        """Return all columns of the impacts."""
        names = diagram.impacts.dtype.names or ()
        columns = {name: np.asarray(diagram.impacts[name]) for name in names}
        return {diagram.parameter_name: diagram.impact_parameter} | columns

    def value_label(self, value: str, shown: str) -> str:
        """Return the symbol and the section."""
        return {
            "approach_velocity": "approach velocity u at impact",
            "q": f"{self.symbol(shown)} at impact",
            "phase": "phase ψ at impact",
            STROBOSCOPIC: f"{self.symbol(shown)} once per drive period",
        }[value]

    def facts(self, run: Any) -> list[tuple[str, str]]:
        """Return how many impacts each stop has had in the kept part of a run."""
        stops = len(self.base.stops)
        if stops < 2 or not len(run.impacts):
            return []
        counts = np.bincount(run.impacts["stop"], minlength=stops)
        order = sorted(np.argsort(-counts, kind="stable")[:_COUNTED].tolist())
        shown = [f"{counts[stop]} at stop {stop}" for stop in order if counts[stop]]
        struck = int(np.count_nonzero(counts))
        rest = [f"some at {struck - len(shown)} other stops"] if struck > len(shown) else []
        window = f"last {len(run.stroboscopic)} periods" if self.driven else "impacts"
        return [(window, ", ".join(shown + rest))]

    # The code that makes all this.

    def start_code(self, initial: Sequence[float]) -> str:
        """Return the rows q and v."""
        return repr(self.begin(initial))

    def definition(self) -> list[str]:
        """Return the call that makes the structure with all of its changes."""
        fields = self.system.to_dict()
        maker = "Structure.from_modes" if "frequencies" in fields else "Structure"
        lines = [f"structure = vi.{maker}("]
        for name, value in fields.items():
            if name == "stops":
                rows = [f"vi.Stop({_arguments(stop)})" for stop in value]
            elif isinstance(value, list) and value and isinstance(value[0], list):
                rows = [repr(row) for row in value]
            else:
                lines += [f"    {name}={value!r},"]
                continue
            lines += [f"    {name}=[", *(f"        {row}," for row in rows), "    ],"]
        return [*lines, ")"]

    def exponent_code(self, periods: int, keep: int, max_events: int) -> list[str]:
        """Return the spectrum of one exponent."""
        return [
            "try:",
            "    spectrum = vi.lyapunov_spectrum(",
            f"        structure, initial=initial, periods={periods}, most=1,",
            f"        max_events={max_events},",
            "    )",
            "    numbers = f'{spectrum.largest:.6g} +- {spectrum.error[0]:.1g}'",
            "    print(f'largest exponent {numbers} per unit of time')",
            "except vi.SimulationError as error:",
            "    print(f'largest exponent: {error}')",
            "if run.period.m is not None and (motion := run.refine()):",
            "    print('multipliers', ', '.join(f'{one:.4g}' for one in motion.multipliers))",
            "    print(motion.stability)",
        ]

    def pictures(self, shown: str, periods: int) -> list[str]:
        """Return the package's figures of a run."""
        place, rate = map(looked_at(shown).name, "qv")
        part, size, x = f"periods={periods}", "2, 2, figsize=(7.1, 5.4)", "phase"
        if not self.driven:
            part = "window=(run.kept_from, run.final_state.time)"
            size, x = "1, 3, figsize=(7.1, 2.7)", "time"
        color = "" if self.by_stop else ", color='regime'"
        lines = [
            f"figure, axes = plt.subplots({size}, layout='constrained')",
            "panels = axes.flat",
            f"vi.plot.time_history(run, coordinates={self._drawn(shown)}, {part}{color},",
            "                     ax=panels[0])",
            f"vi.plot.phase_portrait(run, coordinates={place!r}, {part}{color}, ax=panels[1])",
            f"vi.plot.impact_section(run, x='{x}', y='approach_velocity'{color}, ax=panels[2])",
        ]
        if not self.driven:
            return lines
        return [*lines, f"vi.plot.stroboscopic(run, x={place!r}, y={rate!r}, ax=panels[3])"]

    def family_code(self, *names: str) -> str:
        """Return the structure's name, or a function of factors of what was given."""
        if not {DRIVE, DAMPING} & {*names}:
            return self.noun
        kind = "damping" if self.base.damping is not None else "damping_ratios"
        scaled = {DRIVE: "drive_amplitude", DAMPING: kind}
        changes = []
        for name in names:
            if name in scaled:
                given = getattr(self.base, scaled[name]).tolist()
                changes.append(f"{scaled[name]}={name} * np.array({given!r})")
            else:
                changes.append(f"{name}={name}")
        return f"lambda {', '.join(names)}: structure.replace({', '.join(changes)})"

    def drawn_code(self, value: str, shown: str) -> tuple[str, str]:
        """Return the call of the package's diagram of structures."""
        place = looked_at(shown).name("q")
        if value == STROBOSCOPIC:
            return "vi.plot.bifurcation", f"section='stroboscopic', value={place!r}"
        return "vi.plot.bifurcation", f"value={(place if value == 'q' else value)!r}"


def _arguments(fields: Mapping[str, Any]) -> str:
    return ", ".join(f"{name}={value!r}" for name, value in fields.items())
