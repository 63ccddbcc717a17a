# SPDX-License-Identifier: MIT
"""Whether the tests find faults of one line in the core (faults.toml).

    python tests/mutation/run.py --build build/mutation                 # the first tier: ctest's program and pytest
    python tests/mutation/run.py --build build/mutation --tier all --only motion-order far-sign

Works on a copy of the last commit in FOLDER/tree. A fault is put in, what it touches is compiled, and tests run until
one fails: those in C++, the Python files about the fault's folder, then the others of the tier. What was found, by
which test and in which time is in FOLDER/found.json; faults that are there already are left out.
"""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import time
import tomllib
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
FAULTS = HERE / "faults.toml"
# Words in the names of the Python files that are tried first.
FILES_ABOUT = {
    "energies": ("energy", "photometric", "outline", "patch", "appearance"),
    "tracking": ("tracker", "several", "search"),
    "levelset": ("levelset", "evol", "reconstruction", "printed_evidence"),
    "contour": ("contour", "shape_memory"),
    "lwpr": ("lwpr",),
    "superpixels": ("superpixels",),
    "calibration": ("intrinsics", "camera", "depth_calibration"),
    "primitives": ("primitive", "patch"),
}
LIMIT_S = 3600  # of the tests of one fault; a test that never ends has found it


def faults() -> list[dict[str, str]]:
    listed: list[dict[str, str]] = tomllib.loads(FAULTS.read_text())["fault"]
    return listed


def places(fault: dict[str, str], root: Path) -> list[int]:
    """Numbers of the lines of its file that are the fault's line."""
    path = root / fault["file"]
    lines = path.read_text().splitlines() if path.is_file() else []
    return [n for n, line in enumerate(lines) if line.strip() == fault["before"]]


def put_in(fault: dict[str, str], root: Path) -> str:
    """Changes the line; the text as it was."""
    path = root / fault["file"]
    text = path.read_text()
    lines = text.splitlines(keepends=True)
    (n,) = places(fault, root)
    lines[n] = lines[n].replace(fault["before"], fault["after"])
    path.write_text("".join(lines))
    return text


class CompileError(Exception):
    """The compiler refuses a fault."""


class Workplace:
    """A copy of the last commit and its build."""

    def __init__(self, folder: Path, jobs: int) -> None:
        self.tree, self.build, self.jobs = folder / "tree", folder / "tree" / "build" / "mutation", jobs
        if not self.tree.exists():
            self.tree.mkdir(parents=True)
            archive = subprocess.run(
                ["git", "-C", str(ROOT), "archive", "HEAD"], capture_output=True, check=True
            )
            subprocess.run(["tar", "-x", "-C", str(self.tree)], input=archive.stdout, check=True)
        if not (self.build / "build.ninja").exists():
            self._configure()

    def _configure(self) -> None:
        import pybind11

        # The flags of .ci/run, as deep below the sources: so what that has compiled is in the compiler's cache.
        command = ["cmake", "-S", str(self.tree), "-B", str(self.build), "-G", "Ninja"]
        command += ["-DSDFTRACK_TESTS=ON", "-DSDFTRACK_WERROR=ON"]
        command += [f"-DPython_EXECUTABLE={sys.executable}", f"-Dpybind11_DIR={pybind11.get_cmake_dir()}"]
        if shutil.which("ccache"):
            command.append("-DCMAKE_CXX_COMPILER_LAUNCHER=ccache")
        environment = {**os.environ, "CCACHE_BASEDIR": str(self.tree), "CCACHE_NOHASHDIR": "1", "CXX": "g++"}
        subprocess.run(command, env=environment, check=True)

    def compile(self, target: str) -> None:
        command = ["cmake", "--build", str(self.build), "-j", str(self.jobs), "--target", target]
        environment = {**os.environ, "CCACHE_BASEDIR": str(self.tree), "CCACHE_NOHASHDIR": "1"}
        done = subprocess.run(command, env=environment, capture_output=True, text=True)
        if done.returncode:
            raise CompileError((done.stdout + done.stderr)[-2000:])
        for extension in (self.build / "bindings").glob("_core*.so"):
            shutil.copy2(extension, self.tree / "python" / "sdftrack")

    def fails(self, command: list[str], pattern: str) -> str:
        """The first test that fails, "" if none does."""
        path = os.pathsep.join((str(self.tree / "python"), str(self.tree)))
        data = os.environ.get("SDFTRACK_DATA") or str(ROOT.parent / "shared" / "data")
        environment = {**os.environ, "PYTHONPATH": path, "MPLBACKEND": "agg", "SDFTRACK_DATA": data}
        try:
            done = subprocess.run(
                command, cwd=self.tree, env=environment, capture_output=True, text=True, timeout=LIMIT_S
            )
        except subprocess.TimeoutExpired:
            return f"{command[-1]} does not end"
        if done.returncode == 0:
            return ""
        found = re.search(pattern, done.stdout)
        return found[1] if found else f"exit {done.returncode}: {(done.stdout + done.stderr)[-300:]}"

    def cpp_tests(self) -> str:
        self.compile("sdftrack_tests")
        program = str(self.build / "tests" / "cpp" / "sdftrack_tests")
        return self.fails([program, "--gtest_brief=1", "--gtest_fail_fast"], r"\[  FAILED  \] ([\w./]+)")

    def python_tests(self, *arguments: str) -> str:
        self.compile("_core")  # after the tests in C++, which find most: it takes longer to link
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *arguments]
        return self.fails(command, r"(?:FAILED|ERROR) (\S+)")

    def about(self, folder: str) -> list[str]:
        files = sorted((self.tree / "tests" / "python").glob("test_*.py"))
        return [str(f) for f in files if any(word in f.name for word in FILES_ABOUT[folder])]


def tried(fault: dict[str, str], work: Workplace, tier: str) -> dict[str, object]:
    """Which test finds a fault."""
    before = put_in(fault, work.tree)
    begin = time.monotonic()
    out: dict[str, object] = {"folder": fault["file"].split("/")[1], "tier": tier}
    try:
        tests = ["--all"] if tier == "all" else ["-m", "not nightly"]
        out["found_by"] = (
            work.cpp_tests()
            or work.python_tests(*tests, *work.about(str(out["folder"])))
            or work.python_tests(*tests)
            or None
        )
        return {**out, "seconds": round(time.monotonic() - begin)}
    except CompileError as error:
        return {**out, "found_by": None, "compiler": str(error)}
    finally:
        (work.tree / fault["file"]).write_text(before)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=Path, required=True, metavar="FOLDER")
    parser.add_argument("--tier", choices=("first", "all"), default="first")
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    given = parser.parse_args()
    folder = given.build.resolve()
    work, record = Workplace(folder, given.jobs), folder / "found.json"
    found = json.loads(record.read_text()) if record.exists() else {}
    if not found and (said := work.cpp_tests()):
        raise SystemExit(f"without a fault: {said}")
    for fault in faults():
        name = fault["name"]
        if (given.only and name not in given.only) or found.get(name, {}).get("tier") in (given.tier, "all"):
            continue
        found[name] = tried(fault, work, given.tier)
        record.write_text(json.dumps(found, indent=1) + "\n")
        print(f"{name:24} {found[name].get('found_by') or 'NOT FOUND'}", flush=True)
    missed = [name for name, one in found.items() if not one["found_by"]]
    print(f"{len(found) - len(missed)} of {len(found)} found; not: {', '.join(missed) or 'none'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
