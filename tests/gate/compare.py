# SPDX-License-Identifier: MIT
"""Compare the results of two commits by their bits, on any machine.

    python tests/gate/compare.py REV_A             # with the working tree (files that git knows)
    python tests/gate/compare.py REV_A REV_B --only several lost

Each commit is checked out and built in build/gate (cmake, ninja; by ccache where there is one), and the runs of *this*
folder are done with each of the two packages. A build serves every commit with the same C++; the hashes of a commit
are kept, and a run is repeated only where its definition has changed. Exits 1 where a bit differs.
"""

import argparse
import hashlib
import importlib.util
import json
import os
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from listing import HERE, listed

ROOT = HERE.parents[1]
WORK = ROOT / "build" / "gate"
COMPILED = ("CMakeLists.txt", "cpp", "bindings")
RUN_BY = ("python", "experiments")  # of these and the extension the results are made
FAILED = "failed"  # in the place of hashes: the run's error


def git(*arguments: str) -> str:
    done = subprocess.run(["git", "-C", str(ROOT), *arguments], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"git {' '.join(arguments)}: {done.stderr.strip()}")
    return done.stdout.strip()


def commit_of(revision: str | None) -> str:
    """The commit of a revision; None: one that holds the working tree as it is, which nothing refers to."""
    if revision is None:
        return git("stash", "create") or git("rev-parse", "HEAD")
    return git("rev-parse", "--verify", f"{revision}^{{commit}}")


def key_of(commit: str, places: tuple[str, ...]) -> str:
    """The same for two commits exactly when they have the same files in these places."""
    return hashlib.sha256(git("ls-tree", commit, *places).encode()).hexdigest()[:12]


def source_of(file: str) -> str:
    """A digest of the definition of a run: its file and those that all share."""
    return hashlib.sha256(
        b"".join((HERE / name).read_bytes() for name in (f"{file}.py", "digest.py"))
    ).hexdigest()[:12]


def export(commit: str, folder: Path, *places: str) -> Path:
    """The files of a commit in a folder, all or those of some places; whole or not there."""
    if not folder.exists():
        part = folder.with_suffix(".part")
        shutil.rmtree(part, ignore_errors=True)
        part.mkdir(parents=True)
        command = ["git", "-C", str(ROOT), "archive", commit, *places]
        archive = subprocess.run(command, capture_output=True, check=True)
        subprocess.run(["tar", "-x", "-C", str(part)], input=archive.stdout, check=True)
        part.rename(folder)
    return folder


def built(commit: str) -> Path:
    """The extension of a commit."""
    work = WORK / f"build-{key_of(commit, COMPILED)}"
    if not (work / "done").exists():
        print(f"building {commit[:12]} in {work}", flush=True)
        tree = export(commit, work / "source", *COMPILED, "pyproject.toml")
        # As deep below the sources as in .ci/run, and first with its flags: so what that has compiled is in the cache.
        said = ""
        for errors in ("ON", "OFF"):
            said = _compile(tree, work / "source" / "build" / "gate", f"-DSDFTRACK_WERROR={errors}")
            if not said:
                break
        else:
            raise SystemExit(said)
        (work / "done").touch()
    suffix = sysconfig.get_config_var("EXT_SUFFIX")
    return next((work / "source" / "build" / "gate" / "bindings").glob(f"_core*{suffix}"))


def _compile(tree: Path, folder: Path, *defines: str) -> str:
    """What went wrong, "" if nothing."""
    environment = dict(os.environ)
    if shutil.which("ccache"):
        environment |= {"CMAKE_CXX_COMPILER_LAUNCHER": "ccache", "CCACHE_BASEDIR": str(tree)}
        environment |= {"CCACHE_NOHASHDIR": "1", "CXX": os.environ.get("CXX", "g++")}
    configure = ["cmake", "-S", str(tree), "-B", str(folder), "-G", "Ninja", *defines]
    configure.append(f"-DPython_EXECUTABLE={sys.executable}")
    if importlib.util.find_spec("pybind11"):  # else CMake looks for it
        import pybind11

        configure.append(f"-Dpybind11_DIR={pybind11.get_cmake_dir()}")
    for command in (configure, ["cmake", "--build", str(folder), "--target", "_core"]):
        result = subprocess.run(command, env=environment, capture_output=True, text=True)
        if result.returncode:
            return f"{' '.join(command)}\n{(result.stdout + result.stderr)[-4000:]}"
    return ""


