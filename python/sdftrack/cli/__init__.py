# SPDX-License-Identifier: MIT
"""The command ``sdftrack``: one file per subcommand; the only package that prints and exits."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 0 success, 1 error (one line), 2 usage error."""
    import signal
    import sys

    from sdftrack.cli.app import run

    # A polite kill ends as Ctrl-C does: the files of what was done are whole, no temporary one stays.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    sys.exit(run(list(sys.argv[1:] if arguments is None else arguments)))
