"""Certificates of all kinds: what they state in words, and how they are written and read."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

from ..arguments import path as path_of
from ..arguments import reject
from ..errors import ProofError
from ..whole_file import whole_file
from .branch_files import verified_branch
from .branch_result import BranchProof
from .branch_statement import branch_statement
from .entries import check_entries
from .files import verified
from .result import Proof
from .solutions_files import verified_solutions
from .solutions_result import SolutionsProof
from .solutions_statement import solutions_statement
from .statement import motion_statement

AnyProof = Proof | SolutionsProof | BranchProof


@dataclass(frozen=True)
class Kind:
    """A kind of certificate: entries that pose its problem, entries of its claims, what is done."""

    name: str
    problem: tuple[str, ...]
    claims: tuple[str, ...]
    statement: Callable[[Any], str]
    verified: Callable[[dict[str, Any], Mapping[str, Any]], AnyProof]


KINDS: Final[dict[type[AnyProof], Kind]] = {
    Proof: Kind(
        "vibroimpact proof 1",
        ("machine", "m", "legs", "precision", "box"),
        ("verdict", "stability", "box", "discs"),
        motion_statement,
        verified,
    ),
    SolutionsProof: Kind(
        "vibroimpact proof of all motions with one impact 1",
        ("machine", "n", "precision", "cuts", "holds", "orbits"),
        ("everywhere",),
        solutions_statement,
        verified_solutions,
    ),
    BranchProof: Kind(
        "vibroimpact branch proof 1",
        ("machine", "parameter", "place", "within", "precision", "pieces"),
        ("stretches", "bifurcations"),
        branch_statement,
        verified_branch,
    ),
}


def statement(proof: AnyProof) -> str:
    """The theorem, or what is open."""
    return KINDS[type(proof)].statement(proof)


def write_proof(path: str | os.PathLike[str], proof: AnyProof) -> None:
    """Write a certificate to ``path``; the file appears complete or not at all."""
    path = path_of("path", path)
    if not proof.certificate:
        reject("proof", proof, "one that shows something: this one is undecided, or shows nothing")
    told = {"format": KINDS[type(proof)].name, **proof.certificate, "statement": proof.statement}
    with whole_file(path) as file:
        file.write(json.dumps(told, indent=1).encode())


def read_proof(path: str | os.PathLike[str]) -> AnyProof:
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
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise ProofError(f"{path}: no certificate, or a damaged one: it is no JSON text") from error
    except ProofError:
        raise
    except (ValueError, RecursionError) as error:
        raise ProofError(f"damaged: {error!r}") from error
    try:
        return _verified(content)
    except ProofError:
        raise
    except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError) as error:
        raise ProofError(f"damaged: {error!r}") from error


def _verified(content: dict[str, Any]) -> AnyProof:
    kinds = [kind for kind in KINDS.values() if kind.name == content["format"]]
    if not kinds:
        raise ProofError("not a certificate of this format")
    (kind,), claims = kinds, content["claims"]
    entries = {"format", *kind.problem, "claims", "statement"}
    if {*content} != entries or {*claims} != {*kind.claims}:
        raise ProofError("a certificate with other entries")
    check_entries(content["machine"])
    proof = kind.verified({name: content[name] for name in kind.problem}, claims)
    if content["statement"] != proof.statement:
        raise ProofError("its statement is not what is shown")
    return proof


def _entries(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object of a file; of two entries with one name a reader could take either."""
    found = dict(pairs)
    if len(found) != len(pairs):
        raise ProofError("an entry that is there twice")
    return found
