"""Crops as `cargo run --release -p unlift-vision --example training_crops` writes them, in batches.

`data.py FOLDER SPLIT` prints the photos of a folder that its SOURCES.csv counts to a split: a list for that program.
"""

import csv
import pathlib
import sys

import numpy
import torch

STEPS = 1024.0  # of a pair score per standard deviation
K = 20


def photos(folder: pathlib.Path, split: str) -> list[str]:
    """Photos of a folder that its SOURCES.csv counts to `split`."""
    with open(folder / "SOURCES.csv", newline="") as file:
        return [str(folder / row["file"]) for row in csv.DictReader(file) if row["split"] == split]


def mirror() -> numpy.ndarray:
    """Where each value of a SIFT descriptor stands in that of the mirrored photo: cells upside down, orientations
    backward. Pair scores stay but for how turns by odd multiples of 45 degrees resample cells."""
    at = numpy.arange(128).reshape(4, 4, 8)
    return at[::-1][:, :, (8 - numpy.arange(8)) % 8].reshape(-1)


def squares(places: torch.Tensor) -> torch.Tensor:
    """Squared distances of all pairs of `places` (.., n, 2)."""
    x, y = places.unbind(-1)
    return (x[..., :, None] - x[..., None, :]).square_() + (y[..., :, None] - y[..., None, :]).square_()


def reach(places: torch.Tensor) -> torch.Tensor:
    """Squared distance of every point's K-th nearest, `(.., n)`."""
    # The point itself is the nearest.
    return squares(places).kthvalue(K + 1, dim=-1).values.clamp(min=1e-6)


def wanted(places: torch.Tensor, reaches: torch.Tensor) -> torch.Tensor:
    """What a row's softmax should be, `(.., n, n)`: `exp(-d^2 / r^2)`, where `r` reaches to the K-th nearest."""
    weight = squares(places).div_(-reaches[..., None]).exp_()
    weight.diagonal(dim1=-2, dim2=-1).zero_()
    return weight / weight.sum(-1, keepdim=True)


class Shard:
    """Crops of one size in one folder, read from disk as they are asked for."""

    def __init__(self, folder: pathlib.Path):
        self.folder = folder
        places = numpy.fromfile(folder / "places.f32", "<f4")
        sift = folder / "descriptors.u8"
        self.is_sift = sift.exists()
        descriptors = numpy.memmap(sift, "u1", "r") if self.is_sift else numpy.memmap(folder / "descriptors.f32", "<f4", "r")
        self.crops = numpy.fromfile(folder / "photos.u32", "<u4").size
        self.n = places.size // 2 // self.crops
        self.places = places.reshape(self.crops, self.n, 2)
        # As they do not change, they are not sorted anew in every step.
        parts = torch.from_numpy(self.places).split(max(1, 2_000_000 // self.n**2))
        self.reaches = torch.cat([reach(part) for part in parts]).numpy()
        self.descriptors = descriptors.reshape(self.crops, self.n, -1)
        pairs = numpy.memmap(folder / "pairs.i16", "<i2", "r")
        self.pairs = pairs.reshape(self.crops, -1, self.n, self.n)

    def read(self, rows: numpy.ndarray, kept: numpy.ndarray | None = None) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Descriptors of unit length, pair scores in standard deviations, what is wanted of every row; of the points
        `kept` of each crop, or of all."""
        # Squares of the counts of SIFT sum to 512 x 512; learned descriptors have length 1.
        descriptors = torch.from_numpy(self.descriptors[rows]).float() / (512 if self.is_sift else 1)
        places, pairs = torch.from_numpy(self.places[rows]), torch.from_numpy(self.pairs[rows])
        reaches = torch.from_numpy(self.reaches[rows])
        if kept is not None:
            descriptors, places, pairs = descriptors[:, kept], places[:, kept], pairs[..., kept, :][..., kept]
            reaches = reach(places)
        return descriptors, pairs.float() * (1 / STEPS), wanted(places, reaches)


def shards(folders: list[pathlib.Path]) -> list[Shard]:
    """All shards below `folders`."""
    found = sorted(path.parent for folder in folders for path in folder.rglob("photos.u32"))
    return [Shard(folder) for folder in found]


class Batches:
    """Batch `step` is a function of the seed and the step alone, so that a run goes on where it stopped."""

    def __init__(self, shards: list[Shard], points: int, seed: int, thin: float):
        self.shards, self.points, self.seed, self.thin = shards, points, seed, thin
        self.mirror = torch.from_numpy(mirror())
        self.epoch, self.batches = -1, []
        self.per_epoch = sum(shard.crops // self._crops(shard) for shard in shards)

    def _crops(self, shard: Shard) -> int:
        return min(shard.crops, max(1, self.points // shard.n))

    def _draw(self, epoch: int):
        random = numpy.random.default_rng([self.seed, epoch])
        self.batches = []
        for at, shard in enumerate(self.shards):
            size = self._crops(shard)
            order = random.permutation(shard.crops)[: shard.crops // size * size]
            self.batches += [(at, numpy.sort(rows)) for rows in order.reshape(-1, size)]
        random.shuffle(self.batches)
        self.epoch = epoch

    def batch(self, step: int) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """The batch of one step: about `points` points in crops of one size, half of them mirrored. A share `thin` of the
        crops of at least 512 points keeps a random half: points of maps are sparser than keypoints."""
        epoch, at = divmod(step, self.per_epoch)
        if epoch != self.epoch:
            self._draw(epoch)
        index, rows = self.batches[at]
        shard, random = self.shards[index], numpy.random.default_rng([self.seed, epoch, at])
        mirrored = random.random(len(rows)) < 0.5
        is_thin = shard.n >= 512 and random.random() < self.thin
        kept = numpy.sort(random.permutation(shard.n)[: shard.n // 2]) if is_thin else None
        descriptors, pairs, target = shard.read(rows, kept)
        if shard.is_sift and mirrored.any():
            mirrored = torch.from_numpy(mirrored)
            descriptors[mirrored] = descriptors[mirrored][..., self.mirror]
        return descriptors, pairs, target


if __name__ == "__main__":
    print(*photos(pathlib.Path(sys.argv[1]), sys.argv[2]), sep="\n")
