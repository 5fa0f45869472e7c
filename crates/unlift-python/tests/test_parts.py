"""Recovery in parts equals recovery of the whole map, bit for bit."""

import pathlib
import pickle

import numpy as np
import pytest

import unlift

pa = pytest.importorskip("pyarrow")


def hidden(scheme: str, n: int = 400) -> unlift.Hidden:
    random = np.random.default_rng(3)
    points = random.uniform(0, 4, (n, 3))
    descriptors = random.integers(0, 256, (n, 16), dtype=np.uint8)
    return unlift.obfuscate(unlift.Map(points, descriptors=descriptors, scale=1.0), scheme, seed=4)


def shuffled(table, seed: int):
    return table.take(np.random.default_rng(seed).permutation(len(table)))


@pytest.mark.parametrize("scheme", unlift.SCHEMES)
def test_parts_are_the_whole(scheme: str, tmp_path: pathlib.Path):
    of = hidden(scheme)
    lists = unlift.neighbors.oracle(of, 0.5, k=20)
    model = pickle.loads(pickle.dumps(unlift.prepare(of, lists, seed=2)))
    assert "delta" in repr(model)
    rows = unlift.parts.table(lists)
    assert rows["records"].combine_chunks().flatten().to_pylist() == lists.records.tolist()
    found = []
    for part in (rows.slice(0, 130), rows.slice(130, 2), rows.slice(132)):
        found += unlift.parts.recover(shuffled(part, 1).to_batches(max_chunksize=50), of.released, model)
    assert all(batch.schema == unlift.parts.schema() for batch in found)
    back = unlift.parts.join(reversed(found), of.released, model)
    whole = unlift.recover(of, lists, solver="consensus", seed=2)
    for name, one in (("parts", back), ("whole", whole)):
        one.save(tmp_path / name)
    assert (tmp_path / "parts").read_bytes() == (tmp_path / "whole").read_bytes()


def test_slots_without_rows_have_no_lists():
    of = hidden("ppl")
    rows = unlift.parts.table(unlift.neighbors.oracle(of, 0.5, k=20))
    lists = unlift.Neighborhoods(of, np.full((len(rows), 1), -1))
    model = unlift.prepare(of, unlift.neighbors.oracle(of, 0.5, k=20))
    # The part has one slot of a record: both slots of the record are solved, and no others.
    (found,) = unlift.parts.recover(rows.slice(101, 1).to_batches(), of, model)
    assert found["slot"].to_pylist() == [100, 101] and found["status"].to_pylist() == [1, 0]
    back = unlift.parts.join([found], of, model)
    assert np.flatnonzero(np.array(back.status) == "ok").tolist() == [101] and len(lists) == len(back)
    assert list(unlift.parts.recover([], of, model)) == []


def test_what_is_no_part_is_refused():
    of = hidden("olc", 60)
    lists = unlift.neighbors.oracle(of, 0.5, k=10)
    model = unlift.prepare(of, lists)
    rows = unlift.parts.table(lists)

    def refused(table, of=of, model=model) -> str:
        with pytest.raises(unlift.UnliftError) as error:
            list(unlift.parts.recover(table.to_batches(), of, model))
        return str(error.value)

    assert refused(rows.drop_columns("slot")) == "batches: expected a column slot, found records"
    assert refused(pa.concat_tables([rows, rows])) == "slot: expected each once, found some twice"
    far = pa.table({"slot": [59, 60], "records": [[1], [2]]})
    assert refused(far) == "slot: expected numbers from 0 to 59, found 59 to 60"
    assert "expected numbers from 0 to 59, found 60" in refused(pa.table({"slot": [1], "records": [[60]]}))
    assert refused(pa.table({"slot": [1], "records": [[None]]})) == "records: expected numbers, found null"
    assert refused(rows, of=hidden("olc", 61)).startswith("model: fingerprint: ")
    with pytest.raises(unlift.UnliftError, match="model: "):
        unlift.Model.from_bytes(b"other")
    found = list(unlift.parts.recover(rows.to_batches(), of, model))
    with pytest.raises(unlift.UnliftError, match="slot: expected numbers below 60, each once"):
        unlift.parts.join(found + found, of, model)


def test_a_folder_of_parts_is_read_as_it_was_written(tmp_path: pathlib.Path):
    import pyarrow.parquet as pq

    of = hidden("ray-voxel")
    lists = unlift.neighbors.oracle(of, 0.5, k=20)
    rows = shuffled(unlift.parts.table(lists), 3)
    (tmp_path / "lists").mkdir()
    for at in range(0, len(rows), 150):
        pq.write_table(rows.slice(at, 150), tmp_path / "lists" / f"part-{at}.parquet")
    read = unlift.Neighborhoods.read(tmp_path / "lists", of)
    assert (read.records == lists.records).all() and (read.offsets == lists.offsets).all()
    (tmp_path / "lists" / "part-150.parquet").unlink()
    with pytest.raises(unlift.UnliftError, match=f"expected {len(rows)} rows, one per slot"):
        unlift.Neighborhoods.read(tmp_path / "lists", of)
