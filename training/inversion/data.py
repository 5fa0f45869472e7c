"""Photos and their features, in batches of crops with what recovery would have made of the points.

`data.py prepare OUT PHOTOS.. [--sizes 1,0.7,soft]` writes `OUT/SPLIT-SIZE/` with the photos of the folders' SOURCES.csv at
these sizes, `soft` as a cheap video camera would have taken them; `unlift features OUT/SPLIT-SIZE --out
OUT/SPLIT-SIZE.h5` then extracts what is trained on.
"""

import argparse
import csv
import dataclasses
import pathlib

import h5py
import numpy
import torch
from PIL import Image, ImageFilter

from raster import raster


def soft(photo: Image.Image, random: numpy.random.Generator) -> Image.Image:
    """Out of focus, lighter or darker, of another contrast, noisy. Without such photos a network believes that what is
    blurred is dark, since of photos that people keep the dark ones are."""
    blurred = photo.filter(ImageFilter.GaussianBlur(random.uniform(0.4, 2.0)))
    light = (numpy.asarray(blurred, numpy.float32) / 255) ** numpy.exp(random.uniform(-0.6, 0.5))
    light = random.uniform(0.75, 1.1) * (light - 0.5) + 0.5 + random.uniform(-0.08, 0.1)
    # Grain as large as a pixel or two, as it is after a camera's own smoothing.
    noise = Image.fromarray(random.normal(128, 40, light.shape).clip(0, 255).astype(numpy.uint8))
    noise = numpy.asarray(noise.filter(ImageFilter.GaussianBlur(random.uniform(0.3, 1.0))), numpy.float32) - 128
    light = 255 * light + random.uniform(0, 0.12) * noise
    return Image.fromarray(light.clip(0, 255).round().astype(numpy.uint8))


