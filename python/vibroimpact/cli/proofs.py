"""Proofs of the motions that `orbits` lists."""

import argparse
import functools
from collections.abc import Sequence
from pathlib import Path

from ..errors import ParameterError
from ..orbits import Branch, PeriodicMotion
from ..proof import BranchProof, Proof, prove
from ..structure_motion import StructureOrbit
from . import outputs
from .exit_codes import ExitCode


def add_options(command: argparse.ArgumentParser) -> None:
    """Add the options with which `orbits` proves its motions."""
    group = command.add_argument_group("proof")
    group.add_argument(
        "--prove",
        action="store_true",
        help="prove each motion, or the branch, in ball arithmetic (python-flint)",
    )
    group.add_argument(
        "--proof-out",
        type=Path,
        metavar="DIR",
        help="prove each, and write certificates there, 1_M-N.json ..., for check-proof",
    )


def check(options: argparse.Namespace) -> None:
    """Refuse a place that is no folder, before any work."""
    if not wanted(options):
        return
    folder = options.proof_out
    if folder is not None and folder.exists() and not folder.is_dir():
        raise ParameterError(f"--proof-out {folder}: not a folder")


def wanted(options: argparse.Namespace) -> bool:
    """Whether motions are to be proved."""
    return bool(options.prove or options.proof_out is not None)


def prove_branches(options: argparse.Namespace, branches: Sequence[Branch]) -> ExitCode:
    """Prove branches, print what is shown and what is open, and write certificates."""
    stream, code = outputs.summary_stream(options), ExitCode.DONE
    for number, branch in enumerate(branches):
        if all(len(piece.values) < 2 for piece in branch.pieces):
            continue
        found, interrupted = outputs.partial_on_interrupt(functools.partial(_proved, branch))
        print(f"\n{found.statement}", file=stream)
        for left in found.uncovered:
            print(f"open from {left.lo!r} to {left.hi!r}: {left.why}", file=stream)
            code = ExitCode.INCOMPLETE
        if options.proof_out is not None and found.stretches:
            options.proof_out.mkdir(parents=True, exist_ok=True)
            found.save(options.proof_out / f"{number}_branch.json")
        if interrupted is not None:
            raise interrupted
    return code


def _proved(branch: Branch) -> BranchProof:
    return prove(branch)


class Proving:
    """The proofs of some motions; after Ctrl-C those that are done."""

    def __init__(self, motions: Sequence[PeriodicMotion | StructureOrbit]) -> None:
        self.done: list[Proof] = []
        self.interrupted: KeyboardInterrupt | None = None
        try:
            for motion in motions:
                self.done.append(prove(motion))
        except KeyboardInterrupt as error:
            self.interrupted = error
        self.complete = all(proof.verdict != "undecided" for proof in self.done)

    def columns(self, count: int) -> list[dict[str, str]]:
        """The column of each motion."""
        told = [_told(proof) for proof in self.done]
        return [{"proof": text} for text in told + ["interrupted"] * (count - len(told))]

    def write(self, folder: Path) -> None:
        """Write what is shown, a file for each motion."""
        folder.mkdir(parents=True, exist_ok=True)
        for number, proof in enumerate(self.done, start=1):
            if proof.verdict != "undecided":
                proof.save(folder / f"{number}_{proof.label}.json")


def _told(proof: Proof) -> str:
    if proof.verdict != "proved":
        return f"{proof.verdict}: {proof.why}"
    return f"proved, {proof.stability}" if proof.stability != "undecided" else "proved"
