# SPDX-License-Identifier: MIT
"""``sdftrack live``: follow or reconstruct objects in front of a camera."""

from sdftrack.cli.live.command import live

__all__ = ["live"]
