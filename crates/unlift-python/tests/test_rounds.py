"""Joint recovery whose edges are spread is joint recovery at once, bit for bit."""

import pathlib
import pickle

import numpy as np
import pytest

import unlift

pa = pytest.importorskip("pyarrow")

from test_parts import hidden, shuffled  # noqa: E402


def spread(lists: unlift.Neighborhoods, of, model, cuts: list[int]) -> list[list]:
    """The edges of parts that end at these records."""
    per = (of.released if isinstance(of, unlift.Hidden) else of).slots_per_record
    rows = unlift.parts.table(lists)
    entries = pa.Table.from_batches(unlift.rounds.entries(shuffled(rows, 5).to_batches(max_chunksize=70)))
    bounds = [0, *cuts, len(rows) // per]
    parts = []
    for low, high in zip(bounds, bounds[1:]):
        own = shuffled(rows.slice(low * per, (high - low) * per), 1)
        record = entries["record"].to_numpy()
        named = entries.filter(pa.array((record >= low) & (record < high)))
        made = unlift.rounds.edges(own.to_batches(max_chunksize=50), named.to_batches(), of, model)
        parts.append(list(made))
    return parts


def over(parts: list[list]):
    def run(work: unlift.rounds.Work, columns: dict[str, str]) -> list:
        found = [batch for part in reversed(parts) for batch in pickle.loads(pickle.dumps(work))(part)]
        assert all(batch.schema.names == list(columns) for batch in found), work
        return found

    return run


def bytes_of(back: unlift.Recovered, folder: pathlib.Path) -> bytes:
    back.save(folder / "back", force=True)
    return (folder / "back").read_bytes()


@pytest.mark.parametrize("scheme", unlift.SCHEMES)
@pytest.mark.parametrize("scored", [False, True])
def test_spread_edges_give_the_whole(scheme: str, scored: bool, tmp_path: pathlib.Path):
    of = hidden(scheme)
    of.released.save(tmp_path / "released")
    lists = unlift.neighbors.oracle(of, 0.5, k=20)
    if scored:
        records = lists.records.reshape(-1, 20).astype(np.int64)
        records[5] = -1
        scores = np.random.default_rng(2).uniform(0, 1, records.shape)
        lists = unlift.Neighborhoods(of, records, scores)
    model, outline = unlift.rounds.prepare(of, lists, seed=2)
    model, outline = pickle.loads(pickle.dumps(model)), unlift.rounds.Outline.from_bytes(outline.to_bytes())
    n = of.released.n_slots // of.released.slots_per_record
    parts = spread(lists, of, model, [n // 3, n // 3 + 1])
    back = unlift.rounds.recover(over(parts), tmp_path / "released", model, outline)
    whole = unlift.recover(of, lists, seed=2, confidence=False)
    assert bytes_of(back, tmp_path) == bytes_of(whole, tmp_path)
    assert (np.array(back.status) == "ok").any()


@pytest.mark.parametrize("scheme", ["olc", "ppl", "plane"])
@pytest.mark.parametrize("solver", ["consensus", "joint"])
def test_a_model_of_a_file_is_that_of_its_lists(scheme: str, solver: str, tmp_path: pathlib.Path):
    of = hidden(scheme)
    lists = unlift.neighbors.oracle(of, 0.5, k=20)
    lists.save(tmp_path / "lists")
    model = unlift.prepare(of, lists, solver=solver).to_bytes()
    assert unlift.prepare(of, tmp_path / "lists", solver=solver).to_bytes() == model
    assert unlift.prepare(of, str(tmp_path / "lists"), solver=solver, memory_limit=10**6).to_bytes() == model
    learned = [unlift.rounds.prepare(of, *given) for given in ((lists,), (tmp_path / "lists",))]
    learned.append(unlift.rounds.prepare(of, tmp_path / "lists", memory_limit=10**6))
    assert len({outline.to_bytes() for _, outline in learned}) == 1
    assert solver == "consensus" or {one.to_bytes() for one, _ in learned} == {model}
    with pytest.raises(unlift.UnliftError, match="lists: expected the path of a file, with memory_limit"):
        unlift.prepare(of, lists, solver=solver, memory_limit=10**6)


def test_parts_may_have_others_between_them(tmp_path: pathlib.Path):
    """Rows of edges of any records together, as an engine may cut its files."""
    of = hidden("ppl")
    lists = unlift.neighbors.oracle(of, 0.4, k=20)
    model, outline = unlift.rounds.prepare(of, lists)
    (rows,) = spread(lists, of, model, [])
    table = pa.Table.from_batches(rows)
    is_third = (table["slot"].to_numpy() // 2) % 3
    of.released.save(tmp_path / "released")
    parts = [table.filter(pa.array(is_third == at)).to_batches() for at in range(3)]
    back = unlift.rounds.recover(over([*parts, []]), str(tmp_path / "released"), model, outline)
    whole = unlift.recover(of, lists, confidence=False)
    assert bytes_of(back, tmp_path) == bytes_of(whole, tmp_path)


def test_what_is_no_part_of_rounds_is_refused(tmp_path: pathlib.Path):
    of = hidden("olc", 80)
    lists = unlift.neighbors.oracle(of, 0.5, k=10)
    model, outline = unlift.rounds.prepare(of, lists)
    rows = unlift.parts.table(lists)
    entries = pa.Table.from_batches(unlift.rounds.entries(rows.to_batches()))

    def refused(own, named=entries, model=model) -> str:
        with pytest.raises(unlift.UnliftError) as error:
            list(unlift.rounds.edges(own.to_batches(), named.to_batches(), of, model))
        return str(error.value)

    assert refused(rows, model=unlift.prepare(of, lists)) == "solver of rounds: expected joint, found consensus"
    assert refused(rows.drop_columns("records")) == "batches: expected a column records, found slot"
    assert refused(pa.concat_tables([rows, rows])) == "slot: expected each once, found some twice"
    far = pa.table({"record": [80], "by": [0]})
    assert refused(rows, far) == "records: expected numbers from 0 to 79, found 0 to 80"
    assert "expected numbers from 0 to 79, found 80" in refused(rows, pa.table({"record": [1], "by": [80]}))
    assert refused(rows, pa.concat_tables([entries, entries])).startswith("named by: record 0: expected each slot once")
    parts = spread(lists, of, model, [40])

    def failing(run) -> str:
        with pytest.raises(unlift.UnliftError) as error:
            unlift.rounds.recover(run, of, model, outline)
        return str(error.value)

    def of_parts(parts: list[list]):
        return lambda work, columns: [batch for part in parts for batch in work(part)]

    # What is lost or comes twice is told, wherever it happens.
    assert failing(of_parts([*parts, parts[0]])) == "slot: expected numbers below 80, each once, found others"
    lost = failing(of_parts(parts[:1]))
    assert lost.startswith("edges of slot 40: expected ") and lost.endswith("found 0")
    half = spread(lists, of, model, [])
    few = list(unlift.rounds.edges(rows.to_batches(), entries.slice(0, 700).to_batches(), of, model))
    assert half and failing(of_parts([few])).startswith("edges of slot ")

    def forgetful(work, columns):
        found = [batch for part in parts for batch in work(part)]
        return found[:1] if work.step == "move" else found

    assert failing(forgetful) == "round: expected slot 40, found none"
    assert list(unlift.rounds.edges([], [], of, model)) == []
    with pytest.raises(unlift.UnliftError, match="outline: expected an outline of this version"):
        unlift.rounds.Outline.from_bytes(b"01234567")
    with pytest.raises(unlift.UnliftError, match="lists: expected Neighborhoods, or the path of their file, found int"):
        unlift.rounds.prepare(of, 3)
    with pytest.raises(unlift.UnliftError, match="missing: expected a released map, found No such file"):
        list(unlift.rounds.edges(rows.to_batches(), entries.to_batches(), tmp_path / "missing", model))


def test_rounds_go_on_where_they_were(tmp_path: pathlib.Path):
    of = hidden("ppl")
    lists = unlift.neighbors.oracle(of, 0.3, k=20)
    model, outline = unlift.rounds.prepare(of, lists)
    run, file = over(spread(lists, of, model, [50])), tmp_path / "rounds"
    of.released.save(tmp_path / "released")
    steps: list[str] = []

    def dies(work, columns):
        """In the second round of every run, so that each gets a round farther."""
        steps.append(work.step)
        if steps.count("move") == 2:
            steps.clear()
            raise KeyboardInterrupt
        return run(work, columns)

    for died in range(100):
        try:
            back = unlift.rounds.recover(dies, tmp_path / "released", model, outline, checkpoint=file)
            break
        except KeyboardInterrupt:
            assert file.stat().st_mode & 0o77 == 0
    assert died > 0 and not file.exists()

    def counts(work, columns):
        steps.append(work.step)
        return run(work, columns)

    # A round a run, and no round twice.
    steps.clear()
    unlift.rounds.recover(counts, tmp_path / "released", model, outline)
    assert died == steps.count("move") - 1
    whole = unlift.recover(of, lists, confidence=False)
    assert bytes_of(back, tmp_path) == bytes_of(whole, tmp_path)

    def failing(**others) -> str:
        given = {"over": run, "released": tmp_path / "released", "model": model, "outline": outline, "checkpoint": file}
        with pytest.raises(unlift.UnliftError) as error:
            unlift.rounds.recover(**(given | others))
        return str(error.value)

    file.write_bytes(b"a text of mine")
    assert failing() == f"{file}: lead: expected one of this version, found other bytes"
    assert file.read_bytes() == b"a text of mine"
    file.unlink()
    steps.clear()
    with pytest.raises(KeyboardInterrupt):
        unlift.rounds.recover(dies, tmp_path / "released", model, outline, checkpoint=file)
    other, others = unlift.rounds.prepare(of, lists, seed=3)
    found = failing(model=other, outline=others)
    assert found == f"{file}: lead: expected one with this model and outline, found one with others"
    assert "expected a file, found a folder" in failing(checkpoint=tmp_path)
