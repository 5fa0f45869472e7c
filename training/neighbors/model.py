"""The network: descriptors and pair scores of one image in, a score for every pair out. Positions never enter."""

import dataclasses
import functools
import math

import torch
from torch import nn
from torch.nn import functional


@dataclasses.dataclass(frozen=True)
class Shape:
    """What a network is built from."""

    dim: int = 128
    blocks: int = 3
    heads: int = 4
    columns: int = 128  # values of a descriptor
    reaches: int = 3  # matrices of pair scores; 1 for features that are compared by similarity alone


def features(reaches: int) -> int:
    """Features of a pair."""
    return 3 + (reaches if reaches > 1 else 0)


def hinges(pairs: torch.Tensor) -> torch.Tensor:
    """Features of every pair from its scores `(.., reaches, n, n)` in standard deviations: `(features, .., n, n)`.

    Of the best reach: linear, and from where on a match is unlikely to be chance; of each reach: the latter.
    """
    reaches = pairs.unbind(-3)
    # Faster than a maximum over an axis where the network runs.
    best = functools.reduce(torch.maximum, reaches)
    parts = [0.3 * best, functional.relu(best - 1.5), functional.relu(best - 3.0)]
    if len(reaches) > 1:
        parts += [functional.relu(reach - 2.0) for reach in reaches]
    return torch.stack(parts)


class Block(nn.Module):
    """Self-attention with a bias per pair and head, then a small network per point."""

    def __init__(self, shape: Shape):
        super().__init__()
        self.heads = shape.heads
        self.before = nn.LayerNorm(shape.dim)
        self.into = nn.Linear(shape.dim, 3 * shape.dim)
        self.out = nn.Linear(shape.dim, shape.dim)
        self.between = nn.LayerNorm(shape.dim)
        self.wide = nn.Linear(shape.dim, 2 * shape.dim)
        self.narrow = nn.Linear(2 * shape.dim, shape.dim)

    def forward(self, points: torch.Tensor, bias: torch.Tensor) -> torch.Tensor:
        """`points` (.., n, dim), `bias` (heads, .., n, n)."""
        *batch, n, dim = points.shape
        parts = self.into(self.before(points)).reshape(*batch, n, 3, self.heads, dim // self.heads)
        # Heads come first. The exporter needs axes that are not negative.
        query, key, value = (part.movedim(part.ndim - 2, 0) for part in parts.unbind(-3))
        query = query * (1 / math.sqrt(dim // self.heads))
        attention = torch.softmax(query @ key.transpose(-1, -2) + bias, -1, dtype=value.dtype)
        met = (attention @ value).movedim(0, points.ndim - 1).reshape(*batch, n, dim)
        points = points + self.out(met)
        return points + self.narrow(functional.silu(self.wide(self.between(points))))


class Network(nn.Module):
    """Scores of all pairs of points: the log of how likely one is among the nearest of the other, up to a constant
    per row."""

    def __init__(self, shape: Shape):
        super().__init__()
        self.shape = shape
        self.first = nn.Linear(shape.columns, shape.dim)
        self.second = nn.Linear(shape.dim, shape.dim)
        # A bias per head of each block, and the term that is added to the output.
        self.pairs = nn.Linear(features(shape.reaches), shape.heads * shape.blocks + 1, bias=False)
        self.blocks = nn.ModuleList(Block(shape) for _ in range(shape.blocks))
        self.last = nn.LayerNorm(shape.dim)
        self.left = nn.Linear(shape.dim, shape.dim)
        self.right = nn.Linear(shape.dim, shape.dim)
        for block in self.blocks:
            nn.init.zeros_(block.narrow.weight)
            nn.init.zeros_(block.out.weight)
        nn.init.zeros_(self.left.weight)
        with torch.no_grad():
            # Starts from the pair scores as they are.
            self.pairs.weight.zero_()
            self.pairs.weight[:, :2] = 1.0

    def forward(self, descriptors: torch.Tensor, pairs: torch.Tensor) -> torch.Tensor:
        """`descriptors` (.., n, columns) of unit length, `pairs` (.., reaches, n, n); `(.., n, n)`. What stands on the
        diagonal means nothing."""
        shape = self.shape
        found = hinges(pairs)

        # One after the other: all of them at once take more memory than everything else.
        def term(first: int, count: int) -> torch.Tensor:
            weight = self.pairs.weight[first : first + count]
            return (weight @ found.flatten(1)).reshape(count, *found.shape[1:])

        # Values of unit vectors are small: scaled to a deviation near 1.
        points = self.first(descriptors * math.sqrt(shape.columns))
        points = self.second(functional.silu(points))
        for at, block in enumerate(self.blocks):
            points = block(points, term(at * shape.heads, shape.heads))
        points = self.last(points)
        score = self.left(points) @ self.right(points).transpose(-1, -2)
        return score * (1 / math.sqrt(shape.dim)) + term(shape.heads * shape.blocks, 1)[0]
