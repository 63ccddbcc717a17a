# SPDX-License-Identifier: MIT
"""The documents keep their promises: links lead somewhere, quoted code is the code, commands are run by CI."""

import re
from pathlib import Path

import numpy as np
import pytest

import sdftrack as st

ROOT = Path(__file__).resolve().parents[2]
COPIES = (ROOT / "docs" / "project", ROOT / "docs" / "notebooks")  # made for the site, not in git
DOCUMENTS = sorted(
    path
    for path in [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
    if not any(path.is_relative_to(copy) for copy in COPIES)
)
LINK = re.compile(r"\[[^\]]*\]\(([^)#\s]+)[^)]*\)")
CODE = re.compile(r"^ *```(\w+)\n(.*?)^ *```", re.MULTILINE | re.DOTALL)


def code_blocks(path: Path, language: str) -> list[str]:
    return [text for name, text in CODE.findall(path.read_text(encoding="utf-8")) if name == language]


def name_of(path: Path) -> str:
    return str(path.relative_to(ROOT))


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_every_link_leads_to_a_file(document):
    links = [link for link in LINK.findall(document.read_text(encoding="utf-8")) if "://" not in link]
    assert [link for link in links if not (document.parent / link).exists()] == []


def test_files_that_the_documents_name_exist():
    named = re.compile(r"`((?:cpp|bindings|python|experiments|tests|notebooks|docs)/[\w./]+\.\w+)`")
    missing = {
        f"{name_of(document)}: {path}"
        for document in DOCUMENTS
        for path in named.findall(document.read_text(encoding="utf-8"))
        if not (ROOT / path).exists()
    }
    assert sorted(missing) == []


def test_the_worked_example_quotes_code_that_is_compiled_and_run():
    blocks = code_blocks(ROOT / "docs" / "add_an_energy.md", "cpp")
    source = (ROOT / "tests" / "cpp" / "test_add_an_energy.cpp").read_text(encoding="utf-8")
    assert len(blocks) == 3
    for block in blocks:
        assert block in source


@pytest.mark.parametrize("ending", ["sdftrack demo", "pytest"])
def test_the_readme_has_one_complete_line_for_each_promise(ending):
    lines = [line for block in code_blocks(ROOT / "README.md", "bash") for line in block.splitlines()]
    complete = [line for line in lines if line.startswith("python3 -m venv ") and line.endswith(ending)]
    assert len(complete) == 1
    assert "pip install" in complete[0]
    assert f'run_readme_line "{ending}"' in (ROOT / ".ci" / "run").read_text(encoding="utf-8")


def test_the_readmes_ten_lines_track_a_sequence(tmp_path, monkeypatch, capsys):
    size_mm = np.array([90.0, 60.0, 40.0])
    box, grip = (
        st.SDF.box(size_mm / 1000, voxels=40).to_mesh(),
        st.SDF.box([0.03, 0.03, 0.05], voxels=30).to_mesh(),
    )
    grip_vertices = grip.vertices + np.array([0.02, 0.01, 0.04])  # no turn of it looks like another
    faces = np.concatenate([box.faces, grip.faces + len(box.vertices)])
    bodies = st.Mesh(np.concatenate([box.vertices, grip_vertices]), faces)
    mesh = st.SDF.from_mesh(bodies, voxels=60).to_mesh()  # one surface
    sequence = st.synth.sequence(mesh, 4, seed=1)
    monkeypatch.chdir(tmp_path)
    st.Mesh(1000 * mesh.vertices, mesh.faces).save("drill.ply")
    st.save_sequence("scene", sequence)

    (example,) = code_blocks(ROOT / "README.md", "python")
    exec(compile(example.replace("voxels=200", "voxels=40"), "README.md", "exec"), {})

    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 3  # the first of the four frames is where it starts
    assert all(" ok " in line for line in lines)
