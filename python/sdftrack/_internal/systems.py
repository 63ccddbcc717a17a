# SPDX-License-Identifier: MIT
"""What not every operating system has; on one that lacks it, each function does without. No other file calls it."""

from __future__ import annotations

import contextlib
import errno
import os
from typing import BinaryIO

HELD_BY_ANOTHER = (errno.EAGAIN, errno.EWOULDBLOCK, errno.EACCES)


def try_lock(file: int) -> bool:
    """Whether this process holds the lock of an open file from now on; without locks, it does."""
    try:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except ImportError:
        return True
    except OSError as error:
        return error.errno not in HELD_BY_ANOTHER
    return True


def reserve(file: BinaryIO, size: int) -> None:
    """Give an open file so many bytes on the disk; OSError where there is no room."""
    if hasattr(os, "posix_fallocate"):
        os.posix_fallocate(file.fileno(), 0, size)
    else:
        file.write(bytes(size - file.tell()))


def limit_memory(most: int) -> None:
    """At most so many bytes, or fewer where the system has a limit already; no core file."""
    with contextlib.suppress(ImportError):
        import resource

        for limit, value in ((resource.RLIMIT_AS, most), (resource.RLIMIT_CORE, 0)):
            hard = resource.getrlimit(limit)[1]
            value = value if hard == resource.RLIM_INFINITY else min(value, hard)
            with contextlib.suppress(ValueError, OSError):  # a system that has no such limit
                resource.setrlimit(limit, (value, hard))
