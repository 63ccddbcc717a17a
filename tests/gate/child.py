# SPDX-License-Identifier: MIT
"""Runs by name with the package of PYTHONPATH; a line of JSON for each, also for one that fails."""

import json
import os
import sys
import time
from pathlib import Path

# An editable installation would be found before PYTHONPATH.
sys.meta_path[:] = [finder for finder in sys.meta_path if "Redirecting" not in type(finder).__name__]

import sdftrack  # noqa: E402

wanted = Path(os.environ["PYTHONPATH"].split(os.pathsep)[0])
if not Path(sdftrack.__file__).is_relative_to(wanted):
    sys.exit(f"expected the package of {wanted}, got {sdftrack.__file__}")

from hashes import runs  # noqa: E402

for name in sys.argv[1:]:
    begin = time.perf_counter()
    try:
        hashes = runs()[name]()
    except Exception as error:
        hashes = {"failed": f"{type(error).__name__}: {error}".splitlines()[0]}
    seconds = time.perf_counter() - begin
    print(json.dumps({"run": name, "hashes": hashes, "seconds": seconds}), flush=True)
