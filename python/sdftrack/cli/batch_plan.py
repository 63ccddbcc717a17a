# SPDX-License-Identifier: MIT
"""The plan of a batch: jobs in a TOML file, each a command for many recordings and a matrix of its options."""

from __future__ import annotations

import hashlib
import itertools
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sdftrack._internal.text_files import read_toml
from sdftrack._internal.unknown_option import unknown_option
from sdftrack.batch.addresses import expanded, is_address, name_of
from sdftrack.cli.batch_options import Options, options_of_command

__all__ = ["COMMANDS", "Item", "read_plan"]

COMMANDS = ("track", "reconstruct", "fit", "contour", "superpixels", "convert", "evaluate", "motion")
OF_RESULTS = ("evaluate", "motion")  # may take the results of another job
OWN: dict[str, Any] = {
    "command": str, "name": str, "sequences": (str, list), "of": str, "threads": int, "memory_gb": (int, float),
    "gpus": (int, float), "timeout_s": (int, float),
}  # fmt: skip
TAKEN = ("out", "overwrite", "quiet")
MOST = 10_000_000  # of items


@dataclass(frozen=True)
class Item:
    """One call of a command.

    Attributes
    ----------
    name : str
        job/recording, and the values of the matrix: also the folder of its results below DIR.
    job, command : str
    source : str
        Path or address of the recording.
    after : str or None
        The item whose results it takes.
    options : list of str
        As on a command line, without --out.
    files : tuple of int
        Where among `options` addresses of files stand.
    matrix : dict
        Values of the options that differ between the items of the job.
    threads, memory_gb, gpus, timeout_s
        What it needs.
    """

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
    def digest(self) -> str:
        """Of all that the results depend on."""
        what = [self.command, self.source, self.after, self.options]
        return hashlib.blake2b(json.dumps(what).encode(), digest_size=8).hexdigest()


def read_plan(path: Path, common: Mapping[str, Any]) -> list[Item]:
    """The items of a plan in order; every command line in it has been checked.

    `common`: options of each job that does not set them, if its command has them.

    Raises
    ------
    FileNotFoundError, ValueError
        The file, or a line that names the job and what is wrong with it.
    """
    plan = _parsed(path)
    jobs = plan.pop("job", None)
    if plan:
        raise ValueError(f"{path}: {unknown_option(next(iter(plan)), ['job'])}")
    if not isinstance(jobs, list) or not jobs or not all(isinstance(j, dict) for j in jobs):
        raise ValueError(f"{path}: expected one or more tables [[job]] with command and sequences")
    items: list[Item] = []
    by_job: dict[str, list[Item]] = {}
    for number, job in enumerate(jobs, 1):
        where = f"{path}: job {job.get('name', number)}"
        try:
            made = _items(_with_common(job, common), path.resolve().parent, by_job)
        except (ValueError, TypeError, OSError) as error:
            raise ValueError(f"{where}: {error}") from None
        if made[0].job in by_job:
            raise ValueError(f"{where}: expected a name for each of several jobs of one command (name = ...)")
        by_job[made[0].job] = made
        items += made
        if len(items) > MOST:
            raise ValueError(f"{where}: expected at most {MOST} calls in a plan")
    return items


def _parsed(path: Path) -> dict[str, Any]:
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file; expected a plan in TOML")
    return read_toml(path)


def _with_common(job: Mapping[str, Any], common: Mapping[str, Any]) -> dict[str, Any]:
    known = options_of_command(str(job["command"])).keys if job.get("command") in COMMANDS else ()
    return {**{key: value for key, value in common.items() if key in known}, **job}


def _items(job: Mapping[str, Any], base: Path, earlier: dict[str, list[Item]]) -> list[Item]:
    command = job.get("command")
    if command not in COMMANDS:
        raise ValueError(f"command: expected one of {', '.join(COMMANDS)}, got {command!r}")
    _check_types(job)
    options = options_of_command(command)
    given = {key: value for key, value in job.items() if key not in OWN}
    for key in given:
        if key.replace("-", "_") in TAKEN:
            raise ValueError(f"{key}: set by the batch; remove it")
    name = job.get("name", command)
    if not name or Path(name).name != name or name.startswith("."):
        raise ValueError(f"name: expected a word that can name a folder, got {name!r}")
    threads = job.get("threads", 1)
    rows = list(_matrix(given, options, base))
    sources = _sources(job, base, earlier)
    # Results of results have the names of those.
    names = [
        u.partition("/")[2] if u else name for (_, u), name in zip(sources, _names(sources), strict=True)
    ]
    out = []
    before = {item.name: item.matrix for own in earlier.values() for item in own}
    for (source, upstream), label in zip(sources, names, strict=True):
        for matrix, words, files in rows:
            folder = "/".join([name, label, *([_folder(matrix)] if len(rows) > 1 else [])])
            made = Item(
                folder, name, command, source, upstream, [*words, "--threads", str(threads)], files,
                {**(before[upstream] if upstream else {}), **matrix},
                threads, job.get("memory_gb"), float(job.get("gpus", 0)), job.get("timeout_s"),
            )  # fmt: skip
            out.append(made)
    _check_unique(out)
    options.check(out[0].options)
    return out


