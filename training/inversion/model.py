"""The network: a feature image in, a picture of half its photo's size out.

A residual U-Net without normalization: a point encoder (1x1), residual blocks on the way down, one per level on the way up.
Sizes need not divide: a level is resized to the size of the level that it joins.
"""

import dataclasses

import torch
from torch import nn
from torch.nn import functional

# Channels of a feature image after the descriptor: color (3) and whether it is known, if the network takes colors; then
# the place inside the cell (2) and the weight.
COLOR, PLACE = 4, 3


@dataclasses.dataclass(frozen=True)
class Shape:
    columns: int = 128  # of a descriptor
    colors: int = 1  # whether the network takes colors of points
    width: int = 64  # channels at the size of the feature image
    levels: str = "112,176,216"  # channels at half of it, a quarter, ..
    blocks: str = "1,2,3,2"  # of each level on the way down
    head: int = 32  # channels at half the photo's size

    @property
    def channels(self) -> int:
        """Channels of a feature image."""
        return self.columns + self.colors * COLOR + PLACE


def conv(n_in: int, n_out: int, k: int, stride: int = 1, gain: float = 1.0) -> nn.Conv2d:
    made = nn.Conv2d(n_in, n_out, k, stride, k // 2)
    nn.init.normal_(made.weight, std=gain * (n_in * k * k) ** -0.5)
    nn.init.zeros_(made.bias)
    return made


def bent(x: torch.Tensor) -> torch.Tensor:
    return functional.leaky_relu(x, 0.1)


def resized(x: torch.Tensor, size: tuple[int, int]) -> torch.Tensor:
    return functional.interpolate(x, size=size, mode="bilinear", align_corners=False)


class Block(nn.Module):
    """x + f(x), where f is small at first."""

    def __init__(self, n: int):
        super().__init__()
        self.first, self.second = conv(n, n, 3, gain=1.4), conv(n, n, 3, gain=0.2)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return x + self.second(bent(self.first(bent(x))))


def blocks(n: int, count: int) -> nn.Sequential:
    return nn.Sequential(*(Block(n) for _ in range(count)))


class Spread(nn.Module):
    """Spreads the colors of points over the picture: a pyramid of weighted sums, filled from coarse to fine.

    Nothing is learned. Out: the colors (3) and how much is known near a cell (1), then the same four of a coarse level.
    Zero where no color is known at all.
    """

    LEVELS, COARSE = 8, 2
    # Weight of the coarser level, in points.
    TRUST = 0.5

    def forward(self, colors: torch.Tensor, weight: torch.Tensor) -> torch.Tensor:
        sums = [torch.cat([colors * weight, weight], 1)]
        for _ in range(self.LEVELS):
            # Four times the mean at every second cell keeps the sums.
            sums.append(4 * functional.avg_pool2d(sums[-1], 3, 2, 1))
        found = sums[-1][:, :3] / (sums[-1][:, 3:] + 1e-3)
        for at in reversed(range(self.LEVELS)):
            above = resized(found, sums[at].shape[-2:])
            known = sums[at][:, 3:]
            found = (sums[at][:, :3] + self.TRUST * above) / (known + self.TRUST)
            if at == self.COARSE:
                coarse = torch.cat([found, known / (known + self.TRUST)], 1)
        known = sums[0][:, 3:]
        return torch.cat([found, known / (known + self.TRUST), resized(coarse, known.shape[-2:])], 1)


class Network(nn.Module):
    def __init__(self, shape: Shape):
        super().__init__()
        self.shape = shape
        wide = [shape.width, *map(int, shape.levels.split(","))]
        deep = map(int, shape.blocks.split(","))
        self.encoder = nn.Sequential(conv(shape.channels, 2 * wide[0], 1, gain=1.4), nn.LeakyReLU(0.1), conv(2 * wide[0], wide[0], 1))
        if shape.colors:
            self.spread, self.light = Spread(), conv(8, wide[0], 1)
        self.down = nn.ModuleList(conv(a, b, 3, 2) for a, b in zip(wide, wide[1:]))
        self.levels = nn.ModuleList(blocks(n, count) for n, count in zip(wide, deep))
        self.up = nn.ModuleList(conv(b, a, 1) for a, b in zip(wide, wide[1:]))
        self.joined = nn.ModuleList(blocks(n, 1) for n in wide[:-1])
        # What the deepest level makes of the mean of the whole picture.
        self.whole = nn.Sequential(conv(wide[-1], wide[-1], 1, gain=1.4), nn.LeakyReLU(0.1), conv(wide[-1], wide[-1], 1, gain=0.0))
        self.narrow = conv(wide[0], shape.head, 1)
        self.head = nn.Sequential(conv(shape.head, shape.head, 3, gain=1.4), nn.LeakyReLU(0.1))
        self.picture = conv(shape.head, 3, 3, gain=0.2)

    def forward(self, features: torch.Tensor) -> torch.Tensor:
        """`features` (b, channels, h, w); RGB (b, 3, 2 h, 2 w), 0 to 1 but not clamped."""
        weight = features[:, -1:]
        x = self.encoder(features) * (weight > 0)
        if self.shape.colors:
            colors, known = features[:, self.shape.columns :][:, :3], features[:, self.shape.columns + 3 :][:, :1]
            spread = self.spread(colors, weight * known)
            x = x + self.light(spread)
        kept = []
        for at, level in enumerate(self.levels):
            if at:
                kept.append(x)
                x = self.down[at - 1](x)
            x = level(x)
        x = x + self.whole(x.mean((2, 3), keepdim=True))
        for at in reversed(range(len(kept))):
            x = self.joined[at](kept[at] + resized(self.up[at](x), kept[at].shape[-2:]))
        # Linear, because the nearest cell leaves a mesh and colored fringes.
        x = functional.interpolate(self.narrow(bent(x)), scale_factor=2, mode="bilinear", align_corners=False)
        x = self.picture(self.head(x)) + 0.5
        if self.shape.colors:
            x = x + functional.interpolate(spread[:, :3], scale_factor=2, mode="bilinear", align_corners=False) / 4
        return x
