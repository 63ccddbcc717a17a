# SPDX-License-Identifier: MIT
"""Arguments that nobody means: numbers at the ends of their types, arrays of wrong kinds, shapes and layouts."""

import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

NASTY_FLOATS = (
    0.0, -0.0, -1.0, 1.0, np.nan, np.inf, -np.inf, 5e-324, 1e-310, 1e-300, 1e-45, 1e-38, 1e-9, 1e9, 3.4e38, 1e155,
    1e300, 1.7e308, -1e300, -1e-310, 2.0**24 + 1, 2.0**31, -(2.0**31) - 1, 2.0**53, 2.0**63, 2.0**64, 0.5,
)  # fmt: skip
NASTY_INTS = (
    -1, 0, 1, 2, 3, 7, 255, 256, 65536, 2**24, 2**31 - 1, 2**31, -(2**31), -(2**31) - 1, 2**32, 2**63 - 1, 2**63, 2**64,
    -(2**63), 10**400,
)  # fmt: skip
FEW_INTS = (-(2**31), -1, 0, 1, 2, 5, 2**31, 2**63)
OTHER_THINGS = (
    None,
    "",
    "x",
    "nan",
    b"\0",
    2.5,
    True,
    [],
    {},
    [[]],
    [[1], [2, 3]],
    object(),
    1j,
    np.float32(0.5),
)
DTYPES = "?bBhHiIqQefdgFDSUOMm"


@dataclass(frozen=True)
class Fixed:
    """An argument that is never changed."""

    value: Any


@dataclass(frozen=True)
class Few:
    """A number of steps or rounds: a large one is honoured, and would take for ever."""

    value: int


@dataclass(frozen=True)
class OneOf:
    """Any of some valid values."""

    values: tuple[Any, ...]


class Call:
    """A function with valid arguments, one or two of which are changed at a time."""

    def __init__(self, function: Callable[..., Any], *args: Any, **kwargs: Any) -> None:
        self.function, self.args, self.kwargs = function, args, kwargs
        self.given: dict[int | str, Any] = {**dict(enumerate(args)), **kwargs}

    def valid(self) -> Any:
        """Call it with the valid arguments, which it has to accept."""
        plain = random.Random(0)
        return self._called({place: valid_value(plain, value) for place, value in self.given.items()})

    def __call__(self, rng: random.Random) -> Any:
        may = [place for place, value in self.given.items() if not isinstance(value, Fixed)]
        count = min(len(may), rng.choices((0, 1, 2, 3), (2, 12, 5, 1))[0])
        changed = set(rng.sample(may, count))
        return self._called(
            {p: (nasty if p in changed else valid_value)(rng, value) for p, value in self.given.items()}
        )

    def _called(self, values: dict[int | str, Any]) -> Any:
        args = [values[i] for i in range(len(self.args))]
        return self.function(*args, **{name: values[name] for name in self.kwargs})


def valid_value(rng: random.Random, value: Any) -> Any:
    if isinstance(value, OneOf):
        return rng.choice(value.values)
    return value.value if isinstance(value, Fixed | Few) else value


def nasty(rng: random.Random, value: Any) -> Any:
    """Another value in the place of a valid one."""
    if rng.random() < 0.06:
        return rng.choice(OTHER_THINGS)
    if isinstance(value, OneOf):
        return nasty(rng, rng.choice(value.values))
    if isinstance(value, Few):
        return rng.choice(FEW_INTS)
    if isinstance(value, np.ndarray):
        return nasty_array(rng, value)
    if isinstance(value, bool):
        return rng.choice((not value, value, 2, None))
    if isinstance(value, int):
        return rng.choice(NASTY_INTS) if rng.random() < 0.8 else rng.choice(NASTY_FLOATS)
    if isinstance(value, float):
        return rng.choice(NASTY_FLOATS) if rng.random() < 0.85 else value * rng.choice((1e-3, 1e3, -1))
    if isinstance(value, str):
        return rng.choice(("", "x", value.upper(), value + "\0", value * 9, "ä"))
    if isinstance(value, list | tuple) and value:
        return _nasty_items(rng, value)
    return rng.choice((value, *OTHER_THINGS))


def _nasty_items(rng: random.Random, value: Any) -> Any:
    items = list(value)
    how = rng.randrange(4)
    if how == 0:
        items.pop(rng.randrange(len(items)))
    elif how == 1:
        items.append(items[0])
    else:
        at = rng.randrange(len(items))
        items[at] = nasty(rng, items[at])
    return tuple(items) if isinstance(value, tuple) else items


