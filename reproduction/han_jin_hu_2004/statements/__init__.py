"""Every statement of the paper that can be checked, and a verdict that is computed.

`statement` says what a statement is; `printed_*` hold the paper's formulas as they are printed; the
other modules judge, in the order of the paper; `page` writes docs/claims.md.
"""

from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from types import ModuleType

from vibroimpact import ParameterError

from . import (
    existence_figures,
    explicit,
    frictional,
    general,
    impact_law,
    model,
    named_motions,
    planar,
    restitution_laws,
    sections,
    slip,
    stability,
    undamped,
    undecided,
)
from .statement import STATEMENTS, Statement


def _of(*modules: ModuleType) -> tuple[Statement, ...]:
    """Return the statements of modules in the order in which they stand there."""
    found: list[Statement] = []
    for module in modules:
        for item in vars(module).values():
            if isinstance(item, Statement):
                found.append(item)
            elif isinstance(item, dict):
                found += [value for value in item.values() if isinstance(value, Statement)]
    return tuple(found)


GROUPS: dict[str, tuple[Statement, ...]] = {
    "Sections 1 and 2: laws of restitution": _of(restitution_laws, slip, planar),
    "Sections 2.1 and 2.2: the impact law": _of(impact_law),
    "Sections 3.1 and 3.2: model and period n-1 motions": _of(model, explicit),
    "Section 3.3: stability": _of(stability),
    "Fig. 1 and section 4: contact and Poincaré sections": _of(sections),
    "Figs. 2 and 3": _of(existence_figures),
    "Figs. 5, 6, 9 and 10: named motions": _of(named_motions),
    "Section 4.1: the undamped system": _of(undamped),
    "Sections 4.2.1 and 5: damping": _of(general),
    "Section 4.2.2: friction": _of(frictional),
    "What cannot be decided": _of(undecided),
}
"""The statements by what they are about, in the order of the page."""
STATEMENTS.update((item.id, item) for statements in GROUPS.values() for item in statements)


def chosen(ids: Iterable[str]) -> Sequence[Statement]:
    """Return statements by their ids, all for none.

    Raises
    ------
    ParameterError
        If there is none of a name.
    """
    names = list(ids) or list(STATEMENTS)
    for name in names:
        if name not in STATEMENTS:
            close = get_close_matches(name, STATEMENTS, n=1)
            raise ParameterError(
                f"{name!r} is no statement; `vibroimpact claims --list` names all"
                f"{f', did you mean {close[0]}?' if close else ''}"
            )
    return [STATEMENTS[name] for name in names]


__all__ = ["GROUPS", "STATEMENTS", "Statement", "chosen"]
