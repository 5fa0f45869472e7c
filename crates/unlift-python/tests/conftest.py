"""What several tests use: the program, and points on a surface."""

import os
import shutil

import numpy as np
import pytest

PROGRAM = os.environ.get("UNLIFT_PROGRAM") or shutil.which("unlift")
needs_program = pytest.mark.skipif(PROGRAM is None, reason="the command line is not here (UNLIFT_PROGRAM)")


@pytest.fixture
def points():
    """Returns points on a surface, such as a wall, where neighbors are near each other."""
    random = np.random.default_rng(7)
    flat = random.uniform(0, 4, (600, 2))
    return np.column_stack([flat, 0.3 * np.sin(flat[:, 0] * 2) + 1.0])
