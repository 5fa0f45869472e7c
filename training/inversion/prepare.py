"""Converts photos to arrays for training: `prepare.py OUT PACK.. --features PROGRAM`, with packs that `pack.py` wrote.

`cargo build --release --example features -p unlift-vision` builds PROGRAM, unlift's extractor in one file. OUT gets a folder
`SPLIT-SIZE` for each split of the packs and each size, with NumPy files:
`pixels` (n, 640, 640, 3) bytes, a smaller photo continued by its mirror image to the right and below; `size` (n, 2), width and
height of the photo; `counts` (n,), its number of keypoints; `keypoints` (k, 2) in pixels, the corner of the first pixel at (0, 0);
`descriptors` (k, 128), bytes of SIFT and 32-bit floats of ALIKED.
"""

import argparse
import io
import multiprocessing
import os
import pathlib
import subprocess
import tarfile
import tempfile
import time

import numpy
from PIL import Image, ImageFilter

SIDE = 640
# Values of a descriptor.
TYPES = {"sift": "u1", "aliked": "<f4"}


def soft(photo: Image.Image, random: numpy.random.Generator) -> Image.Image:
    """Returns the photo as a cheap video camera takes it: out of focus, lighter or darker, of another contrast, with grain.

    Without such photos a network learns that what is blurred is dark, because the dark photos that people keep are blurred.
    """
    blurred = photo.filter(ImageFilter.GaussianBlur(random.uniform(0.4, 2.0)))
    light = (numpy.asarray(blurred, numpy.float32) / 255) ** numpy.exp(random.uniform(-0.6, 0.5))
    light = random.uniform(0.75, 1.1) * (light - 0.5) + 0.5 + random.uniform(-0.08, 0.1)
    # A camera smooths its noise, so that a grain covers a pixel or two.
    noise = Image.fromarray(random.normal(128, 40, light.shape).clip(0, 255).astype(numpy.uint8))
    noise = numpy.asarray(noise.filter(ImageFilter.GaussianBlur(random.uniform(0.3, 1.0))), numpy.float32) - 128
    light = 255 * light + random.uniform(0, 0.12) * noise
    return Image.fromarray(light.clip(0, 255).round().astype(numpy.uint8))


def part(job) -> dict[str, numpy.ndarray]:
    """Returns the arrays of some photos at one size."""
    photos, size, program, kind = job
    with tempfile.TemporaryDirectory() as scratch:
        paths, pixels, sizes = [], [], []
        for at, (name, data) in enumerate(photos):
            with Image.open(io.BytesIO(data)) as photo:
                photo = photo.convert("RGB")
            photo.thumbnail((SIDE, SIDE), Image.Resampling.LANCZOS)
            if size == "soft":
                photo = soft(photo, numpy.random.default_rng(list(name.encode())))
            elif size != "1":
                photo = photo.resize([round(side * float(size)) for side in photo.size], Image.Resampling.LANCZOS)
            paths.append(f"{scratch}/{at}.png")
            photo.save(paths[-1], compress_level=1)
            sizes.append(photo.size)
            wide, high = photo.size
            pixels.append(numpy.pad(numpy.asarray(photo), [(0, SIDE - high), (0, SIDE - wide), (0, 0)], "symmetric"))
        out = pathlib.Path(scratch, "features")
        subprocess.run([program, *paths, "--type", kind, "--threads", "1", "--out", out], check=True, stdout=subprocess.DEVNULL)
        raw = out.read_bytes()
    value = numpy.dtype(TYPES[kind])
    at, counts, keypoints, descriptors = 0, [], [], []
    for _ in photos:
        n, wide = map(int, numpy.frombuffer(raw, "<u4", 2, at))
        keypoints.append(numpy.frombuffer(raw, "<f4", 4 * n, at + 8).reshape(n, 4)[:, :2])
        columns = wide // value.itemsize
        descriptors.append(numpy.frombuffer(raw, value, columns * n, at + 8 + 16 * n).reshape(n, columns))
        counts.append(n)
        at += 8 + (16 + wide) * n
    return {
        "pixels": numpy.stack(pixels),
        "size": numpy.array(sizes),
        "counts": numpy.array(counts),
        "keypoints": numpy.concatenate(keypoints),
        "descriptors": numpy.concatenate(descriptors),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("packs", type=pathlib.Path, nargs="+")
    parser.add_argument("--features", type=pathlib.Path, required=True, help="the extractor")
    parser.add_argument("--type", choices=TYPES, default="sift")
    parser.add_argument("--sizes", default="1,0.7,soft", help="of training photos: factors, or `soft` as of a cheap video camera")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    options = parser.parse_args()
    start, program = time.time(), options.features.resolve()
    splits: dict[str, list] = {}
    for pack in options.packs:
        with tarfile.open(pack) as tar:
            for member in tar:
                splits.setdefault(member.name.split("/")[0], []).append((member.name, tar.extractfile(member).read()))
    options.out.mkdir(parents=True, exist_ok=True)
    sets = [(split, size) for split in splits for size in (options.sizes.split(",") if split == "train" else ["1"])]
    with multiprocessing.Pool(options.workers) as pool:
        waiting = []
        for split, size in sets:
            photos = splits[split]
            jobs = [(photos[at : at + 16], size, program, options.type) for at in range(0, len(photos), 16)]
            waiting.append(pool.map_async(part, jobs, 1))
        for (split, size), parts in zip(sets, waiting):
            folder = options.out / f"{split}-{size}"
            folder.mkdir(exist_ok=True)
            parts = parts.get()
            for name in parts[0]:
                numpy.save(folder / f"{name}.npy", numpy.concatenate([made[name] for made in parts]))
            print(f"{folder.name}: {len(splits[split])} photos, {time.time() - start:.0f} s", flush=True)


if __name__ == "__main__":
    main()
