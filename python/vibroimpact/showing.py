"""What results show of themselves: a table, a picture in a notebook, and hints at their names."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

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
                hint = meant_of_object(name, dir(self), self._columns())
                # With an object Python would add a hint of its own.
                raise AttributeError(f"{error}{hint}", name=name) from None

    def _columns(self) -> dict[str, tuple[str, ...]]:
        """Return the columns of its table, for hints, without building it; {} if it has none.

        Here of tables and motions that are fields; where a property makes one, its class knows.
        """
        own = getattr(self, "__dict__", {})
        for table in ("impacts", "solutions"):
            dtype = getattr(own.get(table), "dtype", None)
            if names := getattr(dtype, "names", None):
                return {table: names}
        first = next(iter(own.get("motions", ())), None)
        columns = first._columns() if isinstance(first, Shown) else {}
        return {f"motions[0].{table}": names for table, names in columns.items()}

    def _facts(self) -> Facts:
        """Return what the table says, in its order."""
        return {}

    def _repr_html_(self) -> str:
        """Return the table and the picture as HTML: no script, and nothing from elsewhere."""
        html: str = verb("html")(self, self._facts())
        return html


def counted(number: int, what: str, *, ending: str = "s") -> str:
    """Return how many of something there are, in words; ``ending`` is that of several."""
    return f"{number} {what}{'' if number == 1 else ending}"


# Of many things in a line of a table.
_MOST_SHOWN = 8


def in_a_line(
    things: Sequence[Any] | NDArray[Any], tell: Callable[[Any], str] = "{:.6g}".format
) -> str:
    """Return the first of some numbers, or things, as a table tells them; and how many more."""
    shown = ", ".join(tell(each) for each in things[:_MOST_SHOWN])
    more = len(things) - _MOST_SHOWN
    return f"{shown} and {more} more" if more > 0 else shown
