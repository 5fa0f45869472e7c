"""The pipeline step by step, compared with NumPy."""

import numpy as np
import pytest

import unlift


@pytest.fixture
def described(points):
    random = np.random.default_rng(8)
    waves = np.sin(points @ random.uniform(-2, 2, (3, 128)) + random.uniform(0, 6, 128))
    return unlift.Map(points, (60 + 55 * waves).astype(np.uint8), scale=1.0)


def test_a_map_is_what_it_was_made_of(points):
    for given in [points, points.astype(np.float32), points.tolist(), np.asfortranarray(points)]:
        m = unlift.Map(given, scale=1.0)
        assert len(m) == 600 and m.unit == "m" and m.descriptors is None
        np.testing.assert_allclose(m.positions, points, rtol=1e-6)
    doubled = unlift.Map(points, scale=2.0)
    np.testing.assert_array_equal(doubled.positions, 2 * points)
    without = unlift.Map(points)
    assert without.unit == "kth_neighbor"
    distances = np.sort(np.linalg.norm(points[:, None] - points[None], axis=2), axis=1)
    assert without.unit_in_map_units == pytest.approx(np.median(distances[:, 50]), rel=1e-3)
    some = unlift.Map(points, scale=1.0, max_points=100)
    np.testing.assert_array_equal(some.positions, points[some.rows])


def test_records_go_through_the_points_they_hide(points):
    m = unlift.Map(points, scale=1.0)
    hidden = unlift.obfuscate(m, "olc", seed=3)
    released, truth = hidden.released, hidden.truth
    assert (released.family, released.slots_per_record, len(released)) == ("lines", 1, 600)
    columns = released.columns
    local = points[truth.hidden] - released.origin
    along = columns["direction"]
    off = local - columns["foot"] - along * np.sum((local - columns["foot"]) * along, 1, keepdims=True)
    assert np.linalg.norm(off, axis=1).max() < 1e-5
    assert truth.dropped == {}
    again = unlift.obfuscate(m, "olc", seed=3).released
    assert again.fingerprint == released.fingerprint
    assert unlift.obfuscate(m, "olc").released.fingerprint != released.fingerprint


def test_what_comes_back_is_where_it_was(described, tmp_path):
    hidden = unlift.obfuscate(described, "ppl", seed=1)
    lists = unlift.neighbors.overlap(hidden)
    back = unlift.recover(hidden, lists)
    figures = unlift.evaluate(back, hidden)
    assert figures["n_points"] == 600 and figures["blind_percent"]["0.25"] < 10
    assert figures["recovered_percent"]["0.25"] > 50
    assert back.status.count("ok") == np.isfinite(back.positions).all(1).sum()
    # Files equal those of the command line.
    for name, part in [("r", hidden.released), ("t", hidden.truth), ("l", lists), ("b", back)]:
        part.save(tmp_path / f"{name}.npz")
    read = unlift.Released.read(tmp_path / "r.npz")
    assert read.fingerprint == hidden.released.fingerprint
    lists = unlift.Neighborhoods.read(tmp_path / "l.npz", read)
    again = unlift.recover(read, lists)
    np.testing.assert_array_equal(again.positions, back.positions)
    truth = unlift.Truth.read(tmp_path / "t.npz")
    kept = unlift.Recovered.read(tmp_path / "b.npz")
    alone = unlift.evaluate(kept, truth)
    assert alone["recovered_percent"] == figures["recovered_percent"]
    assert "blind_percent" not in alone


def test_errors_are_those_of_numpy(described):
    hidden = unlift.obfuscate(described, "olc", seed=1)
    back = unlift.recover(hidden, unlift.neighbors.oracle(hidden, 0.7, k=30))
    errors = np.linalg.norm(back.positions - hidden.truth.positions[hidden.truth.hidden], axis=1)
    found = unlift.evaluate(back, hidden, thresholds=["0.05", 0.2])["recovered_percent"]
    for label, percent in found.items():
        assert percent == pytest.approx(100 * np.mean(errors <= float(label)), abs=1e-3)
    sure = back.probability_within(0.1)
    assert sure is None or (sure.shape == (600,) and 0 <= sure.min() <= sure.max() <= 1)
