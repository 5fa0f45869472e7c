"""SuperPoint from the weights that its owner publishes, as an ONNX file for `unlift`.

    python export/superpoint.py superpoint_v1.pth ~/.local/share/unlift/models
    python export/superpoint.py --random FOLDER

The weights (https://github.com/magicleap/SuperPointPretrainedNetwork) are for non-commercial research and may not be
passed on, so neither they nor the file made of them are in this repository. The second form makes a narrow network of
seeded random weights, and what the steps below find on a made-up image: the fixture of
`cargo test -p unlift-vision --test vision superpoint`.

Written from the paper (DeTone, Malisiewicz, Rabinovich: "SuperPoint: Self-Supervised Interest Point Detection and
Description", CVPR workshops 2018) and the names of the published weights:

    image (1, 1, H, W), gray, 0..1 -> score (1, 8 h, 8 w), coarse (1, h, w, 256), h = H // 8, w = W // 8

`score` is the softmax of the 65 classes of every cell without the last one, which says that there is nothing;
`coarse` are descriptors per cell, of length 1.
"""

import argparse
import hashlib
from pathlib import Path

import torch
import torch.nn.functional as F
from safetensors.torch import save_file
from torch import nn

from common import blobs, compare, export

PUBLISHED = "52b6708629640ca883673b5d5c097c4ddad37d8048b33f09c8ca0d69db12c40e"
CELL = 8
# Channels of the four stages, of the heads, and of a descriptor.
WIDTHS = [64, 64, 128, 128, 256, 256]
NARROW = [3, 4, 5, 6, 8, 16]
# As hloc has it.
RADIUS, BORDER, THRESHOLD = 4, 4, 0.005


def shapes(widths):
    """Names and shapes of all weights, as they are published."""
    *stages, head, dim = widths
    found, before = {}, 1
    for at, width in enumerate(stages, start=1):
        found |= {f"conv{at}a": (width, before, 3, 3), f"conv{at}b": (width, width, 3, 3)}
        before = width
    found |= {"convPa": (head, before, 3, 3), "convPb": (CELL * CELL + 1, head, 1, 1)}
    found |= {"convDa": (head, before, 3, 3), "convDb": (dim, head, 1, 1)}
    return found


class SuperPoint(nn.Module):
    def __init__(self, weights, widths=None):
        super().__init__()
        for name, shape in shapes(widths or WIDTHS).items():
            found = tuple(weights[f"{name}.weight"].shape)
            assert found == shape, f"{name}: expected {shape}, found {found}"
        self.weights = {name: value.float() for name, value in weights.items()}

    def layer(self, x, name):
        weight = self.weights[f"{name}.weight"]
        return F.conv2d(x, weight, self.weights[f"{name}.bias"], padding=weight.shape[-1] // 2)

    def forward(self, image):
        x = image
        for stage in (1, 2, 3, 4):
            if stage > 1:
                x = F.max_pool2d(x, 2)
            for part in "ab":
                x = F.relu(self.layer(x, f"conv{stage}{part}"))
        score = self.layer(F.relu(self.layer(x, "convPa")), "convPb").softmax(1)[:, :-1]
        coarse = self.layer(F.relu(self.layer(x, "convDa")), "convDb")
        return F.pixel_shuffle(score, CELL)[:, 0], F.normalize(coarse, dim=1).permute(0, 2, 3, 1)


def maxima(score):
    """Maxima of `score` (H, W), none within the radius of a better one: three passes."""

    def largest(x):
        return F.max_pool2d(x[None, None], 2 * RADIUS + 1, stride=1, padding=RADIUS)[0, 0]

    taken = score == largest(score)
    for _ in range(2):
        hidden = largest(taken.float()) > 0
        rest = score.masked_fill(hidden, 0)
        taken |= (rest == largest(rest)) & ~hidden
    return taken


def features(network, image):
    """Keypoints (x, y), scores and descriptors of an image, the best first."""
    score, coarse = network(image)
    score = score[0]
    height, width = score.shape
    wanted = maxima(score) & (score > THRESHOLD)
    inside = torch.zeros_like(wanted)
    inside[BORDER : height - BORDER, BORDER : width - BORDER] = True
    y, x = torch.nonzero(wanted & inside, as_tuple=True)
    order = torch.argsort(score[y, x], descending=True, stable=True)
    x, y = x[order], y[order]
    # A cell's descriptor stands at its middle; the scale is that of the authors' code.
    places = torch.stack([x, y], dim=1).float() - CELL / 2 + 0.5
    places /= torch.tensor([width - CELL / 2 - 0.5, height - CELL / 2 - 0.5])
    found = F.grid_sample(coarse.permute(0, 3, 1, 2), (2 * places - 1)[None, None], align_corners=True)
    descriptors = F.normalize(found[0, :, 0].T, dim=1)
    return torch.stack([x, y], dim=1).float(), score[y, x], descriptors


def write(network, folder):
    inputs = {"image": blobs(1, 64, 88)}
    outputs = ["score", "coarse"]
    dynamic = {
        "image": {2: "height", 3: "width"},
        "score": {1: "score_height", 2: "score_width"},
        "coarse": {1: "rows", 2: "columns"},
    }
    path = folder / "superpoint.onnx"
    export(network, inputs, outputs, dynamic, path)
    compare(network, inputs, outputs, path)


def random(folder):
    generator = torch.Generator().manual_seed(0)
    weights = {}
    for name, shape in shapes(NARROW).items():
        spread = (2 / (shape[1] * shape[2] * shape[3])) ** 0.5
        weights[f"{name}.weight"] = spread * torch.randn(shape, generator=generator)
        weights[f"{name}.bias"] = 0.1 * torch.randn(shape[:1], generator=generator)
    # So that some places win clearly.
    weights["convPb.weight"] *= 4
    network = SuperPoint(weights, NARROW).eval()
    write(network, folder)
    # Sides that are no multiples of a cell; bytes, as a photo has them.
    image = (255 * blobs(1, 75, 101)).round()
    keypoints, scores, descriptors = features(network, image / 255)
    golden = {"image": image[0, 0].to(torch.uint8), "keypoints": keypoints}
    golden |= {"scores": scores, "descriptors": descriptors}
    save_file({name: value.contiguous() for name, value in golden.items()}, folder / "golden.safetensors")
    print(f"{len(keypoints)} keypoints")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("weights", type=Path, nargs="?", help="superpoint_v1.pth")
    parser.add_argument("out", type=Path, help="folder of models")
    parser.add_argument("--random", action="store_true", help="seeded random weights")
    args = parser.parse_args()
    torch.set_num_threads(1)
    with torch.no_grad():
        if args.random:
            return random(args.out)
        if args.weights is None:
            parser.error("expected the published weights")
        hash = hashlib.sha256(args.weights.read_bytes()).hexdigest()
        if hash != PUBLISHED:
            print(f"note: not the published file: expected SHA-256 {PUBLISHED}, found {hash}")
        weights = torch.load(args.weights, map_location="cpu", weights_only=True)
        write(SuperPoint(weights).eval(), args.out)


if __name__ == "__main__":
    main()
