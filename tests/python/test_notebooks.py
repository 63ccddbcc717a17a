# SPDX-License-Identifier: MIT
"""Notebooks: numbered once each, and written with nothing that a reader could not use."""

import ast
import json
from pathlib import Path

import pytest

NOTEBOOKS = sorted((Path(__file__).resolve().parents[2] / "notebooks").glob("*.ipynb"))
PUBLIC = {"sdftrack", *(f"sdftrack.{name}" for name in (
    "contour", "geometry", "levelset", "metrics", "superpixels", "synth", "testing",
))}  # fmt: skip


def code_of(path):
    cells = json.loads(path.read_text())["cells"]
    return ast.parse("\n\n".join("".join(c["source"]) for c in cells if c["cell_type"] == "code"))


def test_notebooks_are_numbered_without_gaps_in_name_and_title():
    assert [int(path.name.split("_")[0]) for path in NOTEBOOKS] == list(range(1, len(NOTEBOOKS) + 1))
    for path in NOTEBOOKS:
        title = json.loads(path.read_text())["cells"][0]["source"][0]
        assert title.startswith(f"# {int(path.name.split('_')[0])}. "), path.name


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_a_notebook_uses_public_names_alone(path):
    for node in ast.walk(code_of(path)):
        if isinstance(node, ast.Import):
            used = [a.name for a in node.names]
        elif isinstance(node, ast.ImportFrom):
            used = [str(node.module)]
            assert not any(a.name.startswith("_") for a in node.names), ast.unparse(node)
        else:
            if isinstance(node, ast.Attribute):
                assert not node.attr.startswith("_"), ast.unparse(node)
            continue
        private = [name for name in used if name.split(".")[0] == "sdftrack" and name not in PUBLIC]
        assert not private, f"{ast.unparse(node)}: not in the public interface"
