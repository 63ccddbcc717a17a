# SPDX-License-Identifier: MIT
"""The options of a reconstructor, which the core describes (cpp/reconstruction/option_schema.h)."""

from __future__ import annotations

import os
from dataclasses import Field
from typing import Any, ClassVar, Self

from sdftrack import _core
from sdftrack._internal.option_files import options_from_file


class ReconstructorOptions(_core.ReconstructionOptions):
    """Options of :class:`sdftrack.Reconstructor`; any of them is also a keyword of it. Lengths in metres.

    >>> ReconstructorOptions(evidence="printed").sigma_d_m
    0.003
    """

    __slots__ = ()
    __dataclass_fields__: ClassVar[dict[str, Field[Any]]] = _core.ReconstructionOptions.fields()

    @classmethod
    def from_file(cls, path: str | os.PathLike[str]) -> Self:
        """Read the table ``[reconstruct]`` of a TOML file; the defaults if it is missing."""
        return options_from_file(cls, path, "reconstruct")
