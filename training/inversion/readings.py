"""Shows how much SSIM depends on its settings, which papers rarely state: `readings.py NETWORK.onnx PREPARED/SET`.

Prints means over whole photos at full size: of pictures of the true keypoints, and as references of a gray image and of a
thumbnail of 20 x 15 pixels, enlarged. NETWORK is an exported network for colored points.
"""

import argparse
import pathlib

import torch
from torch.nn import functional

from batches import Photos
from evaluate import Exported, photo, pictures
from metrics import ssim

LIGHT = torch.tensor([0.299, 0.587, 0.114]).view(1, 3, 1, 1)


def settings(made: torch.Tensor, real: torch.Tensor) -> list[float]:
    """Returns SSIM of colors and of gray, by uniform and Gaussian windows, each for a range of 1 and of 2.

    scikit-image took a range of 2 for floats by default for years."""
    pairs = [(made, real), ((made * LIGHT).sum(1, keepdim=True), (real * LIGHT).sum(1, keepdim=True))]
    return [ssim(a, b, peak, gaussian).item() for a, b in pairs for gaussian in (False, True) for peak in (1.0, 2.0)]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("network", type=pathlib.Path)
    parser.add_argument("data", type=pathlib.Path, nargs="+")
    parser.add_argument("--images", type=int)
    options = parser.parse_args()
    torch.set_num_threads(1)
    network = Exported(options.network)
    photos = Photos(options.data, "cpu")
    found = {"pictures": [], "gray": [], "thumbnail": []}
    for at in range(len(photos))[: options.images]:
        real = photo(photos, at, full=True)
        small = functional.interpolate(real, size=(15, 20), mode="area")
        full = lambda x: functional.interpolate(x, size=real.shape[-2:], mode="bicubic", align_corners=False).clamp(0, 1)  # noqa: E731
        for name, shown in [("pictures", full(pictures(network, photos, at, "true"))), ("gray", torch.full_like(real, 0.5)), ("thumbnail", full(small))]:
            found[name].append(settings(shown, real))
    print("colors 7x7: range 1, 2; Gaussian: range 1, 2; gray 7x7: range 1, 2; Gaussian: range 1, 2")
    for name, rows in found.items():
        print(name, *(f"{figure:.3f}" for figure in torch.tensor(rows).mean(0).tolist()))


if __name__ == "__main__":
    main()
