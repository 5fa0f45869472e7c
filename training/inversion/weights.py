"""Weights on disk: safetensors of 16-bit floats, the shape of the network beside them."""

import dataclasses
import json
import pathlib

import onnx
import torch
from safetensors import safe_open
from safetensors.torch import save_file

from model import Network, Shape


def save(network: Network, path: pathlib.Path, about: dict[str, str]):
    """Writes weights, shape and what `about` says of them."""
    tensors = {name: value.detach().half().contiguous() for name, value in network.state_dict().items()}
    about = {"shape": json.dumps(dataclasses.asdict(network.shape)), **about}
    scratch = path.with_suffix(".part")
    save_file(tensors, scratch, about)
    scratch.replace(path)


def exported(path: pathlib.Path) -> Network:
    """The network in a file that `export.py` wrote, of the usual shape."""
    network = Network(Shape())
    stored = {tensor.name: onnx.numpy_helper.to_array(tensor) for tensor in onnx.load(path).graph.initializer}
    tensors = {}
    for name in network.state_dict():
        value = stored.get(f"network.{name}.half", stored.get(f"network.{name}"))
        tensors[name] = torch.from_numpy(value.astype("float32"))
    network.load_state_dict(tensors)
    return network


def load(path: pathlib.Path) -> tuple[Network, dict[str, str]]:
    """The network and what is said of it, from weights or from the ONNX file made of them."""
    if path.suffix == ".onnx":
        return exported(path), {}
    with safe_open(path, "pt") as file:
        about = file.metadata()
        network = Network(Shape(**json.loads(about["shape"])))
        network.load_state_dict({name: file.get_tensor(name).float() for name in file.keys()})
    return network, about
