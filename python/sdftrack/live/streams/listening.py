# SPDX-License-Identifier: MIT
"""The socket of a server: on the port that was asked for, or the next one that is free."""

from __future__ import annotations

import errno
import socket

from sdftrack._internal.hosts import bound_address

__all__ = ["PORT", "listen"]

PORT = 8765
PORTS = 20  # how many ports are tried
# Bytes that the operating system keeps for a client that does not read: seconds of stale poses with its default.
SEND_BUFFER = 1 << 16


def listen(host: str, port: int, scheme: str = "ws") -> socket.socket:
    """A listening TCP socket on `host` and `port` (0: any), or the next free port of twenty; `scheme` is for messages.

    Raises
    ------
    OSError
        `host` is not a name or address of this computer, the port needs rights, or no port is free.
    """
    bound = bound_address(host)
    family = socket.AF_INET6 if ":" in bound else socket.AF_INET
    last = min(port + PORTS - 1, 65535) if port else 0
    for candidate in range(port, last + 1):
        try:
            listening = socket.create_server((bound, candidate), family=family)
        except socket.gaierror as error:
            raise OSError(f"{scheme}://{host}:{port}: the host is not known ({error.strerror})") from None
        except OSError as error:
            if error.errno == errno.EADDRINUSE:
                continue
            raise OSError(
                error.errno,
                f"{scheme}://{host}:{port}: expected a name or address of this computer ({error.strerror})",
            ) from None
        # Connections inherit it.
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
        return listening
    raise OSError(
        errno.EADDRINUSE,
        f"{scheme}://{host}:{port}: ports {port} to {last} are in use; close a program or choose another",
    )
