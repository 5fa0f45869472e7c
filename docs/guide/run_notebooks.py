"""Executes each notebook as a reader would, in an empty folder, and writes nothing back."""

from __future__ import annotations

import os
import pathlib
import sys
import tempfile
import time

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError

FOLDER = pathlib.Path(__file__).resolve().parent / "notebooks"


def main() -> int:
    os.environ["RUST_BACKTRACE"] = "0"  # a property test that fails on purpose prints one line
    failed = 0
    for path in sorted(FOLDER.glob("*.ipynb")):
        notebook = nbformat.read(path, as_version=4)
        if any(cell.get("outputs") for cell in notebook.cells):
            print(f"{path.name}: has outputs: clear them before it is committed", file=sys.stderr)
            failed += 1
        started = time.monotonic()
        with tempfile.TemporaryDirectory() as folder:
            client = NotebookClient(notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": folder}})
            try:
                client.execute()
            except CellExecutionError as error:
                print(f"{path.name}: {error}", file=sys.stderr)
                failed += 1
        print(f"{path.name}: {time.monotonic() - started:.1f} s", flush=True)
        if "--show" in sys.argv[1:]:
            for cell in notebook.cells:
                for output in cell.get("outputs", []):
                    print(output.get("text") or output.get("data", {}).get("text/plain", ""))
    return failed


if __name__ == "__main__":
    sys.exit(main())
