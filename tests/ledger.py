# SPDX-License-Identifier: MIT
"""The lines of each room of the repository, beside the most that it may have (ledger.toml).

python tests/ledger.py            # the table; exits 1 where a room is above its number
python tests/ledger.py --write    # today's numbers become the most: say why in the commit
"""

import subprocess
import sys
import tomllib
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LEDGER = Path(__file__).with_name("ledger.toml")
MOST_FILES = 25  # in a folder of the package or the core
CODE = (".py", ".pyi", ".h", ".cpp", ".cu", ".cuh", ".inc", ".cmake", ".sh")
ROOMS = {
    "python/sdftrack": (".py",),  # without the stubs, which a tool writes
    "cpp": (*CODE, "CMakeLists.txt"),
    "bindings": (*CODE, "CMakeLists.txt"),
    "experiments": CODE,
    "tests": (*CODE, "CMakeLists.txt"),
    "docs": (".md", ".py"),
}
SPLIT = ("python/sdftrack",)  # rooms whose folders are counted, too
HEAD = """\
# The most lines of each room, modules of the package, and files of a folder with more than {most} (tests/ledger.py).
# A room above its number fails a test: raise it here and say why in the commit. A room that has shrunk: --write.
"""


def files() -> list[Path]:
    """The files that git knows and that are there, relative to the repository."""
    listed = subprocess.run(
        ["git", "-C", str(ROOT), "ls-files", "-z"], capture_output=True, text=True, check=True
    )
    return [Path(name) for name in listed.stdout.split("\0") if name and (ROOT / name).is_file()]


def counted() -> dict[str, dict[str, int]]:
    """Lines by room, modules of the package, and files of the folders that have more than MOST_FILES."""
    lines: Counter[str] = Counter()
    modules: Counter[str] = Counter()
    in_folder: Counter[str] = Counter()
    for path in files():
        room = next((room for room in ROOMS if path.is_relative_to(room)), None)
        if room is None or not path.name.endswith(ROOMS[room]):
            continue
        count = (ROOT / path).read_bytes().count(b"\n")
        lines[room] += count
        if room in SPLIT:
            modules[room] += 1
            inner = path.relative_to(room).parts
            lines[f"{room}/{inner[0]}" if len(inner) > 1 else f"{room}/*"] += count
        if room in ("python/sdftrack", "cpp"):
            in_folder[path.parent.as_posix()] += 1
    large = {folder: n for folder, n in in_folder.items() if n > MOST_FILES}
    return {"lines": dict(lines), "modules": dict(modules), "files": large}


def most() -> dict[str, dict[str, int]]:
    """The committed numbers."""
    return tomllib.loads(LEDGER.read_text())


def above(now: dict[str, dict[str, int]], allowed: dict[str, dict[str, int]]) -> list[str]:
    """A sentence for each number that is above the committed one; of a folder that is not listed the room's counts."""
    return [
        f"{room}: {count} {kind}, at most {limit}; raise it in tests/ledger.toml and say why in the commit"
        for kind, numbers in now.items()
        for room, count in sorted(numbers.items())
        if count > (limit := allowed[kind].get(room, MOST_FILES if kind == "files" else count))
    ]


def main() -> int:
    now = counted()
    if sys.argv[1:] == ["--write"]:
        tables = [
            f"[{kind}]\n" + "".join(f'"{room}" = {n}\n' for room, n in sorted(numbers.items()))
            for kind, numbers in now.items()
        ]
        LEDGER.write_text(HEAD.format(most=MOST_FILES) + "\n" + "\n".join(tables))
        return 0
    allowed = most()
    for kind, numbers in now.items():
        for room, n in sorted(numbers.items()):
            print(f"{kind:8} {room:32} {n:7} of {allowed[kind].get(room, '-'):>7}")
    wrong = above(now, allowed)
    print(*wrong, sep="\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
