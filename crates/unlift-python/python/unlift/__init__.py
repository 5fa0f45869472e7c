"""unlift measures how much of a privacy-preserving ("obfuscated") map or image an attacker recovers.

Each arrow is a function:

    read -> obfuscate -> neighbors -> recover -> evaluate
      \\____________________ audit ____________________/

>>> import numpy as np, unlift
>>> points = np.random.default_rng(1).uniform(0, 4, (400, 3))
>>> report = unlift.audit(unlift.Map(points, scale=1.0), schemes=["olc"], inlier_ratios=[0.5], solvers=["consensus"])
>>> len(report.rows)
1
>>> report.rows["scheme"]
['olc']

Images are keypoints in pixels, by name of the image:

>>> keypoints = np.random.default_rng(2).uniform(0, [639, 479], (300, 2))
>>> images = {"a.jpg": {"keypoints": keypoints, "width": 640, "height": 480}}
>>> unlift.audit_images(images, schemes="lines2d", inlier_ratios=[0.5], solvers=["consensus"]).rows["unit"]
['px']
"""

from __future__ import annotations

from . import fleet, neighbors, testing
from ._audits import Features, audit, audit_images
from ._plugins import scheme, source
from ._report import Report, Table
from ._unlift import (
    IMAGE_SCHEMES,
    IMAGE_SOLVERS,
    IMAGE_SOURCES,
    SCHEMES,
    SOLVERS,
    SOURCES,
    Candidates,
    Hidden,
    Lines,
    Map,
    Neighborhoods,
    Planes,
    Rays,
    Records,
    Recovered,
    Released,
    Truth,
    UnliftError,
    __version__,
    evaluate,
    obfuscate,
    read,
    recover,
)

__all__ = [
    "IMAGE_SCHEMES",
    "IMAGE_SOLVERS",
    "IMAGE_SOURCES",
    "SCHEMES",
    "SOLVERS",
    "SOURCES",
    "Candidates",
    "Features",
    "Hidden",
    "Lines",
    "Map",
    "Neighborhoods",
    "Planes",
    "Rays",
    "Records",
    "Recovered",
    "Released",
    "Report",
    "Table",
    "Truth",
    "UnliftError",
    "__version__",
    "audit",
    "audit_images",
    "evaluate",
    "fleet",
    "neighbors",
    "obfuscate",
    "read",
    "recover",
    "scheme",
    "source",
    "testing",
]