def _check_types(job: Mapping[str, Any]) -> None:
    for key, kind in OWN.items():
        value = job.get(key)
        if value is None:
            continue
        if not isinstance(value, kind) or isinstance(value, bool):
            expected = (
                "text" if kind is str else "a path, a pattern or a list" if key == "sequences" else "a number"
            )
            raise TypeError(f"{key}: expected {expected}, got {value!r}")
        if isinstance(value, (int, float)) and not 0 <= value < 1e9:
            raise ValueError(f"{key}: expected 0 or more, got {value!r}")


def _sources(
    job: Mapping[str, Any], base: Path, earlier: dict[str, list[Item]]
) -> list[tuple[str, str | None]]:
    """(recording, item whose results are taken) of each call."""
    of, sequences = job.get("of"), job.get("sequences")
    if (of is None) == (sequences is None):
        raise ValueError('expected one of sequences = "FOLDER/*" and of = "JOB"')
    if of is not None:
        if job["command"] not in OF_RESULTS:
            raise ValueError(
                f"of: expected sequences = ...; only {' and '.join(OF_RESULTS)} take results of a job"
            )
        if of not in earlier:
            raise ValueError(f"of: expected the name of an earlier job, {unknown_option(of, earlier)}")
        return [(item.source, item.name) for item in earlier[of]]
    if job["command"] == "evaluate":
        raise ValueError('sequences: expected of = "JOB": evaluate takes the results of a job')
    patterns = [sequences] if isinstance(sequences, str) else sequences
    if not patterns or not all(isinstance(p, str) for p in patterns):
        raise ValueError(f"sequences: expected a path, a pattern or a list of them, got {sequences!r}")
    found = list(dict.fromkeys(place for pattern in patterns for place in expanded(pattern, base)))
    return [(place, None) for place in found]


def _matrix(
    given: Mapping[str, Any], options: Options, base: Path
) -> Iterator[tuple[dict[str, str], list[str], tuple[int, ...]]]:
    """(values that differ, command line, where addresses stand in it) of each combination of options."""
    axes = [(key, value if isinstance(value, list) else [value]) for key, value in given.items()]
    for key, values in axes:
        if not values:
            raise ValueError(f"{key}: expected a value or a list of values, got none")
    for chosen in itertools.product(*(values for _, values in axes)):
        words: list[str] = []
        for (key, _), value in zip(axes, chosen, strict=True):
            words += options.words(key, value, base)
        places = tuple(i for i, word in enumerate(words) if is_address(word))
        varied = {key: _text(v) for (key, values), v in zip(axes, chosen, strict=True) if len(values) > 1}
        yield varied, words, places


def _text(value: Any) -> str:
    return ",".join(str(v) for v in value) if isinstance(value, list) else str(value)


def _folder(matrix: dict[str, str]) -> str:
    """A name for the values of a row of the matrix, that any file system takes."""
    parts = [f"{key}={Path(text).stem if '/' in text else text}" for key, text in matrix.items()]
    return "".join(c if c.isalnum() or c in "=.-_+," else "-" for c in "_".join(parts))[:120]


def _names(sources: list[tuple[str, str | None]]) -> list[str]:
    """The last parts of the recordings' paths, with numbers where several are the same."""
    names = [name_of(source) for source, _ in sources]
    seen: dict[str, int] = {}
    taken, out = set(names), []
    for name in names:
        count = seen[name] = seen.get(name, -1) + 1
        label = name
        while count and (label := f"{name}_{count}") in taken:
            count += 1
        seen[name] = count
        taken.add(label)
        out.append(label)
    return out


def _check_unique(items: list[Item]) -> None:
    seen: dict[str, Item] = {}
    for item in items:
        if item.name.lower() in seen:
            raise ValueError(
                f"expected values with different names, got two calls that write into {item.name}"
            )
        seen[item.name.lower()] = item
