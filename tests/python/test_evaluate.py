# SPDX-License-Identifier: MIT
"""Results against ground truth: the numbers must be those that were put in."""

import json

import numpy as np
import pytest
from tracking_fakes import CAMERA, frame, pose, result

from sdftrack.cli.app import run
from sdftrack.evaluation.report import compare
from sdftrack.geometry import pose as rotated
from sdftrack.io.datasets import Sequence
from sdftrack.io.report_file import read_results
from sdftrack.io.writers import save_sequence
from sdftrack.mesh import Mesh
from sdftrack.recorder import Recorder
from sdftrack.symmetry import Symmetry

OFF_M, OFF_RAD = 0.003, np.deg2rad(2.0)
MESH = Mesh(
    0.05 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]),
    [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
)
TRUTH = [pose(0.001 * i) for i in range(6)]


def sequence():
    return Sequence(
        [frame(i, T, color=True) for i, T in enumerate(TRUTH)], CAMERA, np.array(TRUTH), models={1: MESH}
    )


def off(T):
    """3 mm and 2 degrees from T."""
    return T @ rotated([0, OFF_RAD, 0], [0, 0, 0]) + np.array([[0, 0, 0, OFF_M]] + [[0] * 4] * 3)


def recorded(folder, status=None, settings=None):
    with Recorder(folder, CAMERA, settings=settings) as recorder:
        for i, T in enumerate(TRUTH):
            recorder.add(frame(i, T), result([off(T)], status and [status[i]], i))
    return folder


def test_errors_are_those_that_were_put_in(tmp_path):
    (score,) = compare(read_results(recorded(tmp_path)), sequence())
    np.testing.assert_allclose(score.translation_m, OFF_M)
    np.testing.assert_allclose(score.rotation_rad, OFF_RAD)
    expected = np.linalg.norm(
        (off(TRUTH[0]) - TRUTH[0])[:3] @ np.c_[MESH.vertices, np.ones(4)].T, axis=0
    ).mean()
    np.testing.assert_allclose(score.add_m, expected)
    assert (score.frames, score.compared, score.lost) == (6, 6, 0)


def test_lost_frames_are_counted_and_their_poses_are_not_judged(tmp_path):
    status = ["ok", "lost", "ok", "bad_frame", "weak", "ok"]
    (score,) = compare(read_results(recorded(tmp_path, status)), sequence())
    assert score.images.tolist() == [0, 2, 4, 5]
    assert score.lost == 2
    whole = compare(read_results(recorded(tmp_path / "b")), sequence())[0].to_dict()["add_auc"]
    assert score.to_dict()["add_auc"] == pytest.approx(whole * 4 / 6)


def test_the_recorded_instance_decides_which_truth_is_meant(tmp_path):
    far = [T + np.array([[0, 0, 0, 0.3]] + [[0] * 4] * 3) for T in TRUTH]
    both = {i: {0: a, 1: b} for i, (a, b) in enumerate(zip(far, TRUTH, strict=True))}
    seq = Sequence([frame(i) for i in range(6)], CAMERA, both, models={1: MESH}, objects=[1, 1])
    first = compare(read_results(recorded(tmp_path / "a")), seq)[0]
    second = compare(read_results(recorded(tmp_path / "b", settings={"instances": [1]})), seq)[0]
    assert first.translation_m[0] > 0.2
    assert second.translation_m[0] == pytest.approx(OFF_M)


def test_the_command_writes_table_plots_and_numbers(tmp_path, capsys):
    results = recorded(tmp_path / "run")
    save_sequence(tmp_path / "seq", sequence(), layout="bop")
    assert run(["evaluate", str(results), str(tmp_path / "seq")]) == 0
    out = results / "evaluation"
    assert {p.name for p in out.iterdir()} == {"table.txt", "result.json", "errors.png", "trajectory.png"}
    numbers = json.loads((out / "result.json").read_text())["objects"][0]
    assert numbers["translation_mm"]["mean"] == pytest.approx(3.0, abs=1e-3)
    assert numbers["rotation_deg"]["max"] == pytest.approx(2.0, abs=1e-3)
    assert "3.000" in (out / "table.txt").read_text()
    assert "3.000" in capsys.readouterr().out
    assert run(["evaluate", str(results), str(tmp_path / "seq")]) == 1  # not without --overwrite
    assert "new or empty" in capsys.readouterr().err
    assert run(["evaluate", str(results), str(tmp_path / "seq"), "--overwrite", "--quiet"]) == 0
    assert capsys.readouterr().out == ""


