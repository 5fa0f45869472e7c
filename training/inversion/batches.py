"""Holds photos and keypoints on a device and makes batches of crops there, so that no step waits for the CPU.

`batches.py FILE` writes the golden file of a test in Rust: `../../crates/unlift-vision/tests/data/feature-image.safetensors`.
"""

import pathlib
import sys

import numpy
import torch
from safetensors.torch import save_file
from torch.nn import functional

CELL = 4


def mirror() -> torch.Tensor:
    """Returns the order of a SIFT descriptor's values in the mirrored photo: cells upside down, orientations backward."""
    at = numpy.arange(128).reshape(4, 4, 8)
    return torch.from_numpy(at[::-1][:, :, (8 - numpy.arange(8)) % 8].reshape(-1).copy())


class Photos:
    """The arrays of folders that `prepare.py` wrote, on the device."""

    def __init__(self, folders: list[pathlib.Path], device: str):
        def arrays(name):
            return [numpy.load(folder / f"{name}.npy") for folder in folders]

        def on_device(name):
            return torch.cat([torch.from_numpy(array).to(device) for array in arrays(name)])

        counts, self.size = numpy.concatenate(arrays("counts")), numpy.concatenate(arrays("size"))
        # Rows of keypoints of photo i: from first[i] to first[i + 1].
        self.first = numpy.concatenate([[0], numpy.cumsum(counts)])
        self.pixels, self.keypoints, self.descriptors = map(on_device, ("pixels", "keypoints", "descriptors"))
        self.owner = torch.from_numpy(numpy.repeat(numpy.arange(len(counts)), counts)).to(device)
        self.device = device

    def __len__(self):
        return len(self.size)

    def colors(self, rows: torch.Tensor) -> torch.Tensor:
        """Returns the mean colors (n, 3) of 3 x 3 pixels around keypoints, from 0 to 1."""
        x, y = self.keypoints[rows].long().clamp(1, self.pixels.shape[1] - 2).unbind(1)
        around = [self.pixels[self.owner[rows], y + dy, x + dx].float() for dy in (-1, 0, 1) for dx in (-1, 0, 1)]
        return sum(around) / (9 * 255)


def channels(descriptors: torch.Tensor, colors: torch.Tensor | None, known: torch.Tensor) -> torch.Tensor:
    """Returns the channels (n, c) of points before the place and the weight.

    These are the descriptor, of unit length times the root of its columns, and if there are `colors` (n, 3): 4 (color - 0.5), and
    `known` (n,). A color with `known` 0 is 0, too.
    """
    found = [functional.normalize(descriptors.float(), dim=1) * descriptors.shape[1] ** 0.5]
    if colors is not None:
        found += [4 * (colors - 0.5) * known[:, None], known[:, None]]
    return torch.cat(found, 1)


