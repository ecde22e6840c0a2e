"""Hints for unknown names: what was meant by a name from the theory or from another package."""

import re
from collections.abc import Iterable, Mapping

from ._core import PARAMETERS

# What else people call an argument: the symbols of the theory (M1, omega ...; notation page),
# and names of other packages. Where several are given, the first that the call knows is meant.
_OTHER_NAMES: dict[str, tuple[str, ...]] = {
    **{parameter.symbol: (name,) for name, parameter in PARAMETERS.items()},
    **{"M1": ("pendulum_mass",), "M2": ("oscillator_mass",), "l": ("length",), "L": ("length",)},
    **{"K1": ("torsional_stiffness",), "K2": ("stiffness",), "k": ("stiffness",)},
    **{"C1": ("torsional_damping",), "C2": ("damping",), "c": ("damping",)},
    **{"f10": ("moment_amplitude",), "f20": ("force_amplitude",), "Delta": ("gap",)},
    **{"C10": ("static_moment",), "F20": ("static_force",)},
    **{"Omega": ("drive_frequency",), "frequency": ("drive_frequency",), "e": ("restitution",)},
    "restitution": ("r_low", "r_0"),
    **{"M": ("mass",), "K": ("stiffness",), "C": ("damping",), "F": ("drive_amplitude",)},
    **dict.fromkeys(("zeta", "zetas"), ("damping_ratios", "damping")),
    **dict.fromkeys(("x0", "y0", "X0", "state", "start", "initial_state", "ic"), ("initial",)),
    **dict.fromkeys(("duration", "t_end", "tmax", "t_max", "T"), ("time", "periods")),
    **dict.fromkeys(("cycles", "n_periods", "steps"), ("periods",)),
    **dict.fromkeys(("threads", "n_jobs", "cores"), ("workers",)),
    **dict.fromkeys(("names", "unknowns", "parameters", "free"), ("unknown",)),
    **dict.fromkeys(("tolerance", "tol", "atol"), ("chatter_tolerance",)),
    **{"x": ("x1", "q_0"), "q": ("q_0",), "v": ("v1", "v_0")},
    **dict.fromkeys(("force", "forcing", "F0"), ("drive_amplitude", "force_amplitude")),
    **dict.fromkeys(("load", "weight", "gravity", "preload"), ("static_load", "static_force")),
    **dict.fromkeys(("cor", "coefficient_of_restitution"), ("restitution",)),
    **{"clearance": ("gap",), "direction": ("normal",), "masses": ("mass",)},
    **{"x1": ("q_0",), "x2": ("q_1",), "v1": ("v_0",), "v2": ("v_1",)},
}


# Kinds of bifurcations, also as AUTO and MatCont abbreviate them.
_OTHER_KINDS: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(("fold", "limit_point", "turning_point", "SN", "LP"), ("saddle_node",)),
    **dict.fromkeys(("flip", "PD"), ("period_doubling",)),
    **dict.fromkeys(("hopf", "torus", "secondary_hopf", "NS", "TR"), ("neimark_sacker",)),
    **dict.fromkeys(("pitchfork", "transcritical", "BP"), ("branch_point",)),
    **{"CP": ("cusp",), "chatter": ("chatter_onset",)},
}


# What else columns of a table are called.
_OTHER_COLUMNS = {"v_pre": "v1_pre", "v_post": "v1_post", "velocity": "approach_velocity"}
# The same of names with a number: the velocity of a state, those before and after an impact.
_OTHER_PARTS = {"v": "v_pre", "v_pre": "v", "v_post": "v", "x": "q", "u": "q"}
_NUMBERED = re.compile(r"(.+)(_(?:0|[1-9]\d*))")


def _spelled(name: str) -> list[str]:
    """Return a name as it stands, and if it is none, with other capitals: PD, pd, Flip."""
    is_known = name in _OTHER_NAMES or name in _OTHER_KINDS
    return [name] if is_known else [*dict.fromkeys((name, name.lower(), name.upper()))]


