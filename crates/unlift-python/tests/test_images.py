"""Audits of images: the results of the command line, schemes and sources that are functions, one-line errors."""

import json
import pathlib
import sqlite3
import subprocess

import numpy as np
import pytest

import unlift
from conftest import PROGRAM, needs_program

FIXTURES = pathlib.Path(__file__).parents[2] / "unlift-io" / "tests" / "data"
QUICK = {"inlier_ratios": [0.5], "solvers": ["consensus"], "k": 10}


def features(seed, n=90, size=(640, 480)):
    """Returns keypoints at multiples of 0.5, exact in single precision, and SIFT that varies slowly with the position."""
    random = np.random.default_rng(seed)
    keypoints = random.integers(0, 2 * (np.array(size) - 1), (n, 2)) / 2
    waves = np.sin(keypoints / 90 @ random.uniform(-2, 2, (2, 128)) + random.uniform(0, 6, 128))
    return {
        "keypoints": keypoints,
        "descriptors": (60 + 55 * waves).astype(np.uint8),
        "width": size[0],
        "height": size[1],
    }


@pytest.fixture
def images():
    sizes = {"b.jpg": (640, 480), "sub/c.jpg": (320, 400), "Z.png": (640, 480), "a.jpg": (800, 600)}
    return {name: features(at, 60 + 20 * at, size) for at, (name, size) in enumerate(sizes.items())}


def quick(images, *more, **options):
    return unlift.audit_images(images, *more, **(QUICK | options))


def figures(document):
    """Returns what does not depend on the time, the machine and the file."""
    keep = ["schema", "seed", "options", "results", "not_audited", "notes", "break_even", "gates", "images"]
    return json.dumps({key: document.get(key) for key in keep}, sort_keys=True)


def database(path, images):
    """Writes the images to a COLMAP database, where the middle of the first pixel is (0.5, 0.5)."""
    with sqlite3.connect(path) as base:
        base.executescript("""
            CREATE TABLE cameras (camera_id INTEGER PRIMARY KEY, model INTEGER, width INTEGER, height INTEGER);
            CREATE TABLE images (image_id INTEGER PRIMARY KEY, name TEXT UNIQUE, camera_id INTEGER);
            CREATE TABLE keypoints (image_id INTEGER PRIMARY KEY, rows INTEGER, cols INTEGER, data BLOB);
            CREATE TABLE descriptors (image_id INTEGER PRIMARY KEY, rows INTEGER, cols INTEGER, data BLOB);
        """)
        for at, (name, one) in enumerate(images.items(), 1):
            places, bytes_ = (one["keypoints"] + 0.5).astype("<f4"), one["descriptors"]
            base.execute("INSERT INTO cameras VALUES (?, 0, ?, ?)", (at, one["width"], one["height"]))
            base.execute("INSERT INTO images VALUES (?, ?, ?)", (at, name, at))
            base.execute("INSERT INTO keypoints VALUES (?, ?, 2, ?)", (at, len(places), places.tobytes()))
            base.execute("INSERT INTO descriptors VALUES (?, ?, 128, ?)", (at, len(bytes_), bytes_.tobytes()))
    base.close()


def program(line, folder, code=0):
    done = subprocess.run([PROGRAM, *line.split()], cwd=folder, capture_output=True, text=True)
    assert done.returncode == code, done.stderr
    return json.loads((folder / "cli" / "audit.json").read_text())


