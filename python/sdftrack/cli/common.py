# SPDX-License-Identifier: MIT
"""Options of every command, and what several commands make of them: settings, boxes, tables."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import typer

import sdftrack as st
from sdftrack.cli.options import Usage, option

MAX_PX = 1e6  # of a window in an image
ALL_LOST = 3  # exit code
Unit = Literal["m", "mm", "cm", "in"]
Holes = Literal["error", "close"]


def device_name(value: str) -> str:
    if re.fullmatch(r"auto|cpu|cuda(:\d{1,4})?", value, re.IGNORECASE) is None:
        raise Usage(f"expected one of auto, cpu, cuda, cuda:N, got {value!r}")
    return value.lower()


def above_zero(what: str, limit: float = math.inf) -> Any:
    def check(value: float) -> float:
        if not 0 < value <= limit or value == math.inf:
            most = "" if limit == math.inf else f" and up to {limit:g}"
            raise Usage(f"expected {what} above 0{most}, got {value:g}")
        return value

    return check


def exit_if_lost(lines: list[str]) -> None:
    """Exit code 3 after lines of advice, one for each object that is lost in all frames."""
    for line in lines:
        print(f"sdftrack: {line}", file=sys.stderr)
    if lines:
        raise typer.Exit(ALL_LOST)


@dataclass(frozen=True, kw_only=True)
class Common:
    out: Path | None = option(None, "Output folder.", "--out", "-o", metavar="DIR")
    overwrite: bool = option(
        False, "Allow DIR to contain files; files of this command are replaced.", "--overwrite"
    )
    config: Path | None = option(None, "Options file, see sdftrack config.", metavar="FILE.toml")
    device: str = option(
        "auto", "Device for the computation.", metavar="auto|cpu|cuda|cuda:N", check=device_name
    )
    threads: int = option(0, "Number of threads; 0: all cores. Results do not depend on it.", min=0)
    quiet: bool = option(False, "Print only errors.", "--quiet", "-q")

    @property
    def folder(self) -> Path:
        if self.out is None:
            raise Usage("expected a folder for the results: --out DIR", "--out")
        return self.out

    def refuse_out(self, names: Iterable[str] = (), inputs: Iterable[tuple[str, Path | None]] = ()) -> Path:
        """--out, refused before the work if it holds files of others, or if one of `names` there is an input."""
        from sdftrack.io.out_folder import refuse_folder, refuse_inputs

        refuse_folder(self.folder, self.overwrite)
        refuse_inputs(self.folder, names, inputs)
        return self.folder

    def make_out(self) -> Path:
        """--out, made and held until the end."""
        from sdftrack.io.out_folder import prepare_folder

        prepare_folder(self.folder, self.overwrite)
        return self.folder

    def on_cpu(self) -> None:
        """For commands that run on the CPU and do not use --config: an invalid one is an error."""
        refuse_cuda(self.device)
        self.on_device()

    def on_device(self) -> str:
        """The device, "cpu" or "cuda:N", of commands that do not use --config: an invalid one is an error."""
        from sdftrack.device import resolve_device

        tracker_settings(self.config)
        return resolve_device(self.device)


@dataclass(frozen=True, kw_only=True)
class Sensor:
    sensor: str | None = option(
        None,
        "Depth error model: kinect_v1, realsense_d400, azure_kinect or a file written by calibrate depth.",
        metavar="NAME|FILE",
    )


@dataclass(frozen=True, kw_only=True)
class Meshes:
    """How models become volumes."""

    unit: Unit | None = option(None, "Unit of the meshes.")
    voxels: int = option(200, "Voxels along the longest side of a model's volume.", min=8)


def refuse_cuda(device: str) -> None:
    if device.startswith("cuda"):
        raise Usage(
            f"expected auto or cpu, got {device}: this command runs on the CPU (track, reconstruct, superpixels and "
            "demo use a GPU)",
            "--device",
        )


def tracker_settings(config: Path | None, sensor: str | None = None) -> dict[str, Any]:
    """Keyword arguments for `Tracker` from --config and --sensor."""
    settings: dict[str, Any] = {}
    if config is not None:
        settings["options"] = st.TrackerOptions.from_file(_there(config))
    if sensor is not None:
        try:
            settings["sensor"] = st.SensorModel.of(sensor)
        except (OSError, TypeError, ValueError) as error:
            raise Usage(str(error).removeprefix("sensor: "), "--sensor") from None
    return settings


def reconstructor_settings(config: Path | None, evolution: str | None = None) -> dict[str, Any]:
    single = {} if evolution is None else {"evolution": evolution}
    if config is None:
        return single
    from sdftrack.reconstruction.options import ReconstructorOptions

    options = ReconstructorOptions.from_file(_there(config)).replace(**single)
    tracker = tracker_settings(config)["options"]
    if options.evolution == "printed" and tracker == st.TrackerOptions():
        return {"options": options}  # the printed evolution brings a tracker of its own
    return {"options": options, "tracker_options": tracker}


def contour_settings(config: Path | None, alone: bool = False) -> dict[str, Any]:
    """Options of `ContourTracker` from --config; `alone`: a file that holds none of them is an error."""
    if config is None:
        return {}
    from sdftrack.contour.options import options_of_file

    options = options_of_file(_there(config))
    if alone and not options:
        raise ValueError(
            f"--config {config}: expected options in a table [contour], got none; see sdftrack config"
        )
    return options


def _there(config: Path) -> Path:
    if not config.is_file():
        raise FileNotFoundError(f"--config: no such file: {config}")
    return config


def floats(text: str, count: int) -> tuple[float, ...]:
    """The finite numbers between commas; () if there are not `count` of them."""
    try:
        values = tuple(float(v) for v in text.split(","))
    except ValueError:
        return ()
    return values if len(values) == count and all(map(math.isfinite, values)) else ()


def parse_box(text: str) -> tuple[float, float, float, float]:
    x, y, w, h = floats(text, 4) or (0.0,) * 4
    if not (abs(x) < MAX_PX and abs(y) < MAX_PX and 0 < w < MAX_PX and 0 < h < MAX_PX):
        raise Usage(f"expected x,y,w,h in pixels, w and h above 0, got {text!r}", "--box")
    return x, y, w, h


def text_table(title: str, head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    table = [head, *rows]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    lines = [
        "  ".join([row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])]).rstrip() for row in table
    ]
    return "\n".join([title, *lines])


def show_table(
    title: str, head: Sequence[str], rows: Sequence[Sequence[str]], colors: Mapping[str, str] | None = None,
) -> str:  # fmt: skip
    """Print a table (drawn on a terminal, aligned text in a pipe) and return its text. `colors` are those of columns,
    by head, on a terminal; cells with "0" are not coloured."""
    text = text_table(title, head, rows)
    if sys.stdout.isatty():
        from rich.console import Console
        from rich.table import Table
        from rich.text import Text

        table = Table(title=title, title_justify="left")
        for i, name in enumerate(head):
            table.add_column(name, justify="left" if i == 0 else "right")
        for row in rows:
            styles = ("" if c == "0" else (colors or {}).get(h, "") for h, c in zip(head, row, strict=True))
            table.add_row(*(Text(c, s) for c, s in zip(row, styles, strict=True)))
        Console().print(table)
    else:
        print(text)
    return text
