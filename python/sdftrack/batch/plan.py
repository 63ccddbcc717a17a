# SPDX-License-Identifier: MIT
"""The plan of a batch: jobs in a TOML file, each a command for many recordings and a matrix of its options."""

from __future__ import annotations

import hashlib
import itertools
import json
import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sdftrack._internal.text_files import read_toml
from sdftrack._internal.unknown_option import unknown_option
from sdftrack.batch.addresses import expanded, is_address, name_of

COMMANDS = ("track", "reconstruct", "fit", "contour", "superpixels", "convert", "evaluate", "motion")
OF_RESULTS = ("evaluate", "motion")  # may take the results of another job
TEXT, NUMBER = (str, "text"), ((int, float), "a number")
OWN: dict[str, tuple[Any, str]] = {
    "command": TEXT, "name": TEXT, "sequences": ((str, list), "a path, a pattern or a list"), "of": TEXT,
    "threads": (int, "a number"), "memory_gb": NUMBER, "gpus": NUMBER, "timeout_s": NUMBER,
}  # fmt: skip
TAKEN = ("out", "overwrite", "quiet")
MOST = 10_000_000  # of items


@dataclass(frozen=True)
class Commands:
    """The commands of the program, handed in by what assembles them, the one that runs a batch among them. `fields` of
    a command's name: its options and arguments, as `sdftrack.cli.options.Field`. `check` parses a command line. `run`
    runs it and returns the exit code; workers can import it."""

    fields: Callable[[str], Sequence[Any]]
    check: Callable[[list[str]], None]
    run: Callable[[list[str]], int]


def _key(name: str) -> str:
    return name.replace("-", "_")


@dataclass(frozen=True)
class Item:
    """One call of a command. `name`: job/recording, and the values of the matrix: also the folder of its results below
    DIR. `after`: the item whose results it takes. `options`: as on a command line, without --out and --threads;
    `files`: where addresses stand among them. `matrix`: values of the options that differ between the items of the
    job."""

    name: str
    job: str
    command: str
    source: str
    after: str | None
    options: list[str]
    files: tuple[int, ...] = ()
    matrix: dict[str, str] = field(default_factory=dict)
    threads: int = 1
    memory_gb: float | None = None
    gpus: float = 0.0
    timeout_s: float | None = None

    @property
    def words(self) -> list[str]:
        return [*self.options, "--threads", str(self.threads)]

    @property
    def digest(self) -> str:
        """Of all that the results depend on."""
        what = [self.command, self.source, self.after, self.options]
        return hashlib.blake2b(json.dumps(what).encode(), digest_size=8).hexdigest()


def read_plan(path: Path, common: Mapping[str, Any], commands: Commands) -> list[Item]:
    """The items of a plan in order; every command line in it has been checked. `common`: options of each job that does
    not set them, if its command has them. FileNotFoundError or ValueError name the job and what is wrong with it."""
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file; expected a plan in TOML")
    plan = read_toml(path)
    jobs = plan.pop("job", None)
    if plan:
        raise ValueError(f"{path}: {unknown_option(next(iter(plan)), ['job'])}")
    if not isinstance(jobs, list) or not jobs or not all(isinstance(j, dict) for j in jobs):
        raise ValueError(f"{path}: expected one or more tables [[job]] with command and sequences")
    by_job: dict[str, list[Item]] = {}
    for number, job in enumerate(jobs, 1):
        try:
            made = _items(job, common, path.resolve().parent, by_job, commands)
            if made[0].job in by_job:
                raise ValueError("expected a name for each of several jobs of one command (name = ...)")
            by_job[made[0].job] = made
            if sum(map(len, by_job.values())) > MOST:
                raise ValueError(f"expected at most {MOST} calls in a plan")
        except (ValueError, TypeError, OSError) as error:
            raise ValueError(f"{path}: job {job.get('name', number)}: {error}") from None
    return [item for own in by_job.values() for item in own]


def _items(
    job: Mapping[str, Any], common: Mapping[str, Any], base: Path, earlier: dict[str, list[Item]], commands: Commands
) -> list[Item]:  # fmt: skip
    command = job.get("command")
    if command not in COMMANDS:
        raise ValueError(f"command: expected one of {', '.join(COMMANDS)}, got {command!r}")
    fields = commands.fields(command)
    options = {_key(f.name.removeprefix("--")): f for f in fields if f.is_option}
    job = {**{key: value for key, value in common.items() if key in options}, **job}
    _check_own(job)
    given = {key: value for key, value in job.items() if key not in OWN}
    name = job.get("name", command)
    if not name or Path(name).name != name or name.startswith("."):
        raise ValueError(f"name: expected a word that can name a folder, got {name!r}")
    sources = _sources(job, base, earlier)
    before = {item.name: item for own in earlier.values() for item in own}
    own = (job.get("threads", 1), job.get("memory_gb"), float(job.get("gpus", 0)), job.get("timeout_s"))
    out: dict[str, Item] = {}
    for (source, after), label in zip(sources, _names(sources), strict=True):
        rows = list(_matrix(_filled(given, source, label), options, base))
        for matrix, words, files in rows:
            folder = "/".join([name, label, *([_folder(matrix)] if len(rows) > 1 else [])])
            if folder.lower() in out:
                raise ValueError(
                    f"expected values with different names, got two calls that write into {folder}"
                )
            varied = {**(before[after].matrix if after else {}), **matrix}
            out[folder.lower()] = Item(folder, name, command, source, after, words, files, varied, *own)
    items, inputs = list(out.values()), ["x"] * sum(not f.is_option for f in fields)
    try:
        commands.check([command, *inputs, *items[0].words, "--out", "x"])
    except Exception as error:  # typer may bring its own copy of click
        if not hasattr(error, "format_message"):
            raise
        raise ValueError(" ".join(error.format_message().split())) from None
    return items