@needs_program
def test_figures_are_those_of_the_command_line(images, tmp_path):
    database(tmp_path / "database.db", images)
    line = "audit images database.db --schemes lines2d,dcl2d --neighbors oracle --neighbors overlap --inlier-ratios 0.5,0.3"
    line += " --k 10 --seed 7 --repeats 2 --gate all@0.5:10<=1 --quiet --out cli"
    cli = program(line, tmp_path, code=1)
    options = {"inlier_ratios": [0.5, 0.3], "k": 10, "seed": 7, "repeats": 2, "gates": "all@0.5:10<=1"}
    given = (["lines2d", "dcl2d"], ["oracle", "overlap"])
    of_arrays = unlift.audit_images(images, *given, **options)
    assert figures(of_arrays.document) == figures(cli) and not of_arrays.passed
    assert [one["name"] for one in cli["images"]] == ["Z.png", "a.jpg", "b.jpg", "sub/c.jpg"]
    assert of_arrays.document["input"]["path"] is None and of_arrays.document["input"]["sha256"] != cli["input"]["sha256"]
    # In another order, with another number of threads.
    turned = dict(reversed(images.items()))
    assert figures(unlift.audit_images(turned, *given, **options, threads=1).document) == figures(cli)
    of_file = unlift.audit_images(tmp_path / "database.db", *given, **options)
    assert of_file.document["input"]["sha256"] == cli["input"]["sha256"]
    assert figures(of_file.document) == figures(cli)


def test_a_report_of_images_is_like_one_of_maps(images, tmp_path):
    report = quick(images, "lines2d")
    assert report.rows["scheme"] == ["lines2d"] and report.rows["unit"] == ["px"] and report.passed
    page = report.save(tmp_path / "out")
    text = page.read_text()
    assert 'id="picture-graph"' in text and "sub/c.jpg" in text
    assert json.loads((tmp_path / "out" / "audit.json").read_text())["images"] == report.document["images"]
    safe = report.html(share_safe=True)
    assert 'id="picture-graph"' not in safe and "sub/c.jpg" not in safe
    assert report._repr_html_().startswith("<iframe srcdoc=") and "lines2d" in str(report)
    pyarrow = pytest.importorskip("pyarrow")
    assert pyarrow.table(report.rows).column("recovered_percent_within_10").to_pylist() == report.rows["recovered_percent_within_10"]


def test_images_are_looked_up_when_their_turn_comes(images):
    class Disk:
        asked = []

        def keys(self):
            return [f"{at:03}" for at in range(40)]

        def __getitem__(self, name):
            self.asked.append(name)
            return features(int(name), 40)

    disk = Disk()
    report = quick(disk, "lines2d", max_images=30, threads=1)
    assert report.document["input"]["images"] == {"found": 40, "used": 30, "unusable": 0, "too_small": 0}
    once = disk.asked[:30]
    assert once == sorted(set(once)) and set(disk.asked[30:]) < set(once)
    assert report.document["results"][0]["n_points"] == 30 * 40


def test_a_scheme_and_a_source_are_functions(images):
    @unlift.scheme
    def level(keypoints, random):
        angle = random.uniform(0, np.pi, len(keypoints))
        return unlift.Lines(keypoints, np.stack([np.cos(angle), np.sin(angle)], 1))

    @unlift.source(needs="nothing", k=5)
    def meeting(released):
        # The middle of the first pixel is (0, 0).
        assert released.bounds[0].tolist() == [-0.5, -0.5] and released.unit == "px"
        np.testing.assert_array_equal(released.origin, released.bounds.mean(0))
        foot = released.columns["foot"]
        assert foot.shape == (len(released), 2)
        apart = np.linalg.norm(foot[:, None] - foot[None], axis=2)
        return np.argsort(apart, axis=1)[:, 1:6]

    unlift.testing.check_scheme(level, images=True)
    report = quick(images, ["lines2d", level], ["oracle", meeting])
    assert report.rows["scheme"] == ["lines2d"] * 2 + ["level"] * 2
    assert report.rows["neighbors"] == ["oracle", "meeting"] * 2 and report.rows["k"] == [10, 5] * 2
    of_ours, of_level = (report.rows["recovered_percent_within_25"][at] for at in (0, 2))
    assert of_level == pytest.approx(of_ours, abs=15) and of_level > report.rows["blind_percent_within_25"][2]
    assert figures(quick(images, ["lines2d", level], ["oracle", meeting]).document) == figures(report.document)


def failing(keypoints):
    raise KeyError("mine")


def with_b(**change):
    def changed(images):
        return images | {"b.jpg": {key: value for key, value in (images["b.jpg"] | change).items() if value is not ...}}

    return changed


