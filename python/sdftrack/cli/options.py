# SPDX-License-Identifier: MIT
"""A command from a frozen dataclass: its fields are the options, with help and bounds beside them. typer parses. tyro,
which starts from dataclasses, was tried: it keeps the last of repeated options, knows no bounds, and draws a box around
an error in the place of one line."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable, Iterator
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import typer


def Usage(message: str, option: str | None = None) -> typer.BadParameter:
    return typer.BadParameter(message, param_hint=option) if option else typer.BadParameter(message)


def option(
    default: Any, help: str, *names: str, check: Callable[[Any], Any] | None = None, **more: Any
) -> Any:
    """An option of a job, called as the field if no `names` are given; a default of ``...``: required. ``voxels: int =
    option(200, "Number of voxels.", min=8)``. `check` checks or converts the value; `more`: min, max, metavar,
    show_default. The words of a ``Literal`` are the only values; a ``tuple[T, ...]`` is an option that is repeated."""
    return _described(default, names or ("",), check, {"help": help, **more})


def _described(default: Any, names: tuple[str, ...], check: Any, more: dict[str, Any]) -> Any:
    about = {"names": names, "check": check, "more": more}
    return dataclasses.field(default=dataclasses.MISSING if default is ... else default, metadata=about)


def argument(help: str, metavar: str, default: Any = ...) -> Any:
    about = {"names": (), "check": None, "more": {"help": help, "metavar": metavar}}
    return dataclasses.field(default=dataclasses.MISSING if default is ... else default, metadata=about)


@dataclasses.dataclass(frozen=True)
class Field:
    """A field of a job as the command line knows it.

    `name`: "--depth-topic", of an argument its metavar; `off`: "--no-viewer" of a flag that is on by default;
    `parameter`: for typer; `convert`: makes the value of the field from that of typer.
    """

    name: str
    off: str
    is_option: bool
    is_files: bool
    is_flag: bool
    is_repeated: bool
    parameter: inspect.Parameter
    convert: Callable[[Any], Any]


def fields_of(job: type) -> Iterator[Field]:
    """The fields of a dataclass, its own ones before those of its bases."""
    hints = get_type_hints(job)
    known = {f.name: f for f in dataclasses.fields(job)}
    own_first = dict.fromkeys(name for cls in job.__mro__ for name in inspect.get_annotations(cls))
    for name in own_first:
        if name in known:
            yield _field(known[name], hints[name])


def _field(field: Any, kind: Any) -> Field:
    names = tuple(n or f"--{field.name.strip('_').replace('_', '-')}" for n in field.metadata["names"])
    more, check = dict(field.metadata["more"]), field.metadata["check"]
    long, _, off = next((n for n in names if n.startswith("--")), more.get("metavar", "")).partition("/")
    optional = get_origin(kind) in (Union, UnionType)
    inner = next(k for k in get_args(kind) if k is not NoneType) if optional else kind
    default, repeated = field.default, get_origin(inner) is tuple
    if get_origin(inner) is Literal:
        words = get_args(inner)
        more.setdefault("metavar", "|".join(words))
        inner, check = str, _one_of(words)
    if repeated:
        inner = list[get_args(inner)[0]]  # type: ignore[misc]
        default, optional = (None, True) if default == () else (default, optional)
    parameter = inspect.Parameter(
        field.name,
        inspect.Parameter.KEYWORD_ONLY,
        default=inspect.Parameter.empty if default is dataclasses.MISSING else default,
        annotation=Annotated[
            inner | None if optional else inner,
            typer.Option(*names, **more) if names else typer.Argument(**more),
        ],
    )

    def convert(value: Any) -> Any:
        if repeated:
            return tuple(value or ())
        try:
            return value if value is None or check is None else check(value)
        except typer.BadParameter as error:
            error.param_hint = error.param_hint or long
            raise

    return Field(long, off, bool(names), "Path" in str(inner), inner is bool, repeated, parameter, convert)


def _one_of(words: tuple[str, ...]) -> Callable[[str], str]:
    def check(value: str) -> str:
        if value.lower() not in words:
            listed = " or ".join(words) if len(words) == 2 else f"one of {', '.join(words)}"
            raise Usage(f"expected {listed}, got {value!r}")
        return value.lower()

    return check


def command(function: Callable[..., None], *before: Any, bare: bool = False) -> Callable[..., None]:
    """What typer takes for a command: `function(*before, job)`, with a job of its dataclass; `bare`: no options."""
    job = job_of(function)
    fields = [] if bare else list(fields_of(job))

    def run(**given: Any) -> None:
        function(*before, job(**{f.parameter.name: f.convert(given[f.parameter.name]) for f in fields}))

    made: Any = run
    made.__name__, made.__doc__ = function.__name__, job.__doc__
    made.__signature__ = inspect.Signature([f.parameter for f in fields])
    made.__annotations__ = {f.parameter.name: f.parameter.annotation for f in fields}
    return run


def job_of(function: Callable[..., None]) -> type:
    """The dataclass of a command: the annotation of its argument `job`, which stands in the same module."""
    about: Any = function
    return about.__globals__[about.__annotations__["job"]]  # type: ignore[no-any-return]
