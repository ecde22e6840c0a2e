"""Certificates of all kinds, verified anew from their files."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from typing import Any, Final

from ..errors import ProofError
from .branch_files import BRANCH_FORMAT, verified_branch
from .branch_result import BranchProof
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
        content = json.loads(raw)
        if not isinstance(content, dict) or content.get("format") not in _KINDS:
            raise ProofError("not a certificate of this format")
        return _KINDS[content["format"]](content)
    except ProofError:
        raise
    except (KeyError, TypeError, ValueError, IndexError, AttributeError, OverflowError) as error:
        raise ProofError(f"damaged: {error!r}") from error