@pytest.mark.parametrize(
    "wrong, said",
    [
        (lambda i: quick(with_b(keypoints=np.ones((5, 3)))(i)), r'images\["b.jpg"\]\["keypoints"\]: expected an array of shape \(n, 2\), found \(5, 3\)'),
        (lambda i: quick(with_b(keypoints=...)(i)), r'images\["b.jpg"\]: expected keypoints, width, height, found no keypoints'),
        (lambda i: quick(with_b(height=0.5)(i)), r'images\["b.jpg"\]\["height"\]: expected a whole number of pixels above 0, found 0.5'),
        (lambda i: quick(with_b(descriptors=i["b.jpg"]["descriptors"][:7])(i)), r'images\["b.jpg"\]\["descriptors"\]: expected 60 rows, one per keypoint, found 7'),
        (lambda i: quick(with_b(descriptor=1)(i)), r'images\["b.jpg"\]: expected only keypoints, width, height, descriptors, found descriptor$'),
        (lambda i: quick(with_b(descriptors=None)(i), "lines2d", "overlap", inlier_ratios=None), "images: image b.jpg: expected descriptors, found none"),
        (lambda i: quick(with_b(keypoints=[[np.nan, 3.0]] * 60)(i)), "images: image b.jpg.*finite"),
        (lambda i: quick({"a": 3}), r"""images\["a"\]: expected a dict of arrays, found <class 'int'>"""),
        (lambda i: quick(7), "images: expected a path, or a dict of names to arrays, found <class 'int'>"),
        (lambda i: quick({}), "images: expected at least one, found none"),
        (lambda i: quick("no such file"), "no such file: expected a file or folder, found nothing"),
        (lambda i: quick(i, "olc"), "scheme: expected one that is defined on images, found olc"),
        (lambda i: quick(i, neighbors="geometric", inlier_ratios=None), "expected one that is defined in 2 dimensions, found geometric"),
        (lambda i: quick(FIXTURES / "features-latest.h5", max_features=5), "^max_features: expected with a folder of photos, found a file"),
        (lambda i: quick(i, neighbors="overlap"), "inlier_ratios: expected with neighbors oracle, found only overlap"),
        (lambda i: quick(i, gates=["olc:10<=3"]), "olc"),
    ],
)
def test_what_is_wrong_is_said_in_a_line(images, wrong, said):
    with pytest.raises(unlift.UnliftError, match=said) as error:
        wrong(images)
    assert "\n" not in str(error.value)


def test_what_functions_and_mappings_raise_is_the_cause(images):
    with pytest.raises(unlift.UnliftError, match="failing.*KeyError") as error:
        quick(images, failing)
    assert isinstance(error.value.__cause__, KeyError)

    class Disk(dict):
        def __getitem__(self, name):
            raise OSError(f"no disk for {name}")

    with pytest.raises(unlift.UnliftError, match=r'images\["Z.png"\]: expected arrays, found OSError: no disk for Z.png') as error:
        quick(Disk(images), threads=1)
    assert isinstance(error.value.__cause__, OSError)


def test_images_of_a_file_that_cannot_be_used_are_told_and_left_out(images, tmp_path):
    path = tmp_path / "database.db"
    database(path, images)
    whole = quick(path, "lines2d", gates="lines2d:oracle:10<=100")
    assert whole.passed
    with sqlite3.connect(path) as base:
        base.execute("DELETE FROM keypoints WHERE image_id = 1")
    base.close()
    with pytest.warns(UserWarning, match="b.jpg.*expected keypoints, found none"):
        some = quick(path, "lines2d", gates="lines2d:oracle:10<=100")
    assert some.document["input"]["images"]["unusable"] == 1 and not some.passed
    assert [one["passed"] for one in some.document["gates"]] == [True]
    rest = {name: one for name, one in images.items() if name != "b.jpg"}
    assert some.document["results"] == quick(rest, "lines2d").document["results"]
    with sqlite3.connect(path) as base:
        base.execute("DELETE FROM keypoints")
    base.close()
    with pytest.raises(unlift.UnliftError, match="expected 4 images that can be used, found 0: .*keypoints"):
        quick(path)
