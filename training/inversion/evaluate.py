"""Measures pictures of whole photos: `evaluate.py WEIGHTS PREPARED/SET.. --lpips FILE [--images N] [--sheet FILE]`. WEIGHTS may also
be an exported network (.onnx) for SIFT.

Prints SSIM (mean of the channels), PSNR and LPIPS (squeeze) at half the photos' size: for the true keypoints, without and with
their colors, and for keypoints with errors. For the true ones also at the photos' size, to which pictures are enlarged.
"""

import argparse
import pathlib

import torch
from torch.nn import functional

import metrics
import weights
from batches import Photos, channels, feature_image
from model import Shape

# Errors of keypoints: sigma in pixels (moved), or percent (elsewhere, swapped).
ERRORS = ["half", "moved 2", "moved 5", "moved 10", "elsewhere 10", "elsewhere 30", "swapped 30"]


class Exported:
    """A network in an ONNX file."""

    def __init__(self, path: pathlib.Path):
        import onnxruntime

        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        self.session, self.shape = onnxruntime.InferenceSession(str(path), options), Shape()

    def __call__(self, features: torch.Tensor) -> torch.Tensor:
        return torch.from_numpy(self.session.run(None, {"features": features.numpy()})[0])


def seen(photos: Photos, at: int, how: str, colors: bool) -> torch.Tensor:
    """Returns the feature image of a photo's points: `how` is "true", "colors" or one of ERRORS. `colors`: the network takes colors."""
    random = torch.Generator(photos.device).manual_seed(1)
    rand = lambda *shape: torch.rand(*shape, generator=random, device=photos.device)  # noqa: E731
    rows = torch.arange(int(photos.first[at]), int(photos.first[at + 1]), device=photos.device)
    what, _, much = how.partition(" ")
    if what == "half":
        rows = rows[rand(len(rows)) < 0.5]
    places, sources = photos.keypoints[rows], rows.clone()
    if what == "moved":
        places = places + float(much) * torch.randn(len(rows), 2, generator=random, device=photos.device)
    elif what == "elsewhere":
        chosen = rand(len(rows)) < float(much) / 100
        places = torch.where(chosen[:, None], rand(len(rows), 2) * torch.tensor(photos.size[at], device=photos.device), places)
    elif what == "swapped":
        chosen = torch.nonzero(rand(len(rows)) < float(much) / 100)[:, 0]
        sources[chosen] = rows[chosen[torch.argsort(rand(len(chosen)))]]
    known = torch.full((len(rows),), float(what == "colors"), device=photos.device)
    values = channels(photos.descriptors[sources], photos.colors(rows) if colors else None, known)
    size = tuple(int(side) // 4 * 4 for side in photos.size[at])
    return feature_image(places.float(), values, torch.ones_like(known), torch.zeros_like(rows), 1, size)


def photo(photos: Photos, at: int, full: bool = False) -> torch.Tensor:
    """Returns a photo (1, 3, h, w) from 0 to 1, at half its size or its `full` size."""
    wide, high = (int(side) // 4 * 4 for side in photos.size[at])
    pixels = photos.pixels[at, :high, :wide].permute(2, 0, 1)[None].float() / 255
    return pixels if full else functional.avg_pool2d(pixels, 2)


@torch.inference_mode()
def pictures(network, photos: Photos, at: int, how: str) -> torch.Tensor:
    """Returns the picture (1, 3, h, w) that the network paints of a photo's points."""
    return network(seen(photos, at, how, bool(network.shape.colors)).contiguous()).float().clamp(0, 1)


@torch.inference_mode()
def measure(network, distance: metrics.Lpips, photos: Photos, how: str, images: int | None = None, full: bool = False) -> list[float]:
    """Returns the mean SSIM, PSNR and LPIPS, at half the photos' size or their `full` size."""
    rows = []
    for at in range(len(photos))[:images]:
        made, real = pictures(network, photos, at, how), photo(photos, at, full)
        if full:
            made = functional.interpolate(made, size=real.shape[-2:], mode="bicubic", align_corners=False).clamp(0, 1)
        rows.append([metrics.ssim(made, real), metrics.psnr(made, real), distance(made, real)])
    return torch.tensor(rows).mean(0).tolist()


def sheet(network, photos: Photos, indices: list[int], path: pathlib.Path):
    """Writes a row for each photo: the photo, and the pictures of its keypoints without and with colors."""
    from PIL import Image

    rows = []
    for at in indices:
        row = [photo(photos, at), pictures(network, photos, at, "true")]
        if network.shape.colors:
            row.append(pictures(network, photos, at, "colors"))
        row = torch.cat([functional.pad(part, (0, 320 - part.shape[3], 0, 320 - part.shape[2])) for part in row], 3)
        rows.append((row[0].permute(1, 2, 0) * 255).round().byte().cpu())
    Image.fromarray(torch.cat(rows).numpy()).save(path, quality=92)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("weights", type=pathlib.Path)
    parser.add_argument("data", type=pathlib.Path, nargs="+")
    parser.add_argument("--lpips", type=pathlib.Path, required=True)
    parser.add_argument("--images", type=int, help="largest number of photos")
    parser.add_argument("--sheet", type=pathlib.Path, help="writes an image of the first ten photos beside their pictures")
    options = parser.parse_args()
    if options.weights.suffix == ".onnx":
        network = Exported(options.weights)
    else:
        network, about = weights.load(options.weights)
        print(about)
    distance = metrics.Lpips(options.lpips)
    photos = Photos(options.data, "cpu")
    true = ["true", "colors"][: 1 + network.shape.colors]
    for how, full in [(how, False) for how in true + ERRORS] + [(how, True) for how in true]:
        figures = measure(network, distance, photos, how, options.images, full)
        print(how + ", full size" * full, *(f"{figure:.3f}" for figure in figures))
    if options.sheet:
        sheet(network, photos, list(range(min(10, len(photos)))), options.sheet)


if __name__ == "__main__":
    main()
