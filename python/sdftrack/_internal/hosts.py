# SPDX-License-Identifier: MIT
"""Names of this computer, for servers that others may or may not reach."""

from __future__ import annotations

import socket

__all__ = ["LOCAL", "bound_address", "is_local", "shown_name"]

LOCAL = ("localhost", "127.0.0.1", "::1")
_ANY = ("0.0.0.0", "::")


def is_local(host: str) -> bool:
    """Whether only programs on this computer reach a server bound to `host`."""
    return host in LOCAL


def bound_address(host: str) -> str:
    """What a server binds to; "localhost" may have two addresses."""
    return "127.0.0.1" if host == "localhost" else host


def shown_name(host: str) -> str:
    """The host in a URL for clients of a server bound to `host`."""
    return socket.gethostname() if host in _ANY else f"[{host}]" if ":" in host else host
