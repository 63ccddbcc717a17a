# SPDX-License-Identifier: MIT
"""Output of ``sdftrack calibrate intrinsics``."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

from sdftrack.cli.common import show_table

__all__ = ["FILES", "show", "write"]

FILES = ("camera.json", "result.json", "coverage.png", "estimates.png", "residuals.png")


def write(result: Any, misfits: Any, out: Path, settings: dict[str, Any], im_ids: list[int]) -> None:
    from sdftrack._internal.files import write_json
    from sdftrack.calibration.intrinsics_plots import plot_coverage, plot_estimates, plot_residuals
    from sdftrack.viz.plots import save_figure

    before, after = misfits
    residuals = {"first_guess": before.to_dict(), "calibrated": after.to_dict()}
    result.camera.save(out / "camera.json")
    values = {"settings": settings, **result.to_dict(), "residuals": residuals}
    write_json(out / "result.json", {**values, "im_ids": [im_ids[i] for i in result.frames]})
    save_figure(plot_coverage(result), out / "coverage.png")
    save_figure(plot_estimates(result), out / "estimates.png")
    save_figure(plot_residuals(before, after, result), out / "residuals.png")


def show(result: Any, misfits: Any, first: Any, given: int, out: Path) -> None:
    from sdftrack.calibration.lens import UNKNOWNS, core_lens

    guessed = dict(zip(UNKNOWNS, core_lens(first).values, strict=True))
    rows = [
        [name, f"{guessed[name]:.5g}", f"{value:.6g}", f"{low:.6g} to {high:.6g}"]
        for name, value, (low, high) in zip(result.free, result.values, result.interval95, strict=True)
    ]
    residual = [f"{1e3 * m.median_m:.2f}" if m.frames else "not found" for m in misfits]
    rows.append(["residual mm", *residual, ""])
    rows.append(["frames used", "", str(len(result.frames)), f"of {given}"])
    show_table(f"{out}: {', '.join(FILES)}", ["", "first guess", result.status, "95 %"], rows)
    if result.left_out:
        print(f"left out: {_counted(result.left_out)}")
    if result.extra:
        print(f"camera.json does not hold {', '.join(result.extra)}: see result.json")
    for name, bias, (low, high) in zip(result.free, result.bias, result.interval95, strict=True):
        if abs(bias) > 0.5 * (high - low):
            print(
                f"noise biases {name} by about {bias:+.3g}, which exceeds its interval: see bias in result.json"
            )
    if result.status == "weak":
        print("weak: neither the result nor its intervals are reliable until this is fixed")
    for sentence in result.observability.advice:
        print(f"advice: {sentence}")


def _counted(left_out: dict[int, str]) -> str:
    """Reasons and their counts, without the numbers of single frames."""
    kinds = Counter(reason.split(":")[0] for reason in left_out.values())
    return ", ".join(f"{n} {kind}" for kind, n in kinds.items())
