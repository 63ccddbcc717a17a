# SPDX-License-Identifier: MIT
"""Colour as a video: each frame has its own image, in any order of access and after any interruption."""

import errno
import os
import pickle
import threading
import warnings
from pathlib import Path

import numpy as np
import pytest

import sdftrack as st
from sdftrack._internal import files
from sdftrack.cli.app import run
from sdftrack.io import frames as image_io
from sdftrack.io.datasets import video_images
from sdftrack.io.datasets.video_images import VideoFile, VideoImages
from sdftrack.io.writers import WRITERS, Contents
from sdftrack.io.writers import video as video_writer
from sdftrack.io.writers.video import KEY_EVERY, VideoWriter

CAMERA = st.Camera(60.0, 61.0, 31.0, 23.5, 64, 48)
FOLDERS = [name for name, kind in WRITERS.items() if kind.holds_video]
BLOCK = 16
LEAST_PSNR = 37.0  # dB, of 4:2:0 at this quality; measured 38.6 on the recording
DATA = Path(os.environ.get("SDFTRACK_DATA", Path(__file__).resolve().parents[3] / "shared" / "data"))


def numbered(i, shape=CAMERA.shape):
    """An image that carries its number: twelve bits as dark and light squares, in a colour that changes."""
    image = np.full((*shape, 3), (40, 60, 80), np.uint8)
    for bit in range(12):
        y, x = BLOCK * (bit // 4), BLOCK * (bit % 4)
        if i >> bit & 1:
            image[y : y + BLOCK, x : x + BLOCK] = (210, 190, 170)
    return image


def number_of(image):
    middles = image[BLOCK // 2 :: BLOCK, BLOCK // 2 :: BLOCK].mean(axis=2)[:3, :4] > 120
    return sum(int(light) << bit for bit, light in enumerate(middles.ravel()))


def frames(n, without=(), shape=CAMERA.shape):
    return [
        st.Frame(
            np.full(shape, 1000 + i, np.uint16), None if i in without else numbered(i, shape),
            timestamp=100 + i / 30, depth_scale=0.001,
        )
        for i in range(n)
    ]  # fmt: skip


def saved(folder, n=50, layout="bop", without=()):
    st.save_sequence(folder, st.Sequence(frames(n, without), CAMERA), layout=layout, color="video")
    return folder


def assert_numbered(seq, without=()):
    for i, frame in enumerate(seq):
        assert frame.depth[0, 0] == pytest.approx(1 + i / 1000)
        assert (None if frame.color is None else number_of(frame.color)) == (None if i in without else i)


@pytest.fixture
def decoded(monkeypatch):
    """A list that has an entry for every image that is decoded."""
    calls, whole = [], video_images.decode

    def counted(packet):
        calls.append(packet.size)
        return whole(packet)

    monkeypatch.setattr(video_images, "decode", counted)
    return calls


@pytest.mark.parametrize("without", [(), (0, 7, 8, 49)])
@pytest.mark.parametrize("layout", FOLDERS)
def test_every_frame_has_its_own_colour_in_any_order(tmp_path, layout, without):
    saved(tmp_path / "s", 80, layout, without)
    assert not any((tmp_path / "s" / name).exists() for name in ("rgb", "color"))
    with warnings.catch_warnings(), st.open_sequence(tmp_path / "s") as seq:
        warnings.simplefilter("error")
        assert (seq.layout, len(seq)) == (layout, 80)
        assert_numbered(seq, without)
        order = [i for i in np.random.default_rng(0).permutation(80).tolist() if i not in without]
        assert [number_of(seq[i].color) for i in order] == order
        assert [number_of(frame.color) for frame in seq[10:70:7]] == list(range(10, 70, 7))
        assert np.abs(seq[33].color.astype(int) - numbered(33)).mean() < 2


def test_numbers_of_a_data_set_may_have_gaps(tmp_path):
    ids = [1, 36, 47, 2000]
    images = [frames(2001)[i] for i in ids]
    st.save_sequence(tmp_path / "s", st.Sequence(images, CAMERA, ids=ids), color="video")
    with st.open_sequence(tmp_path / "s") as seq:
        assert [number_of(frame.color) for frame in seq] == ids


def test_neighbours_are_decoded_once_and_others_from_the_nearest_whole_image(tmp_path, decoded):
    saved(tmp_path / "s", 90)
    video = VideoImages(tmp_path / "s")
    for i in range(90):
        video.read(i)
    assert len(decoded) == 90
    video.read(89)
    assert len(decoded) == 90  # the last one is kept
    for i in np.random.default_rng(1).integers(0, 90, 50):
        decoded.clear()
        assert number_of(video.read(int(i))) == i
        assert len(decoded) <= KEY_EVERY
    decoded.clear()
    for i in range(0, 90, 3):
        video.read(i)
    assert len(decoded) <= 90  # a stride goes on, too


def test_several_threads_read_what_they_ask_for(tmp_path):
    saved(tmp_path / "s", 60)
    wrong = []
    with st.open_sequence(tmp_path / "s") as seq:

        def read(seed):
            for i in np.random.default_rng(seed).integers(0, 60, 60):
                if number_of(seq[int(i)].color) != i:
                    wrong.append(i)

        threads = [threading.Thread(target=read, args=(seed,)) for seed in range(6)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert wrong == []


@pytest.mark.parametrize("layout", ["tum", "open3d"])
def test_a_sequence_with_a_video_is_pickled_and_reads_again_after_it_was_closed(tmp_path, layout):
    seq = st.open_sequence(saved(tmp_path / "s", 30, layout))
    assert number_of(seq[20].color) == 20
    other = pickle.loads(pickle.dumps(seq))
    assert number_of(other[17].color) == 17
    seq.close()
    assert number_of(seq[11].color) == 11


@pytest.mark.parametrize("shape", [(47, 63), (48, 63), (47, 64)])
def test_images_of_odd_size_keep_it(tmp_path, shape):
    camera = st.Camera(60.0, 61.0, 31.0, 23.5, shape[1], shape[0])
    seq = st.Sequence(frames(3, shape=shape), camera)
    st.save_sequence(tmp_path / "s", seq, color="video")
    with st.open_sequence(tmp_path / "s") as read:
        assert_numbered(read)
        assert read[1].color.shape[:2] == shape


def test_other_programs_play_the_video(tmp_path):
    import av

    saved(tmp_path / "s", 40)
    with av.open(str(tmp_path / "s" / "color.mkv")) as container:
        images = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
        assert container.duration == pytest.approx(40 * 33_000)
    assert [number_of(image) for image in images] == list(range(40))


def test_an_image_that_the_journal_does_not_have_is_replaced(tmp_path):
    video = VideoWriter(tmp_path)
    for i in range(5):
        video.add(i, numbered(i))
    video.close()  # killed between image 4 and its line in the journal
    video = VideoWriter(tmp_path, last=3)
    video.add(6, numbered(6))
    video.finish()
    read = VideoImages(tmp_path)
    assert [i for i in range(9) if i in read] == [0, 1, 2, 3, 6]
    assert number_of(read.read(6)) == 6
    video = VideoWriter(tmp_path, last=3)  # killed after one image of the second file
    video.add(4, numbered(4))
    video.finish()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["color.mkv", "color_000004.mkv"]
    VideoWriter(tmp_path, last=None).close()  # killed before the first frame was whole
    assert list(tmp_path.iterdir()) == []


def test_a_recording_is_continued_behind_what_a_power_cut_left_of_its_video(tmp_path):
    contents = Contents(st.RGBDCamera(CAMERA))
    with WRITERS["tum"](tmp_path, contents, "video") as writer:
        for frame in frames(20):
            writer.add(frame)
    path = tmp_path / "color.mkv"
    os.truncate(path, VideoFile(path).tracks[0].packets[17].start + 8)
    with WRITERS["tum"](tmp_path, contents, "video", resume=True) as writer:
        assert writer.count == 17
        for frame in frames(20)[17:]:
            writer.add(frame)
        writer.finish()
    with warnings.catch_warnings(), st.open_sequence(tmp_path) as seq:
        warnings.simplefilter("error")
        assert len(seq) == 20
        assert_numbered(seq)
    path.unlink()
    with pytest.warns(UserWarning, match=r"color\.mkv: the video is missing: frames before image 17"):
        VideoImages(tmp_path)


def test_a_video_that_was_cut_has_the_images_before_and_says_so(tmp_path):
    path = saved(tmp_path / "s", 50) / "color.mkv"
    size = path.stat().st_size
    for share in (0.9, 0.5, 0.35):
        os.truncate(path, int(share * size))
        with pytest.warns(UserWarning, match=r"color\.mkv: the video is cut: images \d+ to 49 are missing"):
            seq = st.open_sequence(tmp_path / "s")
        have = [i for i in range(50) if seq[i].color is not None]
        assert have == list(range(len(have)))
        assert len(have) < 50
        assert all(number_of(seq[i].color) == i for i in have)
        assert seq[49].depth is not None
        seq.close()
    os.truncate(path, 30)
    with pytest.raises(ValueError, match="the depth images can be read alone"):
        st.open_sequence(tmp_path / "s")


def test_damage_is_said_and_never_another_image(tmp_path):
    path = saved(tmp_path / "s", 60) / "color.mkv"
    packet = VideoFile(path).tracks[0].packets[30]
    assert packet.key
    content = bytearray(path.read_bytes())
    middle, end = packet.start + packet.size // 2, packet.start + packet.size
    content[middle:end] = bytes(end - middle)
    path.write_bytes(content)
    with st.open_sequence(tmp_path / "s") as seq:
        for i in (44, 31, 30, 29, 45, *range(60)):
            frame = seq[i]
            if 30 <= i < 30 + KEY_EVERY:
                assert f"the video, image {i}: it cannot be decoded" in frame.error
            else:
                assert number_of(frame.color) == i
    content[packet.start - 12 : packet.start + 8] = bytes(20)  # the lengths by which the next image is found
    path.write_bytes(content)
    with (
        pytest.warns(UserWarning, match="images 30 to 59 are missing"),
        st.open_sequence(tmp_path / "s") as seq,
    ):
        assert_numbered(seq, range(30, 60))


def full_after(monkeypatch, count):
    """The disk is full in the middle of the `count`-th write."""
    whole, written = files.write_all, []

    def write(file, data):
        written.append(len(data))
        if len(written) >= count:
            file.write(bytes(data)[: len(data) // 2])
            raise OSError(errno.ENOSPC, "no space left on the disk")
        whole(file, data)

    monkeypatch.setattr(files, "write_all", write)


@pytest.mark.parametrize("layout", FOLDERS)
def test_a_full_disk_leaves_a_video_that_can_be_read(tmp_path, monkeypatch, capsys, layout):
    st.save_sequence(tmp_path / "0", st.Sequence(frames(9), CAMERA))
    out = tmp_path / "1"
    # the header and five images before it; a sixth is written when the next one comes
    full_after(monkeypatch, 7)
    arguments = ["convert", str(tmp_path / "0"), "--to", layout, "--color", "video", "--out", str(out), "-q"]
    assert run(arguments) == 1
    assert "no space left on the disk; 6 frames before that are in" in capsys.readouterr().err
    monkeypatch.undo()
    with warnings.catch_warnings(), st.open_sequence(out) as seq:
        warnings.simplefilter("error")
        colored = [i for i, frame in enumerate(seq) if frame.color is not None]
        assert colored == list(range(5))
        assert_numbered(seq, set(range(5, len(seq))))


def test_writing_goes_on_after_an_image_that_failed(tmp_path, monkeypatch):
    video = VideoWriter(tmp_path)
    for i in range(4):
        video.add(i, numbered(i))
    full_after(monkeypatch, 1)
    with pytest.raises(OSError, match="no space"):
        video.add(4, numbered(4))
    monkeypatch.undo()
    for i in range(5, 8):
        video.add(i, numbered(i))
    video.finish()
    read = VideoImages(tmp_path)
    assert [number_of(read.read(i)) for i in (0, 2, 5, 7, 6)] == [0, 2, 5, 7, 6]
    assert 3 not in read  # which would have been written with the next one
    assert 4 not in read
    with pytest.raises(ValueError, match="image 4 is missing"):
        read.read(4)


def test_a_depth_image_that_fails_leaves_no_colour_behind(tmp_path, monkeypatch):
    contents = Contents(st.RGBDCamera(CAMERA))
    images = frames(3)
    with WRITERS["tum"](tmp_path, contents, "video") as writer:
        writer.add(images[0])
        monkeypatch.setattr(image_io, "_encode", lambda *_: (_ for _ in ()).throw(OSError("full")))
        with pytest.raises(OSError, match="full"):
            writer.add(images[1])
        monkeypatch.undo()
        writer.finish()
    with st.open_sequence(tmp_path) as seq:
        assert_numbered(seq)
        assert len(seq) == 1


def test_what_a_video_cannot_hold_is_refused(tmp_path, monkeypatch):
    seq = st.Sequence(frames(3), CAMERA)
    with pytest.raises(ValueError, match="from 0 on that increase, got 3 for frame 1 after 8"):
        st.save_sequence(tmp_path / "s", st.Sequence(frames(2), CAMERA, ids=[8, 3]), color="video")
    mixed = [frames(1)[0], st.Frame(np.full(CAMERA.shape, 0.5, np.float32), np.zeros((24, 32, 3), np.uint8))]
    with pytest.raises(ValueError, match="32 x 24 pixels, those before 64 x 48"):
        st.save_sequence(tmp_path / "s", st.Sequence(mixed, CAMERA), color="video")
    assert not (tmp_path / "s").exists()
    monkeypatch.setattr(video_writer, "ENCODER", "no such encoder")
    with pytest.raises(ValueError, match=r"no H\.264 encoder"):
        st.save_sequence(tmp_path / "s", seq, color="video")


def test_a_video_of_another_program_is_refused(tmp_path):
    import av

    saved(tmp_path / "s", 20)
    with av.open(str(tmp_path / "s" / "color.mkv"), "w", format="matroska") as container:
        stream = container.add_stream("libx264", rate=30)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        for i in range(20):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(numbered(i), format="rgb24")))
        container.mux(stream.encode())
    with pytest.raises(ValueError, match="expected a video as sdftrack writes it"):
        st.open_sequence(tmp_path / "s")


def test_commands_write_videos_and_images_again(tmp_path, capsys):
    synthetic, recorded, images = (tmp_path / name for name in ("synthetic", "recorded", "images"))
    assert run(f"synth --frames 3 --color video --out {synthetic} -q".split()) == 0
    assert (synthetic / "color.mkv").is_file()
    with st.open_sequence(synthetic) as seq:
        assert all(frame.color is not None for frame in seq)
    saved(tmp_path / "0", 12)
    assert run(f"record replay:{tmp_path / '0'} --fps 200 --color video --out {recorded} -q".split()) == 0
    assert run(f"convert {recorded} --color jpg --out {images} -q".split()) == 0
    assert not (images / "color.mkv").exists()
    for folder in (recorded, images):
        with st.open_sequence(folder) as seq:
            assert_numbered(seq)
    assert run(f"convert {images} --out {recorded} --overwrite -q".split()) == 0
    assert not (recorded / "color.mkv").exists()
    assert run(f"convert {images} --color avi --out {tmp_path / '3'} -q".split()) == 2


@pytest.mark.skipif(not (DATA / "k1" / "rgb").is_dir(), reason="needs the recording k1 in SDFTRACK_DATA")
def test_a_real_recording_is_small_and_close(tmp_path):
    files = sorted((DATA / "k1" / "rgb").glob("*.jpg"))[:45]
    images = [image_io.read_color(file) for file in files]
    video = VideoWriter(tmp_path)
    for i, image in enumerate(images):
        video.add(i, image)
    video.finish()
    read = VideoImages(tmp_path)
    for i in (0, 14, 15, 44, 30):
        error = np.mean((read.read(i).astype(float) - images[i]) ** 2)
        assert 10 * np.log10(255**2 / error) > LEAST_PSNR
    assert (tmp_path / "color.mkv").stat().st_size < 0.3 * sum(file.stat().st_size for file in files)
