"""Writes a recovery as a recording for the viewer rerun (needs `pip install rerun-sdk`).

    lists = {ratio: unlift.neighbors.oracle(hidden, ratio) for ratio in (0.1, 0.3, 0.5)}
    recovered = {ratio: unlift.recover(hidden, each) for ratio, each in lists.items()}
    unlift.viewer.save_rerun("recovery.rrd", hidden, recovered)

The file contains points: it is as private as the map.
"""

from __future__ import annotations

import os
import pathlib
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ._unlift import Hidden, Recovered, Released, UnliftError

__all__ = ["errors", "save_rerun", "segments"]

_TIMELINE = "inlier ratio in percent"
_GRAY = (150, 150, 150)
# Colors from found to lost, safe for people who do not tell red from green.
_FOUND, _LOST = np.array([0.0, 114.0, 178.0]), np.array([213.0, 94.0, 0.0])


def save_rerun(
    path: str | os.PathLike[str],
    hidden: Hidden,
    recovered: Recovered | Mapping[float, Recovered],
    *,
    threshold: float | None = None,
    cameras: npt.ArrayLike | None = None,
    records: int = 2000,
    force: bool = False,
) -> pathlib.Path:
    """Writes a recording: true points, released records, recovered points colored by their error.

    path: the file to write, `.rrd`; an existing file is replaced only with `force`.
    recovered: recovered points of `hidden`; a dict by inlier ratio (0 to 1) becomes a timeline.
    threshold: colors go from error 0 (blue) to this error (orange), in the unit of the map. Default: a twentieth of its size.
    cameras: (N, 3) centers of cameras, in the unit of the map.
    records: the most lines, rays or planes to draw, evenly over the map.

    Lost points are not drawn. The write is atomic, and only the owner may read the file (mode 0600).
    Raises UnliftError if rerun is not installed, the file exists, or the points are not those of `hidden`.
    """
    try:
        import rerun  # type: ignore[import-not-found,unused-ignore]
    except ImportError as missing:
        raise UnliftError("rerun: expected the package rerun-sdk, found none (pip install rerun-sdk)") from missing
    path = pathlib.Path(path)
    if path.exists() and not force:
        raise UnliftError(f"path: expected a file that is not there, or force=True, found {str(path)!r}")
    by_ratio = {0.0: recovered} if isinstance(recovered, Recovered) else dict(recovered)
    truth = hidden.truth.positions[hidden.truth.hidden]
    if truth.shape[0] == 0:
        raise UnliftError("hidden: expected points, found none")
    low, high = np.quantile(truth, 0.01, axis=0), np.quantile(truth, 0.99, axis=0)
    size = float(np.linalg.norm(high - low))
    worst = size / 20 if threshold is None else float(threshold)
    radius = size / 800
    found = {ratio: (each.positions, errors(hidden, each)) for ratio, each in by_ratio.items()}

    partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
    os.close(os.open(partial, os.O_CREAT | os.O_TRUNC | os.O_WRONLY, 0o600))
    try:
        with rerun.RecordingStream("unlift", recording_id="unlift") as stream:
            stream.save(partial)
            stream.log("truth", rerun.Points3D(truth, colors=_GRAY, radii=radius), static=True)
            box = (low - 0.1 * size, high + 0.1 * size)
            lines = segments(hidden.released, box, records).astype(np.float32)
            stream.log("released", rerun.LineStrips3D(lines, colors=_GRAY, radii=radius / 4), static=True)
            if cameras is not None:
                centers = np.asarray(cameras, dtype=np.float64)
                stream.log("cameras", rerun.Points3D(centers, colors=(0, 0, 0), radii=2 * radius), static=True)
            for ratio, (positions, error) in sorted(found.items()):
                stream.set_time(_TIMELINE, sequence=round(100 * ratio))
                here = np.isfinite(error)
                share = np.clip(error[here] / worst, 0.0, 1.0)[:, None]
                colors = (_FOUND * (1 - share) + _LOST * share).astype(np.uint8)
                points = rerun.Points3D(positions[here], colors=colors, radii=radius)
                stream.log("recovered", points)
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)
    return path


def errors(hidden: Hidden, recovered: Recovered) -> npt.NDArray[np.float64]:
    """Returns the distance of each recovered point to the nearest true point of its record: (slots,); inf if it is lost."""
    truth, slots = hidden.truth.positions[hidden.truth.hidden], hidden.released.slots_per_record
    positions = recovered.positions
    if positions.shape != truth.shape:
        raise UnliftError(f"recovered: expected {len(truth)} points, those of hidden, found {len(positions)}")
    of_record = truth.reshape(-1, slots, 3)
    away = positions.reshape(-1, slots, 1, 3) - of_record[:, None]
    error = np.linalg.norm(away, axis=3).min(axis=2).reshape(-1)
    return np.asarray(np.where(np.isfinite(error), error, np.inf), dtype=np.float64)


def segments(
    released: Released, box: tuple[npt.ArrayLike, npt.ArrayLike], most: int = 2000
) -> npt.NDArray[np.float64]:
    """Returns the parts of released records in a box as line segments (M, 2, 3).

    A plane becomes two diagonals, an exchanged point a cross. At most `most` records are drawn, evenly over the map.
    """
    low, high = (np.asarray(side, dtype=np.float64) for side in box)
    columns: dict[str, Any] = released.columns
    chosen = np.unique(np.linspace(0, max(len(released) - 1, 0), min(most, len(released))).astype(np.int64))
    origin = released.origin
    if released.family in ("lines", "rays"):
        is_ray = released.family == "rays"
        through = columns["centers"][columns["center"][chosen]] if is_ray else columns["foot"][chosen]
        return _clipped(through + origin, columns["direction"][chosen].astype(np.float64), (low, high), is_ray)
    if released.family == "axis_planes":
        axis, offset = columns["axis"][chosen].astype(np.int64), columns["offset"][chosen]
        corners = np.empty((len(chosen), 4, 3))
        rows, (a, b) = np.arange(len(chosen)), ((axis + 1) % 3, (axis + 2) % 3)
        for corner, (ends_a, ends_b) in enumerate(((low, low), (high, high), (low, high), (high, low))):
            corners[rows, corner, axis] = offset + origin[axis]
            corners[rows, corner, a], corners[rows, corner, b] = ends_a[a], ends_b[b]
        return corners.reshape(-1, 2, 3)
    at = (columns["position"][chosen] + origin)[:, None, None, :]
    arm = np.linalg.norm(high - low) / 200 * np.eye(3)
    return np.concatenate([at - arm[None, :, None], at + arm[None, :, None]], axis=2).reshape(-1, 2, 3)


def _clipped(
    through: npt.NDArray[np.float64],
    direction: npt.NDArray[np.float64],
    box: tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]],
    is_ray: bool,
) -> npt.NDArray[np.float64]:
    """Returns the parts of lines in a box, without lines that miss it."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([(side - through) / direction for side in box])
    # A line along a side divides by zero: it never leaves through that side.
    first = np.nanmax(ends.min(axis=0), axis=1)
    last = np.nanmin(ends.max(axis=0), axis=1)
    if is_ray:
        first = np.maximum(first, 0.0)
    inside = first < last
    t = np.stack([first, last], axis=1)[inside]
    found: npt.NDArray[np.float64] = through[inside][:, None] + t[:, :, None] * direction[inside][:, None]
    return found
