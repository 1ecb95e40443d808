"""A viser server for this machine's own browser alone: 127.0.0.1, a free port, nothing without the token.

viser has no guard of its own: whoever reaches its port, another user of the machine or any web page (a WebSocket may be
opened across origins), could read the recording and write files. So every request passes ``Guard`` before viser sees
it: the page is answered under its address with the token, which leaves a cookie; all else needs that cookie.
"""

from __future__ import annotations

import contextlib
import hmac
import io
import secrets
import socket
from collections.abc import Callable, Iterator
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from importlib.resources import files
from typing import Any
from urllib.parse import parse_qs, urlsplit

from armdesign.errors import MissingExtraError, SettingsError

HOST = "127.0.0.1"
TITLE = "armdesign studio"
REFUSED = "This page is for the person who started it: open the address that 'armdesign studio' printed.\n"
HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Content-Security-Policy": "frame-ancestors 'none'",
}


class Guard:
    """Lets requests with the token through, to whatever answers them.

    Attributes:
        token: What the address carries.
        port: TCP port of the server.
    """

    def __init__(self, port: int) -> None:
        """With a new token."""
        self.token, self.port = secrets.token_urlsafe(24), port

    @property
    def cookie(self) -> str:
        """The cookie's name; cookies do not tell ports apart."""
        return f"armdesign-studio-{self.port}"

    @property
    def address(self) -> str:
        """Where the page is."""
        return f"http://{HOST}:{self.port}/?token={self.token}"

    def permits(self, path: str, headers: Any) -> bool:  # noqa: ANN401 (a mapping of either library)
        """Whether a request may pass.

        Args:
            path: What is asked for.
            headers: Its headers.
        """
        hosts = {f"{name}:{self.port}" for name in (HOST, "localhost")}
        if headers.get("Host", "") not in hosts:  # a stranger's name for this machine (DNS rebinding)
            return False
        origin = headers.get("Origin")
        if origin is not None and urlsplit(origin).netloc not in hosts:
            return False
        given = parse_qs(urlsplit(path).query).get("token", [""])[0]
        with contextlib.suppress(CookieError):
            found = SimpleCookie(headers.get("Cookie", "")).get(self.cookie)
            given = given if found is None else found.value
        return hmac.compare_digest(given.encode(), self.token.encode())

    def around(self, answer: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
        """What answers requests, behind this guard.

        Args:
            answer: viser's own: connection and request in; a response, or None for a WebSocket, out.
        """

        def guarded(connection: Any, request: Any) -> Any:  # noqa: ANN401 (types of websockets)
            if not self.permits(request.path, request.headers):
                return connection.respond(HTTPStatus.FORBIDDEN, REFUSED)
            del request.headers["Accept-Encoding"]  # the page is changed below
            response = answer(connection, request)
            if response is None:
                return None
            response.headers.update(HEADERS)
            if b"</head>" in response.body:
                response.headers["Set-Cookie"] = f"{self.cookie}={self.token}; Path=/; HttpOnly; SameSite=Strict"
                response.body = with_script(response.body)
                del response.headers["Content-Length"]
                response.headers["Content-Length"] = str(len(response.body))
            return response

        return guarded


def with_script(page: bytes) -> bytes:
    """The page of viser under the studio's title, with what it does by itself."""
    script = files("armdesign.studio").joinpath("page.js").read_bytes()
    page = page.replace(b"<title>Viser</title>", f"<title>{TITLE}</title>".encode(), 1)
    return page.replace(b"</head>", b"<script>" + script + b"</script></head>", 1)


def check_extra() -> None:
    """See that viser is there.

    Raises:
        MissingExtraError: It is not.
    """
    try:
        import viser  # noqa: F401, PLC0415 (an extra)
    except ImportError as error:
        message = "the studio needs viser, which is not installed"
        raise MissingExtraError(message, value="viser", fix="Run: pip install 'armdesign[studio]'") from error


def open_server(port: int | None = None) -> tuple[Any, Guard]:
    """Start a server that nobody passes without the token.

    Args:
        port: TCP port; by default a free one.

    Returns:
        The ``viser.ViserServer``, and its guard with the address.

    Raises:
        SettingsError: The port cannot be had.
        MissingExtraError: viser is not installed.
    """
    check_extra()
    import viser  # noqa: PLC0415 (an extra)

    guard = Guard(free_port(port))
    with guarded_sockets(guard), contextlib.redirect_stdout(io.StringIO()):  # viser prints an address without the token
        server: Any = viser.ViserServer(HOST, guard.port, verbose=False)
    if server.get_port() != guard.port:  # somebody was faster
        server.stop()
        raise SettingsError(f"port {guard.port} of {HOST} has just been taken", value=guard.port, fix="Try again")
    server.request_share_url = lambda *_: None  # the tunnel to the outside that viser offers
    return server, guard


@contextlib.contextmanager
def guarded_sockets(guard: Guard) -> Iterator[None]:
    """Put a guard before the server that viser opens meanwhile; viser has no way to hand one in."""
    from websockets.asyncio import server as sockets  # noqa: PLC0415 (comes with viser)

    plain = sockets.serve

    def serve(*args: Any, process_request: Callable[[Any, Any], Any], **more: Any) -> Any:  # noqa: ANN401
        return plain(*args, process_request=guard.around(process_request), **more)

    sockets.serve = serve  # type: ignore[misc,assignment]
    try:
        yield
    finally:
        sockets.serve = plain  # type: ignore[misc]


def free_port(wanted: int | None) -> int:
    """The port asked for, or a free one.

    Raises:
        SettingsError: It cannot be had.
    """
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, wanted or 0))
        except (OSError, OverflowError) as error:
            fix = "Take another with --port, or leave it out to get a free one"
            raise SettingsError(f"cannot listen on port {wanted} of {HOST}", value=wanted, fix=fix) from error
        return int(probe.getsockname()[1])
