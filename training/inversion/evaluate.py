"""How good pictures of whole photos are: `evaluate.py WEIGHTS PREPARED --lpips FILE [--images N] [--pictures DIR]`.

SSIM (mean of the channels), PSNR and LPIPS (squeeze) at half the photos' size, of the true keypoints and of what
recovery could leave of them; of the true ones also at the photos' size, to which pictures are enlarged.
"""

import argparse
import pathlib

import numpy
import torch
from PIL import Image
from torch.nn import functional

import data
import metrics
import weights
from raster import raster

WORN = ["true", "half", "moved 2", "moved 5", "moved 10", "elsewhere 10", "elsewhere 30", "swapped 30"]


def seen(photo: data.Photo, how: str) -> numpy.ndarray:
    """The feature image of a photo's points, worn as `how` says: pixels, per cents."""
    random = numpy.random.default_rng(1)
    places, descriptors = photo.places.copy(), photo.descriptors.copy()
    n = len(places)
    what, _, much = how.partition(" ")
    if what == "half":
        kept = random.random(n) < 0.5
        places, descriptors = places[kept], descriptors[kept]
    elif what == "moved":
        places += random.normal(0, float(much), places.shape)
    elif what == "elsewhere":
        chosen = random.random(n) < float(much) / 100
        places[chosen] = random.random((chosen.sum(), 2)) * photo.pixels.shape[1::-1]
    elif what == "swapped":
        chosen = numpy.flatnonzero(random.random(n) < float(much) / 100)
        descriptors[chosen] = descriptors[random.permutation(chosen)]
    ones = numpy.ones(len(places), numpy.float32)
    high, wide = (side // 4 * 4 for side in photo.pixels.shape[:2])
    return raster(places, descriptors, ones, (wide, high))


def pictures(network, photo: data.Photo, how: str) -> tuple[torch.Tensor, torch.Tensor]:
    """What the network makes, and the photo at the same size."""
    high, wide = (side // 4 * 4 for side in photo.pixels.shape[:2])
    with torch.inference_mode():
        made = network(torch.from_numpy(seen(photo, how))[None]).clamp(0, 1)
    return made, torch.from_numpy(data.shrunk(photo.pixels[:high, :wide]))[None]


def enlarged(made: torch.Tensor, photo: data.Photo) -> tuple[torch.Tensor, torch.Tensor]:
    """The picture at the photo's size (bicubic), and the photo."""
    real = torch.from_numpy(photo.pixels.transpose(2, 0, 1).astype(numpy.float32) / 255)[None]
    high, wide = (2 * side for side in made.shape[-2:])
    made = functional.interpolate(made, size=(high, wide), mode="bicubic", align_corners=False).clamp(0, 1)
    return made, real[..., :high, :wide].contiguous()


def measure(network, distance: metrics.Lpips, photos: list[data.Photo], how: str, full: bool = False) -> list[float]:
    """Means of SSIM, PSNR and LPIPS, at half the photos' size or at the `full` one."""
    rows = []
    for photo in photos:
        made, real = pictures(network, photo, how)
        if full:
            made, real = enlarged(made, photo)
        with torch.inference_mode():
            rows.append([metrics.ssim(made, real), metrics.psnr(made, real), distance(made, real)])
    return torch.tensor(rows).mean(0).tolist()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("weights", type=pathlib.Path)
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("--lpips", type=pathlib.Path, required=True)
    parser.add_argument("--images", type=int)
    parser.add_argument("--pictures", type=pathlib.Path, help="folder that gets the photo above the picture")
    options = parser.parse_args()
    torch.set_num_threads(1)
    network, about = weights.load(options.weights)
    print(about)
    distance = metrics.Lpips(options.lpips)
    photos = data.photos(options.data, options.images)
    for how in WORN:
        print(how, *(f"{figure:.3f}" for figure in measure(network, distance, photos, how)))
    print("true, full size", *(f"{figure:.3f}" for figure in measure(network, distance, photos, "true", full=True)))
    if options.pictures:
        options.pictures.mkdir(parents=True, exist_ok=True)
        for at, photo in enumerate(photos):
            rows = [part[0].permute(1, 2, 0) for part in reversed(pictures(network, photo, "true"))]
            stacked = (torch.cat(rows) * 255).round().byte().numpy()
            Image.fromarray(stacked).save(options.pictures / f"{at:03}.png")


if __name__ == "__main__":
    main()
