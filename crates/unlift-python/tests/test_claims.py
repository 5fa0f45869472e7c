"""`docs/claims.py` on a miniature of 7-Scenes: the paper's figures beside those of an audit."""

import csv
import json
import math
import pathlib
import shutil
import subprocess
import sys

import numpy as np
import pytest
from conftest import PROGRAM, needs_program

ROOT = pathlib.Path(__file__).parents[3]
PHOTOS = sorted((ROOT / "crates" / "unlift-cli" / "src" / "demo" / "photos").glob("*.jpg"))


def scene(folder):
    """Creates the scene chess with five frames, and a map that is half as large."""
    sequence, model = folder / "chess" / "seq-03", folder / "7scenes_sfm_triangulated" / "chess" / "triangulated"
    sequence.mkdir(parents=True)
    model.mkdir(parents=True)
    (folder / "chess" / "TestSplit.txt").write_text("sequence3\r\n")
    (folder / "chess" / "TrainSplit.txt").write_text("sequence1\r\n")
    images = ""
    for at in range(5):
        center = [0.5 * at, 0.1 * at * at, 1.5 + 0.2 * math.sin(3 * at)]
        x, y, z = center
        # Depth images differ from photos only by name.
        for kind in ("color", "depth"):
            shutil.copy(PHOTOS[at % len(PHOTOS)], sequence / f"frame-{at:06}.{kind}.png")
        (sequence / f"frame-{at:06}.pose.txt").write_text(f"1 0 0 {x}\n0 1 0 {y}\n0 0 1 {z}\n0 0 0 1\n")
        images += f"{at + 1} 1 0 0 0 {-x / 2} {-y / 2} {-z / 2} 1 seq-03/frame-{at:06}.color.png\n\n"
    points = np.random.default_rng(1).uniform(0, [2.5, 2, 1.3], (200, 3))
    track = " ".join(f"{image} 0" for image in range(1, 6))
    rows = [f"{at + 1} {x} {y} {z} 0 0 0 0.5 {track}\n" for at, (x, y, z) in enumerate(points)]
    (model / "cameras.txt").write_text("1 SIMPLE_PINHOLE 128 96 100 64 48\n")
    (model / "images.txt").write_text(images)
    (model / "points3D.txt").write_text("".join(rows))


@needs_program
def test_the_papers_figures_stand_beside_ours(tmp_path):
    def claims(*words):
        command = [sys.executable, ROOT / "docs" / "claims.py", *words, "--unlift", PROGRAM]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)

    def audit(name):
        return json.loads((tmp_path / "o" / "chess" / name / "audit.json").read_text())

    def strongest(document, scheme, threshold):
        rows = [row for row in document["results"] if row["scheme"] == scheme and row["inlier_ratio"] == 0.5]
        return max(row["recovered_percent"][threshold] for row in rows)

    scene(tmp_path / "d")
    done = claims("d", "--table", "1,7", "--images", "2", "--out", "claims.csv", "--work", "o")
    assert "not here: fire, heads, office, pumpkin, redkitchen, stairs: " in done.stderr
    of_map, of_images = audit("map-sift-oracle"), audit("images-sift-oracle")
    assert of_map["input"]["scale_m_per_unit"] == 2.0 and of_images["input"]["images"]["used"] == 2
    text = (tmp_path / "claims.csv").read_text()
    for begin, expected in [
        ("7,7-scenes 3D,sift,cp,oracle 0.5,% within 0.1 m,67.7,", strongest(of_map, "cp", "0.1")),
        ("1,7-scenes 2D,sift,lines2d,oracle 0.5,% within 10 px,", strongest(of_images, "lines2d", "10")),
    ]:
        [line] = [line for line in text.splitlines() if line.startswith(begin)]
        *_, ours, _, n_scenes = next(csv.reader([line]))
        assert float(ours) == pytest.approx(expected, abs=0.1) and float(n_scenes) == 1, line
    assert len(done.stdout.splitlines()) == len(text.splitlines())
    assert "table 13: density attacks on maps: 12-scenes; 18 figures" in claims("--list").stdout
    assert "expected folders of scenes in empty, or --scale" in claims("empty").stderr
