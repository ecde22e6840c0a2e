"""Where the explorer runs: a server for this machine only, or an output cell of a notebook.

The server listens on 127.0.0.1, serves every file itself, and refuses requests that name another
host and connections that come from a page of another origin.
"""

from __future__ import annotations

import errno
import gc
import logging
import sys
from collections.abc import Callable
from typing import Any

from numpy.typing import ArrayLike

from ..arguments import count, flag, reject
from ..errors import ParameterError, StateError
from ..extras import missing
from ..interruption import interruptible
from ..structure import Structure
from ..system import System
from .presets import FIRST
from .state import State, from_query

ADDRESS = "127.0.0.1"
_HOSTS = (ADDRESS, "localhost")


def need_bokeh() -> None:
    """Raise ImportError, with what to do, if Bokeh is not installed."""
    try:
        import bokeh  # noqa: F401
    except ImportError as error:
        raise missing("explore", "the explorer needs Bokeh, which is not installed") from error


@interruptible
def explore(
    system: System | Structure | None = None,
    *,
    initial: ArrayLike | None = None,
    port: int = 0,
    browser: bool = True,
    notebook_url: str | None = None,
) -> None:
    """Show a system or a structure on a live page in the browser: its motion, sections, diagrams.

    In a script or on the command line the call serves the page until Ctrl-C. In a Jupyter notebook
    it shows the page in the output of the cell, and returns. Nothing leaves this machine
    (explorer page). Needs Bokeh.

    Parameters
    ----------
    system
        Where the page begins: a System, or a Structure, whose stops and drive the page can change;
        by default a system of the paper with two coexisting motions.
    initial
        (x1, v1, x2, v2) at t = 0, of a structure the rows q and v, (2, N); by default at rest, or
        the paper's.
    port
        Port on 127.0.0.1; 0 takes a free one.
    browser
        Open the page in the browser; otherwise its address is only printed.
    notebook_url
        In a notebook: where its server is, if that is not ``localhost:8888``.

    Raises
    ------
    ParameterError, StateError
        If an argument is out of range, or the bodies overlap at the start.
    OSError
        If the port is in use.
    ImportError
        If Bokeh is not installed.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> vi.explore(system)  # doctest: +SKIP
    """
    state = first_state(system, initial)
    count("port", port, least=0, most=65535)
    flag("browser", browser)
    if notebook_url is not None and not isinstance(notebook_url, str):
        reject("notebook_url", notebook_url, "an address as text, or None")
    need_bokeh()
    if _in_notebook():
        _show_in_notebook(state, port, notebook_url)
        return
    server = LocalServer(state, port=port)
    print(f"the explorer is at {server.url} (Ctrl-C ends it)", flush=True)
    server.run(browser=browser)


def first_state(system: System | Structure | None, initial: ArrayLike | None) -> State:
    """Return the state with which a page begins.

    Raises
    ------
    ParameterError, StateError
        As for ``explore``.
    """
    if system is None:
        state = FIRST
    elif isinstance(system, System | Structure):
        state = State.of(system, own=True)
    else:
        reject("system", system, "a vibroimpact.System, a vibroimpact.Structure, or None")
    if initial is not None:
        state = state.replace(initial=state.machine.flat(initial))
    state.machine.refuse_start(state.initial)
    return state


class LocalServer:
    """A server of pages for this machine only.

    Parameters
    ----------
    state
        Where a page begins whose address says nothing.
    port
        Port on 127.0.0.1; 0 takes a free one.

    Raises
    ------
    OSError
        If the port is taken.
    """

    def __init__(self, state: State, *, port: int = 0) -> None:
        from bokeh.server.server import BaseServer
        from bokeh.server.util import bind_sockets
        from tornado.httpserver import HTTPServer
        from tornado.ioloop import IOLoop

        # A page that is left while a picture is on its way is no fault; a refused origin is one.
        logging.getLogger("bokeh.server.views.ws").setLevel(logging.ERROR)
        try:
            sockets, self.port = bind_sockets(ADDRESS, port)
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                raise
            raise OSError(f"port {port} is in use; choose another --port, or none") from error
        self.loop = IOLoop(make_current=True)
        pages = _pages(state, self.port)
        http = HTTPServer(pages)
        self._server = BaseServer(self.loop, pages, http)
        self._server.start()
        http.add_sockets(sockets)

    @property
    def url(self) -> str:
        """The address of the page."""
        return f"http://{ADDRESS}:{self.port}/"

    def run(self, *, browser: bool = False) -> None:
        """Serve until `stop`, or Ctrl-C."""
        if browser:
            import webbrowser

            self.loop.add_callback(webbrowser.open, self.url)
        try:
            self.loop.start()
        except KeyboardInterrupt:
            pass
        finally:
            self._server.stop()

    def stop(self) -> None:
        """End `run`; from any thread."""
        self.loop.add_callback(self.loop.stop)


def _pages(state: State, port: int) -> Any:
    """Return the web application: pages for requests to this machine by its own names."""
    from bokeh.server.tornado import BokehTornado
    from bokeh.settings import settings
    from tornado.web import ErrorHandler

    hosts = [f"{host}:{port}" for host in _HOSTS]
    # Whatever the environment says: no file comes from elsewhere.
    settings.resources = "server"

    class OwnHost(BokehTornado):  # type: ignore[misc, unused-ignore]
        """Refuses what was sent to another name: a foreign one that leads to this machine."""

        def find_handler(self, request: Any, **options: Any) -> Any:
            if request.host not in hosts:
                return self.get_handler_delegate(request, ErrorHandler, {"status_code": 403})
            return super().find_handler(request, **options)

    return OwnHost({"/": _application(state)}, extra_websocket_origins=hosts)


def _application(state: State, *, owns_address: bool = True) -> Any:
    """Return what makes the page of each session."""
    from bokeh.application import Application
    from bokeh.application.handlers.function import FunctionHandler

    def page(document: Any) -> None:
        from tornado.ioloop import IOLoop

        from .app import Page

        begin, refused = state, None
        if owns_address:
            given = document.session_context.request.arguments
            try:
                begin = from_query(given, state)
                begin.machine.refuse_start(begin.initial)
            except (ParameterError, StateError) as error:
                begin, refused = state, error
        soon = IOLoop.current().add_callback
        shown = Page(document, begin, owns_address=owns_address, soon=soon)
        shown.refuse_address(refused)
        _end_quickly(document, shown.close)

    return Application(FunctionHandler(page))


def _end_quickly(document: Any, close: Callable[[], None]) -> None:
    """Close a page with its session, without a stop of the other pages of the process.

    Some time after a page has been left, Bokeh destroys its document and goes through all objects
    of the process for garbage: 0.1 ... 0.2 s, in which no slider moves anything. Here it sees none
    of them. The collections that Python begins by itself find the page, mostly while another one is
    made. ``on_session_destroyed`` would collect once more.
    """
    destroy = document.destroy

    def end(session: Any) -> None:
        close()
        gc.freeze()
        try:
            destroy(session)
        finally:
            gc.unfreeze()

    document.destroy = end


def _in_notebook() -> bool:
    """Whether a Jupyter kernel runs this."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return getattr(shell, "kernel", None) is not None


def _show_in_notebook(state: State, port: int, notebook_url: str | None) -> None:
    """Show the page in the output of a cell; every file comes with the notebook."""
    from bokeh.io import output_notebook, show
    from bokeh.resources import INLINE

    output_notebook(resources=INLINE, hide_banner=True)
    options: dict[str, Any] = {} if notebook_url is None else {"notebook_url": notebook_url}
    show(_application(state, owns_address=False), port=port, address=ADDRESS, **options)
