"""Packs photos for a machine that cannot reach them: `pack.py OUT PHOTOS.. [--mib 16] [--quality 40]`.

PHOTOS are folders with SOURCES.csv, which names the split of each photo. OUT gets `pack-00.tar`, `pack-01.tar`, .. with WebP files
in the folders `train` and `val`. Training photos are shuffled, so that each pack is a fair sample. `--look FOLDER` adds photos of
a scene that is measured but not trained on: unchanged, in the folder `look` of the first packs.
WebP at quality 40 keeps 33.8 dB at 640 pixels and 36.3 dB at half that size, which the network paints (30 photos).
"""

import argparse
import csv
import io
import pathlib
import random
import tarfile

from PIL import Image


def webp(path: pathlib.Path, quality: int) -> bytes:
    out = io.BytesIO()
    with Image.open(path) as photo:
        photo.convert("RGB").save(out, "WEBP", quality=quality, method=4)
    return out.getvalue()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("photos", type=pathlib.Path, nargs="+")
    parser.add_argument("--mib", type=float, default=16, help="largest size of a pack")
    parser.add_argument("--quality", type=int, default=40, help="of WebP")
    parser.add_argument("--most", type=int, help="largest number of training photos")
    parser.add_argument("--val", type=int, default=48, help="largest number of validation photos")
    parser.add_argument("--look", type=pathlib.Path, help="folder of photos")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    rows = []
    for folder in options.photos:
        with open(folder / "SOURCES.csv", newline="") as file:
            rows += [(row["split"], folder / row["file"]) for row in csv.DictReader(file)]
    random.Random(1).shuffle(rows)
    val = [path for split, path in rows if split == "val"][: options.val]
    train = [path for split, path in rows if split == "train"][: options.most]
    files = [(f"look/{path.name}", path, None) for path in sorted(options.look.iterdir())] if options.look else []
    for split, paths in [("val", val), ("train", train)]:
        files += [(f"{split}/{path.parent.name}-{path.stem}.webp", path, options.quality) for path in paths]
    packs, size, tar = 0, 0, None
    for name, path, quality in files:
        data = path.read_bytes() if quality is None else webp(path, quality)
        # In a tar, a file takes up to 1,024 bytes more, and the end up to 10,240.
        if tar is None or size + len(data) + 1024 > options.mib * 2**20 - 10240:
            if tar:
                tar.close()
            tar = tarfile.open(options.out / f"pack-{packs:02}.tar", "w")
            packs, size = packs + 1, 0
        entry = tarfile.TarInfo(name)
        entry.size = len(data)
        tar.addfile(entry, io.BytesIO(data))
        size += len(data) + 1024
    tar.close()
    print(f"{packs} packs, {len(train)} photos for training, {len(val)} for validation")


if __name__ == "__main__":
    main()
