# SPDX-License-Identifier: MIT
"""``python -m sdftrack`` is the command ``sdftrack``."""

from sdftrack.cli import main

main()
