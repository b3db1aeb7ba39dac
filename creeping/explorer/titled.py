"""The title of the page: that of the body instead of the library's."""

import html
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from websockets.asyncio import server as websocket_server
from websockets.http11 import Request, Response

from creeping._typing import Any

PLAIN = "<title>Viser</title>"


def with_title(page: str, title: str) -> str:
    """A page of viser with another title."""
    return page.replace(PLAIN, f"<title>{html.escape(title)}</title>", 1)


@contextmanager
def titled(title: str) -> Iterator[None]:
    """Name the page of the server that is started inside; behind the door, which looks at requests first."""
    serve: Callable[..., Any] = websocket_server.serve

    def renamed(*arguments: Any, process_request: Any = None, **options: Any) -> Any:
        def answer(connection: Any, request: Request) -> Response | None:
            index = request.path.partition("?")[0] in ("/", "/index.html")
            if index and "Accept-Encoding" in request.headers:
                # to be changed it must come uncompressed
                del request.headers["Accept-Encoding"]
            found: Response | None = process_request(connection, request)
            if index and found is not None and found.body and found.headers.get("Content-Type", "").startswith("text/"):
                found.body = with_title(bytes(found.body).decode(), title).encode()
                del found.headers["Content-Length"]
                found.headers["Content-Length"] = str(len(found.body))
            return found

        return serve(*arguments, process_request=answer, **options)

    websocket_server.serve = renamed  # type: ignore[assignment, misc]
    try:
        yield
    finally:
        websocket_server.serve = serve  # type: ignore[misc, assignment]