def nasty_array(rng: random.Random, like: np.ndarray) -> Any:
    """An array made of a valid one, by one of the ways that arrays go wrong, and sometimes by two."""
    array: Any = like
    for _ in range(rng.choices((1, 2), (4, 1))[0]):
        if isinstance(array, np.ndarray):
            with np.errstate(all="ignore"):
                array = rng.choice(WAYS)(rng, array)
    return array


def _values(rng: random.Random, a: np.ndarray) -> Any:
    """Some or all elements become nasty."""
    if a.dtype.kind not in "fiu" or not a.size:
        return a
    a = np.array(a)
    flat = a.reshape(-1)
    count = rng.choice((1, 1, 2, max(1, a.size // 10), a.size))
    info = np.finfo(a.dtype) if a.dtype.kind == "f" else np.iinfo(a.dtype)
    ends = (info.min, info.max, 0, 1) if a.dtype.kind != "f" else (*NASTY_FLOATS, info.tiny, info.max)
    for _ in range(min(count, 50)):
        flat[rng.randrange(a.size)] = np.asarray(rng.choice(ends)).astype(a.dtype)
    if count == a.size:
        flat[:] = np.asarray(rng.choice(ends)).astype(a.dtype)
    return a


def _scaled(rng: random.Random, a: np.ndarray) -> Any:
    if a.dtype.kind != "f":
        return a
    return (a * rng.choice((0, -1, 1e-300, 1e-40, 1e-9, 1e-3, 1e3, 1e9, 1e30, 1e154, 1e300, np.nan))).astype(
        a.dtype
    )


def _shifted(rng: random.Random, a: np.ndarray) -> Any:
    if a.dtype.kind not in "fiu":
        return a
    return (a + np.asarray(rng.choice((1, -1, 1e-3, 1e6, 1e15, 1e300))).astype(a.dtype)).astype(a.dtype)


def _empty(rng: random.Random, a: np.ndarray) -> Any:
    shape = list(a.shape) or [0]
    shape[rng.randrange(len(shape))] = 0
    return rng.choice(
        (np.zeros(shape, a.dtype), np.zeros((), a.dtype), np.zeros(0, a.dtype), np.zeros((0, 0, 0), a.dtype))
    )


def _dtype(rng: random.Random, a: np.ndarray) -> Any:
    kind = rng.choice(DTYPES)
    try:
        return a.astype(kind)
    except (TypeError, ValueError, OverflowError):
        return np.zeros(a.shape, kind)


def _shape(rng: random.Random, a: np.ndarray) -> Any:
    if not a.ndim:
        return rng.choice((a[None], a[None, None]))
    cut = tuple(slice(0, max(0, n - rng.randrange(2))) for n in a.shape)
    ways = (
        a.T,
        a[None],
        a[..., None],
        a.reshape(-1),
        a[cut],
        a[:1],
        a[..., :1],
        np.concatenate([a, a]) if a.ndim else a,
    )
    return rng.choice(ways)


def _strides(rng: random.Random, a: np.ndarray) -> Any:
    if not a.ndim or not a.size:
        return a
    wide = np.repeat(a, 2, axis=-1)[..., ::2]
    ways = (
        a[::-1],
        a[..., ::-1],
        np.asfortranarray(a),
        wide,
        np.broadcast_to(a[:1], a.shape),
        np.broadcast_to(a, (2, *a.shape))[1],
    )
    return rng.choice(ways)


def _layout(rng: random.Random, a: np.ndarray) -> Any:
    """Byte order, alignment, write protection, subclasses, lists."""
    if a.dtype.kind not in "biufc":
        return a
    way = rng.randrange(6)
    if way == 0:
        return a.astype(a.dtype.newbyteorder())
    if way == 1:
        raw = bytearray(a.nbytes + 1)
        odd = np.frombuffer(raw, np.uint8)[1:].view(a.dtype) if a.nbytes else a.reshape(-1)
        odd[:] = a.reshape(-1)
        return odd.reshape(a.shape)
    if way == 2:
        a = np.array(a)
        a.setflags(write=False)
        return a
    if way == 3:
        return np.ma.masked_array(a, np.zeros(a.shape, bool))
    return a.tolist() if a.size < 20_000 else a


def _large(rng: random.Random, a: np.ndarray) -> Any:
    """Of many elements, in little memory."""
    one = a.reshape(-1)[:1] if a.size else np.zeros(1, a.dtype)
    length = rng.choice((1000, 70_000))
    shape = (length, *a.shape[1:]) if a.ndim > 1 and np.prod(a.shape[1:]) < 100 else (length,)
    return np.broadcast_to(one, shape)


WAYS = (
    _values,
    _values,
    _values,
    _values,
    _scaled,
    _shifted,
    _empty,
    _dtype,
    _dtype,
    _shape,
    _shape,
    _strides,
    _layout,
    _large,
)
