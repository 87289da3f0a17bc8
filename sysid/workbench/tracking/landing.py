"""The bare address of the tracking server leads to the fits, lists of runs to their figures, comparisons to outputs.

MLflow's own page opens there in its mode for language models. What follows ``#`` in an address reaches no server; so
the page itself is given a script more, which leads on where no page is asked for, and does what its own file says.
"""

from __future__ import annotations

import json
from collections.abc import Awaitable, Callable, MutableMapping
from importlib.resources import files
from typing import Any

Message = MutableMapping[str, Any]
Send = Callable[[Message], Awaitable[None]]
Receive = Callable[[], Awaitable[Message]]
App = Callable[[Message, Receive, Send], Awaitable[None]]
"""An application as ASGI has it."""

VARIABLE = "SYSID_LANDING"
"""Environment variable with the page to lead to, from ``#`` on."""

SETTINGS = {
    "mlflow.workflowType_v1": '"machine_learning"',
    "mlflow.assistant.fab.autoOpenedOnFirstLoad_v1": "true",
    "mlflow.settings.telemetry.enabled_v1": "false",
    "mlflow.telemetry.info.alert.dismissed_v1": "true",
    "mlflow.home.getting-started.collapsed_v1": "true",
}
"""Settings of MLflow's page, as it keeps them in the browser: models before language models, an assistant that waits to
be called, no telemetry. What somebody has set stays; a page that does not know some of them leaves them alone."""

SCRIPTS = ("compare_page.js", "view_page.js")
"""What the page is given; each says in its first lines what it does."""

_STALE = {b"content-length", b"etag", b"last-modified", b"cache-control"}
_CONDITIONS = {b"if-none-match", b"if-modified-since", b"accept-encoding", b"range"}


def leading_to(app: App, page: str) -> App:
    """An application whose bare address leads to a page.

    Args:
        app: The application.
        page: The page, from ``#`` on.

    Returns:
        The application.
    """

    async def lead(scope: Message, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or scope["method"] != "GET" or scope["path"] != "/" or not page:
            await app(scope, receive, send)
            return
        scope = {**scope, "headers": [one for one in scope["headers"] if one[0].lower() not in _CONDITIONS]}
        await app(scope, receive, _Leading(send, page))

    return lead


def with_lead(html: bytes, page: str) -> bytes:
    """A page with our settings, that leads on where its address asks for no page of its own.

    Args:
        html: The page.
        page: Where to, from ``#`` on.

    Returns:
        The page; as it was if it has no head.

    Example:
        >>> b'location.hash = "#/a"' in with_lead(b"<head></head>", "#/a")
        True
    """
    where = json.dumps(page).replace("<", "\\u003c")
    scripts = "\n".join(files(__package__).joinpath(name).read_text(encoding="utf-8") for name in SCRIPTS)
    script = (
        f"<script>for (const [name, value] of Object.entries({json.dumps(SETTINGS)}))"
        " if (localStorage.getItem(name) === null) localStorage.setItem(name, value);"
        f" if (location.hash.length < 3) location.hash = {where};\n{scripts}</script>"
    )
    return html.replace(b"<head>", b"<head>" + script.encode(), 1)


class _Leading:
    """Takes an answer in parts, and sends it on as a whole with the line in it."""

    def __init__(self, send: Send, page: str) -> None:
        self.send, self.page = send, page
        self.head: Message = {}
        self.body = b""

    async def __call__(self, message: Message) -> None:
        if message["type"] == "http.response.start":
            self.head = message
            return
        if message["type"] != "http.response.body":
            return  # a file that is handed over by its path would come without the line; it is asked for as bytes
        self.body += message.get("body", b"")
        if message.get("more_body"):
            return
        body = with_lead(self.body, self.page)
        kept = [(name, value) for name, value in self.head["headers"] if name.lower() not in _STALE]
        headers = [*kept, (b"content-length", str(len(body)).encode()), (b"cache-control", b"no-store")]
        await self.send({**self.head, "headers": headers})
        await self.send({"type": "http.response.body", "body": body})
