"""Certificates of all kinds, verified anew from their files."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from typing import Any, Final

from ..errors import ProofError
from .branch_files import BRANCH_FORMAT, verified_branch
from .branch_result import BranchProof
from .entries import check_entries
from .files import FORMAT, verified
from .result import Proof
from .solutions_files import SOLUTIONS_FORMAT, verified_solutions
from .solutions_result import SolutionsProof

_KINDS: Final[dict[str, Callable[[dict[str, Any]], Proof | SolutionsProof | BranchProof]]] = {
    FORMAT: verified,
    BRANCH_FORMAT: verified_branch,
    SOLUTIONS_FORMAT: verified_solutions,
}


def read_proof(path: str | os.PathLike[str]) -> Proof | SolutionsProof | BranchProof:
    """Verify a certificate anew.

    Raises
    ------
    ProofError
        If it is damaged, or claims what is not shown.
    """
    with open(path, "rb") as file:
        raw = file.read()
    try:
        content = json.loads(raw, object_pairs_hook=_entries)
        if not isinstance(content, dict) or content.get("format") not in _KINDS:
            raise ProofError("not a certificate of this format")
        check_entries(content["machine"])
        return _KINDS[content["format"]](content)
    except ProofError:
        raise
    except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError) as error:
        raise ProofError(f"damaged: {error!r}") from error


def _entries(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object of a file; of two entries with one name a reader could take either."""
    found = dict(pairs)
    if len(found) != len(pairs):
        raise ProofError("an entry that is there twice")
    return found
