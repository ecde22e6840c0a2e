"""Exit codes of `vibroimpact`, the same for all commands."""

from enum import IntEnum


class ExitCode(IntEnum):
    """What the command says to the shell that ran it."""

    DONE = 0
    FAILED = 1
    BAD_INPUT = 2
    INCOMPLETE = 3
    NOT_PROVED = 4
    INTERRUPTED = 130
    NO_READER = 141


MEANINGS = {
    ExitCode.DONE: "done",
    ExitCode.FAILED: "a computation or the writing of a file failed",
    ExitCode.BAD_INPUT: "bad input, nothing computed: an argument, a file, a missing extra",
    ExitCode.INCOMPLETE: "done and written, but part of what was asked for is missing:\n"
    "a run stopped early, no periodic motion was found, ...",
    ExitCode.NOT_PROVED: "a certificate is damaged, or claims what is not shown",
    ExitCode.INTERRUPTED: "interrupted with Ctrl-C; what was done by then is written",
    ExitCode.NO_READER: "the reader of the output has gone, as in `| head`",
}


def table() -> str:
    """Return the codes with their meanings, as `--help` shows them."""
    lines = ["exit codes:"]
    for code, meaning in MEANINGS.items():
        first, *rest = meaning.split("\n")
        lines += [f"  {code:>3}  {first}", *(f"       {line}" for line in rest)]
    return "\n".join(lines)