# What counts in a name beside its place: gap of gap_0, stiffness of stiffness[0, 1].
_PLACED = re.compile(r"(.+?)(?:_\d+|\[.*\])")
_WORD = re.compile(r"[^\W_]+")
# A name so like another one is a slip of the pen; one less like it may be a part of others.
_SLIP = 0.8
# Parts of names have at least so many letters.
_SHORTEST = 3
# Of more names that may be meant none is, or of places the first and the last are told.
_MOST_MEANT = 4


def _place_of(name: str) -> str:
    """Return a name without the place that it ends with."""
    match = _PLACED.fullmatch(name)
    return match[1] if match else name


def _having(part: str, names: Iterable[str]) -> list[str]:
    """Return the names with a word that begins so, one of those that differ in their place."""
    found: dict[str, str] = {}
    for name in names:
        if len(part) >= _SHORTEST and f"_{part}" in f"_{name}":
            found.setdefault(_place_of(name), name)
    return [*found.values()] if len(found) <= _MOST_MEANT else []


def meant_by(name: str, known: Iterable[str]) -> list[str]:
    """Return the known names that may be meant by an unknown one, the likeliest first.

    One for what has another name here, and for a slip of the pen. Several for a place that is none,
    as ``gap_2`` of two stops, and for a part of names, as ``damping``.
    """
    import difflib  # here, to keep the import of the package light

    names = [*known]
    tables = (_OTHER_NAMES, _OTHER_KINDS)
    others = [other for each in _spelled(name) for table in tables for other in table.get(each, ())]
    exact = [*others, _OTHER_COLUMNS.get(name, ""), f"{name}_0", f"{name}[0, 0]"]
    if match := _NUMBERED.fullmatch(name):
        exact.append(f"{_OTHER_PARTS.get(match[1])}{match[2]}")
    if meant := [other for other in exact if other in names]:
        return meant[:1]
    if match and (
        places := [
            each
            for each in names
            if (own := _NUMBERED.fullmatch(each)) and own[1] == match[1] and own[2] != match[2]
        ]
    ):
        return places
    if slip := difflib.get_close_matches(name, names, n=1, cutoff=_SLIP):
        return slip
    for part in (name, *others):
        if parts := _having(part, names):
            return parts
    # A slip in a part.
    words = {word: None for each in names for word in _WORD.findall(_place_of(each))}
    for word in difflib.get_close_matches(name, words, n=1, cutoff=_SLIP):
        if parts := _having(word, names):
            return parts
    return difflib.get_close_matches(name, names, n=1)


def closest(name: str, known: Iterable[str]) -> str | None:
    """Return the known name that is meant by an unknown one, None if none is close."""
    meant = meant_by(name, known)
    return meant[0] if meant else None


def _in_words(names: list[str]) -> str:
    """Return names of which one is meant, for a message: of many the first and the last."""
    if len(names) > _MOST_MEANT:
        return f"one of {names[0]} ... {names[-1]}"
    *first, last = names
    return f"{', '.join(first)} or {last}" if first else last


# Quantities of `System.from_physical` that `System` itself does not have.
IN_SI = frozenset(
    (
        *("pendulum_mass", "oscillator_mass", "length"),
        *("torsional_stiffness", "stiffness", "torsional_damping"),
    )
)


# What a structure has, and a `System` has not.
_OF_STRUCTURES = {"mass", "masses", "m", "stops", "stop", "damping_ratios", "normal"}


