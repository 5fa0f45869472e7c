"""Recovery of one map in parts: Arrow batches of neighbor lists in, Arrow batches of positions out (needs `pyarrow`).

A slot is the place of one hidden point on a record. The solver `consensus` places a slot by all records, a `Model` of the map, and the
slot's own list. So lists, which take most of the space, may be spread over machines, while every machine reads all records. On one
machine, parts save no memory.

>>> import numpy as np, pyarrow, tempfile, unlift
>>> points = np.random.default_rng(1).uniform(0, 4, (300, 3))
>>> hidden = unlift.obfuscate(unlift.Map(points, scale=1.0), "olc", seed=1)
>>> lists = unlift.neighbors.oracle(hidden, 0.5, k=20)
>>> model = unlift.prepare(hidden, lists)
>>> by_slot = unlift.parts.table(lists)
>>> halves = [by_slot.slice(0, 150), by_slot.slice(150)]
>>> found = [batch for half in halves for batch in unlift.parts.recover(half.to_batches(), hidden, model)]
>>> back = unlift.parts.join(found, hidden, model)
>>> bool((back.positions == unlift.recover(hidden, lists, solver="consensus").positions).all())
True

On Spark: `unlift.spark.recover`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ._unlift import Hidden, Model, Neighborhoods, Recovered, Released, UnliftError

if TYPE_CHECKING:
    import pyarrow as _pa  # type: ignore[import-untyped,unused-ignore]

__all__ = ["COLUMNS", "join", "recover", "schema", "table"]

#: The columns of a result: name, and type in Spark's notation. `x`, `y`, `z` are relative to the origin of the released map, NaN if
#: the slot was not recovered; `status` is 0 if it was.
COLUMNS = {
    "slot": "bigint",
    "x": "float",
    "y": "float",
    "z": "float",
    "status": "int",
    "support": "int",
    "axis": "int",
    "evidence": "float",
    "descriptor_row": "bigint",
}

#: Slots per batch of results.
_BATCH = 1 << 16


def schema() -> _pa.Schema:
    """Returns the schema of the results."""
    return _schema(COLUMNS)


def table(lists: Neighborhoods) -> _pa.Table:
    """Returns neighbor lists as a table with a row per slot: `slot`, `records`, and `scores` if there are any."""
    pa = _pyarrow()
    records = lists.records
    # Spark has no unsigned integers.
    kind = np.int32 if len(lists) < 2**31 else np.int64
    offsets = lists.offsets.astype(np.int64)
    columns = {"slot": np.arange(len(lists), dtype=np.int64)}
    columns["records"] = pa.LargeListArray.from_arrays(offsets, records.astype(kind))
    if lists.scores is not None:
        columns["scores"] = pa.LargeListArray.from_arrays(offsets, lists.scores)
    return pa.table(columns)


def recover(
    batches: Iterable[_pa.RecordBatch], released: Released | Hidden, model: Model, *, threads: int | None = None
) -> Iterator[_pa.RecordBatch]:
    """Recovers the slots between the first and the last in `batches` by the solver `consensus`.

    batches: the lists of the part, in any order, with the columns `slot` (integer) and `records` (list of integers). A missing slot
        between others has an empty list. All slots of a record must be in the same part.
    model: the result of `unlift.prepare` for `released` and all of its lists.
    threads: use 1 if an engine runs a task per core.

    Yields rows of `COLUMNS`, in order of slots; none for a part without rows.
    """
    pa = _pyarrow()
    lists = _table(batches, "slot", "records")
    if lists is None:
        return
    first, n = _span(lists, released.released if isinstance(released, Hidden) else released)
    offsets, columns = _rows(lists, first, n, ("records",))
    numbers = columns["records"]
    if len(numbers) and 0 <= numbers.min() and numbers.max() < 2**32:
        numbers = numbers.astype(np.uint32)
    del lists, columns
    found = model.solve_part(released, first, offsets, numbers, threads=threads)
    for start in range(0, n, _BATCH):
        yield _batch(first, found, slice(start, min(start + _BATCH, n)))


def join(batches: Iterable[_pa.RecordBatch], released: Released | Hidden, model: Model) -> Recovered:
    """Joins the results of all parts, bit for bit those of `unlift.recover(.., solver="consensus")`.

    batches: the results of `recover` for all parts, in any order. A missing slot counts as one with an empty list.
    """
    pa = _pyarrow()
    rows = pa.Table.from_batches(list(batches), schema=schema())
    return model.join(released, _columns(rows, released.released if isinstance(released, Hidden) else released))


def _columns(rows: _pa.Table, of_map: Released) -> dict[str, Any]:
    """Converts rows of `COLUMNS` in any order to columns of all slots in order."""
    n = of_map.n_slots
    slots = rows["slot"].to_numpy()
    if len(slots) and not (0 <= slots.min() and slots.max() < n and len(np.unique(slots)) == len(slots)):
        raise UnliftError(f"slot: expected numbers below {n}, each once, found others")
    # The default status, 1, means too few neighbors.
    columns: dict[str, Any] = {
        "position": np.full((n, 3), np.nan, dtype=np.float32),
        "status": np.ones(n, dtype=np.uint8),
        "support": np.zeros(n, dtype=np.uint16),
        "axis": np.zeros(n, dtype=np.uint8),
        "evidence": np.zeros(n, dtype=np.float32),
    }
    for at, axis in enumerate("xyz"):
        columns["position"][slots, at] = rows[axis].to_numpy()
    for name in ("status", "support", "axis", "evidence"):
        columns[name][slots] = rows[name].to_numpy()
    columns["descriptor_row"] = None
    if of_map.descriptors is not None and of_map.slots_per_record == 2:
        columns["descriptor_row"] = np.arange(n, dtype=np.uint32)
        columns["descriptor_row"][slots] = rows["descriptor_row"].to_numpy()
    return columns


def _batch(first: int, found: dict[str, Any], part: slice) -> _pa.RecordBatch:
    pa = _pyarrow()
    rows = found["descriptor_row"]
    size = part.stop - part.start
    columns = [
        pa.array(np.arange(first + part.start, first + part.stop)),
        *(pa.array(np.ascontiguousarray(found["position"][part, axis])) for axis in range(3)),
        *(pa.array(found[name][part].astype(np.int32)) for name in ("status", "support", "axis")),
        pa.array(found["evidence"][part]),
        pa.nulls(size, pa.int64()) if rows is None else pa.array(rows[part].astype(np.int64)),
    ]
    return pa.RecordBatch.from_arrays(columns, schema=schema())


def _table(batches: Iterable[_pa.RecordBatch], *names: str) -> _pa.Table | None:
    """Returns the batches as a table and checks its columns; None without rows."""
    given = [batch for batch in batches if len(batch)]
    if not given:
        return None
    table = _pyarrow().Table.from_batches(given)
    _check(table.schema.names, *names)
    for name in names:
        if name in ("slot", "record", "by") and table[name].null_count:
            raise UnliftError(f"{name}: expected numbers, found null")
    return table


def _check(found: list[str], *names: str) -> None:
    for name in names:
        if name not in found:
            raise UnliftError(f"batches: expected a column {name}, found {', '.join(found) or 'none'}")


def _span(table: _pa.Table, of_map: Released) -> tuple[int, int]:
    """Returns the first slot of the records in `table`, and the number of slots up to the last."""
    slots, per = table["slot"].to_numpy(), of_map.slots_per_record
    low, high = int(slots.min()), int(slots.max())
    if low < 0 or high >= of_map.n_slots:
        raise UnliftError(f"slot: expected numbers from 0 to {of_map.n_slots - 1}, found {low} to {high}")
    first = low // per * per
    return first, (high // per + 1) * per - first


def _rows(given: _pa.Table | None, first: int, n: int, names: Sequence[str]) -> tuple[Any, dict[str, Any]]:
    """Returns the lists of `n` slots from `first` on: their offsets, and the joined columns.

    A missing column is None. Without a table the lists are empty.
    """
    pa = _pyarrow()
    lengths = np.zeros(n + 1, dtype=np.int64)
    if given is None:
        return lengths, dict.fromkeys(names, np.zeros(0, dtype=np.int64))
    table: Any = given
    slots = table["slot"].to_numpy()
    if (slots[1:] < slots[:-1]).any():
        table = table.sort_by("slot")
        slots = table["slot"].to_numpy()
    if (slots[1:] == slots[:-1]).any():
        raise UnliftError("slot: expected each once, found some twice")
    columns: dict[str, Any] = dict.fromkeys(names)
    sizes = pa.compute.fill_null(pa.compute.list_value_length(table[names[0]]), 0).to_numpy()
    for name in names:
        if name not in table.schema.names:
            continue
        values = pa.compute.list_flatten(table[name])
        if values.null_count:
            raise UnliftError(f"{name}: expected numbers, found null")
        if (pa.compute.fill_null(pa.compute.list_value_length(table[name]), 0).to_numpy() != sizes).any():
            raise UnliftError(f"{name}: expected one for each of {names[0]}, found others")
        columns[name] = values.to_numpy()
    lengths[slots - first + 1] = sizes
    return np.cumsum(lengths), columns


def _schema(columns: dict[str, str]) -> _pa.Schema:
    pa = _pyarrow()
    types = {"bigint": pa.int64(), "int": pa.int32(), "float": pa.float32()}
    types |= {"array<int>": pa.list_(pa.int32()), "array<tinyint>": pa.list_(pa.int8())}
    return pa.schema([(name, types[of]) for name, of in columns.items()])


def _pyarrow() -> Any:
    try:
        import pyarrow
        import pyarrow.compute  # type: ignore[import-untyped,unused-ignore]
    except ImportError as missing:
        raise UnliftError("pyarrow: expected the package, found none (pip install pyarrow)") from missing
    return pyarrow
