# SPDX-License-Identifier: MIT
"""Metrics of poses, shapes and segmentations against ground truth."""

from sdftrack.metrics.bop import average_recall, mspd, mssd, vsd
from sdftrack.metrics.scores import (
    achievable_accuracy,
    add,
    adds,
    auc,
    boundary_recall,
    chamfer,
    iou,
    plane_angles,
    pose_error,
    undersegmentation,
)
from sdftrack.symmetry import Symmetry, find_symmetries

__all__ = [
    "Symmetry",
    "achievable_accuracy",
    "add",
    "adds",
    "auc",
    "average_recall",
    "boundary_recall",
    "chamfer",
    "find_symmetries",
    "iou",
    "mspd",
    "mssd",
    "plane_angles",
    "pose_error",
    "undersegmentation",
    "vsd",
]
