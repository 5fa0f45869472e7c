"""What is computed: a feature image in, a picture of half its photo's size out.

Residual U-Net without normalization: a point encoder (1x1), residual blocks on the way down, one a level on the way up. Sizes need not divide: levels are brought to the size of what they join.
"""

import dataclasses

import torch
from torch import nn
from torch.nn import functional


@dataclasses.dataclass(frozen=True)
class Shape:
    columns: int = 128  # of a descriptor
    width: int = 64  # channels at the size of the feature image
    levels: str = "96,128,192"  # channels at half of it, a quarter, ..
    blocks: str = "0,1,2,4"  # of each level on the way down
    head: int = 32  # channels at half the photo's size


def conv(n_in: int, n_out: int, k: int, stride: int = 1, gain: float = 1.0) -> nn.Conv2d:
    made = nn.Conv2d(n_in, n_out, k, stride, k // 2)
    nn.init.normal_(made.weight, std=gain * (n_in * k * k) ** -0.5)
    nn.init.zeros_(made.bias)
    return made


def bent(x: torch.Tensor) -> torch.Tensor:
    return functional.leaky_relu(x, 0.1)


class Block(nn.Module):
    """x + f(x), where f is small at first."""

    def __init__(self, n: int):
        super().__init__()
        self.first, self.second = conv(n, n, 3, gain=1.4), conv(n, n, 3, gain=0.2)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return x + self.second(bent(self.first(bent(x))))


def blocks(n: int, count: int) -> nn.Sequential:
    return nn.Sequential(*(Block(n) for _ in range(count)))


class Network(nn.Module):
    def __init__(self, shape: Shape):
        super().__init__()
        self.shape = shape
        wide = [shape.width, *map(int, shape.levels.split(","))]
        deep = map(int, shape.blocks.split(","))
        self.encoder = nn.Sequential(conv(shape.columns + 3, 2 * wide[0], 1, gain=1.4), nn.LeakyReLU(0.1), conv(2 * wide[0], wide[0], 1))
        self.down = nn.ModuleList(conv(a, b, 3, 2) for a, b in zip(wide, wide[1:]))
        self.levels = nn.ModuleList(blocks(n, count) for n, count in zip(wide, deep))
        self.up = nn.ModuleList(conv(b, a, 1) for a, b in zip(wide, wide[1:]))
        self.joined = nn.ModuleList(blocks(n, 1) for n in wide[:-1])
        self.narrow = conv(wide[0], shape.head, 1)
        self.head = nn.Sequential(conv(shape.head, shape.head, 3, gain=1.4), nn.LeakyReLU(0.1))
        self.picture = conv(shape.head, 3, 3, gain=0.2)

    def forward(self, features: torch.Tensor) -> torch.Tensor:
        """`features` (b, columns + 3, h, w); RGB (b, 3, 2 h, 2 w), 0 to 1 but not clamped."""
        x = self.encoder(features) * (features[:, -1:] > 0)
        kept = []
        for at, level in enumerate(self.levels):
            if at:
                kept.append(x)
                x = self.down[at - 1](x)
            x = level(x)
        for at in reversed(range(len(kept))):
            x = functional.interpolate(self.up[at](x), size=kept[at].shape[-2:], mode="bilinear", align_corners=False)
            x = self.joined[at](kept[at] + x)
        x = functional.interpolate(self.narrow(bent(x)), scale_factor=2, mode="nearest")
        return self.picture(self.head(x)) + 0.5
