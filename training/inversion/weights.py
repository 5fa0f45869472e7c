"""Saves and loads weights: safetensors of 16-bit floats, with the shape of the network in the metadata."""

import dataclasses
import json
import pathlib

import torch
from safetensors import safe_open
from safetensors.torch import save_file

from model import Network, Shape


def save(network: Network, path: pathlib.Path, about: dict[str, str]):
    """Writes weights and their shape, with further metadata `about` them."""
    tensors = {name: value.detach().half().contiguous() for name, value in network.state_dict().items()}
    about = {"shape": json.dumps(dataclasses.asdict(network.shape)), **about}
    scratch = path.with_suffix(".part")
    save_file(tensors, scratch, about)
    scratch.replace(path)


def load(path: pathlib.Path) -> tuple[Network, dict[str, str]]:
    """Returns the network and the metadata."""
    with safe_open(path, "pt") as file:
        about = file.metadata()
        network = Network(Shape(**json.loads(about["shape"])))
        network.load_state_dict({name: file.get_tensor(name).float() for name in file.keys()})
    return network, about
