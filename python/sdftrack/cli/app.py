# SPDX-License-Identifier: MIT
"""Assembles the commands and handles their errors."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import typer

from sdftrack._internal.unknown_option import unknown_option
from sdftrack.cli import (
    batch,
    contour,
    demo,
    evaluate,
    fit,
    info,
    live,
    motion,
    reconstruct,
    record,
    reproduce,
    superpixels,
    synth,
    track,
    view,
)
from sdftrack.cli.calibrate import color, depth, intrinsics
from sdftrack.cli.options import Field, command, fields_of, job_of
from sdftrack.io.out_folder import one_run

if TYPE_CHECKING:
    from sdftrack.batch.plan import Commands


def _version(wanted: bool) -> None:
    if wanted:
        from sdftrack import __version__

        print(__version__)
        raise typer.Exit()


def _root(
    version: bool = typer.Option(
        False, "--version", callback=_version, is_eager=True, help="Print the version."
    ),
) -> None:
    pass


@cache
def parser(only: str | None = None) -> Any:
    """The whole command line, as typer made it. `only`: the one command whose options are needed, "" for none; those of
    all take a tenth of a second."""
    app = typer.Typer(
        name="sdftrack",
        help="Track and reconstruct rigid objects with an RGB-D camera, using signed distance functions.",
        add_completion=False,
        pretty_exceptions_enable=False,
        no_args_is_help=True,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback()(_root)
    for each in COMMANDS:
        # A batch runs others, so that it cannot import what assembles them all: they are handed to it.
        handed = [_commands] if each is batch.batch else []
        app.command()(command(each, *handed, bare=only not in (None, each.__name__)))
    calibrations = typer.Typer(help="Calibrate cameras from recorded sequences.", no_args_is_help=True)
    for each in (intrinsics.intrinsics, color.color, depth.depth):
        calibrations.command()(command(each, bare=only not in (None, "calibrate")))
    app.add_typer(calibrations, name="calibrate")
    return typer.main.get_command(app)


def run(arguments: list[str]) -> int:
    import warnings

    whole = parser(next((word for word in arguments if not word.startswith("-")), ""))
    with warnings.catch_warnings():
        options = options_of(whole, arguments)

        def warn(message: Warning | str, *about: Any, **more: Any) -> None:
            print(f"sdftrack: warning: {as_options(_one_line(str(message)), options)}", file=sys.stderr)

        warnings.showwarning = warn
        return _run(whole, arguments, options)


def _run(command: Any, arguments: list[str], options: dict[str, str]) -> int:
    try:
        with one_run():
            code = command.main(args=arguments, prog_name="sdftrack", standalone_mode=False)
        sys.stdout.flush()
        # Newer releases of typer turn Ctrl-C into this code without a word.
        return _fail("interrupted", 130) if code == 130 else int(code or 0)
    except BrokenPipeError:  # `sdftrack ... | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except KeyboardInterrupt:
        return _fail("interrupted", 130)
    except Exception as error:
        # typer may bring its own copy of click, so its exceptions are known by what they can do.
        kind, context = type(error).__name__, getattr(error, "ctx", None)
        if kind == "Abort":  # of Ctrl-C, and of a prompt at the end of its input
            return _fail("interrupted", 130)
        if kind == "NoArgsIsHelpError":
            print(error)
            return 2
        if hasattr(error, "format_message"):
            text = str(error.format_message())
            if kind == "NoSuchOption" and context is not None:
                known = [name for p in context.command.params for name in p.opts]
                text = unknown_option(getattr(error, "option_name", ""), known)
            where = context.command_path if context is not None else "sdftrack"
            return _fail(f"{_one_line(text)} (see {where} --help)", 2)
        if os.environ.get("SDFTRACK_DEBUG"):
            raise
        return _fail(_told(error, options), 1)


def _told(error: Exception, options: dict[str, str]) -> str:
    text = as_options(_one_line(str(error)), options)
    if (
        not isinstance(error, (ValueError, TypeError, OSError, RuntimeError, ImportError, MemoryError))
        or not text
    ):
        return (
            f"{type(error).__name__}: {text} (set SDFTRACK_DEBUG=1 for the traceback, and please report it)"
        )
    if isinstance(error, OSError) and error.strerror:
        about = [str(error.filename)] if error.filename is not None else []
        return _one_line(": ".join([*about, error.strerror]))
    return text


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _fail(text: str, code: int) -> int:
    sys.stdout.flush()
    print(f"sdftrack: error: {text}", file=sys.stderr)
    return code


def _commands() -> Commands:
    from sdftrack.batch.plan import Commands

    def fields(name: str) -> list[Field]:
        return list(fields_of(job_of(next(each for each in COMMANDS if each.__name__ == name))))

    def parse(line: list[str]) -> None:
        parser(line[0]).commands[line[0]].make_context(line[0], line[1:])

    return Commands(fields, parse, run)


COMMANDS: tuple[Callable[..., None], ...] = (
    demo.demo, track.track, reconstruct.reconstruct, fit.fit, contour.contour, superpixels.superpixels,
    evaluate.evaluate, motion.motion, batch.batch, live.live, record.record, record.convert, synth.synth,
    reproduce.reproduce, view.view, info.info, info.config,
)  # fmt: skip


# Of every command, also where the parser could not tell which one was meant.
COMMON = {"voxels": "--voxels", "unit": "--unit", "holes": "--holes", "overwrite": "--overwrite"}
NAME = r"(?<![\w/])([a-z][a-z0-9_]*)="  # not in a path
END = r"(?=[\s,;.)]|$)"


def options_of(command: Any, arguments: Sequence[str]) -> dict[str, str]:
    """Options of the (sub)command called by the arguments, by the name of the Python argument."""
    for word in arguments:
        below = getattr(command, "commands", {}).get(word)
        if below is None:
            break
        command = below
    own = {}
    for parameter in getattr(command, "params", []):
        long = [text for text in getattr(parameter, "opts", []) if text.startswith("--")]
        if long and parameter.name:
            own[parameter.name] = long[0]
    return {**COMMON, **own}


def as_options(text: str, options: dict[str, str]) -> str:
    """Rewrite Python arguments in `text` as options; advice without a corresponding option is removed."""
    # Code in brackets, such as (points[np.isfinite(points).all(axis=1)]), is for those who write code.
    text = re.sub(r" \([a-z_]+\[.*?\]\)", "", text)
    text = re.sub(r"\bpass " + NAME + r", or ", lambda m: m[0] if m[1] in options else "", text)
    text = re.sub(r",? or (?:pass )?" + NAME + END, lambda m: m[0] if m[1] in options else "", text)
    text = re.sub(r" \(" + NAME + END, lambda m: m[0] if m[1] in options else " (", text)
    text = re.sub(r",? or [^,;()]* \(from Python: \w+\)", "", text).replace(" ()", "")
    text = re.sub(r"\bpass " + NAME + "False", lambda m: "leave out " + options.get(m[1], m[1]), text)
    if "no_plane" in options:
        text = re.sub(r"\bplane=None\b", options["no_plane"], text)
    text = re.sub(r"^([a-z][a-z0-9_]*):", lambda m: f"{options.get(m[1], m[1])}:", text)

    def option(match: re.Match[str]) -> str:
        name, value = match[1], match[2] or ""
        if name not in options:
            return match[0]
        if value in ("", "True"):
            return options[name]
        return f"{options[name]} " + re.sub(r"['\"()\s]", "", value)

    return re.sub(NAME + r"('\w+'|\"\w+\"|\([^()]*\)|\w[\w.]*)?", option, text)
