"""Valid arguments are accepted, others refused in one line."""

import numpy as np
import pytest

import unlift


@pytest.fixture(scope="module")
def points():
    return np.random.default_rng(7).uniform(0, 4, (400, 3))


@pytest.fixture(scope="module")
def hidden(points):
    return unlift.obfuscate(unlift.Map(points, scale=1.0), "olc", seed=1)


def cheap(points, schemes=("olc",), *more, **options):
    options = {"inlier_ratios": [0.5], "solvers": ["consensus"], "k": 20} | options
    return unlift.audit(unlift.Map(points, scale=1.0), schemes, *more, **options)


@pytest.mark.parametrize("dtype", ["u1", "i1", "u2", "u4", "i8", "u8"])
def test_records_are_those_of_the_array_in_every_kind_of_number(points, dtype):
    # As many records as the type can number.
    n = min(256, int(np.iinfo(dtype).max) + 1)
    some = unlift.obfuscate(unlift.Map(points[:n], scale=1.0), "olc", seed=1)
    rows = ((np.arange(n)[:, None] + [1, 2, 3]) % n).astype(dtype)
    lists = unlift.Neighborhoods(some, rows, np.tile([3, 2, 1], (n, 1)))
    assert rows.max() == n - 1
    # Lists are stored in the order of records.
    np.testing.assert_array_equal(lists.records, np.sort(rows, 1).ravel())
    np.testing.assert_array_equal(lists.offsets, 3 * np.arange(n + 1))
    # Sequences of rows are accepted as arrays.
    assert unlift.Neighborhoods(some, rows.tolist(), [[3.0, 2.0, 1.0]] * n).scores[:3].tolist() == [3, 2, 1]
    if dtype[0] == "i":
        rows[:, 1] = -1
        np.testing.assert_array_equal(unlift.Neighborhoods(some, rows).records, np.sort(rows[:, [0, 2]], 1).ravel())


def test_lists_of_paired_lines_may_name_slots(points, tmp_path):
    paired = unlift.obfuscate(unlift.Map(points[:60], scale=1.0), "ppl", seed=1)
    slots = (np.arange(60)[:, None] // 2 * 2 + [2, 5, 8]) % 60
    slots[0, 2] = -1
    lists = unlift.Neighborhoods(paired, np.where(slots < 0, -1, slots // 2), slots=slots)
    np.testing.assert_array_equal(lists.slots // 2, lists.records)
    lists.save(tmp_path / "lists.npz")
    read = unlift.Neighborhoods.read(tmp_path / "lists.npz", paired)
    np.testing.assert_array_equal(read.slots, lists.slots)
    assert unlift.Neighborhoods(paired, slots // 2).slots is None
    with pytest.raises(ValueError, match="neighborhood of slot 0: expected a slot of record 1, found 4"):
        unlift.Neighborhoods(paired, slots // 2, slots=np.where(slots == 2, 4, slots))


def broken(points):
    return unlift.Lines(points + 1.0, np.tile([0.0, 0.0, 1.0], (len(points), 1)))


def shuffled(points, random):
    return unlift.Lines(random.permutation(points), random.normal(size=points.shape))


def masked(points):
    return np.ma.masked_array(points, mask=points > 3.9)


def lacking(points):
    points = points.copy()
    points[17, 1] = np.nan
    return points


@unlift.scheme(name="olc")
def ours(points):
    return unlift.Lines(points, points)


def twice(points):
    lists = unlift.source(lambda released: released, name="near")
    return cheap(points, ["olc"], [lists, unlift.source(lambda released: 0, name="near")])


@pytest.mark.parametrize(
    "wrong, said",
    [
        (lambda p, h: unlift.Neighborhoods(h, np.full((400, 2), 2**64 - 1, "u8")), "records: expected numbers from -1 to 399, found 18446744073709551615"),
        (lambda p, h: unlift.Neighborhoods(h, [[1], [2, 3]]), "records: expected an array of whole numbers, found setting an array"),
        (lambda p, h: unlift.Neighborhoods(h, np.zeros((400, 2), int), [1.0]), r"scores: expected the shape of the records, \(400, 2\), found \(1,\)"),
        (lambda p, h: unlift.Map(masked(p), scale=1.0), "positions: expected an array of numbers without a mask .*, found a masked array"),
        (lambda p, h: unlift.Map(lacking(p), scale=1.0), "point 17: expected finite coordinates"),
        (lambda p, h: cheap(p, thresholds=[0.1, "0.10"]), "thresholds: expected each once, found 0.10 again"),
        (lambda p, h: cheap(p, thresholds=[]), "thresholds: expected at least one, found none"),
        (lambda p, h: cheap(p, [ours]), "schemes: expected functions with a name that unlift does not use, found olc"),
        (lambda p, h: twice(p), "neighbors: expected each name once, found near"),
        (lambda p, h: unlift.obfuscate(unlift.Map(p, scale=1.0), shuffled, seed=1), "shuffled: truth: expected points nearer to their own records"),
        (lambda p, h: unlift.Map(p[:, :2]), r"positions: expected an array of shape \(n, 3\), found \(400, 2\)"),
        (lambda p, h: unlift.Map(p, p[:5].astype("f4"), scale=1), "descriptors: expected 400 rows, one per point, found 5"),
        (lambda p, h: unlift.Map(p, np.zeros((400, 4), int), scale=1), "descriptors: expected an array of uint8 or floats, found one of int64"),
        (lambda p, h: unlift.Map(p, scale=-1), "scale: expected a number above 0, found -1"),
        (lambda p, h: unlift.Map(p[:9], scale=1), "points: expected at least 51"),
        (lambda p, h: unlift.read("no such map"), "no such map: expected"),
        (lambda p, h: unlift.obfuscate(unlift.Map(p), "cp2d"), "scheme: expected one that is defined on maps, found cp2d"),
        (lambda p, h: unlift.neighbors.overlap(h), "descriptors: expected some"),
    ],
)
def test_what_is_wrong_is_said_in_a_line(points, hidden, wrong, said):
    with pytest.raises(unlift.UnliftError, match=said) as error:
        wrong(points, hidden)
    assert "\n" not in str(error.value)


def test_choices_count_once_as_on_the_command_line(points):
    rows = cheap(
        points, ["olc"], ["oracle", "oracle"], inlier_ratios=[0.5, 0.5], oracle_noise=["near", "near"], solvers=["consensus"] * 2
    ).rows
    assert len(rows) == 1


def test_a_broken_law_is_told_by_its_exception_alone(capfd):
    sizes = set()

    @unlift.scheme
    def level(points, random):
        sizes.add(len(points))
        if len(points) < 2:
            raise ValueError("too few")
        return unlift.Lines(points, np.column_stack([random.normal(size=(len(points), 2)), np.zeros(len(points))]))

    unlift.testing.check_scheme(level)
    assert sizes == {0, 1, 2, 3, 7, 120, 200, 300, 301, 600, 700}
    with pytest.raises(AssertionError, match="broken") as error:
        unlift.testing.check_scheme(broken)
    assert error.value.__cause__ is None
    assert capfd.readouterr().err == ""

    @unlift.scheme
    def refuses(points):
        if len(points) < 600:
            raise ValueError(f"not of {len(points)}")
        return level(points)

    # The cause is the exception that failed the check, not an earlier refusal.
    with pytest.raises(AssertionError, match="not of 200") as error:
        unlift.testing.check_scheme(refuses)
    assert str(error.value.__cause__) == "not of 200"
