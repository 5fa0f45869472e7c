"""What several tests use: the program, figures of documents, maps, and points on a surface."""

import json
import os
import shutil

import numpy as np
import pytest

PROGRAM = os.environ.get("UNLIFT_PROGRAM") or shutil.which("unlift")
needs_program = pytest.mark.skipif(PROGRAM is None, reason="the command line is not here (UNLIFT_PROGRAM)")


def figures(document):
    """Returns what does not depend on the time, the machine and the file."""
    keep = ["schema", "seed", "options", "results", "not_audited", "notes", "break_even", "gates", "images"]
    return json.dumps({key: document.get(key) for key in keep}, sort_keys=True)


def maps(folder, n):
    """Writes maps of different sizes, and returns their paths."""
    paths = [str(folder / f"map{at}.npy") for at in range(n)]
    for at, path in enumerate(paths):
        np.save(path, np.random.default_rng(at).uniform(0, 4, (200 + 50 * at, 3)))
    return paths


@pytest.fixture(scope="session")
def points():
    """Returns points on a surface, such as a wall, where neighbors are near each other."""
    random = np.random.default_rng(7)
    flat = random.uniform(0, 4, (600, 2))
    return np.column_stack([flat, 0.3 * np.sin(flat[:, 0] * 2) + 1.0])
