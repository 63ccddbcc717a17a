# SPDX-License-Identifier: MIT
"""All targets by name."""

from __future__ import annotations

from importlib.util import find_spec

import fuzz_arrays
import fuzz_datasets
import fuzz_objects
import fuzz_readers
import fuzz_recordings
import fuzz_saved
from fuzz_targets import Target

__all__ = ["TARGETS"]

TARGETS: dict[str, Target] = {
    target.name: target
    for module in (
        fuzz_readers, fuzz_saved, fuzz_datasets, fuzz_recordings, fuzz_arrays, fuzz_objects,
    )
    for target in module.TARGETS
    if all(find_spec(name) is not None for name in target.needs)
}  # fmt: skip
