# SPDX-License-Identifier: MIT
"""Each argument of each public function in turn is of another kind: the refusal is one line that names it.

The functions and their valid arguments are those that are fuzzed.
"""

from __future__ import annotations

import inspect
import random
from collections.abc import Iterator

import numpy as np
import pytest
from fuzz_targets import unclear
from fuzz_values import Call, Fixed, valid_value
from test_fuzz import CALLS

WRONG = {
    "object": object(), "text": "x", "complex": 1j, "texts": np.array([["a", "b"]]), "NaN": float("nan"),
    "negative": -1, "zero": 0, "fraction": 2.5, "huge": 10**400, "None": None, "shape": np.zeros((7, 9, 2, 3)),
}  # fmt: skip
# What is accepted as a value like others, or refused in words that do not name the argument: no more than there were.
LEFT = {
    "fuzz_arrays._geometry": 73, "fuzz_arrays._mesh": 29, "fuzz_arrays._sdf": 108, "fuzz_arrays._levelset": 18,
    "fuzz_arrays._superpixels": 18, "fuzz_arrays._metrics": 123, "fuzz_arrays._motion": 110,
    "fuzz_objects._trackers": 32, "fuzz_objects._reconstructors": 11, "fuzz_objects._contours": 51,
    "fuzz_objects._lwpr": 4, "fuzz_objects._primitives": 14, "fuzz_objects._planes": 89, "fuzz_objects._energies": 3,
}  # fmt: skip


def refusals(call: Call) -> Iterator[tuple[str, str, str]]:
    """(argument, what it was, what is wrong with the answer) of every argument that may vary."""
    names = list(inspect.signature(call.function).parameters)
    given = {**dict(zip(names, call.args, strict=False)), **call.kwargs}
    valid = {name: valid_value(random.Random(0), value) for name, value in given.items()}
    for name in (name for name, value in given.items() if not isinstance(value, Fixed)):
        for kind, wrong in WRONG.items():
            changed = {**valid, name: wrong}
            try:
                call.function(
                    *(changed[n] for n in names[: len(call.args)]), **{n: changed[n] for n in call.kwargs}
                )
            except (ValueError, TypeError) as error:
                fault = unclear(error) or ("" if name in str(error) else f"not named: {error}")
            except Exception as error:
                fault = repr(error)
            else:
                fault = "accepted"
            yield name, kind, fault


@pytest.mark.parametrize("group", CALLS)
@pytest.mark.filterwarnings("ignore")
def test_an_argument_of_another_kind_is_refused_by_its_name(group: str) -> None:
    answers = [(name, *answer) for name, call in CALLS[group]().items() for answer in refusals(call)]
    left = [answer for answer in answers if answer[-1]]
    assert len(left) <= LEFT[group], left
