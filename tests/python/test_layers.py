# SPDX-License-Identifier: MIT
"""Nothing points upwards or in a circle: imports and includes against the orders that docs/architecture.md shows."""

import ast
import functools
import graphlib
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import sdftrack

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs/architecture.md").read_text()
PACKAGE = ROOT / "python/sdftrack"


def circle(graph: dict[str, set[str]]) -> list[str]:
    """One circle of a graph, [] where there is none."""
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        return list(error.args[1])
    return []


# -- Python
ROOMS = {"sdftrack": PACKAGE, "experiments": ROOT / "experiments"}


def modules() -> dict[str, Path]:
    names = {}
    for folder in ROOMS.values():
        for path in folder.rglob("*.py"):
            parts = path.relative_to(folder.parent).with_suffix("").parts
            names[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return names


MODULES = modules()


def face(name: str) -> str:
    """The module behind a public name of the package, or the module of that name."""
    return f"sdftrack.{sdftrack._HOME_OF.get(name, name)}"


def run_nodes(tree: ast.AST) -> Iterator[ast.AST]:
    """Everything in a module that may run: not what is for type checkers, or for a file that is run as a program."""
    for child in ast.iter_child_nodes(tree):
        if not (
            isinstance(child, ast.If)
            and ast.unparse(child.test) in ("TYPE_CHECKING", "__name__ == '__main__'")
        ):
            yield child
            yield from run_nodes(child)


def imported_by_name(node: ast.Call) -> Iterator[str]:
    """What importlib imports: import_module("sdftrack.x") and __import__, with a constant."""
    function = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
    if function in ("import_module", "__import__") and node.args and isinstance(node.args[0], ast.Constant):
        yield str(node.args[0].value)


def imported(tree: ast.Module) -> Iterator[str]:
    """What a file imports of the package and the laboratory, also inside functions and by importlib."""
    faces, attributes = set(), []
    for node in run_nodes(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name == "sdftrack":
                    faces.add(alias.asname or alias.name)
                elif alias.name.split(".")[0] in ROOMS:
                    yield alias.name
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in ROOMS:
            assert node.module
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                if node.module == "sdftrack":
                    yield face(alias.name)
                else:
                    yield inner if inner in MODULES else node.module
        elif isinstance(node, ast.Call):
            yield from (name for name in imported_by_name(node) if name.split(".")[0] in ROOMS)
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            attributes.append((node.value.id, node.attr))
    yield from (face(attribute) for name, attribute in attributes if name in faces)


def room(module: str) -> str:
    return [*module.split("."), "sdftrack"][1]


@functools.cache
def imports() -> dict[str, set[str]]:
    """Module -> what it imports."""
    return {
        name: {to for to in imported(ast.parse(path.read_text())) if to != name}
        for name, path in MODULES.items()
    }


RUNS_THE_LABORATORY = {"sdftrack.cli.reproduce"}
BELOW_ALL = {"_core", "__version__"}


def python_rows() -> dict[str, int]:
    """Room -> its row in the document, 0 on top."""
    block = re.search(r"```text\n(cli\n.*?)```", TEXT, re.S)
    assert block
    return {name: row for row, line in enumerate(block[1].splitlines()) for name in line.split()}


def test_the_document_lists_every_room_of_the_package() -> None:
    package = {room(name) for name in MODULES if name.split(".")[0] == "sdftrack"}
    assert set(python_rows()) == package - {"sdftrack", "__main__"}


def test_no_import_points_upwards_or_sideways() -> None:
    rows = python_rows()
    wrong = [
        f"{name} -> {to}"
        for name, others in imports().items()
        for to in sorted(others)
        if name.startswith("sdftrack.")
        and room(name) in rows
        and room(to) not in BELOW_ALL | {room(name)}
        and rows[room(to)] <= rows[room(name)]
    ]
    assert wrong == []


def test_the_package_knows_nothing_of_the_laboratory() -> None:
    """But the command `reproduce`, which runs it where the sources are."""
    wrong = [
        f"{name} -> {to}"
        for name, others in imports().items()
        for to in sorted(others)
        if name.startswith("sdftrack") and to.startswith("experiments") and name not in RUNS_THE_LABORATORY
    ]
    assert wrong == []


def test_no_modules_import_each_other_in_a_circle() -> None:
    assert circle(imports()) == []


def test_the_top_level_holds_only_what_users_import() -> None:
    public = {home.split(".")[0] for home in sdftrack._HOMES} | set(sdftrack.__all__)
    files = {path.stem for path in PACKAGE.glob("*.py")} - {"__init__", "__main__"}
    assert files - public == set()


# -- C++
def includes() -> dict[str, set[str]]:
    """Folder of cpp -> folders that it includes."""
    graph: dict[str, set[str]] = {}
    for path in (ROOT / "cpp").rglob("*"):
        if path.suffix not in (".h", ".cpp", ".cu", ".cuh", ".inc"):
            continue
        folder = path.parent.relative_to(ROOT / "cpp").as_posix()
        others = {
            Path(i).parent.as_posix() for i in re.findall(r'#\s*include "([^"]+/[^"]+)"', path.read_text())
        }
        graph.setdefault(folder, set()).update(others - {folder})
    return graph


def drawn() -> dict[str, set[str]]:
    """Folder of cpp -> folders that the diagram lets it use: where its arrows lead, on and on."""
    block = re.search(r"```mermaid\n(.*?)```", TEXT, re.S)
    assert block
    labels = dict(re.findall(r'(\w+)\["cpp/([\w/]+)"\]', block[1]))
    arrows: dict[str, set[str]] = {}
    for a, b in re.findall(r"^\s*(\w+)(?:\[.*?\])? --> (\w+)", block[1], re.M):
        if a in labels:
            arrows.setdefault(labels[a], set()).add(labels[b])
    reach: dict[str, set[str]] = {}
    for folder in labels.values():
        todo, known = [folder], set[str]()
        while todo:
            for other in arrows.get(todo.pop(), ()):
                if other not in known:
                    known.add(other)
                    todo.append(other)
        reach[folder] = known
    return reach


def test_the_diagram_shows_every_folder_of_the_core() -> None:
    assert set(drawn()) == set(includes()) - {"cmake", "examples"}


@pytest.mark.parametrize("folder", sorted(set(includes()) - {"examples"}))
def test_a_folder_includes_only_what_the_diagram_lets_it_use(folder: str) -> None:
    assert includes()[folder] - drawn().get(folder, set()) == set()


def test_each_folder_of_the_core_has_its_namespace() -> None:
    for path in (ROOT / "cpp").rglob("*.h"):
        top = path.relative_to(ROOT / "cpp").parts[0]
        expected = "sdftrack" if top in ("base", "sdftrack") else f"sdftrack::{top}"
        found = re.findall(r"^namespace (sdftrack[\w:]*) ", path.read_text(), re.M)
        assert set(found) <= {expected, f"{expected}::{path.parent.name}"}, path


def test_the_core_has_no_streams() -> None:
    """With libstdc++ linked statically, a stream of numbers crashes once numpy has loaded the system's."""
    stream = re.compile(r"#\s*include <(\w*stream|iomanip|locale|regex|format)>")
    sources = (p for folder in ("cpp", "bindings") for p in (ROOT / folder).rglob("*.[ch]*"))
    assert [p.name for p in sources if "examples" not in p.parts and stream.search(p.read_text())] == []


def test_floats_become_ints_through_one_function() -> None:
    """What is rounded is a float: its cast is base/to_int.h's, which has an answer for every number."""
    cast = re.compile(
        r"static_cast<(int|long|std::u?int\w+_t|std::size_t)>\(\s*std::(floor|ceil|l*round|trunc|sqrt)\b"
    )
    files = [
        p for folder in ("cpp", "bindings") for p in (ROOT / folder).rglob("*") if p.suffix in (".h", ".cpp")
    ]
    assert len(files) > 300
    found = [str(p.relative_to(ROOT)) for p in files if cast.search(p.read_text(encoding="utf-8"))]
    assert found == []


# -- Operating systems
ONE_SYSTEM = PACKAGE / "_internal" / "systems.py"  # where a call may be that Windows or macOS lacks
LACKING = {
    "fcntl", "resource", "pwd", "grp", "termios", "tty", "pty", "posix", "syslog", "crypt", "winreg", "msvcrt",
    "os.fork", "os.forkpty", "os.kill", "os.killpg", "os.getpgid", "os.setsid", "os.setpgid", "os.nice", "os.uname",
    "os.getloadavg", "os.sched_getaffinity", "os.sched_setaffinity", "os.sysconf", "os.statvfs", "os.mkfifo",
    "os.chown", "os.fchmod", "os.getuid", "os.geteuid", "os.getgid", "os.pread", "os.pwrite", "os.posix_fallocate",
    "os.posix_spawn", "os.register_at_fork", "os.wait", "os.WNOHANG", "os.O_DIRECTORY", "os.O_NOFOLLOW",
    "signal.SIGKILL", "signal.SIGHUP", "signal.SIGUSR1", "signal.SIGUSR2", "signal.SIGPIPE", "signal.SIGALRM",
    "signal.SIGCHLD", "signal.SIGQUIT", "signal.SIGSTOP", "signal.SIGCONT", "signal.alarm", "signal.setitimer",
    "signal.pause", "signal.sigwait", "signal.pthread_sigmask", "socket.AF_UNIX", "time.tzset",
}  # fmt: skip


def calls_of_systems(tree: ast.AST) -> Iterator[str]:
    """Modules and members that a file names, as LACKING writes them."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Attribute):
            yield ast.unparse(node)


def test_what_not_every_system_has_is_called_in_one_file():
    found = {
        f"{path.relative_to(PACKAGE)}: {name}"
        for path in PACKAGE.rglob("*.py")
        for name in calls_of_systems(ast.parse(path.read_text(encoding="utf-8")))
        if name in LACKING and path != ONE_SYSTEM
    }
    assert sorted(found) == []
    assert {"fcntl", "resource"} <= set(calls_of_systems(ast.parse(ONE_SYSTEM.read_text())))


def test_the_core_includes_no_header_of_one_system_outside_a_condition():
    of_one = re.compile(r"#\s*include <(sys/\w+|unistd|fcntl|sched|pthread|dlfcn|windows|mach/\w+)\.h>")
    for path in sorted((ROOT / "cpp").rglob("*.[ch]*")):
        depth = 0
        for line in path.read_text(encoding="utf-8").splitlines():
            depth += bool(re.match(r"#\s*if", line)) - bool(re.match(r"#\s*endif", line))
            assert depth > 0 or not of_one.match(line), f"{path}: {line}"
