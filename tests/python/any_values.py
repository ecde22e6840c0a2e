"""Values of every kind that a caller may hand over, and which of them each kind of argument takes.

What is not taken must be refused, by the name of the argument and before any work.
"""

import datetime
import decimal
import fractions
import math

import numpy as np

VALUES = {
    "none": None,
    # Scalars: every kind of float, and what looks like a number.
    "nan": math.nan,
    "inf": math.inf,
    "-inf": -math.inf,
    "-0": -0.0,
    "subnormal": 5e-324,
    "huge": 1.7e308,
    "minus": -1.0,
    "whole": 2,
    "numpy whole": np.int8(2),
    "whole float": 2.0,
    "whole, minus": -2,
    "whole, huge": 10**400,
    "half": np.float16(0.5),
    "half, nan": np.float16("nan"),
    "half, longdouble": np.longdouble("0.5"),
    "longdouble beyond": np.longdouble("1e4000"),
    "fraction": fractions.Fraction(1, 2),
    "0-d": np.array(0.5),
    "true": True,
    "numpy true": np.True_,
    "complex": 1j,
    "decimal": decimal.Decimal("0.5"),
    "decimal nan": decimal.Decimal("NaN"),
    "masked": np.ma.masked,
    "nat": np.datetime64("NaT"),
    # What is no number at all.
    "word": "newton",
    "word, foreign": "n\u00e9wton",
    "word, half a character": "\udc80",
    "word, zero byte": "a\x00b",
    "word, empty": "",
    "number as a word": "1.0",
    "bytes": b"\x00",
    "object": object(),
    "type": float,
    "function": len,
    "date": datetime.date(2004, 1, 1),
    "dict": {"gap": 1.0},
    "set": {1.0, 2.0},
    "list of nothing": [],
    "ragged": [[0.0], [0.0, 1.0]],
    # Arrays of every shape and type.
    "0-d object": np.array(None, dtype=object),
    "empty": np.array([]),
    "empty rows": np.empty((0, 4)),
    "empty columns": np.empty((4, 0)),
    "pair": np.array([0.25, 0.5]),
    "pair of float16": np.array([0.25, 0.5], np.float16),
    "pair of longdoubles": np.array([0.25, 0.5], np.longdouble),
    "pair, subnormal": np.array([5e-324, 0.5]),
    "pair, huge": np.array([0.5, 1.7e308]),
    "pair of whole": np.array([0, 1], np.int8),
    "pair of unsigned": np.array([2**64 - 1, 0], np.uint64),
    "pair, nan": np.array([0.5, math.nan]),
    "pair, inf": np.array([math.inf, 0.5]),
    "pair of longdoubles beyond": np.array(["1e4000", "0.5"], np.longdouble),
    "pair of bools": np.array([True, False]),
    "pair of complex": np.array([1j, 2.0]),
    "pair of objects": np.array([0.5, None], dtype=object),
    "pair of words": np.array(["a", "b"]),
    "pair of dates": np.array(["2004-01-01", "NaT"], "M8[D]"),
    "pair of records": np.zeros(2, [("x1", float), ("v1", float)]),
    "pair, masked": np.ma.masked_array([0.5, 0.6], [True, False]),
    "state": np.array([0.125, 0.25, -0.125, 0.5]),
    "state of float16": np.array([0.125, 0.25, -0.125, 0.5], np.float16),
    "state, nan": np.array([0.0, math.nan, 0.0, 0.0]),
    "state, inf": np.array([0.0, 0.0, -math.inf, 0.0]),
    "state, masked": np.ma.masked_array([0.0, 0.5, 0.0, 0.0], [True, False, False, False]),
    "states": np.array([[0.125, 0.25, -0.125, 0.5], [0.0, 0.5, 0.0, 0.0]]),
    "rows of two": np.array([[0.25, 0.5], [0.5, 0.25], [0.0, 0.5]]),
    "deep": np.zeros((2, 2, 2, 4)),
}

