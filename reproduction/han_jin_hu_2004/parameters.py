"""The systems behind Figs. 4 to 10 of Han, Jin & Hu (2004), as their captions give them.

All share mass ratio 0.6, frequency ratio 2, restitution 0.8, gap 0.5, the initial state
(0, 0.5, 0, 0), and 600 drive periods of which the last 100 are kept (section 4 of the paper). The
drive is cos(omega t). The paper states no ranges for its diagrams: those here are ours, and so are
the low frequencies at which Fig. 7(c) is looked at for sustained contact.
"""

from dataclasses import dataclass
from typing import Literal

from vibroimpact import System

INITIAL = (0.0, 0.5, 0.0, 0.0)
PERIODS = 600
KEEP = 100
FREQUENCY_RANGE = (0.2, 4.0)
ENLARGED_RANGE = (1.5, 1.6)
LOW_RANGE = (0.2, 0.6)
LOW_EXAMPLES = (0.25, 0.30, 0.45)
LAWS = ("poisson", "newton", "energetic")
FIGURES = (2, 3, 4, 5, 6, 7, 8, 9, 10)


def paper_system(
    *,
    moment_amplitude: float = 1.0,
    force_amplitude: float = 0.0,
    damping: float = 0.0,
    friction: float = 0.0,
    drive_frequency: float = 1.0,
) -> System:
    """Return the paper's system with the parameters that its captions vary."""
    return System(
        mass_ratio=0.6,
        frequency_ratio=2.0,
        restitution=0.8,
        gap=0.5,
        drive_frequency=drive_frequency,
        moment_amplitude=moment_amplitude,
        force_amplitude=force_amplitude,
        damping=(damping, damping),
        friction=friction,
    )


@dataclass(frozen=True)
class Transition:
    """A bifurcation diagram over the drive frequency, which replaces that of its system."""

    figure: int
    panel: str
    system: System

    @property
    def id(self) -> str:
        """Figure and panel, e.g. ``7a``."""
        return f"{self.figure}{self.panel}"


@dataclass(frozen=True)
class Motion:
    """A motion that the paper shows, and what it says of it.

    `right` is what the right-hand panel draws: the phase portrait of both bodies or of the pendulum
    alone, or the impact section.
    """

    id: str
    figure: int
    panel: str
    paper_says: str
    system: System
    right: Literal["portrait", "pendulum", "section"] = "portrait"

    @property
    def place(self) -> str:
        """Where in the paper it says so."""
        panel = f"({self.panel})" if self.panel else ""
        return f"caption of Fig. {self.figure}{panel}"

    @property
    def source(self) -> str:
        """Paper and place."""
        return f"Han, Jin & Hu (2004), {self.place}"


TRANSITIONS = (
    Transition(4, "", paper_system()),
    Transition(7, "a", paper_system(damping=0.01, force_amplitude=0.5)),
    Transition(7, "b", paper_system(damping=0.1, force_amplitude=0.5)),
    Transition(7, "c", paper_system(damping=0.1, force_amplitude=1.5)),
    Transition(8, "a", paper_system(friction=0.5)),
    Transition(8, "b", paper_system(friction=0.4, damping=0.01, force_amplitude=0.5)),
    Transition(8, "c", paper_system(friction=0.8, damping=0.01, force_amplitude=0.5)),
)

MOTIONS = (
    Motion("5a", 5, "a", "1-1", paper_system(drive_frequency=1.25)),
    Motion("5b", 5, "b", "1-1", paper_system(drive_frequency=1.8)),
    Motion("5c", 5, "c", "2-1", paper_system(drive_frequency=2.75, moment_amplitude=1.5)),
    Motion("6a", 6, "a", "1-2", paper_system(drive_frequency=0.73, moment_amplitude=2.3)),
    Motion("6b", 6, "b", "2-4", paper_system(drive_frequency=1.1)),
    Motion("6c", 6, "c", "8-6", paper_system(drive_frequency=2.56), right="pendulum"),
    Motion(
        "9(1)",
        9,
        "1",
        "1-3",
        paper_system(drive_frequency=0.75, damping=0.1, force_amplitude=1.5),
    ),
    Motion(
        "9(2)",
        9,
        "2",
        "chaotic",
        paper_system(drive_frequency=1.545, friction=0.5),
        right="section",
    ),
    Motion("9(3)", 9, "3", "4-5", paper_system(drive_frequency=1.5752, friction=0.5)),
    Motion(
        "9(4)",
        9,
        "4",
        "chaotic",
        paper_system(drive_frequency=2.55, friction=0.4, damping=0.01, force_amplitude=0.5),
        right="section",
    ),
    Motion(
        "10",
        10,
        "",
        "impacts stop after a finite number",
        paper_system(drive_frequency=2.98, friction=0.3),
    ),
)
