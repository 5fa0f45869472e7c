"""One map in parts by joint recovery: who lists whom is spread over machines, and nobody needs all of it (needs `pyarrow`).

Every slot looks at where the records are believed to be that it lists, and those whose slots list it: its edges. They stay where they
are. In every round one who leads says where all slots are believed to be, and each part where its slots go from there.

>>> import numpy as np, pyarrow, unlift
>>> points = np.random.default_rng(1).uniform(0, 4, (300, 3))
>>> hidden = unlift.obfuscate(unlift.Map(points, scale=1.0), "olc", seed=1)
>>> lists = unlift.neighbors.oracle(hidden, 0.5, k=20)
>>> model, outline = unlift.rounds.prepare(hidden, lists)

Parts are lists of some slots, and all entries that name records of these:

>>> by_slot = unlift.parts.table(lists)
>>> entries = pyarrow.Table.from_batches(unlift.rounds.entries(by_slot.to_batches()))
>>> is_first = pyarrow.compute.less(entries["record"], 150)
>>> halves = [
...     (by_slot.slice(0, 150), entries.filter(is_first)),
...     (by_slot.slice(150), entries.filter(pyarrow.compute.invert(is_first))),
... ]
>>> parts = [
...     list(unlift.rounds.edges(own.to_batches(), named.to_batches(), hidden, model)) for own, named in halves
... ]

`over` is all that an engine has to do: a function over the rows of each part, and all that comes of it.

>>> def over(work, columns):
...     return [batch for part in parts for batch in work(part)]
>>> back = unlift.rounds.recover(over, hidden, model, outline)
>>> whole = unlift.recover(hidden, lists, confidence=False)
>>> bool((back.positions == whole.positions).all())
True

On Spark: `unlift.spark.recover_in_rounds`.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from . import parts
from ._unlift import Edges, Hidden, Lead, Model, Neighborhoods, Outline, Recovered, Released, UnliftError, prepare_rounds
from .parts import _check, _pyarrow, _rows, _schema, _span, _table

if TYPE_CHECKING:
    import pyarrow as _pa  # type: ignore[import-untyped,unused-ignore]

__all__ = ["EDGES", "Outline", "Over", "Work", "edges", "entries", "prepare", "recover"]

#: Who lists whom about a slot: name, and type as Spark writes it. `ends` are slots, ascending; a class says which of the two
#: names the other, and how high a source scores it.
EDGES = {"slot": "bigint", "ends": "array<int>", "classes": "array<tinyint>"}

_START = parts.COLUMNS | {"edges": "bigint"}
_MOVED = {name: of for name, of in parts.COLUMNS.items() if name != "descriptor_row"} | {"ahead": "float"}
_TOLD = {"slot": "bigint", "jumps": "bigint"}

#: Applies a function to the rows of each part; it gives rows with columns of these types, as Spark writes them.
Over = Callable[["Work", dict[str, str]], "Iterable[_pa.RecordBatch]"]


def entries(batches: Iterable[_pa.RecordBatch]) -> Iterator[_pa.RecordBatch]:
    """Entries of lists one by one: which `record` is named, by the list of which slot (`by`), and its `score`, if lists have
    `scores`.

    batches: lists, a row per slot, with the columns `slot` and `records`, and perhaps `scores`.
    """
    pa = _pyarrow()
    for batch in batches:
        _check(batch.schema.names, "slot", "records")
        rows = batch["records"]
        lengths = pa.compute.fill_null(pa.compute.list_value_length(rows), 0).to_numpy(zero_copy_only=False)
        by = np.repeat(batch["slot"].to_numpy(zero_copy_only=False), lengths)
        named = {"record": pa.compute.list_flatten(rows).cast(pa.int64()), "by": pa.array(by)}
        if "scores" in batch.schema.names:
            named["score"] = pa.compute.list_flatten(batch["scores"]).cast(pa.float32())
        yield pa.RecordBatch.from_pydict(named)


def edges(
    lists: Iterable[_pa.RecordBatch],
    named: Iterable[_pa.RecordBatch],
    released: Released | Hidden | str | os.PathLike[str],
    model: Model,
    *,
    threads: int | None = None,
) -> Iterator[_pa.RecordBatch]:
    """The edges of the slots of a part.

    lists: the lists of the part, in any order: columns `slot` and `records`, and `scores` where the model's lists have some. All slots of
        a record belong to the same part.
    named: all `entries` of any lists that name records of the part, in any order.
    released: the map, or the path of its file.
    model: what `prepare` learned of it and all of its lists.

    Yields rows of `EDGES`, in order of slots.
    """
    pa = _pyarrow()
    of_map = _read(released)
    own = _table(lists, "slot", "records")
    naming = _table(named, "record", "by")
    per = of_map.slots_per_record
    records = [] if own is None else [own["slot"].to_numpy() // per]
    if naming is not None:
        records.append(naming["record"].to_numpy())
    if not records:
        return
    low, high = min(int(of.min()) for of in records), max(int(of.max()) for of in records)
    if low < 0 or high >= of_map.n_slots // per:
        raise UnliftError(f"records: expected numbers from 0 to {of_map.n_slots // per - 1}, found {low} to {high}")
    first, n = low * per, (high - low + 1) * per
    offsets, columns = _rows(own, first, n, ("records", "scores"))
    given: dict[str, Any] = dict.fromkeys(("record", "by", "score"), np.zeros(0, dtype=np.int64))
    if naming is not None:
        given = {name: naming[name].to_numpy() if name in naming.schema.names else None for name in given}
    found = Edges.of_lists(
        model,
        of_map,
        first,
        offsets,
        columns["records"],
        given["record"],
        given["by"],
        scores=columns["scores"],
        named_scores=given["score"],
        threads=threads,
    ).columns()
    lengths = np.diff(found["offsets"].astype(np.int64))
    # Between records of the part may be others.
    present = np.zeros(n // per, dtype=bool)
    for of in records:
        present[of - low] = True
    kept = np.flatnonzero(present.repeat(per))
    if len(kept) < n:
        # Those have no lists here, and nobody names them.
        offsets = np.concatenate([[0], np.cumsum(lengths[kept])])
    else:
        offsets = found["offsets"]
    if offsets[-1] > np.iinfo(np.int32).max:
        raise UnliftError(f"edges: expected less than 2^31 in a part, found {offsets[-1]} (more parts have less each)")
    offsets = pa.array(offsets.astype(np.int32))
    yield pa.RecordBatch.from_arrays(
        [
            pa.array(first + kept),
            pa.ListArray.from_arrays(offsets, pa.array(found["ends"].astype(np.int32))),
            pa.ListArray.from_arrays(offsets, pa.array(found["classes"].astype(np.int8))),
        ],
        schema=_schema(EDGES),
    )


def prepare(
    released: Released | Hidden,
    lists: Neighborhoods | str | os.PathLike[str],
    *,
    delta: float | None = None,
    seed: int = 0,
    exact_constraints: bool = True,
    memory_limit: int | None = None,
    threads: int | None = None,
) -> tuple[Model, Outline]:
    """What all machines must know of a map and its lists (the model, small), and what the one must that leads rounds (the outline:
    8 bytes a slot, and a sample of the edges).

    lists: all of them, or the path of their file. With a `memory_limit` (bytes) it is read a window at a time, and what takes more is put in
        files of the folder for temporary ones (`TMPDIR`): some 1.5 kB a slot.
    """
    return prepare_rounds(
        released,
        lists,
        delta=delta,
        seed=seed,
        exact_constraints=exact_constraints,
        memory_limit=memory_limit,
        threads=threads,
    )


def recover(
    over: Over,
    released: Released | Hidden | str | os.PathLike[str],
    model: Model,
    outline: Outline,
    *,
    checkpoint: str | os.PathLike[str] | None = None,
) -> Recovered:
    """Recovers a map whose edges are spread: `unlift.recover(.., confidence=False)`, bit for bit.

    over: `over(work, columns)` gives back the batches of `work(batches)` for the `edges` of every part, in any order. What it
        gives have `columns`: names, and types as Spark writes them. `work` can be pickled if `released` is a path.
    released: the map, or the path of its file where every machine reads it.
    model, outline: what `prepare` learned of the map and all of its lists. Edges that are lost on the way, or come twice, are told.
    checkpoint: a file that is written after every round, some 60 bytes a slot, and gone at the end. Where it is there, rounds go on from it, to
        the same bits.

    In memory are some 300 bytes a slot at most, while slots come back; on every machine 100 to 130 a task while it works, beside the records.
    How sure the attacker is, is not asked: that takes all edges.
    """
    pa = _pyarrow()
    of_map = _read(released)
    n, per = of_map.n_slots, of_map.slots_per_record

    def all_of(step: str, columns: dict[str, str], told: Any = None) -> _pa.Table:
        batches = list(over(Work(step, released, model, told), columns))
        return pa.Table.from_batches(batches, schema=_schema(columns))

    started = all_of("start", _START)
    start, lengths = parts._columns(started, of_map), np.zeros(n, dtype=np.int64)
    lengths[started["slot"].to_numpy()] = started["edges"].to_numpy()
    del started
    if checkpoint is not None and os.path.lexists(checkpoint):
        lead = Lead.resume(model, of_map, outline, lengths, checkpoint)
    else:
        lead = Lead(model, of_map, outline, start, lengths)
    rows = start["descriptor_row"]
    del start
    while not lead.is_done:
        moved = all_of("move", _MOVED, lead.standing())
        columns = {name: moved[name].to_numpy() for name in _MOVED if name not in "xyz"}
        columns["position"] = np.stack([moved[axis].to_numpy() for axis in "xyz"], axis=1)
        news = lead.moved(columns | {"descriptor_row": None})
        told = pa.table({"slot": [], "jumps": []}, schema=_schema(_TOLD))
        if news is not None:
            told = all_of("tell", _TOLD, news)
        lead.told(told["slot"].to_numpy(), told["jumps"].to_numpy())
        if checkpoint is not None:
            lead.save(checkpoint)
    found = lead.finish(rows)
    if checkpoint is not None and os.path.lexists(checkpoint):
        os.unlink(checkpoint)
    return found


class Work:
    """What is to be done with the edges of each part: called with batches of `EDGES`, gives batches."""

    def __init__(self, step: str, released: Released | Hidden | str | os.PathLike[str], model: Model, told: Any = None) -> None:
        self.step, self.released, self.model, self.told = step, released, model, told

    def __call__(self, batches: Iterable[_pa.RecordBatch]) -> Iterator[_pa.RecordBatch]:
        rows = _table(batches, *EDGES)
        if rows is not None:
            yield from getattr(self, f"_{self.step}")(rows, _read(self.released))

    def __repr__(self) -> str:
        return f"<unlift.rounds.Work: {self.step}>"

    def _start(self, rows: _pa.Table, of_map: Released) -> Iterator[_pa.RecordBatch]:
        pa = _pyarrow()
        held, first, n = _held(rows, of_map)
        found = parts._batch(first, held.start(self.model, of_map, threads=1), slice(0, n))
        lengths = pa.array(np.diff(held.columns()["offsets"].astype(np.int64)))
        found = pa.RecordBatch.from_arrays([*found.columns, lengths], schema=_schema(_START))
        per = of_map.slots_per_record
        present = np.zeros(n // per, dtype=bool)
        present[(rows["slot"].to_numpy() - first) // per] = True
        yield found.filter(pa.array(present.repeat(per)))

    def _move(self, rows: _pa.Table, of_map: Released) -> Iterator[_pa.RecordBatch]:
        pa = _pyarrow()
        found = _held(rows, of_map)[0].move_on(self.model, of_map, self.told, threads=1)
        columns = {axis: np.ascontiguousarray(found["position"][:, at]) for at, axis in enumerate("xyz")}
        columns |= {name: found[name] for name in _MOVED if name not in "xyz"}
        schema = _schema(_MOVED)
        arrays = [pa.array(columns[field.name].astype(field.type.to_pandas_dtype())) for field in schema]
        yield pa.RecordBatch.from_arrays(arrays, schema=schema)

    def _tell(self, rows: _pa.Table, of_map: Released) -> Iterator[_pa.RecordBatch]:
        pa = _pyarrow()
        found = _held(rows, of_map)[0].tell(self.model, of_map, self.told, threads=1)
        arrays = [pa.array(found[name].astype(np.int64)) for name in _TOLD]
        yield pa.RecordBatch.from_arrays(arrays, schema=_schema(_TOLD))


def _held(rows: _pa.Table, of_map: Released) -> tuple[Edges, int, int]:
    """The edges of a part, its first slot, and how many there are from there to the last."""
    first, n = _span(rows, of_map)
    offsets, columns = _rows(rows, first, n, ("ends", "classes"))
    return Edges(of_map, first, offsets, columns["ends"], columns["classes"]), first, n


def _read(released: Released | Hidden | str | os.PathLike[str]) -> Released:
    if isinstance(released, (str, os.PathLike)):
        try:
            told = os.stat(released)
        except OSError as error:
            raise UnliftError(f"{os.fspath(released)}: expected a released map, found {error.strerror}") from error
        return _read_once(os.fspath(released), told.st_mtime_ns, told.st_size)
    return released.released if isinstance(released, Hidden) else released


#: The map that this process read last: those of engines live through many rounds of one.
_LAST: dict[tuple[str, int, int], Released] = {}


def _read_once(path: str, modified: int, size: int) -> Released:
    found = _LAST.get((path, modified, size))
    if found is None:
        _LAST.clear()
        found = _LAST[path, modified, size] = Released.read(path)
    return found
