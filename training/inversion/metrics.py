"""SSIM, PSNR and LPIPS of pictures (b, 3, h, w) from 0 to 1, as losses and as figures."""

import pathlib

import torch
from safetensors.torch import load_file
from torch.nn import functional


def ssim(a: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
    """Mean over pixels and channels, `(b,)`: uniform windows of 7 x 7 as scikit-image has them by default."""

    def mean(x):
        return functional.avg_pool2d(x, 7, 1)

    at_a, at_b = mean(a), mean(b)
    unbiased = 49 / 48
    aa, bb = unbiased * (mean(a * a) - at_a**2), unbiased * (mean(b * b) - at_b**2)
    ab = unbiased * (mean(a * b) - at_a * at_b)
    c1, c2 = 0.01**2, 0.03**2
    s = (2 * at_a * at_b + c1) * (2 * ab + c2) / ((at_a**2 + at_b**2 + c1) * (aa + bb + c2))
    return s.mean((1, 2, 3))


def psnr(a: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
    """Decibels of each picture, `(b,)`."""
    return -10 * (a - b).square().mean((1, 2, 3)).log10()


class Lpips(torch.nn.Module):
    """LPIPS v0.1 on SqueezeNet 1.1, from `lpips_squeeze_v0.1.safetensors`."""

    def __init__(self, path: pathlib.Path, device: str = "cpu"):
        super().__init__()
        self.tensors = load_file(path, device)
        self.shift = self.tensors["scaling_layer.shift"].view(1, 3, 1, 1)
        self.scale = self.tensors["scaling_layer.scale"].view(1, 3, 1, 1)

    def _conv(self, name: str, x: torch.Tensor, **options) -> torch.Tensor:
        return functional.conv2d(x, self.tensors[f"{name}.weight"], self.tensors[f"{name}.bias"], **options).relu()

    def features(self, x: torch.Tensor) -> list[torch.Tensor]:
        x = (2 * x - 1 - self.shift) / self.scale
        x = self._conv("features.0", x, stride=2)
        found = [x]
        for fire in (3, 4, 6, 7, 9, 10, 11, 12):
            if fire in (3, 6, 9):
                x = functional.max_pool2d(x, 3, 2, ceil_mode=True)
            x = self._conv(f"features.{fire}.squeeze", x)
            sides = self._conv(f"features.{fire}.expand1x1", x), self._conv(f"features.{fire}.expand3x3", x, padding=1)
            x = torch.cat(sides, 1)
            if fire not in (3, 6):
                found.append(x)
        return [part / (part.square().sum(1, keepdim=True) + 1e-12).sqrt() for part in found]

    def between(self, a: list[torch.Tensor], b: list[torch.Tensor]) -> torch.Tensor:
        """Distance of each picture from what `features` says of both, `(b,)`."""
        total = 0
        for at, (x, y) in enumerate(zip(a, b)):
            weight = self.tensors[f"lin{at}.model.1.weight"]
            total = total + functional.conv2d((x - y).square(), weight).mean((1, 2, 3))
        return total

    def forward(self, a: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
        return self.between(self.features(a), self.features(b))
