"""Whether maps can be made of the sequences among the training photos: `projections.py PHOTOS SOURCE..`, which needs pycolmap.

PHOTOS is a folder with SOURCES.csv; each block of four photos or more of a source is reconstructed alone (SIFT, defaults; one camera for
frames of a video, sequential matching above 30 photos). Prints how many photos are registered, block by block.
"""

import collections
import csv
import pathlib
import shutil
import sys
import tempfile

import pycolmap


def registered(paths: list[pathlib.Path], one_camera: bool) -> list[tuple[int, int]]:
    """Photos and points of every model that comes of the photos at `paths`."""
    with tempfile.TemporaryDirectory() as folder:
        at = pathlib.Path(folder)
        (at / "images").mkdir()
        (at / "models").mkdir()
        for path in paths:
            shutil.copy(path, at / "images" / path.name)
        cameras = pycolmap.CameraMode.SINGLE if one_camera else pycolmap.CameraMode.PER_IMAGE
        pycolmap.extract_features(at / "db", at / "images", camera_mode=cameras)
        match = pycolmap.match_exhaustive if len(paths) <= 30 else pycolmap.match_sequential
        match(at / "db")
        models = pycolmap.incremental_mapping(at / "db", at / "images", at / "models")
        return [(model.num_reg_images(), model.num_points3D()) for model in models.values()]


def main():
    photos, sources = pathlib.Path(sys.argv[1]), sys.argv[2:]
    blocks = collections.defaultdict(list)
    with open(photos / "SOURCES.csv", newline="") as file:
        for row in csv.DictReader(file):
            if row["source"] in sources:
                blocks[row["source"], row["block"]].append(photos / row["file"])
    total = found = 0
    for (source, block), paths in sorted(blocks.items()):
        if len(paths) < 4:
            continue
        models = registered(paths, source != "houses")
        total, found = total + len(paths), found + sum(n for n, _ in models)
        print(f"{source} {block}: {len(paths)} photos, models {models}; so far {found} of {total}", flush=True)


if __name__ == "__main__":
    main()
