"""How the commands of this distribution are added to `vibroimpact`, in the form of its own."""

import argparse
import functools
from typing import Any

_Formatter = functools.partial(argparse.RawDescriptionHelpFormatter, max_help_position=28)


def add_command(
    subparsers: Any, name: str, *, summary: str, about: str, more: str, needs: str = ""
) -> Any:
    """Add a command: a line for the list, what it does, and what follows its options.

    `needs` are its required arguments, for a usage that does not list them all.
    """
    return subparsers.add_parser(
        name,
        help=summary,
        usage=f"vibroimpact {name} {needs} [options]".replace("  ", " "),
        description=about,
        epilog=more,
        formatter_class=_Formatter,
    )