_WHOLE = {"whole", "numpy whole", "whole float", "-0"}
_HALF = {"half", "half, longdouble", "fraction", "0-d"}
_NOT_NEGATIVE = {"-0", "subnormal", "huge", "whole float", *_WHOLE, *_HALF}
_PAIRS = {
    *("pair", "pair of float16", "pair of longdoubles", "pair, subnormal", "pair, huge"),
    *("pair of whole", "pair of unsigned"),
}
_ONE_DIMENSION = {*_PAIRS, "state", "state of float16"}
# Half a character stands for a byte of a name that is no text.
_NAMES = {"word", "word, foreign", "word, half a character", "number as a word"}

# Of each kind of argument, the values that may be taken. A value taken may still be refused for
# what it is: the bodies overlap in a state, a step is too short.
TAKES: dict[str, set[str]] = {
    "number": {*_NOT_NEGATIVE, "minus", "whole, minus"},
    "number >= 0": _NOT_NEGATIVE,
    "number > 0": _NOT_NEGATIVE - {"-0"},
    "number > 0 or none": {*_NOT_NEGATIVE, "none"} - {"-0"},
    "step": _NOT_NEGATIVE - {"-0", "huge"},
    "step or none": {*_NOT_NEGATIVE, "none"} - {"-0", "huge"},
    "part of 1": {"-0", "subnormal", *_HALF},
    "phase": _NOT_NEGATIVE - {"huge"},
    "whole number": _WHOLE,
    "whole number > 2": set(),
    "index": {*_WHOLE, "minus", "whole, minus"},
    "whole number or none": {*_WHOLE, "none"},
    "whole number > 2 or none": {"none"},
    "true or false": {"true", "numpy true"},
    "true, false or none": {"true", "numpy true", "none"},
    # Where it says "True or False" to the letter.
    "python's true or false": {"true"},
    "law": {"word"},
    "a word of a list": set(),
    "words of a list": {"list of nothing"},
    "object": set(),
    "function": set(),
    "names": {"dict"},
    "object or none": {"none"},
    "directions or none": {"none"},
    "state": {"state", "state of float16"},
    "state or states": {"state", "state of float16", "states", "empty rows"},
    "state or some states": {"state", "state of float16", "states"},
    # Of four coordinates.
    "state of a structure": {"states"},
    "states or a number": {"state", "state of float16", "states", *_WHOLE},
    "axis": _ONE_DIMENSION,
    "axis of starts": _ONE_DIMENSION - {"pair of unsigned"},
    "axis >= 0": _ONE_DIMENSION - {"state", "state of float16"},
    "axis or none": {*_ONE_DIMENSION, "none"},
    "times": {
        *("empty", "list of nothing", "minus", "whole, minus"),
        *_NOT_NEGATIVE,
        *_ONE_DIMENSION,
    },
    "errors or none": {*_NOT_NEGATIVE, *_ONE_DIMENSION, "none"},
    "name or none": {*_NAMES, "word, zero byte", "word, empty", "none"},
    "numbers": {
        *("-0", "subnormal", "huge", "minus", "whole, minus", "whole float"),
        *("empty", "empty rows", "empty columns", "list of nothing", "rows of two", "states"),
        *("deep", *_WHOLE, *_ONE_DIMENSION, "half", "half, longdouble", "0-d"),
    },
    "whole numbers": set(),
    "range": set(),
    "range around 0.5": _PAIRS - {"pair of unsigned", "pair, huge"},
    "range or none": {*_PAIRS, "none"} - {"pair of unsigned", "pair, huge"},
    "pair or none": {"none", *_PAIRS},
    "pair, number or none": {"none", *_PAIRS, *_NOT_NEGATIVE},
    "pair": _PAIRS,
    "complex pair or none": {"none", "pair of complex", *_PAIRS},
    # Beyond the frequencies of modes.
    "ascending pair": _PAIRS - {"pair, huge", "pair of unsigned", "pair, subnormal"},
    "stops": {"list of nothing"},
    "rows of two": {"rows of two"},
    "grid value": {*_HALF},
    "value of a branch": set(),
    "steps or none": {*_WHOLE, "none"},
    "path that is missing": _NAMES,
    "path": _NAMES,
    "path or none": {*_NAMES, "none"},
}

# What is not tried, and why.
NOT_TRIED = {
    ("axis of starts", "pair of unsigned"): "a tip that turns 1e19 times in a period",
    ("function", "function"): "it is called, and its errors are its own",
    ("function", "type"): "the same",
    ("directions or none", "dict"): "the error shows the value of its entry",
}
