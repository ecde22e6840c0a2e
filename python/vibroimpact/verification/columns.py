"""The columns of the tables of a verification: which numbers of a run are compared."""

import numpy as np

#: Numbers of an impact that are verified, besides its regime: of the motion, and what follows.
MOTION_NUMBERS = ("time", "x1", "v1_pre", "v1_post", "x2", "v2_pre", "v2_post")
FURTHER_NUMBERS = ("phase", "impulse_normal", "impulse_tangential", "energy_loss")
IMPACT_NUMBERS = MOTION_NUMBERS + FURTHER_NUMBERS
#: Numbers of an event of sustained contact, and those of a section.
CONTACT_NUMBERS = ("time", "x1", "v1", "x2", "v2")
SECTION_NUMBERS = ("x1", "v1", "x2", "v2")
#: A double has no more digits than these.
MOST_DIGITS = 16.0

_JUDGED = [("digits", "f8"), ("reference_error", "f8"), ("certified", "?")]
IMPACT_DTYPE = np.dtype(
    [
        ("number", "i8"),
        ("time", "f8"),
        *((f"error_{name}", "f8") for name in IMPACT_NUMBERS),
        ("regime", "i8"),
        ("regime_agrees", "?"),
        ("ambiguous", "?"),
        *_JUDGED,
        ("growth", "f8"),
    ]
)
CONTACT_DTYPE = np.dtype(
    [
        ("row", "i8"),
        ("kind", "i8"),
        ("time", "f8"),
        *((f"error_{name}", "f8") for name in CONTACT_NUMBERS),
        *_JUDGED,
        ("growth", "f8"),
    ]
)
SECTION_DTYPE = np.dtype(
    [
        ("row", "i8"),
        ("time", "f8"),
        *((f"error_{name}", "f8") for name in SECTION_NUMBERS),
        *_JUDGED,
    ]
)
FINAL_DTYPE = np.dtype(
    [("time", "f8"), *((f"error_{name}", "f8") for name in SECTION_NUMBERS), *_JUDGED]
)
MISSED_DTYPE = np.dtype([("time", "f8"), ("jump", "f8"), ("graze", "i8"), *_JUDGED])


def structure_tables(size: int) -> dict[str, np.dtype[np.void]]:
    """The tables of a structure's run: errors of q, v as arrays of so many coordinates."""
    time, state = ("time", "f8"), [(f"error_{name}", "f8", (size,)) for name in ("q", "v")]
    states = [(f"error_{name}", "f8", (size,)) for name in ("q", "v_pre", "v_post")]
    more = ("approach_velocity", "phase", "impulse_normal", "impulse_tangential", "energy_loss")
    impact = [
        ("number", "i8"),
        ("stop", "i8"),
        time,
        ("error_time", "f8"),
        *states,
        *((f"error_{name}", "f8") for name in more),
        ("regime", "i8"),
        ("regime_agrees", "?"),
        ("ambiguous", "?"),
        *_JUDGED,
        ("growth", "f8"),
    ]
    contact = [("row", "i8"), ("kind", "i8"), ("stop", "i8"), time, ("error_time", "f8")]
    return {
        "impacts": np.dtype(impact),
        "contacts": np.dtype([*contact, *state, *_JUDGED, ("growth", "f8")]),
        "sections": np.dtype([("row", "i8"), time, *state, *_JUDGED]),
        "final": np.dtype([time, *state, *_JUDGED]),
        "missed": MISSED_DTYPE,
    }
