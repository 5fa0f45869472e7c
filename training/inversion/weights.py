"""Weights on disk: safetensors of 16-bit floats, the shape of the network beside them."""

import dataclasses
import json
import pathlib

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


def load(path: pathlib.Path) -> tuple[Network, dict[str, str]]:
    """The network and what is said of it."""
    with safe_open(path, "pt") as file:
        about = file.metadata()
        network = Network(Shape(**json.loads(about["shape"])))
        network.load_state_dict({name: file.get_tensor(name).float() for name in file.keys()})
    return network, about
