"""Photos to arrays for training: `prepare.py OUT PACK.. --sift PROGRAM`, with packs that `pack.py` wrote.

PROGRAM is `cargo build --release --example sift -p unlift-features`: one portable file with the product's extractor. OUT gets
folders `SPLIT-SIZE` with NumPy files: `pixels` (n, 640, 640, 3) bytes, mirrored at the right and lower border where the photo
ends, `size` (n, 2), `counts` (n,), `keypoints` (k, 2) with the corner of the first pixel at (0, 0), `descriptors` (k, 128).
Training photos come at these sizes: 1, 0.7, and `soft`, as a cheap video camera takes them.
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


def soft(photo: Image.Image, random: numpy.random.Generator) -> Image.Image:
    """Returns the photo out of focus, lighter or darker, of another contrast, with grain. Without such photos a network
    learns that what is blurred is dark, because the dark photos that people keep are blurred."""
    blurred = photo.filter(ImageFilter.GaussianBlur(random.uniform(0.4, 2.0)))
    light = (numpy.asarray(blurred, numpy.float32) / 255) ** numpy.exp(random.uniform(-0.6, 0.5))
    light = random.uniform(0.75, 1.1) * (light - 0.5) + 0.5 + random.uniform(-0.08, 0.1)
    # Grain is as large as a pixel or two after a camera's own smoothing.
    noise = Image.fromarray(random.normal(128, 40, light.shape).clip(0, 255).astype(numpy.uint8))
    noise = numpy.asarray(noise.filter(ImageFilter.GaussianBlur(random.uniform(0.3, 1.0))), numpy.float32) - 128
    light = 255 * light + random.uniform(0, 0.12) * noise
    return Image.fromarray(light.clip(0, 255).round().astype(numpy.uint8))


def part(job) -> dict[str, numpy.ndarray]:
    """Returns the arrays of some photos at one size."""
    photos, size, program = job
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
        subprocess.run([program, *paths, "--threads", "1", "--out", out], check=True, stdout=subprocess.DEVNULL)
        raw = out.read_bytes()
    at, counts, keypoints, descriptors = 0, [], [], []
    for _ in photos:
        n = int(numpy.frombuffer(raw, "<u4", 1, at)[0])
        keypoints.append(numpy.frombuffer(raw, "<f4", 4 * n, at + 4).reshape(n, 4)[:, :2])
        descriptors.append(numpy.frombuffer(raw, numpy.uint8, 128 * n, at + 4 + 16 * n).reshape(n, 128))
        counts.append(n)
        at += 4 + 144 * n
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
    parser.add_argument("--sift", type=pathlib.Path, required=True)
    parser.add_argument("--sizes", default="1,0.7,soft", help="of training photos")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    options = parser.parse_args()
    start = time.time()
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
            jobs = [(photos[at : at + 16], size, options.sift.resolve()) for at in range(0, len(photos), 16)]
            waiting.append(pool.map_async(part, jobs, 1))
        for (split, size), parts in zip(sets, waiting):
            folder = options.out / f"{split}-{size}"
            folder.mkdir(exist_ok=True)
            for name in parts.get()[0]:
                numpy.save(folder / f"{name}.npy", numpy.concatenate([made[name] for made in parts.get()]))
            print(f"{folder.name}: {len(splits[split])} photos, {time.time() - start:.0f} s", flush=True)


if __name__ == "__main__":
    main()
