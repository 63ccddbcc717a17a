# SPDX-License-Identifier: MIT
"""``sdftrack batch``: commands over many recordings, on this machine or a cluster; goes on after a crash."""

from sdftrack.cli.batch.command import batch
from sdftrack.cli.batch.commands import Commands

__all__ = ["Commands", "batch"]
