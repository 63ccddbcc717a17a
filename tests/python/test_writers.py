# SPDX-License-Identifier: MIT
"""Every writer of the package gives a file its name when it is whole; only old files, on request, are unpickled."""

import ast
from pathlib import Path

import sdftrack

PACKAGE = Path(sdftrack.__file__).parent
METHODS = {"write_text", "write_bytes", "savez", "savez_compressed", "imwrite", "savefig", "to_csv", "tofile"}
WHOLE = ("replacing(", "write_whole(")
# Functions that open a file for writing in another way: where its name is another one until it is whole, or where it
# grows while it is written and may be read before its end.
HIDDEN = "under a hidden name, renamed by its owner"
GROWS = "a recording or its journal, which is read up to where it was cut"
OTHERS = {
    ("_internal/saved_file", "_write_archive"): "into what its caller replaces",
    ("batch/journal", "__init__"): GROWS,
    ("batch/task", "_placed"): "in a hidden folder, which gets its name when it is whole",
    ("batch/task", "_run"): "a log, which is read while it grows",
    ("batch/task", "_time_limit"): "a log, which is read while it grows",
    ("batch/task", "end"): "a log, which is read while it grows",
    ("cli/contour", "__init__"): "a hidden list of what is written",
    ("io/datasets/bags/topics", "models_of"): "in a temporary folder",
    ("io/out_folder", "__init__"): "a lock that has no content",
    ("recorder", "__init__"): HIDDEN,
    ("_internal/files", "__init__"): GROWS,
    ("io/writers/video", "_begin"): GROWS,
    ("io/video", "__init__"): HIDDEN,
    ("io/writers/base", "_keep_space"): GROWS,
    ("io/writers/base", "_line"): GROWS,
    ("motion/files/c3d_child", "main"): "in a temporary folder",
    ("motion/report/plots", "_svg"): "in memory",
}


def is_writing_mode(node: ast.expr) -> bool:
    mode = node.value if isinstance(node, ast.Constant) else None
    return isinstance(mode, str) and set(mode) <= set("rwaxbt+") and bool(set(mode) & set("wax+"))


def writes(function: ast.FunctionDef) -> bool:
    for call in ast.walk(function):
        if isinstance(call, ast.Call):
            attribute = isinstance(call.func, ast.Attribute)
            name = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
            arguments = [*call.args, *(keyword.value for keyword in call.keywords)]
            if (attribute and name in METHODS) or (name == "open" and any(map(is_writing_mode, arguments))):
                return True
    return False


def test_every_writer_gives_a_file_its_name_when_it_is_whole() -> None:
    found = set()
    for path in PACKAGE.rglob("*.py"):
        text = path.read_text()
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.FunctionDef) and writes(node):
                source = ast.get_source_segment(text, node) or ""
                if not any(word in source for word in WHOLE):
                    found.add((path.relative_to(PACKAGE).with_suffix("").as_posix(), node.name))
    assert found == set(OTHERS)


def test_pickles_are_neither_read_nor_written() -> None:
    users = set()
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import | ast.ImportFrom) else []
            if isinstance(node, ast.ImportFrom):
                names.append(node.module or "")
            if any(name.split(".")[0] in ("pickle", "dill", "joblib", "shelve", "marshal") for name in names):
                users.add(path.name)
            if isinstance(node, ast.keyword) and node.arg == "allow_pickle":
                assert isinstance(node.value, ast.Constant), path
                assert node.value.value is False, path
    assert users == set()
