"""The same on Apache Spark: DataFrames in, DataFrames out (`pip install 'unlift[spark]'`).

    tasks = spark.createDataFrame([("maps/office", 1.0), ("maps/lab", 1.0)], "path string, scale double")
    rows = unlift.spark.audit_maps(tasks.repartition(8), schemes=["olc", "ppl"], inlier_ratios=[0.5])
    rows.where("recovered_percent['0.10'] > 20").show()

One map whose lists are spread over the cluster (`unlift split` makes a folder of parts of a file):

    found = unlift.spark.recover(spark.read.parquet("lists"), "released.parquet", model)

By joint recovery, which comes back whole, as it looks at all slots in every round:

    model, outline = unlift.rounds.prepare(released, "lists", memory_limit=2 * 10**9)
    back = unlift.spark.recover_in_rounds(spark.read.parquet("lists"), "released.parquet", model, outline)

Every executor needs this package. A task that is lost with its executor is run again by Spark, to the same rows.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from . import fleet, parts, rounds
from ._unlift import Model, Outline, Recovered, Released

if TYPE_CHECKING:
    import pyarrow as _pa  # type: ignore[import-untyped,unused-ignore]
    from pyspark.sql import DataFrame as _DataFrame  # type: ignore[import-not-found,unused-ignore]

__all__ = ["audit_images", "audit_maps", "recover", "recover_in_rounds"]



def audit_maps(maps: _DataFrame, **options: Any) -> _DataFrame:
    """`unlift.fleet.audit_maps` on every partition of `maps`: columns `path`, and perhaps `scale` and `descriptors`.

    options: those of `unlift.audit`; `threads` is 1 unless it is said, as Spark runs a task per core.
    """
    return _over(maps, "audit_maps", options)


def audit_images(images: _DataFrame, **options: Any) -> _DataFrame:
    """`unlift.fleet.audit_images` on every partition of `images`: columns `name`, `keypoints`, `width`, `height`, and perhaps
    `descriptors`.

    options: those of `unlift.audit_images`; `threads` is 1 unless it is said.
    """
    return _over(images, "audit_images", options)


def recover(lists: _DataFrame, released: str, model: Model, *, n_parts: int | None = None) -> _DataFrame:
    """`unlift.parts.recover` on every part of `lists`: columns `slot` and `records`, in any order and partitions.

    released: the file of the released map, where every executor reads it.
    model: what `unlift.prepare` learned of it and all of its lists.
    n_parts: how many parts; Spark's own number of shuffle partitions unless it is said. Each reads all records once.

    `unlift.parts.join(found.toArrow().to_batches(), ..)` makes of the rows what `unlift.recover` gives.
    """
    from pyspark.sql import functions

    # Of lines through two points both are solved together.
    record = functions.floor(functions.col("slot") / Released.read(released).slots_per_record)
    ranged = lists.repartitionByRange(record) if n_parts is None else lists.repartitionByRange(n_parts, record)
    learned = model.to_bytes()

    def of_partition(batches: Iterator[_pa.RecordBatch]) -> Iterator[_pa.RecordBatch]:
        from unlift import Model, Released, parts

        given = [batch for batch in batches if len(batch)]
        if given:
            yield from parts.recover(given, Released.read(released), Model.from_bytes(learned), threads=1)

    return ranged.mapInArrow(of_partition, _spec(parts.COLUMNS))


def recover_in_rounds(
    lists: _DataFrame,
    released: str,
    model: Model,
    outline: Outline,
    *,
    n_parts: int | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
) -> Recovered:
    """`unlift.rounds.recover`: `unlift.recover(.., confidence=False)`, bit for bit, of lists that no machine has all of.

    lists: columns `slot` and `records`, and `scores` where the model's lists have some, in any order and partitions.
    released, n_parts: as for `recover`.
    model, outline: what `unlift.rounds.prepare` learned of the map and all of its lists.
    checkpoint: a file of this process, as for `unlift.rounds.recover`: after a driver is lost the next one makes the edges again, and goes on
        with the round that was under way.

    Entries of lists are shuffled once, to where the records are that they name. What comes of it stays on the disks of executors, or in the
    checkpoint folder of the SparkContext, if it has one: then what an executor loses is not made again. A round is two jobs,
    in which nothing is shuffled: all executors are sent where all slots are (24 bytes each at least, and 100 to 130 in every task that
    works with them), and this process what became of those that moved.
    """
    from pyspark import StorageLevel

    of_map = Released.read(released)
    per, n_records = of_map.slots_per_record, of_map.n_slots // of_map.slots_per_record
    session = lists.sparkSession
    if n_parts is None:
        n_parts = int(session.conf.get("spark.sql.shuffle.partitions") or 200)
    n_parts = max(1, min(n_parts, n_records))
    scores = ["scores"] if "scores" in lists.columns else []
    learned = model.to_bytes()

    def to_parts(batches: Iterator[_pa.RecordBatch]) -> Iterator[_pa.RecordBatch]:
        from unlift import rounds

        for batch in batches:
            own = batch["slot"].to_numpy(zero_copy_only=False) // per
            yield _blocks(batch, own * n_parts // n_records, True)
            (named,) = rounds.entries([batch])
            yield _blocks(named, named["record"].to_numpy() * n_parts // n_records, False)

    def of_part(batches: Iterator[_pa.RecordBatch]) -> Iterator[_pa.RecordBatch]:
        from unlift import Model, rounds

        blocks: dict[bool, list[_pa.RecordBatch]] = {True: [], False: []}
        for batch in batches:
            for is_own, block in zip(batch["own"], batch["block"]):
                blocks[is_own.as_py()] += _unpacked(block)
        if blocks[True] or blocks[False]:
            model = Model.from_bytes(learned)
            yield from rounds.edges(blocks[True], blocks[False], released, model, threads=1)

    # Entries travel in blocks: a row each would cost a cluster more than all that comes after.
    blocks = lists.select("slot", "records", *scores).mapInArrow(to_parts, "part bigint, own boolean, block binary")
    ranged = blocks.repartitionByRange(n_parts, "part")
    edges = ranged.mapInArrow(of_part, _spec(rounds.EDGES))
    if session.sparkContext.getCheckpointDir() is None:
        edges = edges.persist(StorageLevel.DISK_ONLY)
    else:
        edges = edges.checkpoint()

    def over(work: rounds.Work, columns: dict[str, str]) -> list[_pa.RecordBatch]:
        batches: list[_pa.RecordBatch] = edges.mapInArrow(work, _spec(columns)).toArrow().to_batches()
        return batches

    try:
        return rounds.recover(over, released, model, outline, checkpoint=checkpoint)
    finally:
        edges.unpersist()


def _blocks(batch: _pa.RecordBatch, part: Any, is_own: bool) -> _pa.RecordBatch:
    """The rows of `batch` by the part that each goes to, all of a part in one binary value."""
    import numpy as np
    import pyarrow as pa

    order = np.argsort(part, kind="stable")
    sorted_batch, part = batch.take(pa.array(order)), part[order]
    starts = np.flatnonzero(np.diff(part, prepend=-1))
    ends = np.append(starts[1:], len(part))
    packed = []
    for start, end in zip(starts.tolist(), ends.tolist()):
        sink = pa.BufferOutputStream()
        with pa.ipc.new_stream(sink, batch.schema) as stream:
            stream.write_batch(sorted_batch.slice(start, end - start))
        packed.append(sink.getvalue().to_pybytes())
    columns = {"part": part[starts], "own": [is_own] * len(packed), "block": packed}
    types = pa.schema([("part", pa.int64()), ("own", pa.bool_()), ("block", pa.binary())])
    return pa.RecordBatch.from_pydict(columns, schema=types)


def _unpacked(block: Any) -> list[_pa.RecordBatch]:
    import pyarrow as pa

    with pa.ipc.open_stream(block.as_buffer()) as stream:
        return list(stream)


def _spec(columns: dict[str, str]) -> str:
    return ", ".join(f"{name} {of}" for name, of in columns.items())


def _over(items: _DataFrame, by: str, options: dict[str, Any]) -> _DataFrame:
    options = {"threads": 1, **options}

    def of_partition(batches: Iterator[_pa.RecordBatch]) -> Iterator[_pa.RecordBatch]:
        from unlift import fleet as here

        rows: Iterator[_pa.RecordBatch] = getattr(here, by)(batches, **options)
        return rows

    return items.mapInArrow(of_partition, _spec(fleet.ROWS))
