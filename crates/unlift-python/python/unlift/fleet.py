"""Audits of many maps or images: Arrow batches in, Arrow batches out (needs `pyarrow`).

For engines that pass batches to a function: Spark (`unlift.spark`), Dask, Ray, Beam, or a pool of processes. Every row depends on its
own item only, so it does not depend on the batch or the machine.

    tasks = pyarrow.RecordBatch.from_pydict({"path": ["office", "lab"], "scale": [1.0, 1.0]})
    rows = pyarrow.Table.from_batches(unlift.fleet.audit_maps([tasks], schemes=["olc"]))

Processes of one machine, without any engine:

    with concurrent.futures.ProcessPoolExecutor() as pool:
        parts = pool.map(functools.partial(audit_part, schemes=["olc"]), tasks.to_batches(max_chunksize=100))

    def audit_part(batch, **options):
        return pyarrow.Table.from_batches(unlift.fleet.audit_maps([batch], threads=1, **options))
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from ._audits import Features
from ._unlift import UnliftError

if TYPE_CHECKING:
    import pyarrow as _pa  # type: ignore[import-untyped,unused-ignore]

__all__ = ["ROWS", "audit_images", "audit_maps", "schema"]

#: The columns of the rows: name, and type in Spark's notation.
ROWS = {
    "item": "string",
    "tile": "bigint",
    "error": "string",
    "scheme": "string",
    "neighbors": "string",
    "oracle_noise": "string",
    "inlier_ratio": "double",
    "k": "bigint",
    "solver": "string",
    "unit": "string",
    "n_points": "bigint",
    "n_lost": "bigint",
    "delta": "double",
    "recovered_percent": "map<string,double>",
    "blind_percent": "map<string,double>",
    "records_alone_percent": "map<string,double>",
    "median_error": "double",
    "notes": "array<string>",
}


def schema() -> _pa.Schema:
    """Returns the Arrow schema of the rows."""
    pa = _pyarrow()
    types = {
        "string": pa.string(),
        "double": pa.float64(),
        "bigint": pa.int64(),
        "map<string,double>": pa.map_(pa.string(), pa.float64()),
        "array<string>": pa.list_(pa.string()),
    }
    return pa.schema([(name, types[of]) for name, of in ROWS.items()])


def audit_maps(batches: Iterable[_pa.RecordBatch], **options: Any) -> Iterator[_pa.RecordBatch]:
    """Audits the map of every row of `batches` and yields one row per map, scheme, source, inlier ratio and solver.

    batches: with a column `path` (string), as for `unlift.read`. Optional columns, null for maps without them: `scale` (meters per
        unit), `descriptors` (path of a file); `tile_points` and `tile`, to audit one tile of a large map per row. Tiles count from
        0; a map of n points has `-(-n // tile_points)` tiles.
    options: those of `unlift.audit`, the same for all maps. Use `threads=1` if an engine runs a task per core.

    Yields a batch per map. A map that cannot be read or audited has one row with an `error`, and so has a scheme that cannot be
    applied to it; the audit continues with the other maps. Raises UnliftError if there is no `path`.
    """
    from . import Map, audit, read

    for batch in batches:
        if "path" not in batch.schema.names:
            found = ", ".join(batch.schema.names) or "none"
            raise UnliftError(f"batches: expected a column path, found {found}")
        for task in batch.to_pylist():
            path, scale, descriptors = task["path"], task.get("scale"), task.get("descriptors")
            tile = {name: task.get(name) for name in ("tile_points", "tile") if task.get(name) is not None}
            try:
                if path is None:
                    raise UnliftError("path: expected a file or folder, found null")
                map: Map = read(path, scale=scale, descriptors=descriptors)
                report = audit(map, **options, **tile)
            except UnliftError as error:
                yield _batch([{"item": path, "tile": task.get("tile"), "error": str(error)}])
                continue
            yield _rows_of(str(path), report.document, task.get("tile"))


def audit_images(batches: Iterable[_pa.RecordBatch], **options: Any) -> Iterator[_pa.RecordBatch]:
    """Audits the image of every row of `batches` and yields one row per image, scheme, source, inlier ratio and solver.

    batches: with the columns
        `name` (string): must be unique, because randomness depends on it;
        `keypoints` (list of float): x and y in turns, in pixels, the middle of the first pixel at (0, 0);
        `descriptors` (optional): binary, uint8, one keypoint after the other; or a list of floats in the same order;
        `width`, `height` (integers): in pixels.
    options: those of `unlift.audit_images`, the same for all images; no image is drawn. Use `threads=1` if an engine runs a task
        per core.

    Yields a batch per image, with the same rows as an audit of the image alone. An image that cannot be used has one row with an
    `error`; the audit continues with the others. Raises UnliftError if a column is missing.
    """
    from . import audit_images as audit

    for batch in batches:
        for column in ("name", "keypoints", "width", "height"):
            if column not in batch.schema.names:
                found = ", ".join(batch.schema.names) or "none"
                raise UnliftError(f"batches: expected a column {column}, found {found}")
        for image in batch.to_pylist():
            try:
                report = audit({image["name"]: _features(image)}, pictures=False, **options)
            except UnliftError as error:
                yield _batch([{"item": image["name"], "error": str(error)}])
                continue
            yield _rows_of(image["name"], report.document)


def _features(image: dict[str, Any]) -> Features:
    """Converts a row to the arrays of an image."""
    name = image["name"]
    if name is None:
        raise UnliftError("name: expected a text, found null")
    flat = np.asarray(image["keypoints"] or [], dtype=np.float32)
    if len(flat) % 2:
        raise UnliftError(f"{name}: keypoints: expected x and y in turns, found {len(flat)} numbers")
    found: Features = {"keypoints": flat.reshape(-1, 2), "width": image["width"], "height": image["height"]}
    rows = image.get("descriptors")
    if rows is not None:
        values = np.frombuffer(rows, dtype=np.uint8) if isinstance(rows, bytes) else np.asarray(rows, dtype=np.float32)
        n = max(len(flat) // 2, 1)
        if len(values) % n:
            raise UnliftError(f"{name}: descriptors: expected a multiple of {n} values, found {len(values)}")
        found["descriptors"] = values.reshape(n, -1)
    return found


def _rows_of(item: str, document: dict[str, Any], tile: int | None = None) -> _pa.RecordBatch:
    """Returns the rows of one audit, with the name of its item."""
    rows = [{**_pairs(row), "notes": document.get("notes") or []} for row in document["results"]]
    rows += [{"scheme": row["scheme"], "error": row["reason"]} for row in document.get("not_audited") or []]
    return _batch([{**row, "item": item, "tile": tile} for row in rows])


def _pairs(row: dict[str, Any]) -> dict[str, Any]:
    """Returns a row with lists of pairs in place of dicts, as Arrow takes maps."""
    return {name: list(value.items()) if isinstance(value, dict) else value for name, value in row.items()}


def _batch(rows: list[dict[str, Any]]) -> _pa.RecordBatch:
    return _pyarrow().RecordBatch.from_pylist(rows, schema=schema())


def _pyarrow() -> Any:
    try:
        import pyarrow  # type: ignore[import-untyped,unused-ignore]
    except ImportError as missing:
        raise UnliftError("pyarrow: expected the package, found none (pip install pyarrow)") from missing
    return pyarrow
