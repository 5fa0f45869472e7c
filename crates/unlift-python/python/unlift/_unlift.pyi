"""The native module of unlift. `mypy.stubtest` compares these stubs with it."""

import os
import pathlib
from collections.abc import Callable
from typing import Any, final

import numpy as np
import numpy.typing as npt
from typing_extensions import Self, disjoint_base

_Path = str | os.PathLike[str]

__all__ = [
    "IMAGE_SCHEMES",
    "IMAGE_SOLVERS",
    "IMAGE_SOURCES",
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
    "Truth",
    "UnliftError",
    "__version__",
    "audit",
    "audit_images",
    "check_scheme",
    "check_solver",
    "check_source",
    "command_line",
    "evaluate",
    "find",
    "obfuscate",
    "oracle",
    "read",
    "recover",
]

__version__: str
IMAGE_SCHEMES: list[str]
IMAGE_SOURCES: list[str]
IMAGE_SOLVERS: list[str]
SCHEMES: list[str]
SOURCES: list[str]
SOLVERS: list[str]

class UnliftError(ValueError):
    """An error in an argument, a file or a map: one line that names it, what was expected and what was found."""

@final
class Map:
    def __new__(
        cls,
        positions: npt.ArrayLike,
        descriptors: npt.ArrayLike | None = None,
        *,
        scale: float | None = None,
        k: int = 50,
        max_points: int | None = None,
        seed: int = 0,
    ) -> Map: ...
    def __len__(self) -> int: ...
    @property
    def positions(self) -> npt.NDArray[np.float64]: ...
    @property
    def descriptors(self) -> npt.NDArray[np.uint8] | npt.NDArray[np.float32] | None: ...
    @property
    def unit(self) -> str: ...
    @property
    def unit_in_map_units(self) -> float: ...
    @property
    def notes(self) -> list[str]: ...
    @property
    def rows(self) -> npt.NDArray[np.uint32]: ...

def read(
    path: _Path,
    *,
    descriptors: _Path | None = None,
    scale: float | None = None,
    k: int = 50,
    max_points: int | None = None,
    seed: int = 0,
) -> Map: ...

@final
class Records:
    def __len__(self) -> int: ...

def Lines(
    points: npt.ArrayLike, directions: npt.ArrayLike, *, hidden: npt.ArrayLike | None = None
) -> Records: ...
def Rays(
    centers: npt.ArrayLike,
    center: npt.ArrayLike,
    directions: npt.ArrayLike,
    *,
    hidden: npt.ArrayLike | None = None,
) -> Records: ...
def Planes(
    axis: npt.ArrayLike, offset: npt.ArrayLike, *, hidden: npt.ArrayLike | None = None
) -> Records: ...
def Candidates(
    positions: npt.ArrayLike, swapped_axis: npt.ArrayLike, *, hidden: npt.ArrayLike | None = None
) -> Records: ...

@final
class Released:
    @staticmethod
    def read(path: _Path) -> Released: ...
    def save(self, path: _Path, *, force: bool = False) -> None: ...
    def __len__(self) -> int: ...
    @property
    def family(self) -> str: ...
    @property
    def unit(self) -> str: ...
    @property
    def slots_per_record(self) -> int: ...
    @property
    def n_slots(self) -> int: ...
    @property
    def origin(self) -> npt.NDArray[np.float64]: ...
    @property
    def bounds(self) -> npt.NDArray[np.float64] | None: ...
    @property
    def fingerprint(self) -> str: ...
    @property
    def descriptors(self) -> npt.NDArray[np.uint8] | npt.NDArray[np.float32] | None: ...
    @property
    def columns(self) -> dict[str, npt.NDArray[Any]]: ...

@final
class Truth:
    @staticmethod
    def read(path: _Path) -> Truth: ...
    def save(self, path: _Path, *, force: bool = False) -> None: ...
    @property
    def positions(self) -> npt.NDArray[np.float64]: ...
    @property
    def hidden(self) -> npt.NDArray[np.uint32]: ...
    @property
    def dropped(self) -> dict[str, int]: ...

@final
class Hidden:
    @property
    def released(self) -> Released: ...
    @property
    def truth(self) -> Truth: ...

def obfuscate(
    map: Map, scheme: str | Callable[..., Records], *, seed: int | None = None
) -> Hidden: ...

@final
class Neighborhoods:
    def __new__(
        cls,
        released: Released | Hidden,
        records: npt.ArrayLike,
        scores: npt.ArrayLike | None = None,
        *,
        slots: npt.ArrayLike | None = None,
        needs: str = "descriptors",
    ) -> Neighborhoods: ...
    @staticmethod
    def read(path: _Path, released: Released | Hidden) -> Neighborhoods: ...
    def save(self, path: _Path, *, force: bool = False) -> None: ...
    def __len__(self) -> int: ...
    @property
    def records(self) -> npt.NDArray[np.uint32]: ...
    @property
    def slots(self) -> npt.NDArray[np.uint32] | None: ...
    @property
    def offsets(self) -> npt.NDArray[np.uint64]: ...
    @property
    def scores(self) -> npt.NDArray[np.float32] | None: ...

def find(
    released: Released | Hidden,
    source: str,
    *,
    k: int | None = None,
    seed: int = 0,
    threads: int | None = None,
) -> Neighborhoods: ...
def oracle(
    hidden: Hidden, inlier_ratio: float, *, k: int = 50, noise: str = "uniform", seed: int = 0
) -> Neighborhoods: ...

@final
class Recovered:
    @staticmethod
    def read(path: _Path) -> Recovered: ...
    def save(self, path: _Path, *, force: bool = False) -> None: ...
    def __len__(self) -> int: ...
    @property
    def positions(self) -> npt.NDArray[np.float64]: ...
    @property
    def status(self) -> list[str]: ...
    @property
    def support(self) -> npt.NDArray[np.uint16]: ...
    @property
    def delta(self) -> float: ...
    @property
    def unit(self) -> str: ...
    @property
    def confidence_unknown(self) -> str | None: ...
    def probability_within(self, threshold: float) -> npt.NDArray[np.float64] | None: ...

def recover(
    released: Released | Hidden,
    lists: Neighborhoods,
    *,
    solver: str | Callable[..., Any] | None = None,
    seed: int = 0,
    confidence: bool = True,
    threads: int | None = None,
) -> Recovered: ...

def evaluate(
    recovered: Recovered, truth: Truth | Hidden, *, thresholds: list[float | str] | None = None
) -> dict[str, Any]: ...

@disjoint_base
class Report:
    def __new__(cls, native: Report) -> Self: ...
    @property
    def passed(self) -> bool: ...
    def json(self, *, share_safe: bool = False) -> str: ...
    def html(self, *, share_safe: bool = False) -> str: ...
    def save(self, out: _Path, *, share_safe: bool = False, force: bool = False) -> pathlib.Path: ...

def audit(
    map: Map, options: dict[str, Any], tell: Callable[[int, int, str], object] | None
) -> Report: ...
def audit_images(
    images: Any, options: dict[str, Any], tell: Callable[[int, int, str], object] | None
) -> tuple[Report, list[str]]: ...
def check_scheme(scheme: Callable[..., Records], *, images: bool = False) -> None: ...
def check_solver(
    solver: Callable[..., Any], released: Released | Hidden, lists: Neighborhoods
) -> None: ...
def check_source(source: Callable[..., Any], released: Released | Hidden) -> None: ...
def command_line(words: list[str]) -> int: ...
