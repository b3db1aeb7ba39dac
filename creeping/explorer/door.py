"""Who may come in: the check of a connection to the page before anything is sent, upgraded or carried out.

A request is let in if

    its only Host is this machine's, with the port of the page
    its Origin, where a browser names one, is the page itself
    it brings the token: in the address when the page is opened, in a cookie from there on

so that neither the page of another site nor another user of this machine can drive the program. An upgrade that is
refused never becomes a connection. A browser is started with a file of this user's own that leads to the page, for
every user of a machine can read command lines.
"""

import hmac
import html
import http
import secrets
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.cookies import CookieError, SimpleCookie
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Lock
from urllib.parse import parse_qs, urlsplit

from websockets.asyncio import server as websocket_server
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from creeping._typing import Any
from creeping.errors import CreepingError

CLIENTS = 16
"""Pages that may be open."""
_PATCHING = Lock()


class Door:
    """The check of one page.

    Parameters
    ----------
    clients : callable
        Number of connections that are open.
    title : str
        Of the page, in place of the library's.

    Attributes
    ----------
    token : str
        Random; to know it is to be let in.
    """

    def __init__(self, clients: Callable[[], int], title: str) -> None:
        self.token = secrets.token_urlsafe(24)
        self._clients, self._title = clients, title

    def refusal(self, request: Request, port: int) -> str:
        """Why a request is not let in; nothing if it is."""
        own = {f"{name}:{port}" for name in ("127.0.0.1", "localhost", "[::1]")}
        hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
        if len(hosts) != 1 or hosts[0].lower() not in own:
            return "this page is for this machine, by its own name"
        if len(origins) > 1 or any(origin.lower() not in {f"http://{name}" for name in own} for origin in origins):
            return "this page does not serve other sites"
        if not (self._brought(request, port) or self.opened_by(request)):
            return "open the page by the address that creeping explore prints: it has a token"
        if upgrades(request) and self._clients() >= CLIENTS:
            return f"{CLIENTS} pages are open; close one"
        return ""

    def opened_by(self, request: Request) -> bool:
        """Whether the token stands in the address of a request that is no upgrade."""
        given = parse_qs(urlsplit(request.path).query).get("token", [])
        return not upgrades(request) and len(given) == 1 and self._is_token(given[0])

    def _brought(self, request: Request, port: int) -> bool:
        try:
            jar = SimpleCookie("; ".join(request.headers.get_all("Cookie")))
        except CookieError:
            return False
        return _name(port) in jar and self._is_token(jar[_name(port)].value)

    def _is_token(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(), self.token.encode())

    @contextmanager
    def installed(self) -> Iterator[None]:
        """Stand before the server that is started inside: viser has no other place before the upgrade.

        Raises
        ------
        CreepingError
            At the end, if no server was started where the door stands: another viser, that would be open to all.
        """
        serve = websocket_server.serve
        stands = False

        def guarded(*arguments: Any, process_request: Any = None, max_size: Any = None, **options: Any) -> Any:
            nonlocal stands
            stands = True

            def checked(connection: Any, request: Request) -> Response | None:
                port = int(connection.local_address[1])
                reason = self.refusal(request, port)
                if reason:
                    body = reason.encode()
                    headers = Headers({"Content-Type": "text/plain", "Content-Length": str(len(body))})
                    return Response(http.HTTPStatus.FORBIDDEN.value, "Forbidden", headers, body)
                index = request.path.partition("?")[0] in ("/", "/index.html")
                if index and "Accept-Encoding" in request.headers:
                    # to be given its title it must come uncompressed
                    del request.headers["Accept-Encoding"]
                found: Response | None = process_request(connection, request)
                if found is None:
                    return None
                if index and found.body and found.headers.get("Content-Type", "").startswith("text/"):
                    found.body = with_title(bytes(found.body).decode(), self._title).encode()
                    del found.headers["Content-Length"]
                    found.headers["Content-Length"] = str(len(found.body))
                if self.opened_by(request):
                    # a browser brings the token from there on
                    cookie = f"{_name(port)}={self.token}; Path=/; HttpOnly; SameSite=Strict"
                    found.headers["Set-Cookie"] = cookie
                return found

            # bytes of a message from a page: a slider's are hundreds
            return serve(*arguments, process_request=checked, max_size=1_000_000, **options)

        with _PATCHING:
            websocket_server.serve = guarded  # type: ignore[assignment, misc]
            try:
                yield
            finally:
                websocket_server.serve = serve  # type: ignore[misc]
        if not stands:
            raise CreepingError("this version of viser starts its server in a way that cannot be guarded")


def upgrades(request: Request) -> bool:
    """Whether a request is to become a websocket."""
    return any("websocket" in value.lower() for value in request.headers.get_all("Upgrade"))


@contextmanager
def leading_to(address: str) -> Iterator[str]:
    """Address of a file that only this user can read, and that takes a browser on to another address."""
    with TemporaryDirectory(prefix="creeping-") as folder:
        file = Path(folder) / "page.html"
        file.touch(0o600)
        onward = f'<meta http-equiv="refresh" content="0; url={html.escape(address)}">'
        file.write_text(f"<!DOCTYPE html><title>creeping</title>{onward}", encoding="ascii")
        yield file.as_uri()


def _name(port: int) -> str:
    """Of the cookie: cookies do not tell ports apart."""
    return f"creeping-{port}"


def with_title(page: str, title: str) -> str:
    """A page of viser with another title."""
    return page.replace("<title>Viser</title>", f"<title>{html.escape(title)}</title>", 1)
