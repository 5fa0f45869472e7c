"""What all exports share: writing ONNX, and the golden output beside it."""

import hashlib
import math

import numpy as np
import onnx
import onnxruntime
import torch
from safetensors.torch import save_file

# What rten reads and all operators that are used have.
OPSET = 17
# Of outputs longer than this a golden file keeps every 37th number, in reading order.
LONG, STRIDE = 4096, 37
# Largest difference between PyTorch and the exported file, of values of about 1.
TOLERANCE = 1e-4


def blobs(channels, height, width):
    """A made-up input in 0..1: waves of several lengths and directions. Shape (1, channels, height, width)."""
    y, x = torch.meshgrid(torch.arange(height).double(), torch.arange(width).double(), indexing="ij")
    planes = [
        0.5
        + 0.25 * torch.sin(x * (0.31 + 0.07 * (c % 7)) + y * 0.11 + c)
        + 0.25 * torch.sin(y * (0.43 - 0.05 * (c % 5)) - x * 0.17 + math.sqrt(c))
        for c in range(channels)
    ]
    return torch.stack(planes)[None].float()


def export(network, inputs, outputs, dynamic, path):
    """Writes `network` to `path`, one file with everything in it, the same bytes every time."""
    path.parent.mkdir(parents=True, exist_ok=True)
    torch.onnx.export(
        network,
        tuple(inputs.values()),
        str(path),
        input_names=list(inputs),
        output_names=outputs,
        dynamic_axes=dynamic,
        opset_version=OPSET,
        dynamo=False,
    )
    model = onnx.load(path)
    # Names of scopes tell where a file was made and nothing else.
    for node in model.graph.node:
        node.doc_string = ""
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, path)


def halve(path):
    """Stores weights that are 16-bit floats without loss as such, half the size; whoever runs the file sees 32 bits."""
    model = onnx.load(path)
    casts = []
    for tensor in model.graph.initializer:
        values = onnx.numpy_helper.to_array(tensor)
        if values.dtype != np.float32 or values.size < 64:
            continue
        half = values.astype(np.float16)
        if not (half.astype(np.float32) == values).all():
            continue
        name = tensor.name
        tensor.CopyFrom(onnx.numpy_helper.from_array(half, name + ".half"))
        casts.append(onnx.helper.make_node("Cast", [name + ".half"], [name], to=onnx.TensorProto.FLOAT))
    nodes = [*casts, *model.graph.node]
    del model.graph.node[:]
    model.graph.node.extend(nodes)
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, path)


def compare(network, inputs, outputs, model):
    """Runs the network in PyTorch and in onnxruntime, and returns PyTorch's outputs by name."""
    found = network(*inputs.values())
    golden = dict(zip(outputs, found))
    session = onnxruntime.InferenceSession(str(model), providers=["CPUExecutionProvider"])
    others = session.run(outputs, {name: value.numpy() for name, value in inputs.items()})
    for (name, value), other in zip(golden.items(), others):
        apart = np.abs(value.numpy() - other).max()
        print(f"{name:12} {str(tuple(value.shape)):20} {apart:.1e} from PyTorch")
        assert apart < TOLERANCE, name
    print(f"{model}: {model.stat().st_size} bytes, sha256 {hashlib.sha256(model.read_bytes()).hexdigest()}")
    return golden


def write_golden(network, inputs, outputs, model, path):
    """Keeps inputs and PyTorch's outputs in `path`, long ones in part."""
    golden = compare(network, inputs, outputs, model)
    part = {name: v.flatten()[::STRIDE] if v.numel() > LONG else v for name, v in golden.items()}
    save_file({name: value.contiguous() for name, value in {**inputs, **part}.items()}, path)
