# SPDX-License-Identifier: MIT
"""Hosts and ports of addresses, and names of objects that OSC and ROS accept."""

from __future__ import annotations

import re
from collections.abc import Sequence

PORT = 8765  # of websocket servers, unless the address says another

_FORM = re.compile(r"//(?P<host>\[[0-9A-Fa-f:.]+\]|[^\s:/?#\[\]@]*)(?::(?P<port>\d*))?/?")


def host_and_port(rest: str, scheme: str, port: int | None = None) -> tuple[str, int]:
    """Host and port of ``//HOST:PORT``; IPv6 in brackets. `port` is that of an address without one.

    >>> host_and_port("//[::1]:9000", "osc")
    ('::1', 9000)
    """
    whole = f"{scheme}:{rest}"
    found = _FORM.fullmatch(rest)
    if found is None or not found["host"]:
        raise ValueError(f"address: expected {scheme}://HOST:PORT, got {whole!r}")
    if found["port"]:
        port = int(found["port"])
    if port is None:
        raise ValueError(f"address: expected {scheme}://HOST:PORT, got {whole!r} without a port")
    if port > 65535:
        raise ValueError(f"address: expected a port of at most 65535, got {port} in {whole!r}")
    return found["host"].strip("[]"), port


def safe_names(names: Sequence[str]) -> list[str]:
    """Names of letters, digits and underscores, each once, none beginning with a digit.

    >>> safe_names(["drill", "box 1", "box/1", "2nd", ""])
    ['drill', 'box_1', 'box_1_2', '_2nd', 'object_4']
    """
    out: list[str] = []
    for k, name in enumerate(names):
        safe = re.sub(r"[^A-Za-z0-9_]", "_", name) or f"object_{k}"
        safe = f"_{safe}" if safe[0].isdigit() else safe
        # Double underscores are not allowed in ROS topics.
        safe = first = re.sub(r"__+", "_", safe)
        count = 1
        while safe in out:
            count += 1
            safe = f"{first}_{count}"
        out.append(safe)
    return out
