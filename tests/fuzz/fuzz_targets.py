# SPDX-License-Identifier: MIT
"""What is fuzzed: a target makes one case of a seed, and says whether its outcome is one that is meant."""

import random
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

__all__ = ["MEANT", "Case", "Target", "Unclear", "outcome_of"]

MEANT = (ValueError, TypeError, OSError)
LONGEST_MESSAGE = 1500  # characters
MEMORY_FACTOR, MEMORY_BYTES = 10, 200_000_000  # what a file of so many bytes may take: factor * size + these

Case = Callable[[random.Random], Any]  # raises what it raises


class Unclear(Exception):
    """A refusal that does not say in one line what is wrong, or a result that cannot be."""


@dataclass(frozen=True)
class Target:
    """A surface.

    Attributes
    ----------
    name : str
    make : callable
        Given an empty folder, returns a case: a function of a random generator. Called once in a process.
    weight : float
        Share of the cases of a run, relative to other targets: less for slow ones.
    needs : tuple of str
        Modules of extras, without which the target is left out.
    """

    name: str
    make: Callable[[Path], Case]
    weight: float = 1.0
    needs: tuple[str, ...] = ()


def rng_of(target: str, seed: int) -> random.Random:
    """The generator of a case; text as seed gives the same numbers everywhere."""
    return random.Random(f"{target}:{seed}")


def outcome_of(target: Target, case: Case, seed: int) -> tuple[str, str]:
    """("accepted" | "refused" | "unclear" | "error", message) of one case."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            finite(case(rng_of(target.name, seed)))
    except MEANT as error:
        wrong = unclear(error)
        return ("unclear", f"{type(error).__name__}: {wrong}: {error}") if wrong else ("refused", str(error))
    except Unclear as error:
        return "unclear", str(error)
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt | SystemExit):
            raise
        return "error", f"{type(error).__name__}: {error}"
    return "accepted", ""


def unclear(error: BaseException) -> str:
    """What is wrong with a message; "" for a clear one."""
    text = str(error)
    if not text.strip():
        return "no message"
    if "\n" in text.strip():
        return "more than one line"
    if len(text) > LONGEST_MESSAGE:
        return "a message of more than one line's length"
    if isinstance(error, UnicodeError):
        return "a message of Python's decoder"
    return ""


def any_of(cases: Mapping[str, Case] | Sequence[Case]) -> Case:
    """A case that is one of several."""
    every = list(cases.values() if isinstance(cases, Mapping) else cases)

    return lambda rng: rng.choice(every)(rng)


def finite(result: Any) -> None:
    """Unclear unless poses that count as found, or values of a volume, are finite."""
    import numpy as np

    status = getattr(result, "status", None)
    if isinstance(status, list | tuple) and hasattr(result, "confidence"):
        for k, word in enumerate(status):
            if str(word) in ("ok", "weak"):
                for name in ("poses", "confidence", "covariances"):
                    if not np.isfinite(getattr(result, name)[k]).all():
                        raise Unclear(f"status {word} with {name} that are not finite")
    values = getattr(result, "values", None)
    if isinstance(values, np.ndarray) and not np.isfinite(values).all():
        raise Unclear("a volume with values that are not finite")
