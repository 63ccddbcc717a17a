# SPDX-License-Identifier: MIT
"""Many recordings on many processes or machines: a function over all of them, files from anywhere."""

from sdftrack.batch.cluster import Outcome, map

__all__ = ["Outcome", "map"]