def prepare(out: pathlib.Path, folders: list[pathlib.Path], sizes: list[str], most: int | None):
    for folder in folders:
        with open(folder / "SOURCES.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        for size in sizes:
            of_split = {split: [row for row in rows if row["split"] == split][:most] for split in ("train", "val")}
            for row in of_split["train"] + of_split["val"]:
                to = out / f"{row['split']}-{size}" / f"{folder.name}-{row['file']}"
                to.parent.mkdir(parents=True, exist_ok=True)
                with Image.open(folder / row["file"]) as photo:
                    photo = photo.convert("RGB")
                    if size == "soft":
                        random = numpy.random.default_rng(list(f"{folder.name}/{row['file']}".encode()))
                        photo = soft(photo, random)
                    else:
                        sides = [round(side * float(size)) for side in photo.size]
                        photo = photo.resize(sides, Image.Resampling.LANCZOS)
                    photo.save(to, quality=92)


def mirror() -> numpy.ndarray:
    """Where each value of a SIFT descriptor stands in that of the mirrored photo: cells upside down, orientations
    backward."""
    at = numpy.arange(128).reshape(4, 4, 8)
    return at[::-1][:, :, (8 - numpy.arange(8)) % 8].reshape(-1)


@dataclasses.dataclass
class Photo:
    pixels: numpy.ndarray  # (h, w, 3), 8 bits
    places: numpy.ndarray  # (n, 2) pixels, upper-left corner at (0, 0)
    descriptors: numpy.ndarray  # (n, columns)


def photos(folder: pathlib.Path, most: int | None = None) -> list[Photo]:
    """Photos of a folder with the features in FOLDER.h5, as `unlift features` writes them."""
    found = []
    with h5py.File(folder.with_name(folder.name + ".h5")) as file:
        for path in sorted(folder.iterdir())[:most]:
            if path.name not in file:
                continue
            group = file[path.name]
            descriptors = group["descriptors"][:].T
            if len(descriptors) < 16:
                continue
            with Image.open(path) as photo:
                pixels = numpy.asarray(photo.convert("RGB"))
            # Without a half added: the upper-left corner of the picture at (0, 0), as COLMAP counts.
            places = group["keypoints"][:, :2].astype(numpy.float32) + 0.5
            found.append(Photo(pixels, places, numpy.ascontiguousarray(descriptors)))
    return found


def worn(photo: Photo, random: numpy.random.Generator, plain: bool) -> tuple[numpy.ndarray, numpy.ndarray, numpy.ndarray]:
    """Places, descriptors and weights of a photo as an attacker may hold them.

    `plain`: half a pixel of noise and some points missing. Otherwise half of all photos also have what recovery leaves:
    points moved by a few to many pixels, points elsewhere, descriptors of other points, and weights that know about it.
    """
    n = len(photo.places)
    kept = random.random(n) < random.choice([1.0, 0.8, 0.5, 0.25], p=[0.5, 0.2, 0.2, 0.1])
    places, descriptors = photo.places[kept].copy(), photo.descriptors[kept]
    n = len(places)
    size = numpy.array(photo.pixels.shape[1::-1], numpy.float32)
    recovered = not plain and random.random() < 0.5
    if not recovered:
        return places + random.normal(0, 0.5, (n, 2)).astype(numpy.float32), descriptors, numpy.ones(n, numpy.float32)
    sigma = numpy.exp(random.uniform(-0.7, 2.5)) * numpy.exp(random.normal(0, 0.6, (n, 1)))
    places = places + sigma * random.normal(0, 1, (n, 2))
    wrong = random.random(n) < random.choice([0.0, random.uniform(0, 0.5)])
    anywhere = random.random((n, 2)) * size
    near = places + random.normal(0, 60, (n, 2))
    places = numpy.where(wrong[:, None], numpy.where(random.random((n, 1)) < 0.5, anywhere, near), places)
    weights = numpy.ones(n)
    if random.random() < 0.6:
        weights = numpy.where(wrong, random.beta(1.2, 3.0, n), random.beta(4.0, 1.2, n)).clip(0.02, 1.0)
    swapped = numpy.flatnonzero(random.random(n) < random.choice([0.0, random.uniform(0, 0.3)], p=[0.6, 0.4]))
    descriptors = descriptors.copy()
    descriptors[swapped] = descriptors[random.permutation(swapped)]
    return places.astype(numpy.float32), descriptors, weights.astype(numpy.float32)


def shrunk(pixels: numpy.ndarray) -> numpy.ndarray:
    """A picture (h, w, 3) at half its size, by means of 2 x 2, from 0 to 1 and (3, h / 2, w / 2)."""
    h, w = pixels.shape[0] // 2 * 2, pixels.shape[1] // 2 * 2
    parts = pixels[:h, :w].reshape(h // 2, 2, w // 2, 2, 3).astype(numpy.float32)
    return numpy.ascontiguousarray(parts.mean((1, 3)).transpose(2, 0, 1) / 255)


class Batches:
    """Batch `step` is a function of the seed and the step alone, so that a run goes on where it stopped."""

    def __init__(self, photos: list[Photo], size: int, crop: int, seed: int, plain: bool):
        self.photos, self.size, self.crop, self.seed, self.plain = photos, size, crop, seed, plain
        self.mirror = mirror()

    def batch(self, step: int) -> tuple[torch.Tensor, torch.Tensor]:
        """Feature images (b, columns + 3, crop / 4, crop / 4) and pictures (b, 3, crop / 2, crop / 2)."""
        assert len(self.photos) >= self.size, f"{len(self.photos)} photos, and {self.size} in a batch"
        per_epoch = len(self.photos) // self.size
        epoch, at = divmod(step, per_epoch)
        order = numpy.random.default_rng([self.seed, epoch]).permutation(len(self.photos))
        random = numpy.random.default_rng([self.seed, epoch, at])
        made = [self._crop(self.photos[i], random) for i in order[at * self.size : (at + 1) * self.size]]
        features, pictures = (torch.from_numpy(numpy.stack(part)) for part in zip(*made))
        return features, pictures

    def _crop(self, photo: Photo, random: numpy.random.Generator) -> tuple[numpy.ndarray, numpy.ndarray]:
        places, descriptors, weights = worn(photo, random, self.plain)
        crop = self.crop
        high, wide = photo.pixels.shape[:2]
        x, y = (random.integers(0, max(1, side - crop + 1)) for side in (wide, high))
        pixels = photo.pixels[y : y + crop, x : x + crop]
        pixels = numpy.pad(pixels, [(0, crop - pixels.shape[0]), (0, crop - pixels.shape[1]), (0, 0)], "reflect")
        places = places - numpy.array([x, y], numpy.float32)
        # SIFT is stored as bytes. Of others of as many values, ALIKED's for one, nobody knows the mirrored ones.
        mirrors = descriptors.dtype == numpy.uint8 and descriptors.shape[1] == len(self.mirror)
        if mirrors and random.random() < 0.5:
            pixels, descriptors = pixels[:, ::-1], descriptors[:, self.mirror]
            places = numpy.stack([crop - places[:, 0], places[:, 1]], 1)
        return raster(places, descriptors, weights, (crop, crop)), shrunk(pixels)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=["prepare"])
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("folders", type=pathlib.Path, nargs="+")
    parser.add_argument("--sizes", default="1,0.7", help="of 1; or soft")
    parser.add_argument("--most", type=int, help="photos per folder, split and size")
    options = parser.parse_args()
    prepare(options.out, options.folders, options.sizes.split(","), options.most)


if __name__ == "__main__":
    main()
