"""The server: this machine only, one page only, and it ends when told."""

import http.client
import os
import re
import signal
import socket
import subprocess
import sys
import threading

import pytest

from armdesign.errors import SettingsError
from armdesign.views.preview import server as module
from armdesign.views.preview.server import PageServer, has_display, open_browser

PAGE = "<!DOCTYPE html><title>é</title>"


@pytest.fixture
def served():
    """A server at work."""
    with PageServer() as server:
        server.page = PAGE.encode()
        worker = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
        worker.start()
        yield server
        server.shutdown()
        worker.join()


def ask(port, path="/", method="GET", host=None):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=5)
    connection.request(method, path, headers={} if host is None else {"Host": host})
    answer = connection.getresponse()
    return answer.status, answer.read().decode(), answer


def test_it_listens_on_this_machine_only_and_answers_with_the_page(served):
    assert served.server_address[0] == "127.0.0.1"
    assert served.address == f"http://127.0.0.1:{served.server_port}/"
    status, body, answer = ask(served.server_port)
    assert (status, body) == (200, PAGE)
    assert answer.getheader("Content-Type") == "text/html; charset=utf-8"
    assert ask(served.server_port, method="HEAD")[:2] == (200, "")
    assert ask(served.server_port, path="/?x=1")[0] == 200


@pytest.mark.parametrize("path", ["/etc/passwd", "/../../etc/passwd", "/favicon.ico", "/static/"])
def test_there_is_nothing_else(served, path):
    assert ask(served.server_port, path)[0] == 404


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS"])
def test_nothing_is_taken_in(served, method):
    assert ask(served.server_port, method=method)[0] == 501


def test_pages_under_a_stranger_s_name_get_nothing(served):
    port = served.server_port
    assert ask(port, host=f"localhost:{port}")[0] == 200
    for host in ("evil.example", f"evil.example:{port}", f"127.0.0.1.evil.example:{port}", "127.0.0.1:1", ""):
        assert ask(port, host=host)[0] == 403


def test_a_port_in_use_is_said_in_a_sentence(served):
    with pytest.raises(SettingsError, match=rf"cannot listen on port {served.server_port} of 127.0.0.1: it is in use"):
        PageServer(served.server_port)


@pytest.mark.parametrize("port", [-1, 0, 65536])
def test_ports_that_are_none_are_refused(port):
    with pytest.raises(SettingsError, match="allowed: 1 to 65535"):
        PageServer(port)


def test_a_silent_visitor_keeps_nobody_waiting(served):
    with socket.create_connection(served.server_address):
        assert ask(served.server_port)[0] == 200


@pytest.mark.parametrize(
    ("environment", "platform", "expected"),
    [
        ({}, "linux", False),
        ({"DISPLAY": ":0"}, "linux", True),
        ({"WAYLAND_DISPLAY": "wayland-0"}, "linux", True),
        ({"BROWSER": "firefox"}, "linux", True),
        ({"DISPLAY": ""}, "linux", False),
        ({}, "darwin", True),
        ({}, "win32", True),
    ],
)
def test_a_display_is_told_from_the_environment(environment, platform, expected):
    assert has_display(environment, platform) is expected


@pytest.mark.parametrize("outcome", [False, module.webbrowser.Error("none"), OSError("none"), True])
def test_no_browser_is_said(monkeypatch, outcome):
    def browse(address, new):
        if isinstance(outcome, Exception):
            raise outcome
        return outcome

    monkeypatch.setattr(module.webbrowser, "open", browse)
    monkeypatch.setenv("DISPLAY", ":0")
    said = []
    open_browser("http://127.0.0.1:1/", said.append)
    assert said == ([] if outcome is True else ["No browser was found: open the address yourself."])


@pytest.mark.skipif(os.name == "nt", reason="sends signals")
def test_ctrl_c_ends_it_without_a_word_too_many():
    code = "from armdesign.views.preview import PageServer\nwith PageServer() as server: server.show('x', browse=False)"
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen(
        [sys.executable, "-u", "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    ) as process:
        port = int(re.search(r"http://127.0.0.1:(\d+)/", process.stdout.readline()).group(1))
        assert ask(port)[:2] == (200, "x")
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=10) == 0
        assert process.stderr.read() == ""
    with pytest.raises(OSError, match=r"refused|closed|reset"):
        ask(port)
