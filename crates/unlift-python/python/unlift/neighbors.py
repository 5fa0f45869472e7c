"""Lists of near records: by an oracle who knows the truth, or from a released map alone.

>>> import numpy as np, unlift
>>> points = np.random.default_rng(1).uniform(0, 4, (200, 3))
>>> hidden = unlift.obfuscate(unlift.Map(points, scale=1.0), "olc", seed=1)
>>> unlift.neighbors.oracle(hidden, 0.5, k=20)
<unlift.Neighborhoods: 200 lists of up to 20>
"""

from __future__ import annotations

from ._unlift import Hidden, Neighborhoods, Released, find, oracle

__all__ = ["descriptors", "find", "geometric", "learned", "oracle", "overlap", "similarity"]


def similarity(
    released: Released | Hidden, *, k: int | None = None, seed: int = 0, threads: int | None = None
) -> Neighborhoods:
    """Records with the most similar descriptors, of any kind; of learned ones with a short walk."""
    return find(released, "similarity", k=k, seed=seed, threads=threads)


def overlap(
    released: Released | Hidden, *, k: int | None = None, seed: int = 0, threads: int | None = None
) -> Neighborhoods:
    """Records whose SIFT patches overlap, and a short walk from these; no training."""
    return find(released, "overlap", k=k, seed=seed, threads=threads)


def descriptors(
    released: Released | Hidden, *, k: int | None = None, seed: int = 0, threads: int | None = None
) -> Neighborhoods:
    """The best that descriptors allow without training: overlap of SIFT, similarity of others."""
    return find(released, "descriptors", k=k, seed=seed, threads=threads)


def learned(
    released: Released | Hidden, *, k: int | None = None, seed: int = 0, threads: int | None = None
) -> Neighborhoods:
    """Records that a network, trained on photos, takes for near ones; SIFT or ALIKED descriptors."""
    return find(released, "learned", k=k, seed=seed, threads=threads)


def geometric(
    released: Released | Hidden, *, k: int | None = None, seed: int = 0, threads: int | None = None
) -> Neighborhoods:
    """Records that meet where records alone say that points are; no descriptors."""
    return find(released, "geometric", k=k, seed=seed, threads=threads)
