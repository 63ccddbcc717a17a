# SPDX-License-Identifier: MIT
"""The memory that a piece of code takes at most, measured in a process of its own."""

import subprocess
import sys
from pathlib import Path

import pytest

MEASURE = """
def peak():
    with open("/proc/self/status") as file:
        return 1024 * next(int(line.split()[1]) for line in file if line.startswith("VmHWM"))
"""


def peak_bytes(code: str, before: str = "pass") -> int:
    """Bytes by which `code` raises the peak of a process that has run `before`.

    Of VmHWM: the maximum that getrusage tells may be that of this process, which started the other one.
    """
    if not Path("/proc/self/status").is_file():
        pytest.skip("the peak is read from /proc/self/status")
    whole = f"{MEASURE}\n{before}\nstart = peak()\n{code}\nprint(peak() - start)"
    run = subprocess.run([sys.executable, "-c", whole], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return int(run.stdout.split()[-1])
