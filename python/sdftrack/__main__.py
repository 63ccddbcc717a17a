# SPDX-License-Identifier: MIT
"""Run the command ``sdftrack`` as ``python -m sdftrack``."""

from sdftrack.cli import main

main()
