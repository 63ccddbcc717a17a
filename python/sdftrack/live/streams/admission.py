# SPDX-License-Identifier: MIT
"""Who may connect to a server: local programs and pages, and from elsewhere those that know the token."""

from __future__ import annotations

import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any, Self
from urllib.parse import parse_qs, urlsplit

from sdftrack._internal.hosts import LOCAL, is_local, shown_name

__all__ = ["Admission"]


@dataclass(frozen=True)
class Admission:
    """The rule of one server.

    Attributes
    ----------
    token : str
        Must be in the client's URL as ``?token=...``; "": the server is local and asks for none.
    origins : tuple of str
        Origins of web pages that a local server admits beside those of this computer. A browser lets any page connect
        to localhost, so the server has to look where a page is from.
    """

    token: str = ""
    origins: tuple[str, ...] = ()

    @classmethod
    def at(cls, host: str, origins: Sequence[str] = ()) -> Self:
        """The rule of a server bound to `host`: a new token unless it is local."""
        return cls("" if is_local(host) else secrets.token_urlsafe(16), tuple(origins))

    def address(self, host: str, port: int) -> str:
        """The URL for clients."""
        return f"ws://{shown_name(host)}:{port}" + (f"/?token={self.token}" if self.token else "")

    def refusal(self, path: str, origin: str | None) -> str:
        """ "" for a client that is admitted, else what it should change."""
        if self.token:
            given = parse_qs(urlsplit(path).query).get("token", [""])[0]
            right = secrets.compare_digest(given.encode(), self.token.encode())
            return (
                "" if right else "expected ?token=... in the URL, as the program that streams has shown it\n"
            )
        if origin is None or origin in self.origins or urlsplit(origin).hostname in LOCAL:
            return ""
        return f"expected a page from this computer (http://localhost), got one from {origin}\n"

    def answer(self, connection: Any, request: Any) -> Any:
        """`process_request` of websockets: None admits, a response refuses."""
        refusal = self.refusal(request.path, request.headers.get("Origin"))
        if not refusal:
            return None
        return connection.respond(HTTPStatus.UNAUTHORIZED if self.token else HTTPStatus.FORBIDDEN, refusal)