def feature_image(places, values, weights, of, n: int, size: tuple[int, int]) -> torch.Tensor:
    """Returns feature images (n, c + 3, height / 4, width / 4) of `size` (width, height), as `unlift-vision` makes them.

    `places` (k, 2) are in pixels, the corner of the first pixel at (0, 0); `values` (k, c) are those of `channels`; `weights` (k,)
    are from 0 to 1; `of` (k,) is the image of each point. A cell has the weighted means of its points' values and places inside
    the cell, which are from -1 to 1, and their largest weight. It is 0 if it has no point.
    """
    wide, high = (-(-side // CELL) for side in size)
    at = (places / CELL).floor()
    inside = (places >= 0).all(1) & (places[:, 0] < size[0]) & (places[:, 1] < size[1])
    weights = weights * inside
    values = torch.cat([values, 2 * (places / CELL - at) - 1], 1)
    at = at.long()
    cell = torch.where(inside, (of * high + at[:, 1]) * wide + at[:, 0], 0)
    cells = n * high * wide
    sums = values.new_zeros(cells, values.shape[1]).index_add_(0, cell, values * weights[:, None])
    total = values.new_zeros(cells).index_add_(0, cell, weights)
    largest = values.new_zeros(cells).scatter_reduce_(0, cell, weights, "amax")
    made = torch.cat([sums / total.clamp(min=1e-12)[:, None], largest[:, None]], 1)
    return made.view(n, high, wide, -1).permute(0, 3, 1, 2)


class Batches:
    """Makes batches of crops of photos, with points as an attacker may have them.

    Half of the crops have the errors of recovery: points moved by a few to many pixels, points at random places, descriptors of
    other points, and weights that are lower for wrong points. A quarter have as few points as a map has in a view. Half have colors.
    Half are mirrored if the descriptors are of SIFT; those of mirrored photos are not known for others.
    """

    def __init__(self, photos: Photos, crop: int, seed: int, colors: bool):
        self.photos, self.crop, self.colored = photos, crop, colors
        # Only SIFT's descriptors are bytes.
        self.mirror = mirror().to(photos.device) if photos.descriptors.dtype == torch.uint8 else None
        self.order = numpy.random.default_rng(seed)
        self.random = torch.Generator(photos.device).manual_seed(seed)
        self.queue: list[int] = []

    def _rand(self, *shape):
        return torch.rand(*shape, generator=self.random, device=self.photos.device)

    def _randn(self, *shape):
        return torch.randn(*shape, generator=self.random, device=self.photos.device)

    def _choice(self, n: int, values: list[float], shares: list[float]):
        bounds = torch.tensor(shares, device=self.photos.device).cumsum(0)[:-1].contiguous()
        return torch.tensor(values, device=self.photos.device)[torch.bucketize(self._rand(n), bounds)]

    def batch(self, n: int) -> tuple[torch.Tensor, torch.Tensor]:
        """Returns the feature images of crops of `n` photos, and the crops at half their size."""
        while len(self.queue) < n:
            self.queue += self.order.permutation(len(self.photos)).tolist()
        ids = numpy.array([self.queue.pop() for _ in range(n)])
        photos, crop, device = self.photos, self.crop, self.photos.device
        counts = photos.first[ids + 1] - photos.first[ids]

        def on(array):
            return torch.from_numpy(numpy.ascontiguousarray(array)).to(device, non_blocking=True)

        total, points = int(counts.sum()), on(counts)
        of = torch.repeat_interleave(torch.arange(n, device=device), points, output_size=total)
        rows = torch.arange(total, device=device) + on(photos.first[ids] - numpy.cumsum(counts) + counts)[of]
        size = on(photos.size[ids]).float()
        places, weights, sources = self._worn(photos.keypoints[rows], rows, of, points, size)
        corner = (self._rand(n, 2) * (size - crop + 1).clamp(min=1)).floor()
        places = places - corner[of]
        flipped = self._rand(n) < (0.5 if self.mirror is not None else 0)
        places[:, 0] = torch.where(flipped[of], crop - places[:, 0], places[:, 0])
        descriptors = photos.descriptors[sources]
        if self.mirror is not None:
            descriptors = torch.where(flipped[of][:, None], descriptors[:, self.mirror], descriptors)
        known = (self._rand(n) < 0.5)[of].float()
        values = channels(descriptors, self._colors(sources, of, n) if self.colored else None, known)
        line = torch.arange(crop, device=device)
        x, y = (corner[:, c, None].long() + line for c in (0, 1))
        pixels = photos.pixels[on(ids)[:, None, None], y[:, :, None], x[:, None, :]].permute(0, 3, 1, 2).float() / 255
        pixels = torch.where(flipped[:, None, None, None], pixels.flip(3), pixels)
        return feature_image(places, values, weights, of, n, (crop, crop)), functional.avg_pool2d(pixels, 2)

    def _colors(self, rows, of, n):
        """Returns colors as a map stores them: of photos with another exposure, and with noise."""
        gain, shift = 1 + 0.1 * self._randn(n, 1), 0.03 * self._randn(n, 1) + 0.02 * self._randn(n, 3)
        colors = (self.photos.colors(rows) - 0.5) * gain[of] + 0.5 + shift[of] + 0.03 * self._randn(len(rows), 3)
        return colors.clamp(0, 1)

    def _worn(self, places, rows, of, points, size):
        """Returns places, weights, and rows of descriptors and colors, with errors."""
        total, n = len(rows), len(points)
        kept = self._choice(n, [1.0, 0.8, 0.5, 0.25], [0.5, 0.2, 0.2, 0.1])
        sparse = self._rand(n) < 0.25
        kept = torch.where(sparse, (200 + 600 * self._rand(n)) / points, kept)
        weights = (self._rand(total) < kept[of]).float()
        recovered = self._rand(n) < 0.5
        sigma = torch.where(recovered[of], (self._rand(n) * 3.2 - 0.7).exp()[of] * (0.6 * self._randn(total)).exp(), 0.5)
        moved = places + sigma[:, None] * self._randn(total, 2)
        # In a map's view, points behind a wall may pass as visible.
        share = torch.where(recovered, 0.5 * self._rand(n) * (self._rand(n) < 0.5), 0.1 * self._rand(n) * sparse)
        wrong = self._rand(total) < share[of]
        elsewhere = torch.where(self._rand(total, 1) < 0.5, self._rand(total, 2) * size[of], moved + 60 * self._randn(total, 2))
        moved = torch.where(wrong[:, None], elsewhere, moved)
        # Powers of uniform numbers are close to Beta(1.2, 3) and Beta(4, 1.2).
        believed = torch.where(wrong, 1 - self._rand(total) ** 0.38, self._rand(total) ** 0.28).clamp(0.02, 1.0)
        knows = (self._rand(n) < 0.6) & recovered
        weights = weights * torch.where(knows[of], believed, 1.0)
        swapped = self._rand(total) < (self._rand(n) * 0.3 * (self._rand(n) < 0.4) * recovered)[of]
        others = rows[torch.argsort(of + 0.999 * self._rand(total).double())]
        return moved, weights, torch.where(swapped, others, rows)


def main():
    """Writes a feature image of 150 random points, without and with colors."""
    random = numpy.random.default_rng(1)
    # More points than cells; some are outside, some have no weight.
    places = torch.from_numpy(random.uniform(-3, 33, (150, 2)).astype(numpy.float32))
    descriptors = torch.from_numpy(random.normal(size=(150, 8)).astype(numpy.float32))
    weights = torch.from_numpy(random.uniform(0, 1, 150).astype(numpy.float32))
    weights[::9] = 0
    colors = torch.from_numpy(random.integers(0, 256, (150, 3), numpy.uint8))
    tensors = {"places": places, "descriptors": descriptors, "weights": weights, "colors": colors}
    for name, known in (("features", None), ("features_colored", colors / 255)):
        values = channels(descriptors, known, torch.ones(150))
        made = feature_image(places, values, weights, torch.zeros(150, dtype=torch.long), 1, (30, 22))
        tensors[name] = made[0].contiguous()
    save_file(tensors, sys.argv[1])


if __name__ == "__main__":
    main()
