"""The distance LPIPS as one ONNX file that `unlift` carries: `lpips.py lpips_squeeze_v0.1.safetensors OUT`.

Inputs `a` and `b` (1, 3, h, w) from 0 to 1, output `distance` (1,), 32-bit floats, any size. Beside it comes
golden.safetensors.
"""

import argparse
import pathlib
import sys

import torch

from metrics import Lpips

sys.path.append(str(pathlib.Path(__file__).parents[1] / "export"))
from common import blobs, export, write_golden  # noqa: E402


class Distance(torch.nn.Module):
    """Both pictures at once, so that weights are stored once."""

    def __init__(self, lpips: Lpips):
        super().__init__()
        self.lpips = lpips

    def forward(self, a: torch.Tensor, b: torch.Tensor) -> tuple[torch.Tensor]:
        features = self.lpips.features(torch.cat([a, b]))
        return (self.lpips.between([part[:1] for part in features], [part[1:] for part in features]),)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("weights", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path, help="a folder")
    options = parser.parse_args()
    network = Distance(Lpips(options.weights)).eval()
    a = blobs(3, 64, 96)
    inputs = {"a": a, "b": a.flip(3).contiguous() * 0.8}
    sizes = {2: "h", 3: "w"}
    path = options.out / f"{options.out.name}.onnx"
    with torch.inference_mode():
        export(network, inputs, ["distance"], {"a": sizes, "b": sizes}, path)
        write_golden(network, inputs, ["distance"], path, options.out / "golden.safetensors")


if __name__ == "__main__":
    main()
