# SPDX-License-Identifier: MIT
"""H.264 image by image, as Matroska stores it: each image one packet, in the order of their times."""

from __future__ import annotations

import re
import struct
from fractions import Fraction
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.extras import need

__all__ = ["KEY_EVERY", "H264Decoder", "H264Encoder", "has_encoder"]

KEY_EVERY = 15  # images; to read one, at most so many are decoded
ENCODER = "libx264"
# No image refers to a later one, so that each is a packet at once; no distortion that only looks sharper.
OPTIONS = {"preset": "veryfast", "crf": "17", "tune": "psnr,zerolatency", "g": str(KEY_EVERY)}
SPS, PPS = 7, 8  # kinds of the units that describe a stream
WITH_FORMAT = (100, 110, 122, 244)  # profiles whose description also names the pixel format


def has_encoder() -> bool:
    """Whether this build of PyAV can write it. ImportError without PyAV."""
    av = need("av", "video")
    return ENCODER in av.codecs_available


class H264Encoder:
    """Encodes images of even width and height, nearly without loss.

    Attributes
    ----------
    private : bytes
        The description of the stream, which a decoder needs (AVCDecoderConfigurationRecord).
    """

    def __init__(self, width: int, height: int) -> None:
        import av
        from av.codec.context import Flags

        context = cast(Any, av.CodecContext.create(ENCODER, "w"))
        context.width, context.height, context.pix_fmt = width, height, "yuv420p"
        context.time_base, context.framerate = Fraction(1, 30), Fraction(30)
        context.options = OPTIONS
        context.flags |= Flags.global_header
        context.thread_count = 1  # the same bits on any machine
        context.open()
        self._context = context
        self.private = _description(context.extradata)
        self._count = 0

    def encode(self, image: NDArray[np.uint8]) -> tuple[bytes, bool]:
        """The packet of an image, and whether it needs no other one."""
        import av

        frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(image), format="rgb24")
        frame = frame.reformat(format="yuv420p", interpolation="AREA")  # chroma is the mean of 2 x 2 pixels
        frame.pts = self._count
        (packet,) = self._context.encode(frame)
        self._count += 1
        units = _units(bytes(packet))
        return b"".join(struct.pack(">I", len(unit)) + unit for unit in units), bool(packet.is_keyframe)


class H264Decoder:
    """Decodes the packets of a stream one after the other, beginning at one that needs no other."""

    def __init__(self, private: bytes) -> None:
        av = need("av", "video")
        self._context: Any = av.CodecContext.create("h264", "r")
        self._context.extradata = private
        self._context.thread_count = 1  # threads would hold images back
        self._context.options = {"err_detect": "explode"}  # instead of inventing what is damaged

    def decode(self, packet: bytes) -> Any:
        """The image as PyAV's frame; ValueError if it is damaged."""
        import av

        try:
            frames = self._context.decode(av.Packet(packet))
        except av.FFmpegError as error:
            raise ValueError(f"it cannot be decoded ({error.strerror})") from None
        if len(frames) != 1 or frames[0].is_corrupt:
            raise ValueError("it cannot be decoded")
        return frames[0]


def _units(stream: bytes) -> list[bytes]:
    """The units of a byte stream, which start codes separate."""
    return [unit for unit in re.split(rb"\x00?\x00\x00\x01", stream) if unit]


def _description(extradata: bytes) -> bytes:
    units = _units(extradata)
    sps = next(unit for unit in units if unit[0] & 31 == SPS)
    pps = next(unit for unit in units if unit[0] & 31 == PPS)
    head = bytes([1, *sps[1:4], 0xFF, 0xE1])  # units have 4 bytes of length; one SPS
    text = head + struct.pack(">H", len(sps)) + sps + b"\1" + struct.pack(">H", len(pps)) + pps
    return text + bytes([0xFD, 0xF8, 0xF8, 0]) if sps[1] in WITH_FORMAT else text  # 4:2:0, 8 bits
