"""Weights to ONNX, with a small golden input and output: `export.py WEIGHTS OUT.onnx`.

Inputs `descriptors` (n, columns) of unit length and `pairs` (reaches, n, n) in standard deviations, output `scores`
(n, n), 32-bit floats, any n. Beside OUT comes golden.safetensors: an input by a formula and what PyTorch makes of
it. Fails when onnxruntime differs from PyTorch by more than 1e-4 of the largest score.
"""

import argparse
import pathlib

import numpy
import onnx
import onnxruntime
import torch
from safetensors.torch import save_file

from model import Network
from weights import load

TOLERANCE = 1e-4


def example(network: Network, n: int) -> tuple[torch.Tensor, torch.Tensor]:
    """An input that is a formula: descriptors of unit length, symmetric pair scores."""
    shape = network.shape
    row = torch.arange(n, dtype=torch.float64)
    column = torch.arange(shape.columns, dtype=torch.float64)
    values = (1 + torch.sin(row[:, None] * 0.7 + column * 1.3 + row[:, None] * column * 0.011)).square()
    descriptors = torch.nn.functional.normalize(values, dim=-1)
    reach = torch.arange(shape.reaches, dtype=torch.float64)[:, None, None]
    pairs = 3 * torch.sin(row[:, None] * row * 0.13 + reach * 0.9) + 1
    pairs.diagonal(dim1=-2, dim2=-1).zero_()
    return descriptors.float(), pairs.float()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("weights", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    options = parser.parse_args()
    torch.set_num_threads(1)
    network, about = load(options.weights)
    network.eval()
    torch.onnx.export(
        network,
        example(network, 70),
        options.out,
        input_names=["descriptors", "pairs"],
        output_names=["scores"],
        dynamic_axes={"descriptors": {0: "n"}, "pairs": {1: "n", 2: "n"}, "scores": {0: "n", 1: "n"}},
        opset_version=17,
        dynamo=False,
    )
    model = onnx.load(options.out)
    for key, value in sorted(about.items()):
        entry = model.metadata_props.add()
        entry.key, entry.value = key, value
    onnx.checker.check_model(model)
    onnx.save(model, options.out)
    print(*sorted({node.op_type for node in model.graph.node}))
    session = onnxruntime.InferenceSession(options.out, providers=["CPUExecutionProvider"])
    for n in (40, 300):
        descriptors, pairs = example(network, n)
        with torch.inference_mode():
            scores = network(descriptors, pairs)
        found = session.run(None, {"descriptors": descriptors.numpy(), "pairs": pairs.numpy()})[0]
        apart = numpy.abs(found - scores.numpy()).max() / scores.abs().max().item()
        print(f"n = {n}: apart by {apart:.1e} of the largest score")
        assert apart < TOLERANCE, "onnxruntime and PyTorch differ"
        if n == 40:
            golden = {"descriptors": descriptors, "pairs": pairs, "scores": scores.contiguous()}
            save_file(golden, options.out.with_name("golden.safetensors"))


if __name__ == "__main__":
    main()
