"""`vibroimpact claims`: every statement of the paper, computed again and judged."""

import argparse
import sys
import time
from pathlib import Path
from typing import Any

from vibroimpact import ParameterError

from .command import add_command

ABOUT = """\
Judge the statements of Han, Jin & Hu (2004): equations, figures, quoted
numbers, conclusions. Each is computed when asked for. All are on the page
docs/claims.md."""
MORE = """\
printed for each statement that is named:
  statement  what the paper says, in our words, and its place
  computed   what comes out
  verdict    reproduced; reproduced with correction, it holds once put right;
             refuted, the evidence speaks against it; not decided, no
             computation with this model can tell
  evidence   the numbers behind the verdict
  by hand    another command that shows the same, if there is one
without names: one line for each statement, and how often each verdict occurs.

examples (all statements take some three minutes on two cores):
  vibroimpact claims eq5a fig2-digits
  vibroimpact claims --list
  vibroimpact claims eq39-40 fig5b --json claims.json"""


def add(subparsers: Any) -> None:
    """Add the command."""
    command = add_command(
        subparsers,
        "claims",
        summary="judge every statement of Han, Jin & Hu (2004)",
        about=ABOUT,
        more=MORE,
        needs="[ID ...]",
    )
    command.add_argument("ids", nargs="*", metavar="ID", help="which statements (default: all)")
    command.add_argument("--list", action="store_true", help="name all statements, judge none")
    command.add_argument(
        "--markdown", type=Path, metavar="FILE.md", help="write the page of all statements"
    )
    command.add_argument("--json", type=Path, metavar="FILE.json", help="write the claims")
    command.add_argument("--quiet", action="store_true", help="show no progress")
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Judge statements, print and write them."""
    from ..claims import to_json
    from ..statements import STATEMENTS, chosen, page

    statements = chosen(options.ids)
    if options.markdown is not None and options.ids:
        raise ParameterError("--markdown: the page holds all statements; allowed without ID only")
    if options.list:
        width = max(map(len, STATEMENTS))
        for item in statements:
            print(f"{item.id.ljust(width)}  {item.place}: {item.says}")
        return 0
    claims = {}
    for item in statements:
        started = time.perf_counter()
        claims[item.id] = item.evaluate()
        if not options.quiet:
            seconds = time.perf_counter() - started
            print(f"{item.id}: {seconds:.1f} s", file=sys.stderr, flush=True)
    if options.ids:
        print("\n\n".join(map(page.text, claims.values())))
    else:
        print(page.table(claims))
    if options.json is not None:
        options.json.write_text(to_json(list(claims.values())), encoding="utf-8")
    if options.markdown is not None:
        options.markdown.write_text(page.to_markdown(claims), encoding="utf-8")
    return 0
