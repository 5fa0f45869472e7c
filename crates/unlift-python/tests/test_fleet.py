"""Audits of many maps, as engines run them."""

import pathlib

import numpy as np
import pytest

import unlift

pa = pytest.importorskip("pyarrow")
OPTIONS = {"schemes": ["olc", "plane"], "inlier_ratios": [0.5, 0.3], "solvers": ["consensus"], "k": 20}


def maps(folder: pathlib.Path, n: int = 3) -> list[str]:
    paths = []
    for at in range(n):
        path = folder / f"map{at}.npy"
        np.save(path, np.random.default_rng(at).uniform(0, 4, (200 + 50 * at, 3)))
        paths.append(str(path))
    return paths


def rows(tasks: "pa.Table", batch: int = 2, **options) -> "pa.Table":
    found = list(unlift.fleet.audit_maps(tasks.to_batches(max_chunksize=batch), **{**OPTIONS, **options}))
    assert all(one.schema == unlift.fleet.schema() for one in found)
    return pa.Table.from_batches(found)


def test_rows_are_those_of_single_audits(tmp_path: pathlib.Path):
    paths = maps(tmp_path)
    found = rows(pa.table({"path": paths, "scale": [1.0, 1.0, None]})).to_pylist()
    assert [row["item"] for row in found] == [path for path in paths for _ in range(4)]
    for at, path in enumerate(paths):
        scale = 1.0 if at < 2 else None
        document = unlift.audit(unlift.read(path, scale=scale), **OPTIONS).document
        for row, alone in zip(found[4 * at :], document["results"], strict=False):
            for name in ("scheme", "inlier_ratio", "solver", "n_points", "delta", "unit", "median_error", "k"):
                assert row[name] == alone[name], name
            assert dict(row["recovered_percent"]) == alone["recovered_percent"]
            assert dict(row["blind_percent"]) == alone["blind_percent"]
            assert row["error"] is None


def test_a_map_that_cannot_be_read_is_one_row(tmp_path: pathlib.Path):
    (tmp_path / "broken.npy").write_bytes(b"no map")
    paths = [*maps(tmp_path, 1), str(tmp_path / "missing.ply"), str(tmp_path / "broken.npy"), None]
    found = rows(pa.table({"path": paths})).to_pylist()
    assert [row["error"] is None for row in found] == [True] * 4 + [False] * 3
    assert found[4]["error"].endswith("missing.ply: expected a file or folder, found nothing")
    assert found[6]["error"] == "path: expected a file or folder, found null"


def images(n: int = 4) -> "pa.Table":
    random = np.random.default_rng(1)
    found = []
    for at in range(n):
        count = 80 + 10 * at
        keypoints = random.uniform(0, (319, 239), (count, 2)).astype(np.float32)
        descriptors = random.integers(0, 256, (count, 16), dtype=np.uint8)
        found.append(
            {
                "name": f"{at}.jpg",
                "keypoints": keypoints.reshape(-1).tolist(),
                "descriptors": descriptors.tobytes(),
                "width": 320,
                "height": 240,
            }
        )
    return pa.Table.from_pylist(found)


OF_IMAGES = {"schemes": ["lines2d"], "neighbors": ["oracle", "similarity"], "inlier_ratios": [0.5], "k": 10}


def test_rows_of_images_are_those_of_single_audits():
    tasks = images()
    found = pa.Table.from_batches(unlift.fleet.audit_images(tasks.to_batches(max_chunksize=3), **OF_IMAGES))
    assert found.equals(pa.Table.from_batches(unlift.fleet.audit_images(tasks.to_batches(), threads=1, **OF_IMAGES)))
    by_item: dict[str, list[dict]] = {}
    for row in found.to_pylist():
        by_item.setdefault(row["item"], []).append(row)
    assert list(by_item) == [f"{at}.jpg" for at in range(4)]
    for image in tasks.to_pylist():
        keypoints = np.array(image["keypoints"], dtype=np.float32).reshape(-1, 2)
        descriptors = np.frombuffer(image["descriptors"], dtype=np.uint8).reshape(len(keypoints), -1)
        features = {"keypoints": keypoints, "descriptors": descriptors, "width": 320, "height": 240}
        results = unlift.audit_images({image["name"]: features}, **OF_IMAGES).document["results"]
        assert len(by_item[image["name"]]) == len(results) > 0
        for row, alone in zip(by_item[image["name"]], results, strict=True):
            assert (row["neighbors"], row["solver"], row["n_points"]) == (alone["neighbors"], alone["solver"], len(keypoints))
            assert dict(row["recovered_percent"]) == alone["recovered_percent"]


def test_an_image_that_cannot_be_used_is_one_row():
    tasks = images(4).to_pylist()
    tasks[1]["keypoints"] = tasks[1]["keypoints"][:-1]
    tasks[2]["descriptors"] = tasks[2]["descriptors"][:-1]
    tasks[3]["keypoints"][0] = float("nan")
    found = pa.Table.from_batches(unlift.fleet.audit_images(pa.Table.from_pylist(tasks).to_batches(), **OF_IMAGES)).to_pylist()
    errors = {row["item"]: row["error"] for row in found}
    assert errors["0.jpg"] is None
    assert errors["1.jpg"] == "1.jpg: keypoints: expected x and y in turns, found 179 numbers"
    assert errors["2.jpg"] == "2.jpg: descriptors: expected a multiple of 100 values, found 1599"
    assert errors["3.jpg"].startswith("images: image 3.jpg: point 0: ")
    with pytest.raises(unlift.UnliftError, match="expected a column keypoints, found name"):
        list(unlift.fleet.audit_images(pa.table({"name": ["a"]}).to_batches()))
