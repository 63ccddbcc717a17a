# SPDX-License-Identifier: MIT
"""The package as installed: what importing it costs, its version, its types."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

import sdftrack as st

ROOT = Path(__file__).resolve().parents[2]
# Libraries that take longer to import than everything else: each is imported by the function that uses it.
HEAVY = ("cv2", "trimesh", "scipy", "matplotlib", "av", "typer", "rich")
SOURCES = {
    "cpp": (".h", ".cpp", ".cu", ".cuh"), "bindings": (".h", ".cpp"), "python": (".py",),
    "tests": (".py", ".cpp"),
}  # fmt: skip


def run_python(code: str) -> str:
    return subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout


def test_importing_the_package_imports_no_heavy_library():
    loaded = run_python("import sys, sdftrack; print(*sorted(sys.modules))").split()
    assert "sdftrack._core" in loaded
    assert [name for name in HEAVY if name in loaded] == []


def test_the_help_of_the_commands_needs_no_numpy():
    loaded = run_python("import sys, sdftrack.cli.app; print(*sys.modules)").split()
    assert "sdftrack.cli.track" in loaded
    assert "numpy" not in loaded


def test_every_public_name_exists_and_is_listed():
    assert [name for name in st.__all__ if not hasattr(st, name)] == []
    assert set(st.__all__) <= set(dir(st))


def test_type_checkers_read_the_names_that_users_get():
    tree = ast.parse(Path(st.__file__).read_text())
    (block,) = [
        node for node in tree.body if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
    ]
    told = {alias.name: node.module for node in block.body for alias in node.names}
    modules = {name for name, home in told.items() if home == "sdftrack"}
    assert {*told, "__version__"} == set(st.__all__)
    assert {f"sdftrack.{home}": set(names) for home, names in st._HOMES.items()} == {
        home: {name for name in told if told[name] == home} for home in set(told.values()) - {"sdftrack"}
    }
    assert all(getattr(st, name).__name__ == f"sdftrack.{name}" for name in modules)


def test_a_misspelt_name_is_an_error_that_names_it():
    with pytest.raises(AttributeError, match="'sdftrack' has no attribute 'Traker'"):
        st.Traker  # noqa: B018
    with pytest.raises(ImportError, match="Traker"):
        from sdftrack import Traker  # noqa: F401


def test_the_version_has_one_home():
    line = re.search(r'^version = "(.+)"$', (ROOT / "pyproject.toml").read_text(), re.MULTILINE)
    assert line is not None
    assert st.__version__ == line[1]


def test_the_package_is_typed():
    package = Path(st.__file__).parent
    assert (package / "py.typed").is_file()
    assert (package / "_core.pyi").is_file()


def test_every_source_file_names_its_licence_in_the_first_line():
    files = [
        path
        for folder, endings in SOURCES.items()
        for path in (ROOT / folder).rglob("*")
        if path.suffix in endings
    ]
    assert files
    unmarked = [
        str(path.relative_to(ROOT))
        for path in files
        if "SPDX-License-Identifier: MIT" not in path.read_text().partition("\n")[0]
    ]
    assert unmarked == []
