"""Many maps, one after another: Arrow batches in, Arrow batches out (needs `pyarrow`).

For engines that hand batches to a function: Spark (`unlift.spark`), Dask, Ray, Beam, or a pool of processes. Every row depends on its
own item alone, so that it is the same wherever and in whatever company it is made.

    tasks = pyarrow.RecordBatch.from_pydict({"path": ["office", "lab"], "scale": [1.0, 1.0]})
    rows = pyarrow.Table.from_batches(unlift.fleet.audit_maps([tasks], schemes=["olc"]))
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

from ._unlift import UnliftError

if TYPE_CHECKING:
    import pyarrow as _pa  # type: ignore[import-untyped,unused-ignore]

__all__ = ["ROWS", "audit_maps", "schema"]

#: What rows say: name, and type as Spark writes it.
ROWS = {
    "item": "string",
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
    """The schema of rows, as Arrow says it."""
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
    """Audits the map of every row of `batches`: one row of figures per map, scheme, source, inlier ratio and solver.

    batches: with a column `path` (string), as `unlift.read` takes it; and, if they are there, `scale` (meters per unit) and
        `descriptors` (a file of them), null for maps without.
    options: those of `unlift.audit`, the same for all maps. `threads=1` where an engine runs a task per core.

    Yields a batch per map. A map that cannot be read or audited has one row, whose `error` says why in a line, and a scheme that
    cannot be applied to it another; all other maps go on. Raises UnliftError where there is no `path`.
    """
    from . import Map, audit, read

    for batch in batches:
        if "path" not in batch.schema.names:
            found = ", ".join(batch.schema.names) or "none"
            raise UnliftError(f"batches: expected a column path, found {found}")
        for task in batch.to_pylist():
            path, scale, descriptors = task["path"], task.get("scale"), task.get("descriptors")
            try:
                if path is None:
                    raise UnliftError("path: expected a file or folder, found null")
                map: Map = read(path, scale=scale, descriptors=descriptors)
                report = audit(map, **options)
            except UnliftError as error:
                yield _batch([{"item": path, "error": str(error)}])
                continue
            yield rows_of(str(path), report.document)


def rows_of(item: str, document: dict[str, Any]) -> _pa.RecordBatch:
    """The rows of one audit, under the name of its item."""
    notes = document.get("notes") or []
    rows = [{**_figures(row), "item": item, "notes": notes} for row in document["results"]]
    missing = [
        {"item": item, "scheme": one["scheme"], "error": one["reason"]} for one in document.get("not_audited") or []
    ]
    return _batch(rows + missing)


def _figures(row: dict[str, Any]) -> dict[str, Any]:
    figures: dict[str, Any] = {}
    for name, of in ROWS.items():
        value = row.get(name)
        is_map = of.startswith("map")
        figures[name] = list(value.items()) if is_map and value is not None else value
    return figures


def _batch(rows: list[dict[str, Any]]) -> _pa.RecordBatch:
    return _pyarrow().RecordBatch.from_pylist(rows, schema=schema())


def _pyarrow() -> Any:
    try:
        import pyarrow  # type: ignore[import-untyped,unused-ignore]
    except ImportError as missing:
        raise UnliftError("pyarrow: expected the package, found none (pip install pyarrow)") from missing
    return pyarrow
