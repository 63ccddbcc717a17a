# SPDX-License-Identifier: MIT
"""``sdftrack batch``: commands over many recordings, on this machine or a cluster; goes on after a crash."""

from sdftrack.cli.batch.command import Commands, batch

__all__ = ["Commands", "batch"]
