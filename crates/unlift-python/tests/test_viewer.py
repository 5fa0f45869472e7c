"""rerun opens the recordings of the viewer."""

import pathlib
import shutil
import subprocess
import sys

import numpy as np
import pytest

import unlift
from unlift import viewer

SIDE = 4.0
BOX = (np.full(3, 100.0), np.full(3, 100.0 + SIDE))


@pytest.fixture(scope="module")
def points() -> np.ndarray:
    return np.random.default_rng(1).uniform(100, 100 + SIDE, (300, 3))


def hidden_by(points: np.ndarray, scheme: str) -> unlift.Hidden:
    return unlift.obfuscate(unlift.Map(points, scale=1.0), scheme, seed=1)


@pytest.mark.parametrize("scheme", ["olc", "ppl", "ray"])
def test_lines_pass_through_their_points_and_end_at_the_box(points: np.ndarray, scheme: str):
    hidden = hidden_by(points, scheme)
    found = viewer.segments(hidden.released, BOX)
    assert found.shape == (len(hidden.released), 2, 3)
    assert np.all(found >= 100 - 1e-4) and np.all(found <= 100 + SIDE + 1e-4)
    hides = hidden.truth.positions[hidden.truth.hidden]
    a, b = np.repeat(found, hidden.released.slots_per_record, axis=0).swapaxes(0, 1)
    along = (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)
    away = hides - a - np.sum((hides - a) * along, axis=1, keepdims=True) * along
    assert np.max(np.linalg.norm(away, axis=1)) < 1e-4


def test_planes_hold_their_points(points: np.ndarray):
    hidden = hidden_by(points, "plane")
    found = viewer.segments(hidden.released, BOX).reshape(-1, 4, 3)
    axis = hidden.released.columns["axis"]
    hides = hidden.truth.positions[hidden.truth.hidden]
    for corners, axis, point in zip(found, axis, hides, strict=True):
        np.testing.assert_allclose(corners[:, axis], point[axis], atol=1e-4)
        others = [other for other in range(3) if other != axis]
        assert {tuple(corner) for corner in corners[:, others]} == {(x, y) for x in (100, 104) for y in (100, 104)}


def test_few_of_many_records_are_drawn_and_all_of_cp(points: np.ndarray):
    assert viewer.segments(hidden_by(points, "olc").released, BOX, 10).shape == (10, 2, 3)
    cp = hidden_by(points, "cp")
    crosses = viewer.segments(cp.released, BOX).reshape(-1, 3, 2, 3)
    np.testing.assert_allclose(crosses.mean(axis=(1, 2)), cp.released.columns["position"] + cp.released.origin, atol=1e-9)


def test_errors_are_those_of_evaluate(points: np.ndarray):
    for scheme in ("olc", "plane", "cp"):
        hidden = hidden_by(points, scheme)
        back = unlift.recover(hidden, unlift.neighbors.oracle(hidden, 0.5, k=20))
        within = 100 * np.mean(viewer.errors(hidden, back) <= 0.25)
        figures = unlift.evaluate(back, hidden, thresholds=[0.25])
        assert within == pytest.approx(figures["recovered_percent"]["0.25"], abs=0.01)


def test_points_of_another_map_are_refused(points: np.ndarray):
    hidden, other = hidden_by(points, "olc"), hidden_by(points[:200], "olc")
    back = unlift.recover(other, unlift.neighbors.oracle(other, 0.5, k=20))
    with pytest.raises(unlift.UnliftError, match="recovered: expected 300 points, those of hidden, found 200"):
        viewer.errors(hidden, back)


def test_rerun_opens_a_recording(points: np.ndarray, tmp_path: pathlib.Path):
    pytest.importorskip("rerun")
    hidden = hidden_by(points, "ray")
    lists = {ratio: unlift.neighbors.oracle(hidden, ratio, k=20) for ratio in (0.3, 0.5)}
    back = {ratio: unlift.recover(hidden, each) for ratio, each in lists.items()}
    out = tmp_path / "recovery.rrd"
    assert viewer.save_rerun(out, hidden, back, cameras=points[:3]) == out
    assert out.stat().st_mode & 0o777 == 0o600 and list(tmp_path.iterdir()) == [out]
    program = shutil.which("rerun", path=str(pathlib.Path(sys.executable).parent)) or "rerun"
    subprocess.run([program, "rrd", "verify", str(out)], check=True)
    told = subprocess.run([program, "rrd", "print", "-v", str(out)], check=True, capture_output=True, text=True).stdout
    for entity in ("/truth", "/released", "/recovered", "/cameras"):
        assert entity in told
    with pytest.raises(unlift.UnliftError, match="force=True"):
        viewer.save_rerun(out, hidden, back[0.3])
    viewer.save_rerun(out, hidden, back[0.3], force=True)


def test_without_rerun_it_is_said(points: np.ndarray, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch):
    hidden = hidden_by(points, "olc")
    back = unlift.recover(hidden, unlift.neighbors.oracle(hidden, 0.5, k=20))
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(unlift.UnliftError, match="pip install rerun-sdk"):
        viewer.save_rerun(tmp_path / "a.rrd", hidden, back)
    assert not list(tmp_path.iterdir())
