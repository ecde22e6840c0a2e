"""`vibroimpact explore`: a system on a live page in the browser."""

import argparse
from pathlib import Path
from typing import Any

from . import options as shared
from .exit_codes import ExitCode
from .machines import FLAGS

ABOUT = f"""\
Show a system on a live page in the browser: the machine in motion, its time
history, phase portrait and sections, and a bifurcation diagram, a chart or
basins in which a click chooses a motion; of a structure its stops and the
diagram. Without a system it begins with one of the paper. The page comes from
this machine and only to it; Ctrl-C ends it.

{shared.UNITS}"""
MORE = """\
printed: the address of the page; with --code the Python that makes its views.

The page needs Bokeh: pip install bokeh. Its address holds what it shows, so
that a bookmark leads back there.

example, with the system file of vibroimpact --help:
  vibroimpact explore fig5b.toml --friction 0.5 --code"""


def add(subparsers: Any) -> None:
    """Add the command."""
    command = shared.command(
        subparsers,
        "explore",
        summary="a live page in the browser",
        about=ABOUT,
        more=MORE,
        needs="[SYSTEM.toml]",
    )
    command.add_argument(
        "file", type=Path, nargs="?", metavar="SYSTEM.toml", help="as --system FILE.toml"
    )
    shared.add_system(command, units=False)
    group = command.add_argument_group("page")
    group.add_argument(
        "--port", type=int, default=0, metavar="N", help="port on 127.0.0.1 (default: a free one)"
    )
    group.add_argument(
        "--no-browser", action="store_true", help="print the address only, open no browser"
    )
    group.add_argument(
        "--code", action="store_true", help="print the Python of the views, and serve no page"
    )
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> ExitCode:
    """Serve the page until Ctrl-C, or print its code."""
    # Here: its texts are those of pictures, and other commands do without matplotlib.
    from ..explorer import explore
    from ..explorer.code import python_code
    from ..explorer.server import first_state

    if options.system is None:
        options.system = options.file
    given = (getattr(options, name) for name in (*FLAGS, "set"))
    some = options.system is not None or any(value is not None for value in given)
    system, initial = None, options.initial
    if some:
        request = shared.Request.of(options)
        system = request.system()
        initial = request.values(initial=None)["initial"]
    if options.code:
        print(python_code(first_state(system, initial)), end="")
        return ExitCode.DONE
    explore(system, initial=initial, port=options.port, browser=not options.no_browser)
    return ExitCode.DONE
