"""What all proofs have: a statement in words, and a certificate that can be saved."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from ..interruption import interruptible
from ..showing import Shown
from ..verbs import verb


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Theorem(Shown):
    """A proof that prints as its statement; without a certificate it shows nothing."""

    verdict: str
    certificate: Mapping[str, Any] = field(default_factory=dict)

    def __bool__(self) -> bool:
        """Whether the verdict is "proved"."""
        return self.verdict == "proved"

    @cached_property
    def statement(self) -> str:
        """What is shown, as a theorem that can be printed; or what is open.

        Examples
        --------
        >>> print(proof.statement[:38])
        Theorem. Consider vibroimpact's System
        """
        text: str = verb("proof_statement")(self)
        return text

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the certificate to ``path`` (JSON); ``vibroimpact.check_proof`` verifies it.

        Raises
        ------
        ParameterError
            If the proof is undecided, or shows nothing: there is nothing to write.
        OSError
            If it cannot be written.

        Examples
        --------
        >>> proof.save("proof.json")
        >>> vi.check_proof("proof.json").statement == proof.statement
        True
        """
        verb("write_proof")(path, self)

    def __str__(self) -> str:
        """The statement."""
        return self.statement
