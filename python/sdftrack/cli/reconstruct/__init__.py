# SPDX-License-Identifier: MIT
"""``sdftrack reconstruct``: shape, mesh and poses of an unknown object from recorded sequences."""

from sdftrack.cli.reconstruct.command import reconstruct

__all__ = ["reconstruct"]