def _filled(value: Any, source: str, name: str) -> Any:
    """The value for one recording: {recording} is its path or address, {name} its name."""
    if isinstance(value, Mapping):
        return {key: _filled(v, source, name) for key, v in value.items()}
    if isinstance(value, list):
        return [_filled(v, source, name) for v in value]
    return value.replace("{recording}", source).replace("{name}", name) if isinstance(value, str) else value


def _check_own(job: Mapping[str, Any]) -> None:
    for key, value in job.items():
        kind, words = OWN.get(key, (object, ""))
        if key in OWN and (not isinstance(value, kind) or isinstance(value, bool)):
            raise TypeError(f"{key}: expected {words}, got {value!r}")
        if key in OWN and isinstance(value, (int, float)) and not 0 <= value < 1e9:
            raise ValueError(f"{key}: expected 0 or more, got {value!r}")
        if _key(key) in TAKEN:
            raise ValueError(f"{key}: set by the batch; remove it")


def _sources(
    job: Mapping[str, Any], base: Path, earlier: dict[str, list[Item]]
) -> list[tuple[str, str | None]]:
    of, sequences = job.get("of"), job.get("sequences")
    if (of is None) == (sequences is None):
        raise ValueError('expected one of sequences = "FOLDER/*" and of = "JOB"')
    if of is not None:
        if job["command"] not in OF_RESULTS:
            known = " and ".join(OF_RESULTS)
            raise ValueError(f"of: expected sequences = ...; only {known} take results of a job")
        if of not in earlier:
            raise ValueError(f"of: expected the name of an earlier job, {unknown_option(of, earlier)}")
        return [(item.source, item.name) for item in earlier[of]]
    if job["command"] == "evaluate":
        raise ValueError('sequences: expected of = "JOB": evaluate takes the results of a job')
    patterns = [sequences] if isinstance(sequences, str) else sequences
    if not patterns or not all(isinstance(p, str) for p in patterns):
        raise ValueError(f"sequences: expected a path, a pattern or a list of them, got {sequences!r}")
    found = dict.fromkeys(place for pattern in patterns for place in expanded(pattern, base))
    return [(place, None) for place in found]


def _matrix(
    given: Mapping[str, Any], options: Mapping[str, Any], base: Path
) -> Iterator[tuple[dict[str, str], list[str], tuple[int, ...]]]:
    """(values that differ, command line, where addresses stand in it) of each combination of options."""
    axes = {key: value if isinstance(value, list) else [value] for key, value in given.items()}
    for key, values in axes.items():
        if not values:
            raise ValueError(f"{key}: expected a value or a list of values, got none")
    for row in itertools.product(*axes.values()):
        chosen = dict(zip(axes, row, strict=True))
        words = [word for key, value in chosen.items() for word in _words(options, key, value, base)]
        varied = {
            key: ",".join(map(str, v)) if isinstance(v, list) else str(v)
            for key, v in chosen.items()
            if len(axes[key]) > 1
        }
        yield varied, words, tuple(i for i, word in enumerate(words) if is_address(word))


def _words(options: Mapping[str, Any], key: str, value: Any, base: Path) -> list[str]:
    """The words of `key` = `value` on a command line; paths of files become whole, relative ones are below `base`."""
    field = options.get(_key(key))
    if field is None:
        raise ValueError(unknown_option(key, options))
    if field.is_flag:
        if not isinstance(value, bool):
            raise ValueError(f"{key}: expected true or false, got {value!r}")
        return [name for name in [field.name if value else field.off] if name]
    values = value if isinstance(value, list) else [value]
    if len(values) > 1 and not field.is_repeated:
        raise ValueError(f"{key}: expected one value for each call, got the list {value!r}")
    words = []
    for each in values:
        if isinstance(each, bool) or not isinstance(each, (str, int, float)):
            raise ValueError(f"{key}: expected text or a number, got {each!r}")
        text = str(each)
        if isinstance(each, str) and text and not is_address(text):
            path = base / Path(text).expanduser()
            if os.path.exists(path):  # unlike Path.exists(), also of a text that is too long for a name
                text = str(path)
            elif field.is_files:
                raise ValueError(f"{key}: no such file: {path}")
        words += [field.name, text]
    return words


def _folder(matrix: dict[str, str]) -> str:
    """A name for the values of a row of the matrix, that any file system takes."""
    parts = [f"{key}={Path(text).stem if '/' in text else text}" for key, text in matrix.items()]
    return "".join(c if c.isalnum() or c in "=.-_+," else "-" for c in "_".join(parts))[:120]


def _names(sources: list[tuple[str, str | None]]) -> list[str]:
    """The last parts of the recordings' paths, with numbers where several are the same; results of results have the
    names of those."""
    names = [name_of(source) for source, _ in sources]
    taken, numbers, out = set(names), Counter[str](), list[str]()
    for name, (_, after) in zip(names, sources, strict=True):
        label = after.partition("/")[2] if after else name
        if not after and numbers[name]:
            label = next(f"{name}_{k}" for k in itertools.count(numbers[name]) if f"{name}_{k}" not in taken)
            taken.add(label)
        numbers[name] += 1
        out.append(label)
    return out
