"""ALIKED (aliked-n16rot) as one ONNX file that `unlift` carries.

    python export/aliked.py aliked_n16rot.safetensors ../crates/unlift-vision/models/aliked-n16rot

Written from the paper (Zhao et al., "ALIKED: A Lighter Keypoint and Descriptor Extraction Network via
Deformable Transformation", 2023) and the names of the published weights. The file holds three networks
that share nothing but the file, so that whoever runs it never makes a map of descriptors for all pixels:

    image   (1, 3, H, W)    -> score (1, 1, H, W), level1 (1, 32, H, W),
                               level2 .. level4 (1, H/s, W/s, 32), s = 2, 8, 32
    patch   (N, 9, 128)     -> offsets (N, 2, 16)
    samples (N, 16, 128)    -> descriptors (N, 128)

H and W are multiples of 32, N is any number. A pixel's descriptor is what the four levels say there (bilinear,
corners aligned), joined to 128 numbers and brought to length 1; `patch` are those of the 3 x 3 pixels around a
keypoint in reading order, `samples` those at the keypoint plus its 16 offsets (all x, then all y).
"""

import argparse
from pathlib import Path

import torch
import torch.nn.functional as F
from safetensors.torch import load_file
from torch import nn

from common import blobs, export, write_golden

ALPHA, SCALE = 1.6732632423543772, 1.0507009873554805
CHANNELS = 32
TAPS = 9


def selu(x):
    """SELU in the operators that rten has."""
    return SCALE * F.elu(x, alpha=ALPHA)


def folded(weights, conv, norm):
    """A convolution without bias and the batch normalization behind it, as one weight and one bias."""
    gain = weights[f"{norm}.weight"] / torch.sqrt(weights[f"{norm}.running_var"] + 1e-5)
    weight = weights[f"{conv}.weight"] * gain[:, None, None, None]
    return weight, weights[f"{norm}.bias"] - weights[f"{norm}.running_mean"] * gain


def deformable(x, offset_weight, offset_bias, weight, bias):
    """A 3 x 3 convolution whose taps are moved, pixel by pixel, by offsets (dy, dx) that are convolved from `x`.

    All nine taps are one sampling of `x` and one 1 x 1 convolution of the samples: operators that every runtime has.
    """
    channels = weight.shape[1]
    height, width = x.shape[2], x.shape[3]
    offset = F.conv2d(x, offset_weight, offset_bias, padding=1)
    most = torch.max(torch._shape_as_tensor(x)[2:]).to(x.dtype) / 4
    offset = torch.minimum(torch.maximum(offset, -most), most)
    offset = offset.reshape(TAPS, 2, height, width)
    tap = torch.arange(TAPS, dtype=x.dtype)
    rows = torch.arange(height, dtype=x.dtype).reshape(1, -1, 1)
    columns = torch.arange(width, dtype=x.dtype).reshape(1, 1, -1)
    y = rows + (torch.floor(tap / 3) - 1).reshape(-1, 1, 1) + offset[:, 0]
    x_ = columns + (torch.remainder(tap, 3) - 1).reshape(-1, 1, 1) + offset[:, 1]
    # Corners not aligned: the middle of pixel p is at (2 p + 1) / n - 1.
    y = (2 * y + 1) / height - 1
    x_ = (2 * x_ + 1) / width - 1
    grid = torch.stack([x_, y], dim=-1).reshape(1, TAPS * height, width, 2)
    samples = F.grid_sample(x, grid, mode="bilinear", padding_mode="zeros", align_corners=False)
    samples = samples.reshape(1, channels * TAPS, height, width)
    return F.conv2d(samples, weight.reshape(weight.shape[0], channels * TAPS, 1, 1), bias)


