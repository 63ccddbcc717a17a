# SPDX-License-Identifier: MIT
"""Recordings at addresses: memory, local files, a web server, an S3 server."""

import functools
import http.server
import os
import threading

import pytest

from sdftrack.batch.addresses import expanded, fetched, is_address, name_of

fsspec = pytest.importorskip("fsspec")
FILES = {"run_1/camera.json": b"{}", "run_1/depth/000000.png": b"abc" * 1000, "run_2/camera.json": b"[]"}


@pytest.fixture
def memory():
    fs = fsspec.filesystem("memory")
    fs.store.clear()
    for name, content in FILES.items():
        fs.pipe(f"/rec/{name}", content)
    yield fs
    fs.store.clear()


def content_below(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("s3://bucket/run", True), ("zip://run::s3://bucket/all.zip", True), ("gs://b/x", True),
        ("data/run", False), ("/data/run", False), ("C:/data", False), ("C:\\data", False), ("auto", False),
        ("box:1,2,3,4", False), ("", False),
    ],
)  # fmt: skip
def test_what_is_an_address(text, expected):
    assert is_address(text) == expected


@pytest.mark.parametrize(
    ("place", "expected"),
    [("s3://b/day 1/run_7/", "run_7"), ("http://host/x.bag?token=1/2", "x.bag"), ("/a/b/", "b"), ("a", "a")],
)
def test_names(place, expected):
    assert name_of(place) == expected


class TestMemory:
    def test_a_pattern(self, memory, tmp_path):
        assert [name_of(p) for p in expanded("memory://rec/run_*", tmp_path)] == ["run_1", "run_2"]

    def test_a_folder_is_copied_and_removed(self, memory):
        with fetched("memory://rec/run_1") as folder:
            assert folder.name == "run_1"
            assert content_below(folder) == {k[6:]: v for k, v in FILES.items() if k.startswith("run_1/")}
        assert not folder.parent.exists()

    def test_the_cache_keeps_it_until_it_changes(self, memory, tmp_path):
        with fetched("memory://rec/run_2/camera.json", tmp_path / "cache") as first:
            os.utime(first, (1, 1))
        with fetched("memory://rec/run_2/camera.json", tmp_path / "cache") as second:
            assert second == first
            assert second.stat().st_mtime == 1
        memory.pipe("/rec/run_2/camera.json", b"[1]")
        with fetched("memory://rec/run_2/camera.json", tmp_path / "cache") as third:
            assert third.read_bytes() == b"[1]"
        assert not [p for p in (tmp_path / "cache").iterdir() if p.name.startswith(".")]

    def test_nothing_there(self, memory, tmp_path):
        with (
            pytest.raises(FileNotFoundError, match=r"^memory://rec/run_9: nothing is there$"),
            fetched("memory://rec/run_9"),
        ):
            pass
        with pytest.raises(FileNotFoundError, match=r"^sequences: nothing matches memory://rec/x\*$"):
            expanded("memory://rec/x*", tmp_path)

    def test_a_file_that_comes_in_part(self, memory, monkeypatch, tmp_path):
        cut = type(memory).get_file

        def get_file(self, source, target, **options):
            cut(self, source, target, **options)
            os.truncate(target, 1)

        monkeypatch.setattr(type(memory), "get_file", get_file)
        with (
            pytest.raises(OSError, match=r"came with 1 of 2 bytes"),
            fetched("memory://rec/run_2", tmp_path / "cache"),
        ):
            pass
        assert list((tmp_path / "cache").iterdir()) == []

    def test_names_that_lead_out_of_the_folder(self, memory, monkeypatch):
        monkeypatch.setattr(type(memory), "find", lambda self, path, detail: {f"{path}/../../x": {"size": 1}})
        with pytest.raises(ValueError, match=r"expected names below it"), fetched("memory://rec/run_1"):
            pass


class TestLocal:
    def test_paths_are_relative_to_the_plan_and_sorted(self, tmp_path):
        for name in ("b", "a", ".hidden"):
            (tmp_path / name).mkdir()
        assert expanded("*", tmp_path) == [str(tmp_path / "a"), str(tmp_path / "b")]
        assert expanded("a", tmp_path) == [str(tmp_path / "a")]
        assert expanded(str(tmp_path / "b"), tmp_path / "elsewhere") == [str(tmp_path / "b")]
        with pytest.raises(FileNotFoundError, match=r"^sequences: nothing matches c$"):
            expanded("c", tmp_path)


def test_a_web_server(tmp_path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "camera.json").write_bytes(b"{}")
    pytest.importorskip("aiohttp")

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *arguments):
            pass

    server = http.server.ThreadingHTTPServer(
        ("127.0.0.1", 0), functools.partial(Quiet, directory=str(tmp_path))
    )
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        with fetched(f"http://127.0.0.1:{server.server_port}/run/") as folder:
            assert content_below(folder) == {"camera.json": b"{}"}
        with (
            pytest.raises(FileNotFoundError, match=r"/none.txt: nothing is there"),
            fetched(f"http://127.0.0.1:{server.server_port}/none.txt"),
        ):
            pass
    finally:
        server.shutdown()
        server.server_close()


@pytest.mark.parametrize(
    ("place", "told"), [("foo://x", "expected an address that fsspec reads"), ("zip::", "::")]
)
def test_what_fsspec_does_not_read(place, told):
    with pytest.raises((ValueError, OSError)) as caught, fetched(place):
        pass
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)
