"""Other programs open what the command line writes."""

import pathlib
import subprocess

import numpy as np
import pytest

import unlift
from conftest import PROGRAM, needs_program


@needs_program
def test_pycolmap_opens_a_model(tmp_path: pathlib.Path):
    pycolmap = pytest.importorskip("pycolmap")
    points = np.random.default_rng(1).uniform(0, 4, (300, 3))
    hidden = unlift.obfuscate(unlift.Map(points, scale=0.5), "olc", seed=1)
    hidden.truth.save(tmp_path / "truth.npz")
    # A model with a rotated camera, for --cameras.
    (tmp_path / "from").mkdir()
    (tmp_path / "from/cameras.txt").write_text("1 SIMPLE_RADIAL 640 480 500 320 240 0.01\n")
    (tmp_path / "from/images.txt").write_text("4 0.6 0.48 -0.64 0 1 2 3 1 seq/a.png\n\n")
    (tmp_path / "from/points3D.txt").write_text("1 0 0 0 0 0 0 0\n")
    line = [PROGRAM, "export", "truth.npz", "--scale", "0.5", "--cameras", "from", "--out", "model"]
    subprocess.run(line, cwd=tmp_path, check=True)
    model, source = (pycolmap.Reconstruction(str(tmp_path / name)) for name in ("model", "from"))
    assert (model.num_points3D(), model.num_cameras(), model.num_images()) == (300, 1, 1)
    found = np.array([model.points3D[at + 1].xyz for at in range(300)])
    np.testing.assert_allclose(found, points, atol=1e-9)
    pose, expected = (each.images[4].cam_from_world() for each in (model, source))
    np.testing.assert_allclose(pose.matrix(), expected.matrix(), atol=1e-12)
    assert model.images[4].name == "seq/a.png"
    np.testing.assert_array_equal(model.cameras[1].params, source.cameras[1].params)
