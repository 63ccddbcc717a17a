# SPDX-License-Identifier: MIT
"""Common parts of commands for recorded sequences: usage errors, output folders, processing in turn."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from sdftrack.cli.common import Usage

__all__ = ["MODES", "check_unit", "check_usage", "each_sequence", "folder_each"]

MODES = ("auto", "depth", "rgbd")


def check_usage(mode: str, unit: str | None, out: Path | None, modes: tuple[str, ...] = MODES) -> None:
    if out is None:
        raise Usage("expected a folder for the results: --out DIR", "--out")
    if mode not in modes:
        raise Usage(f"expected one of {', '.join(modes)}, got {mode!r}", "--mode")
    check_unit(unit)


def check_unit(unit: str | None) -> None:
    if unit not in (None, "m", "mm", "cm", "in"):
        raise Usage(f"expected m, mm, cm or in, got {unit!r}", "--unit")


def folder_each(sequences: list[Path], out: Path) -> list[Path]:
    """Output folder of each sequence: `out` for a single one, else a subfolder of its name."""
    if len(sequences) == 1:
        return [out]
    names: list[str] = []
    for folder in sequences:
        name = folder.resolve().name
        taken = names.count(name)
        names.append(name)
        if taken:
            names[-1] = f"{name}_{taken}"
    return [out / name for name in names]


def each_sequence(
    sequences: list[str], out: Path, work: Callable[[Path, Path], None], *also: type[Exception]
) -> None:
    """Call `work(sequence, output folder)` for each; with several, failures are reported at the end."""
    folders = [Path(s) for s in sequences]
    targets = folder_each(folders, out)
    for folder, target in zip(folders, targets, strict=True):
        if target.resolve() == folder.resolve():  # --overwrite or not: its mesh.ply is not ours to replace
            raise ValueError(f"--out: expected another folder than the sequence {folder}, got the same")
    failed: list[str] = []
    told_at_the_end: tuple[type[Exception], ...] = (OSError, ValueError, TypeError, RuntimeError, *also)
    for folder, target in zip(folders, targets, strict=True):
        try:
            work(folder, target)
        except told_at_the_end as error:
            if len(folders) == 1:
                raise
            told = " ".join(str(error).split())
            failed.append(told if told.startswith(str(folder)) else f"{folder}: {told}")
    if failed:
        raise RuntimeError(f"{len(failed)} of {len(folders)} sequences failed: " + "; ".join(failed))
