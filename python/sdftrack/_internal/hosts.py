# SPDX-License-Identifier: MIT
"""Servers: names of this computer, where a request is from, and the socket to listen at."""

from __future__ import annotations

import errno
import socket
from urllib.parse import urlsplit

LOCAL = ("localhost", "127.0.0.1", "::1")
_ANY = ("0.0.0.0", "::")
PORTS = 20  # how many ports are tried


def is_local(host: str) -> bool:
    return host in LOCAL


def bound_address(host: str) -> str:
    """What a server binds to; "localhost" may have two addresses."""
    return "127.0.0.1" if host == "localhost" else host


def shown_name(host: str) -> str:
    """The host in a URL for clients of a server bound to `host`."""
    return socket.gethostname() if host in _ANY else f"[{host}]" if ":" in host else host


def host_of(netloc: str) -> str | None:
    """Name or address in the ``HOST:PORT`` of a request; None for what is neither.

    >>> host_of("[::1]:8080"), host_of("[::1")
    ('::1', None)
    """
    try:
        return urlsplit(f"//{netloc}").hostname
    except ValueError:
        return None


def origin_host(origin: str) -> str | None:
    """The ``HOST:PORT`` of the page that sends this header ``Origin``; None for what is none.

    >>> origin_host("http://PC:8080"), origin_host("null"), origin_host("http://[::1")
    ('pc:8080', None, None)
    """
    try:
        return urlsplit(origin).netloc.lower() or None
    except ValueError:
        return None


def listen(host: str, port: int, name: str) -> socket.socket:
    """A listening TCP socket on `host` and `port` (0: any), or the next free port of twenty. OSError, whose message
    begins with `name`, if `host` is not a name or address of this computer, the port needs rights, or no port is
    free."""
    bound = bound_address(host)
    family = socket.AF_INET6 if ":" in bound else socket.AF_INET
    last = min(port + PORTS - 1, 65535) if port else 0
    for candidate in range(port, last + 1):
        try:
            return socket.create_server((bound, candidate), family=family)
        except socket.gaierror as error:
            raise OSError(f"{name}: the host is not known ({error.strerror})") from None
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                raise OSError(
                    error.errno, f"{name}: expected a name or address of this computer ({error.strerror})"
                ) from None
    raise OSError(
        errno.EADDRINUSE, f"{name}: ports {port} to {last} are in use; close a program or choose another"
    )
