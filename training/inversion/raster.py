"""Feature images: what a network sees of keypoints and descriptors.

A cell is `CELL` pixels wide. Channels: the descriptor (of unit length, times the root of its columns), the place inside
the cell from -1 to 1, the weight. Of several points in a cell the mean by weight, and the largest weight. Nothing where
no point is. The same function as `unlift_invert::feature_image`, which a test holds against what `raster.py
../../crates/unlift-invert/tests/data/feature-image.safetensors` writes.
"""

import pathlib
import sys

import numpy
from safetensors.numpy import save_file

CELL = 4


def raster(places: numpy.ndarray, descriptors: numpy.ndarray, weights: numpy.ndarray, size: tuple[int, int]) -> numpy.ndarray:
    """Feature image `(columns + 3, height, width)` in cells of a picture of `size` (width, height) pixels.

    `places` (n, 2) in pixels, the upper-left corner of the picture at (0, 0); `descriptors` (n, columns) of any
    length; `weights` (n,) from 0 to 1. Points outside the picture and of no weight are left out.
    """
    wide, high = -(-size[0] // CELL), -(-size[1] // CELL)
    at = numpy.floor(places / CELL).astype(numpy.int64)
    inside = (places >= 0).all(1) & (places < numpy.array(size)).all(1) & (weights > 0)
    at, places, descriptors, weights = at[inside], places[inside], descriptors[inside], weights[inside]
    columns = descriptors.shape[1]
    lengths = numpy.sqrt((descriptors.astype(numpy.float32) ** 2).sum(1, keepdims=True))
    values = numpy.empty((len(at), columns + 2), numpy.float32)
    numpy.multiply(descriptors, numpy.sqrt(columns) / numpy.maximum(lengths, 1e-12), out=values[:, :columns], casting="same_kind")
    values[:, columns:] = 2 * (places / CELL - at) - 1
    cell = at[:, 1] * wide + at[:, 0]
    grid = numpy.zeros((wide * high, columns + 3), numpy.float32)
    total = numpy.bincount(cell, weights, wide * high)
    order = numpy.argsort(cell, kind="stable")
    starts = numpy.flatnonzero(numpy.diff(cell[order], prepend=-1))
    filled = cell[order][starts]
    sums = numpy.add.reduceat(values[order] * weights[order, None], starts) if len(order) else values
    grid[filled, :-1] = sums / total[filled, None]
    grid[filled, -1] = numpy.maximum.reduceat(weights[order], starts) if len(order) else 0
    return numpy.ascontiguousarray(grid.reshape(high, wide, -1).transpose(2, 0, 1))


def main():
    random = numpy.random.default_rng(1)
    size = (30, 22)
    # More points than cells; some outside, some without weight.
    places = random.uniform(-3, 33, (150, 2)).astype(numpy.float32)
    descriptors = random.normal(size=(150, 8)).astype(numpy.float32)
    weights = random.uniform(0, 1, 150).astype(numpy.float32)
    weights[::9] = 0
    features = raster(places, descriptors, weights, size)
    columns = {"places": places, "descriptors": descriptors, "weights": weights, "features": features}
    save_file(columns, pathlib.Path(sys.argv[1]))


if __name__ == "__main__":
    main()
