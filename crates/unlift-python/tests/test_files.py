"""Saved files: foreign files are not replaced."""

import numpy as np
import pytest

import unlift


@pytest.fixture(scope="module")
def parts():
    """Returns objects that can be saved, and their classes, by name."""
    points = np.random.default_rng(7).uniform(0, 4, (300, 3))
    hidden = unlift.obfuscate(unlift.Map(points, scale=1.0), "olc", seed=1)
    lists = unlift.neighbors.oracle(hidden, 0.7, k=20)
    back = unlift.recover(hidden, lists, solver="consensus")
    return {"released": hidden.released, "truth": hidden.truth, "lists": lists, "recovered": back}


@pytest.mark.parametrize("name", ["released", "truth", "lists", "recovered"])
def test_what_is_not_of_its_kind_stays(parts, name, tmp_path):
    part, path = parts[name], tmp_path / "x.npz"
    path.write_text("mine")
    with pytest.raises(unlift.UnliftError, match=r"x.npz: expected nothing, or .*, found another file"):
        part.save(path)
    assert path.read_text() == "mine"
    other = parts["truth" if name == "lists" else "lists"]
    other.save(path, force=True)
    kept = path.read_bytes()
    with pytest.raises(unlift.UnliftError, match="found another file"):
        part.save(path)
    assert path.read_bytes() == kept
    part.save(path, force=True)
    # A file of the same kind is replaced without `force`.
    part.save(path)
    with pytest.raises(unlift.UnliftError, match="expected a file, found a folder"):
        part.save(tmp_path, force=True)
    assert [entry.name for entry in tmp_path.iterdir()] == ["x.npz"]


def test_a_report_names_the_way_out_as_python_has_it(tmp_path):
    points = np.random.default_rng(7).uniform(0, 4, (300, 3))
    report = unlift.audit(unlift.Map(points, scale=1.0), ["olc"], inlier_ratios=[0.5], solvers=["consensus"])
    (tmp_path / "report.html").write_text("mine")
    with pytest.raises(unlift.UnliftError, match=r"^out: .*found another file"):
        report.save(tmp_path)