def test_results_of_other_images_or_of_another_object_are_refused(tmp_path):
    report = read_results(recorded(tmp_path / "a"))
    elsewhere = Sequence(
        [frame(i) for i in range(6)], CAMERA, np.array(TRUTH), models={1: MESH}, ids=range(100, 106)
    )
    with pytest.raises(
        ValueError, match=r"none of their images \(0 to 5\) is one of the sequence's \(100 to 105\)"
    ):
        compare(report, elsewhere)
    truth = {i: {0: T} for i, T in enumerate(TRUTH)}
    other = Sequence([frame(i) for i in range(6)], CAMERA, truth, models={7: MESH}, objects=[7])
    with pytest.raises(
        ValueError, match=r"object 0 \(.*\) has obj_id 1, the sequence has obj_id 7 as instance 0"
    ):
        compare(report, other)
    report["settings"]["known_models"] = [False]  # a mesh of the user's own
    assert compare(report, other)[0].compared == 6
    some = Sequence(
        [frame(i) for i in range(6)], CAMERA, truth, models={1: MESH}, ids=[0, 1, 2, 103, 104, 105]
    )
    report["settings"].pop("known_models")
    with pytest.warns(UserWarning, match="3 of their 6 images are not in the sequence"):
        assert compare(report, some)[0].compared == 3


def test_errors_of_bop_are_those_of_the_metrics_and_lost_frames_count_as_wrong(tmp_path):
    from sdftrack import metrics
    from sdftrack.evaluation.report import TAUS, diameter

    seq = sequence()
    (score,) = compare(read_results(recorded(tmp_path / "a")), seq)
    across = diameter(MESH.vertices)
    assert across == pytest.approx(0.05 * np.sqrt(2))
    for n, T in enumerate(TRUTH):
        estimate = np.asarray(read_results(tmp_path / "a")["frames"][n]["objects"][0]["pose"])
        assert score.bop.mspd_px[n] == pytest.approx(metrics.mspd(estimate, T, MESH.vertices, CAMERA))
        depths = [seq[n].depth, *(MESH.raycast(CAMERA, P)[0] for P in (estimate, T))]
        np.testing.assert_allclose(score.bop.vsd[n], metrics.vsd(*depths, CAMERA, TAUS * across))
    whole = score.to_dict()
    expected = metrics.average_recall(
        score.bop.vsd, score.mssd_m, score.bop.mspd_px, diameter=across, width=CAMERA.width
    )
    assert whole["average_recall"] == pytest.approx(expected)
    status = ["ok", "lost", "lost", "lost", "ok", "ok"]
    half = compare(read_results(recorded(tmp_path / "b", status)), seq)[0].to_dict()
    assert half["average_recall"]["AR"] == pytest.approx(0.5 * expected["AR"])


def test_a_symmetry_of_the_command_line_goes_before_that_of_the_results(tmp_path, capsys):
    turned = rotated([0, 0, np.pi], [0, 0, 0])
    seq = sequence()
    with Recorder(tmp_path / "run", CAMERA) as recorder:
        for i, T in enumerate(TRUTH):
            recorder.add(frame(i, T), result([T @ turned], None, i))
    report = read_results(tmp_path / "run")
    (plain,) = compare(report, seq)
    (alike,) = compare(report, seq, {1: Symmetry(discrete=[turned])})
    assert plain.mssd_m.min() > 0.05
    assert alike.mssd_m.max() < 1e-9
    assert alike.bop.mspd_px.max() < 1e-6
    seq.symmetries = {1: Symmetry(discrete=[turned])}  # those of the recording
    assert compare(report, seq)[0].mssd_m.max() < 1e-9
    seq.symmetries = {}
    save_sequence(tmp_path / "seq", seq, layout="bop")
    (tmp_path / "models_info.json").write_text(json.dumps({"1": Symmetry(discrete=[turned]).to_dict()}))
    command = f"evaluate {tmp_path / 'run'} {tmp_path / 'seq'} --symmetry {tmp_path / 'models_info.json'}"
    assert run(command.split()) == 0
    assert "with its symmetries" in capsys.readouterr().out
