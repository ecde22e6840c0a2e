"""Hints for wrong commands and options: what was meant by them."""

import argparse
from collections.abc import Sequence

from ..hints import close_to, closest
from ..stop import is_of_stops


def check_words(parser: argparse.ArgumentParser, words: Sequence[str]) -> None:
    """Refuse an unknown command, or an unknown option of a command, with a hint.

    argparse would refuse it too, but without a hint, and perhaps for another reason first.

    Raises
    ------
    SystemExit
        With code 2, after a message on the standard error stream.
    """
    if not words or words[0].startswith("-"):
        return
    (commands,) = (
        action.choices
        for action in parser._actions
        if isinstance(action, argparse._SubParsersAction)
    )
    name = words[0]
    if name not in commands:
        known = ", ".join(commands)
        parser.error(
            f"argument COMMAND: invalid choice: {name!r}{close_to(name, commands)} "
            f"(choose from {known})"
        )
    command = commands[name]
    known_options = [*command._option_string_actions]
    for word in words[1:]:
        if word == "--":
            return
        option = word.partition("=")[0]
        if option.startswith("--") and not any(one.startswith(option) for one in known_options):
            names = {_argument(one): one for one in known_options}
            meant = closest(_argument(option), names)
            hint = f", did you mean {names[meant]}?" if meant else ""
            if "--set" in known_options and is_of_stops(_argument(option)):
                hint = f", did you mean --set {_argument(option).replace('_', '-')} X?"
            command.error(f"unrecognized arguments: {option}{hint}")


def _argument(option: str) -> str:
    """Return the name of the argument that an option stands for; by it the hints know it."""
    return option.removeprefix("--").replace("-", "_")
