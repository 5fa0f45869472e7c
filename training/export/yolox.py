"""The golden output of YOLOX-nano, whose published file `unlift` carries as it is: `yolox.py yolox-nano.onnx`.

The input is a formula (`common.blobs`, times 255), which the test computes itself: it would be larger than the network.
"""

import hashlib
import pathlib
import sys

import onnxruntime
from safetensors.numpy import save_file

from common import STRIDE, blobs

SHA256 = "695e750a5d5754bb5a8d5325643b59282191a7e7a564e435a415fd3c578eab14"


def main():
    path = pathlib.Path(sys.argv[1])
    assert hashlib.sha256(path.read_bytes()).hexdigest() == SHA256, "another file"
    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    output = session.run(["output"], {"images": 255 * blobs(3, 416, 416).numpy()})[0]
    save_file({"output": output.reshape(-1)[::STRIDE].copy()}, path.with_name("golden.safetensors"))


if __name__ == "__main__":
    main()
