# SPDX-License-Identifier: MIT
"""Point files on the command line: what is torn or no cloud is named in one line, and advice is in options."""

import numpy as np
import pytest

from sdftrack.cli.app import as_options, options_of, parser, run

OPTIONS = options_of(parser(), ["calibrate", "color", "SEQ"])
COUNT = 400


def ball(scale=1.0):
    v = np.random.default_rng(0).normal(size=(COUNT, 3))
    return scale * (0.05 * v / np.linalg.norm(v, axis=1, keepdims=True) + [0, 0, 1])


def test_a_folder_with_files_is_refused_before_the_work(tmp_path, capsys):
    cloud = tmp_path / "cloud.ply"
    cloud.write_text("nothing that could be read")
    assert run(["fit", str(cloud), "--out", str(tmp_path)]) == 1
    assert "expected a new or empty folder" in capsys.readouterr().err


@pytest.mark.parametrize("separator", [",", ", ", ";", "\t"])
def test_coordinates_may_be_parted_by_commas(tmp_path, separator):
    path = tmp_path / "cloud.xyz"
    path.write_text("# x y z\n" + "\n".join(separator.join(f"{c:.6f}" for c in p) for p in ball()))
    assert run(["fit", str(path), "--kind", "sphere", "--out", str(tmp_path / "out"), "-q"]) == 0


def test_a_cloud_in_millimetres_is_refused_unless_the_unit_is_said(tmp_path, capsys):
    path = tmp_path / "cloud.npy"
    np.save(path, ball(1e3))
    out = str(tmp_path / "out")
    assert run(["fit", str(path), "--kind", "sphere", "--out", out]) == 1
    assert "are they in mm? pass --unit mm" in capsys.readouterr().err
    assert run(["fit", str(path), "--kind", "sphere", "--unit", "mm", "--out", out]) == 0
    assert "radius 50.0" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("python", "shell"),
    [
        ("pass unit='mm'", "pass --unit mm"),
        ("or colour is late (time_offset=True)", "or colour is late (--time-offset)"),
        ("ball_color: grey; paint the ball, or pass mask_fn=", "--ball-color: grey; paint the ball"),
        ("move the ball, or pass color_camera=", "move the ball, or pass --color-camera"),
        ("pass ball_color=(r, g, b) or mask_fn=", "pass --ball-color r,g,b"),
        ("leave them out (points[np.isfinite(points).all(axis=1)])", "leave them out"),
        ("holds files; pass overwrite=True", "holds files; pass --overwrite"),
        ("fx=500 is far", "fx=500 is far"),
    ],
)  # fmt: skip
def test_advice_is_in_options_and_what_has_none_is_left_out(python, shell):
    assert as_options(python, OPTIONS) == shell