def results(commit: str, only: list[str]) -> dict[str, dict[str, str]]:
    """The hashes of every run with the package of a commit, kept ones where the run is the same."""
    kept_file = WORK / f"hashes-{key_of(commit, (*COMPILED, *RUN_BY))}.json"
    kept = json.loads(kept_file.read_text()) if kept_file.exists() else {}
    source = {name: source_of(file) for name, file in listed().items() if not only or name in only}
    out = {name: kept[name]["hashes"] for name in source if kept.get(name, {}).get("source") == source[name]}
    while missing := [name for name in source if name not in out]:
        tree = export(commit, WORK / f"tree-{git('rev-parse', f'{commit}^{{tree}}')[:12]}")
        shutil.copy2(built(commit), tree / "python" / "sdftrack")
        for done in _runs(tree, missing):
            out[done["run"]] = done["hashes"]
            print(f"  {done['run']:20} {len(done['hashes']):3} hashes {done['seconds']:6.1f} s", flush=True)
            kept[done["run"]] = {"source": source[done["run"]], "hashes": done["hashes"]}
            kept_file.write_text(json.dumps(kept, indent=1))
        # The process ends early by the run that ends it, which may not be so next time: it is not kept.
        if died := next((name for name in missing if name not in out), None):
            out[died] = {FAILED: "the process ended"}
    return out


def _runs(tree: Path, names: list[str]) -> Iterator[dict[str, Any]]:
    """What each run gives with the package of a folder, as one process has it ready."""
    environment = {**os.environ, "PYTHONPATH": f"{tree / 'python'}{os.pathsep}{tree}"}
    command = [sys.executable, str(HERE / "hashes.py"), "--lines", *names]
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        yield from (json.loads(line) for line in child.stdout if line.startswith("{"))


def report(a: dict[str, dict[str, str]], b: dict[str, dict[str, str]]) -> int:
    """Prints what differs; how many outputs."""
    count = 0
    for run in b:
        if FAILED in a[run] or FAILED in b[run]:
            which = [name for name, side in (("A", a), ("B", b)) if FAILED in side[run]]
            print(f"{run}: not in {' and '.join(which)}: {(a[run] | b[run])[FAILED]}")
            count += FAILED in b[run]
            continue
        outputs = sorted({*a[run], *b[run]})
        differ = [name for name in outputs if a[run].get(name) != b[run].get(name)]
        count += len(differ)
        if differ:
            print(f"{run}: DIFFERS in {len(differ)} of {len(outputs)} outputs: {', '.join(differ)}")
    return count


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("a", metavar="REV_A")
    parser.add_argument("b", metavar="REV_B", nargs="?", help="default: the working tree")
    parser.add_argument("--only", nargs="+", default=[], metavar="RUN")
    given = parser.parse_args()
    if unknown := set(given.only) - set(listed()):
        parser.error(f"no such run here: {', '.join(sorted(unknown))}; there are {', '.join(listed())}")
    WORK.mkdir(parents=True, exist_ok=True)
    hashes = []
    for name, revision in (("A", given.a), ("B", given.b)):
        commit = commit_of(revision)
        print(f"{name}: {revision or 'the working tree'} ({commit[:12]})", flush=True)
        hashes.append(results(commit, given.only))
    count = report(*hashes)
    print(f"{len(hashes[0])} runs, {count} differences")
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main())
