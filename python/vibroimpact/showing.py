"""What results show of themselves: a table, a picture in a notebook, and hints at their names."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .hints import meant_of_object
from .interruption import interruptible
from .verbs import verb

# What is said of a result: a name, and a number or words.
Facts = dict[str, object]


@interruptible
class Shown:
    """A result that a notebook shows as a table with a picture; wrong names of it get a hint."""

    # Not for type checkers: they know the names.
    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """Say which name was meant.

            Raises
            ------
            AttributeError
                Always; that of a property which fails is its own.
            """
            try:
                return object.__getattribute__(self, name)
            except AttributeError as error:
                if name[:1] == "_" or hasattr(type(self), name):
                    raise
                hint = meant_of_object(name, dir(self), _tables(self))
                # With an object Python would add a hint of its own.
                raise AttributeError(f"{error}{hint}", name=name) from None

    def _facts(self) -> Facts:
        """Return what the table says, in its order."""
        return {}

    def _repr_html_(self) -> str:
        """Return the table and the picture as HTML: no script, and nothing from elsewhere."""
        html: str = verb("html")(self, self._facts())
        return html


def _tables(shown: Shown) -> dict[str, tuple[str, ...]]:
    """Return the columns of the table of what has one, or of the first of a sequence of such."""
    first = "motions" in dir(shown) and next(iter(getattr(shown, "motions", ())), None)
    for each, where in ((shown, ""), (first, "motions[0]." if first else "")):
        for table in ("impacts", "solutions"):
            if table in dir(type(each)) or table in getattr(each, "__dict__", {}):
                dtype = getattr(getattr(each, table, None), "dtype", None)
                if names := getattr(dtype, "names", None):
                    return {f"{where}{table}": names}
    return {}


def counted(number: int, what: str, *, ending: str = "s") -> str:
    """Return how many of something there are, in words; ``ending`` is that of several."""
    return f"{number} {what}{'' if number == 1 else ending}"


# Numbers of an array in a table.
_MOST_SHOWN = 8


def in_a_line(numbers: NDArray[np.float64]) -> str:
    """Return the first numbers of an array as a table tells them, and how many more there are."""
    shown = ", ".join(f"{each:.6g}" for each in numbers[:_MOST_SHOWN])
    more = len(numbers) - _MOST_SHOWN
    return f"{shown} and {more} more" if more > 0 else shown
