"""Weights of an inverter to ONNX, with a golden input and output beside it: `export.py WEIGHTS OUT`, a folder.

Input `features` (1, columns + 3, h, w), output `picture` (1, 3, 2 h, 2 w), RGB from 0 to 1 but not clamped. Weights are
stored in 16 bits.
"""

import argparse
import pathlib
import sys

import torch

import weights

sys.path.append(str(pathlib.Path(__file__).parents[1] / "export"))
from common import blobs, export, halve, write_golden  # noqa: E402


class Pictures(torch.nn.Module):
    """The network, its output as a tuple."""

    def __init__(self, network: weights.Network):
        super().__init__()
        self.network = network

    def forward(self, features: torch.Tensor) -> tuple[torch.Tensor]:
        return (self.network(features),)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("weights", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    options = parser.parse_args()
    torch.set_num_threads(1)
    network, _ = weights.load(options.weights)
    wrapped = Pictures(network).eval()
    # Sides that none of the levels divides.
    inputs = {"features": blobs(network.shape.columns + 3, 13, 22) - 0.4}
    path = options.out / f"{options.out.name}.onnx"
    with torch.inference_mode():
        export(wrapped, inputs, ["picture"], {"features": {2: "h", 3: "w"}, "picture": {2: "H", 3: "W"}}, path)
        halve(path)
        write_golden(wrapped, inputs, ["picture"], path, options.out / "golden.safetensors")


if __name__ == "__main__":
    main()
