"""Audits on Apache Spark: DataFrames in, DataFrames out (`pip install 'unlift[spark]'`).

    tasks = spark.createDataFrame([("maps/office", 1.0), ("maps/lab", 1.0)], "path string, scale double")
    rows = unlift.spark.audit_maps(tasks.repartition(8), schemes=["olc", "ppl"], inlier_ratios=[0.5])
    rows.where("recovered_percent['0.10'] > 20").show()

Every executor needs this package. If an executor fails, Spark runs its tasks again, with the same rows as result.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from . import fleet

if TYPE_CHECKING:
    import pyarrow as _pa  # type: ignore[import-untyped,unused-ignore]
    from pyspark.sql import DataFrame as _DataFrame  # type: ignore[import-not-found,unused-ignore]

__all__ = ["audit_images", "audit_maps"]


def audit_maps(maps: _DataFrame, **options: Any) -> _DataFrame:
    """Runs `unlift.fleet.audit_maps` on every partition of `maps`.

    maps: a DataFrame with the column `path`, and optional `scale`, `descriptors`, `tile_points` and `tile`.
    options: those of `unlift.audit`. `threads` is 1 by default, because Spark runs a task per core.
    """
    return _over(maps, "audit_maps", options)


def audit_images(images: _DataFrame, **options: Any) -> _DataFrame:
    """Runs `unlift.fleet.audit_images` on every partition of `images`.

    images: a DataFrame with the columns `name`, `keypoints`, `width`, `height`, and optional `descriptors`.
    options: those of `unlift.audit_images`. `threads` is 1 by default.
    """
    return _over(images, "audit_images", options)


def _over(items: _DataFrame, by: str, options: dict[str, Any]) -> _DataFrame:
    options = {"threads": 1, **options}

    def of_partition(batches: Iterator[_pa.RecordBatch]) -> Iterator[_pa.RecordBatch]:
        from unlift import fleet as here

        rows: Iterator[_pa.RecordBatch] = getattr(here, by)(batches, **options)
        return rows

    columns = ", ".join(f"{name} {of}" for name, of in fleet.ROWS.items())
    return items.mapInArrow(of_partition, columns)
