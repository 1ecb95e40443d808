"""One page served to this machine's own browser: bound to 127.0.0.1, nothing but that page, nothing taken in."""

from __future__ import annotations

import errno
import os
import socketserver
import sys
import threading
import webbrowser
from collections.abc import Callable, Mapping
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from armdesign.errors import SettingsError

HOST = "127.0.0.1"
HIGHEST_PORT = 65535
PATIENCE = 10.0
"""How long a connection may keep silent [s]."""
_REASONS = {
    errno.EADDRINUSE: "it is in use",
    errno.EACCES: "it is reserved for the system",
    errno.EPERM: "it is reserved for the system",
}


class PageServer(ThreadingHTTPServer):
    """A server on 127.0.0.1 that has one page.

    Attributes:
        page: The page, UTF-8.
    """

    daemon_threads = True
    allow_reuse_address = os.name != "nt"  # there it would let two servers share a port

    def __init__(self, port: int | None = None) -> None:
        """Take the port, but do not answer yet.

        Args:
            port: TCP port; by default a free one.

        Raises:
            SettingsError: The port is none, or cannot be had.
        """
        if port is not None and not 1 <= port <= HIGHEST_PORT:
            raise SettingsError(f"port {port} is none", value=port, allowed=f"1 to {HIGHEST_PORT}")
        self.page = b""
        try:
            super().__init__((HOST, port or 0), PageHandler)
        except OSError as error:
            why = _REASONS.get(error.errno or 0, error.strerror or str(error))
            fix = "Take another with --port, or leave it out to get a free one"
            raise SettingsError(f"cannot listen on port {port} of {HOST}: {why}", value=port, fix=fix) from error

    def server_bind(self) -> None:
        """Bind without asking a name server what this machine is called."""
        socketserver.TCPServer.server_bind(self)
        self.server_name, self.server_port = HOST, int(self.server_address[1])

    def handle_error(self, request: Any, client_address: Any) -> None:  # noqa: ANN401
        """Say nothing of a browser that goes away in the middle."""

    @property
    def address(self) -> str:
        """Where the page is."""
        return f"http://{HOST}:{self.server_port}/"

    def show(self, page: str, *, browse: bool = True, say: Callable[[str], None] = print) -> None:
        """Serve a page until Ctrl-C.

        Args:
            page: The page.
            browse: Open it in the browser.
            say: Called with sentences for the user.
        """
        self.page = page.encode("utf-8")
        say(f"The preview is at {self.address}, for this machine only. End with Ctrl-C.")
        if browse:
            threading.Thread(target=open_browser, args=(self.address, say), daemon=True).start()
        try:
            self.serve_forever(poll_interval=0.2)
        except KeyboardInterrupt:
            say("")


class PageHandler(BaseHTTPRequestHandler):
    """Answers ``GET /`` to whoever asks this machine by its own name, and nothing else."""

    server: PageServer
    timeout = PATIENCE
    server_version, sys_version = "armdesign", ""

    def do_GET(self) -> None:
        """Send the page."""
        self._answer(self.server.page)

    def do_HEAD(self) -> None:
        """Send the head of the answer."""
        self._answer(None)

    def _answer(self, body: bytes | None) -> None:
        """Send head and body, unless the page was asked for under a stranger's name (DNS rebinding)."""
        known = {f"{name}:{self.server.server_port}" for name in (HOST, "localhost")}
        if self.headers.get("Host", "") not in known:
            self.send_error(403)
            return
        if self.path.split("?")[0] != "/":
            self.send_error(404)
            return
        self.send_response(200)
        self.send_header("Content-Type", "text/html; charset=utf-8")
        self.send_header("Content-Length", str(len(self.server.page)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("Content-Security-Policy", "frame-ancestors 'none'")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.end_headers()
        if body is not None:
            self.wfile.write(body)

    def log_message(self, *_: object) -> None:
        """Say nothing of requests."""


def open_browser(address: str, say: Callable[[str], None]) -> None:
    """Open an address in the browser, or say that it has to be done by hand."""
    if not has_display(os.environ):
        say("There is no display here: open the address in a browser on this machine, or use --html for a file.")
        return
    try:
        opened = webbrowser.open(address, new=2)
    except (webbrowser.Error, OSError):
        opened = False
    if not opened:
        say("No browser was found: open the address yourself.")


def has_display(environment: Mapping[str, str], platform: str = sys.platform) -> bool:
    """Whether a browser with a window can be expected; one of the terminal would take the terminal over.

    Args:
        environment: Of the process. ``BROWSER`` is the user's own word on what to open.
        platform: As ``sys.platform``.
    """
    if platform in ("darwin", "win32"):
        return True
    return any(environment.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"))
