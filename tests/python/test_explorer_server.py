"""The server of the explorer: its page and files, and who is refused."""

import asyncio
import gc
import weakref

import pytest
from tornado.httpclient import AsyncHTTPClient, HTTPClientError, HTTPRequest
from tornado.websocket import websocket_connect

from chromium import serving
from vibroimpact.cli import main


@pytest.fixture(scope="module")
def server():
    with serving() as made:
        yield made


def fetch(server, path="", host=None):
    async def get():
        headers = {"Host": host} if host else {}
        return await AsyncHTTPClient().fetch(
            HTTPRequest(server.url + path, headers=headers), raise_error=False
        )

    return asyncio.run(get())


def test_the_page_and_its_files_come_from_the_server_alone(server):
    answer = fetch(server)
    assert answer.code == 200
    text = answer.body.decode()
    assert "vibroimpact explorer" in text
    assert "http://" not in text
    assert "https://" not in text
    assert fetch(server, "static/js/bokeh.min.js").code == 200


def test_another_host_is_refused(server):
    own = f"localhost:{server.port}"
    assert fetch(server, host=own).code == 200
    for host in ("example.org", f"example.org:{server.port}", "127.0.0.1:1", "localhost"):
        assert fetch(server, host=host).code == 403


def test_a_connection_from_another_origin_is_refused(server):
    async def connect(origin):
        request = HTTPRequest(server.url.replace("http", "ws") + "ws", headers={"Origin": origin})
        try:
            connection = await websocket_connect(request, subprotocols=["bokeh", "no-token"])
            connection.close()
            await connection.read_message()
        except HTTPClientError as error:
            return error.code
        return 101

    for origin in ("http://example.org", f"http://example.org:{server.port}", "null"):
        assert asyncio.run(connect(origin)) == 403
    # From its own page it is the token that is missing.
    assert asyncio.run(connect(f"http://127.0.0.1:{server.port}")) != 403


def test_the_server_listens_on_this_machine_only(server):
    sockets = server._server._http._sockets.values()
    assert {each.getsockname()[0] for each in sockets} == {"127.0.0.1"}


# Tornado leaves the socket that it could not bind to the collector.
@pytest.mark.filterwarnings("ignore:unclosed <socket:ResourceWarning")
def test_a_port_in_use_is_told(server, capsys):
    assert main(["explore", "--no-browser", "--port", str(server.port)]) == 1
    told = f"port {server.port} is in use; choose another --port, or none"
    assert capsys.readouterr().err == f"vibroimpact: {told}\n"


class Knot:
    """Garbage that only a collection finds."""

    def __init__(self):
        self.itself = self


def test_the_end_of_a_page_does_not_go_through_all_objects_of_the_process(server):
    pages = server._server._tornado
    assert fetch(server).code == 200
    documents = [session.document for session in pages.get_sessions("/")]
    models = [weakref.ref(each.get_model_by_name("page")) for each in documents]
    del documents

    async def leave():
        knot = weakref.ref(Knot())
        while pages.get_sessions("/"):
            for session in pages.get_sessions("/"):
                session.request_expiration()
            await pages._cleanup_sessions()
            await asyncio.sleep(0)
        return knot() is None

    # From here on no collection begins by itself.
    gc.disable()
    try:
        left = asyncio.run_coroutine_threadsafe(leave(), server.loop.asyncio_loop)
        assert not left.result()
    finally:
        gc.enable()
    # Later collections find the page, when its threads have ended.
    while any(model() is not None for model in models):
        gc.collect()
