"""What results show of themselves in a notebook: a table of facts and a small picture."""

from __future__ import annotations

from .interruption import interruptible
from .verbs import verb

# What is said of a result: a name, and a number or words.
Facts = dict[str, object]


@interruptible
class Shown:
    """A result that a notebook shows as a table with a picture."""

    def _facts(self) -> Facts:
        """Return what the table says, in its order."""
        return {}

    def _repr_html_(self) -> str:
        """Return the table and the picture as HTML: no script, and nothing from elsewhere."""
        html: str = verb("html")(self, self._facts())
        return html
