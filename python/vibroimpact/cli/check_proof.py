"""`vibroimpact check-proof`: certificates of proofs, verified anew (proofs page)."""

import argparse
from pathlib import Path
from typing import Any

from ..errors import ParameterError
from ..proof import check_proof
from . import options as shared
from .exit_codes import ExitCode

ABOUT = """\
Verify the certificate of a proof anew, from the file alone, in ball
arithmetic: that a periodic motion exists, is the only one near by, strikes in
its order and nowhere else, and is stable or unstable. Needs python-flint."""
MORE = """\
printed: the theorem; or, with exit code 4, why the file proves nothing: it is
damaged, or was altered so that it claims what is not shown.

example, with the system file of vibroimpact --help:
  vibroimpact orbits --system fig5b.toml --proof-out proofs
  vibroimpact check-proof proofs/1_1-1.json"""


def add(subparsers: Any) -> None:
    """Add the command."""
    command = shared.command(
        subparsers,
        "check-proof",
        summary="verify a saved proof of a motion",
        about=ABOUT,
        more=MORE,
        needs="FILE.json",
    )
    command.add_argument("file", type=Path, metavar="FILE.json", help="what --proof-out wrote")
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> ExitCode:
    """Verify a certificate and print its theorem."""
    try:
        proof = check_proof(options.file)
    except OSError as error:
        raise ParameterError(f"FILE.json {options.file}: {error.strerror}") from error
    print(proof.statement)
    return ExitCode.DONE
