# SPDX-License-Identifier: MIT
"""Metrics of poses, shapes and segmentations against ground truth."""

from sdftrack.metrics.scores import (
    achievable_accuracy,
    add,
    adds,
    auc,
    average_recall,
    boundary_recall,
    chamfer,
    iou,
    mspd,
    mssd,
    plane_angles,
    pose_error,
    undersegmentation,
    vsd,
)
from sdftrack.symmetry import Symmetry, find_symmetries

__all__ = [
    "Symmetry", "achievable_accuracy", "add", "adds", "auc", "average_recall", "boundary_recall", "chamfer",
    "find_symmetries", "iou", "mspd", "mssd", "plane_angles", "pose_error", "undersegmentation", "vsd",
]  # fmt: skip
