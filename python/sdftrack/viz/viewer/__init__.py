# SPDX-License-Identifier: MIT
"""A page in the browser that shows a tracker while it runs, and takes clicks (extra ``viewer``)."""

from sdftrack.viz.viewer.panel import Box, Click, Pause, Record, Request, Save
from sdftrack.viz.viewer.viewer import Viewer

__all__ = ["Box", "Click", "Pause", "Record", "Request", "Save", "Viewer"]