def close_to(name: str, known: Iterable[str]) -> str:
    """Return a hint for the error about an unknown name: the known names it may stand for."""
    names = [*known]
    others = (other for each in _spelled(name) for other in (each, *_OTHER_NAMES.get(each, ())))
    if "mass_ratio" in names and (own := _OF_STRUCTURES & {name}) and not own & {*names}:
        return "; a vibroimpact.Structure takes masses, springs and stops of your own, as matrices."
    physical = [each for each in others if each in IN_SI]
    if physical and "mass_ratio" in names and physical[0] not in names:
        taken = "System.from_physical takes it, and sweeps of such a system vary it with units='SI'"
        other = "other masses and springs are a vibroimpact.Structure"
        return f"; {physical[0]} is a quantity in SI units: {taken}; {other}."
    meant = meant_by(name, names)
    return f", did you mean {_in_words(meant)}?" if meant else ""


# What the verbs of other packages are called here.
_OTHER_VERBS: dict[str, str] = {
    **dict.fromkeys(("solve", "solve_ivp", "integrate"), "simulate"),
    **dict.fromkeys(("poincare", "poincare_section"), "plot.impact_section or plot.stroboscopic"),
    **dict.fromkeys(("lyapunov", "lyapunov_exponents"), "lyapunov_spectrum"),
    **dict.fromkeys(("basins_of_attraction", "attractors"), "basins"),
    **dict.fromkeys(("follow", "continue_motion"), "follow_motion"),
    **dict.fromkeys(("find_periodic_orbit", "periodic_orbit", "orbit"), "periodic_motion"),
    **dict.fromkeys(("animate", "animation"), "plot.animation, or run.animate()"),
    **dict.fromkeys(("bifurcation", "diagram"), "bifurcation_diagram"),
    **dict.fromkeys(("ImpactOscillator", "Oscillator", "BouncingBall", "Parameters"), "System"),
    **dict.fromkeys(("Wall", "Obstacle", "Barrier", "Constraint"), "Stop"),
    **dict.fromkeys(("Mass", "Spring", "Chain", "MassSpring", "TwoMass", "Beam"), "Structure"),
}


def meant_in_package(name: str, public: Iterable[str]) -> str:
    """Return a hint for the error about a name that the package does not have."""
    if name in _OTHER_VERBS:
        return f", did you mean {_OTHER_VERBS[name]}?"
    return close_to(name, public)


# What attributes of results are called elsewhere; the first that an object has is meant.
_OTHER_ATTRIBUTES: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(("t", "times", "y", "q", "v", "x"), ("trajectory",)),
    "states": ("trajectory", "final_states"),
    **dict.fromkeys(("eigenvalues", "floquet_multipliers"), ("multipliers",)),
    "to_csv": ("to_pandas",),
    "at": ("run",),
    "poincare": ("stroboscopic",),
    **dict.fromkeys(("verdict", "stability"), ("stretches",)),
    "energy": ("energy_audit",),
    **dict.fromkeys(("lyapunov", "lyapunov_exponent"), ("largest_exponent", "largest")),
}
# How they are written, where the name alone does not say it.
_IN_FULL = {"trajectory": "trajectory(times)", "to_pandas": "to_pandas().to_csv(path)"}


# Columns of tables that are taken for attributes of what has the table: what they may be called.
_COLUMNS: dict[str, tuple[str, ...]] = {
    "u": ("approach_velocity",),
    "v1": ("v1_pre",),
    "v2": ("v2_pre",),
    "v1_pre": ("v1",),
    "v2_pre": ("v2",),
}


def meant_of_object(
    name: str, known: Iterable[str], tables: Mapping[str, Iterable[str]] | None = None
) -> str:
    """Return a hint for the error about an attribute that an object does not have.

    ``tables`` are those of the object, with their columns.
    """
    names = [other for other in known if other[:1] != "_"]
    for table, columns in (tables or {}).items():
        for column in (name, *_COLUMNS.get(name, ())):
            if column in columns:
                return f", did you mean {table}[{column!r}]?"
    for meant in _OTHER_ATTRIBUTES.get(name, ()):
        if meant in names:
            return f", did you mean {_IN_FULL.get(meant, meant)}?"
    return close_to(name, names)
