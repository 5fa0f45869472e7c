"""How much of a privacy-preserving ("obfuscated") map comes back?

The pipeline, a function per arrow:

    read -> obfuscate -> neighbors -> recover -> evaluate
      \\____________________ audit ____________________/

>>> import numpy as np, unlift
>>> points = np.random.default_rng(1).uniform(0, 4, (400, 3))
>>> report = unlift.audit(unlift.Map(points, scale=1.0), schemes=["olc"], inlier_ratios=[0.5], solvers=["consensus"])
>>> len(report.rows)
1
>>> report.rows["scheme"]
['olc']
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from . import fleet, neighbors, testing, viewer
from ._plugins import scheme, source
from ._report import Report, Table
from ._unlift import (
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
from ._unlift import audit as _audit

__all__ = [
    "SCHEMES",
    "SOLVERS",
    "SOURCES",
    "Candidates",
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
    "evaluate",
    "fleet",
    "neighbors",
    "obfuscate",
    "read",
    "recover",
    "scheme",
    "source",
    "testing",
    "viewer",
]


def audit(
    map: Map,
    schemes: Sequence[str | Callable[..., Records]] | None = None,
    neighbors: Sequence[str | Callable[..., Any]] = ("oracle",),
    *,
    inlier_ratios: Sequence[float] | None = None,
    oracle_noise: Sequence[str] | None = None,
    solvers: Sequence[str] | None = None,
    thresholds: Iterable[float | str] | None = None,
    k: int = 50,
    source_k: int | None = None,
    delta: float | None = None,
    exact_constraints: bool = True,
    records_alone: bool = True,
    reference: bool = False,
    seed: int = 0,
    repeats: int = 1,
    gates: Sequence[str] = (),
    threads: int | None = None,
    progress: bool | Callable[[int, int, str], object] = False,
) -> Report:
    """How much of `map` comes back under each of `schemes`, attacked with each of `neighbors`.

    map: points in meters (with a scale), else in the usual distance to the K-th neighbor.
    schemes: names of `SCHEMES`, or functions (`scheme`); all of ours without it.
    neighbors: "oracle", names of `SOURCES`, or functions (`source`).
    inlier_ratios: shares of true neighbors to try (oracle); six without it.
    oracle_noise: how the oracle errs: "uniform", "near", "clustered".
    solvers: names of `SOLVERS`; the strongest ones for this size without it.
    thresholds: errors up to which a point counts as recovered, in the unit of the map; texts are kept as written.
    k: true neighbors per point. source_k: records per list of a source, which chooses itself without it.
    delta: the distance that decides support; the attack chooses without it.
    exact_constraints: whether rules that tie records together are used.
    records_alone: whether maps are also attacked without lists. reference: also with the neighbors' true places.
    seed, repeats: of everything that is drawn; figures are means over repeats.
    gates: bounds to hold, as in "olc@0.5:0.10<=20"; `Report.passed` says whether they did.
    threads: never change a result.
    progress: True for a bar (tqdm if it is there), or a function of done, total and what comes next.

    Raises UnliftError in one line; KeyboardInterrupt at once.
    """
    asked = {
        "schemes": None if schemes is None else list(schemes),
        "neighbors": list(neighbors),
        "inlier_ratios": None if inlier_ratios is None else list(inlier_ratios),
        "oracle_noise": None if oracle_noise is None else list(oracle_noise),
        "solvers": None if solvers is None else list(solvers),
        "thresholds": None if thresholds is None else list(thresholds),
        "k": k,
        "source_k": source_k,
        "delta": delta,
        "exact_constraints": exact_constraints,
        "records_alone": records_alone,
        "reference": reference,
        "seed": seed,
        "repeats": repeats,
        "gates": list(gates),
        "threads": threads,
    }
    if progress is True:
        with _Bar() as bar:
            return Report(_audit(map, asked, bar.tell))
    return Report(_audit(map, asked, progress or None))


class _Bar:
    """Tells how far an audit is: by tqdm where it is installed, else in lines on stderr."""

    def __enter__(self) -> _Bar:
        try:
            from tqdm.auto import tqdm  # type: ignore[import-untyped,unused-ignore]

            self._bar: Any = tqdm(unit="row")
        except ImportError:
            self._bar = None
        return self

    def tell(self, done: int, total: int, what: str) -> None:
        if self._bar is None:
            print(f"unlift: {done}/{total} {what}", file=sys.stderr, flush=True)
            return
        self._bar.total = total
        self._bar.set_description(what, refresh=False)
        self._bar.update(done - self._bar.n)

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()