class Aliked(nn.Module):
    """The three networks; `forward` runs all of them."""

    def __init__(self, weights):
        super().__init__()
        layers = {
            f"{block}.{n}": folded(weights, f"{block}.conv{n}{inner}", f"{block}.bn{n}")
            for block, inner in [("block1", ""), ("block2", "")]
            + [("block3", ".regular_conv"), ("block4", ".regular_conv")]
            for n in (1, 2)
        }
        for block in ("block2", "block3", "block4"):
            name = f"{block}.downsample"
            layers[name] = (weights[f"{name}.weight"], weights[f"{name}.bias"])
        for block in ("block3", "block4"):
            for n in (1, 2):
                name = f"{block}.conv{n}.offset_conv"
                layers[f"{block}.offset{n}"] = (weights[f"{name}.weight"], weights[f"{name}.bias"])
        self.layers = layers
        self.to_level = [weights[f"conv{n}.weight"] for n in (1, 2, 3, 4)]
        self.score = [weights[f"score_head.{n}.weight"] for n in (0, 2, 4, 6)]
        head = "desc_head.offset_conv"
        # (32, 128, 3, 3) to rows over (3 x 3, 128).
        first = weights[f"{head}.0.weight"].permute(2, 3, 1, 0).reshape(TAPS * 4 * CHANNELS, -1)
        second = weights[f"{head}.2.weight"][:, :, 0, 0].T
        self.offset = [(first, weights[f"{head}.0.bias"]), (second, weights[f"{head}.2.bias"])]
        self.sample = weights["desc_head.sf_conv.weight"][:, :, 0, 0].T.contiguous()
        self.aggregate = weights["desc_head.agg_weights"].reshape(-1, 4 * CHANNELS)

    def residual(self, x, block):
        """Two convolutions, deformable in the coarse blocks, added to a 1 x 1 convolution of the input."""
        y = x
        for n in (1, 2):
            weight, bias = self.layers[f"{block}.{n}"]
            if f"{block}.offset{n}" in self.layers:
                y = deformable(y, *self.layers[f"{block}.offset{n}"], weight, bias)
            else:
                y = F.conv2d(y, weight, bias, padding=1)
            if n == 1:
                y = selu(y)
        return selu(y + F.conv2d(x, *self.layers[f"{block}.downsample"]))

    def dense(self, image):
        """Scores of all pixels, and the four levels."""
        x = image
        for n in (1, 2):
            x = selu(F.conv2d(x, *self.layers[f"block1.{n}"], padding=1))
        stages = [x]
        for block, shrink in (("block2", 2), ("block3", 4), ("block4", 4)):
            x = self.residual(F.avg_pool2d(x, shrink), block)
            stages.append(x)
        levels = [selu(F.conv2d(x, weight)) for x, weight in zip(stages, self.to_level)]
        # The first layer of the score is linear and sees one pixel at a time, as enlarging is and keeps weights:
        # eight channels are enlarged in place of 32.
        parts = self.score[0].split(CHANNELS, dim=1)
        score = F.conv2d(levels[0], parts[0])
        for level, part, scale in zip(levels[1:], parts[1:], (2, 8, 32)):
            coarse = F.conv2d(level, part)
            score = score + F.interpolate(
                coarse, scale_factor=float(scale), mode="bilinear", align_corners=True
            )
        for weight in self.score[1:]:
            score = F.conv2d(selu(score), weight, padding=1)
        # Coarse levels are read between pixels, all channels at once; turning the finest would take a tenth of the time.
        coarse = [level.permute(0, 2, 3, 1) for level in levels[1:]]
        return torch.sigmoid(score), levels[0], *coarse

    def offsets(self, patch):
        """Where around a keypoint to look, in pixels, not yet limited: all x, then all y."""
        (first, first_bias), (second, second_bias) = self.offset
        x = selu(patch.reshape(-1, TAPS * 4 * CHANNELS) @ first + first_bias)
        return (x @ second + second_bias).reshape(-1, 2, 16)

    def descriptors(self, samples):
        """What was seen there, as one vector of length 1."""
        x = selu(samples @ self.sample).reshape(-1, 16 * 4 * CHANNELS)
        return F.normalize(x @ self.aggregate, dim=1)

    def forward(self, image, patch, samples):
        return *self.dense(image), self.offsets(patch), self.descriptors(samples)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("weights", type=Path, help="aliked_n16rot.safetensors")
    parser.add_argument("out", type=Path, help="folder of the model")
    args = parser.parse_args()
    torch.set_num_threads(1)
    network = Aliked(load_file(args.weights)).eval()
    inputs = {
        "image": blobs(3, 32, 64),
        "patch": F.normalize(blobs(2 * TAPS, 8, 16).reshape(2, TAPS, 128), dim=-1),
        "samples": F.normalize(blobs(2 * 16, 8, 16).reshape(2, 16, 128), dim=-1),
    }
    outputs = ["score", "level1", "level2", "level3", "level4", "offsets", "descriptors"]
    dynamic = {"image": {2: "height", 3: "width"}, "patch": {0: "patches"}, "samples": {0: "keypoints"}}
    for at, name in enumerate(outputs[:5]):
        axes = (2, 3) if at < 2 else (1, 2)
        dynamic[name] = {axis: f"{name}_{side}" for axis, side in zip(axes, ("height", "width"))}
    dynamic |= {"offsets": {0: "patches"}, "descriptors": {0: "keypoints"}}
    path = args.out / "aliked-n16rot.onnx"
    with torch.no_grad():
        export(network, inputs, outputs, dynamic, path)
        write_golden(network, inputs, outputs, path, args.out / "golden.safetensors")


if __name__ == "__main__":
    main()
