"""Results of an audit: tables, plots, and the page in a notebook."""

from __future__ import annotations

import html
import json
import math
from collections.abc import Iterator
from typing import Any

from ._unlift import Report as _Report
from ._unlift import UnliftError

#: Height of the page in a notebook, in pixels.
HEIGHT = 720
#: The most rows that a table shows in a notebook.
ROWS = 100
#: The names in the CSV of values by threshold, percentile or measure.
IN_CSV = {
    **dict.fromkeys(
        ("recovered_percent", "recovered_std", "blind_percent", "blind_std", "records_alone_percent", "records_alone_by"),
        "{}_within_{}",
    ),
    "error_percentiles": "error_percentile_{1}",
    "metrics": "metric_{1}",
}


class Table:
    """The rows of an audit as columns: `polars.DataFrame(table.to_dict())`, `table.to_pandas()`, `pyarrow.table(table)`."""

    def __init__(self, rows: list[dict[str, Any]]) -> None:
        self._columns: dict[str, list[Any]] = {}
        self._n = len(rows)
        for at, row in enumerate(rows):
            for name, value in _flat(row):
                self._columns.setdefault(name, [None] * self._n)[at] = value

    @property
    def columns(self) -> list[str]:
        """The names of the columns, as in the CSV of `unlift table` (`recovered_percent_within_0.10`).

        Columns that the CSV lacks have their names of `audit.json`, with a dot between the levels (`lost.no_neighbors`).
        """
        return list(self._columns)

    def __len__(self) -> int:
        return self._n

    def __getitem__(self, column: str) -> list[Any]:
        return self._columns[column]

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        """Exports the table to polars and DuckDB by means of pyarrow."""
        import pyarrow  # type: ignore[import-untyped,unused-ignore]

        return pyarrow.table(self._columns).__arrow_c_stream__(requested_schema)

    def to_dict(self) -> dict[str, list[Any]]:
        """Returns a dict of columns."""
        return dict(self._columns)

    def to_pandas(self) -> Any:
        """Returns a pandas DataFrame."""
        import pandas  # type: ignore[import-not-found,import-untyped,unused-ignore]

        return pandas.DataFrame(self._columns)

    def __repr__(self) -> str:
        return f"<unlift.Table: {self._n} rows of {len(self._columns)} columns>"

    def _repr_html_(self) -> str:
        """Returns the first rows for a notebook, without empty columns."""
        shown = {name: values for name, values in self._columns.items() if any(value is not None for value in values)}
        heads = "".join(f"<th>{html.escape(name)}</th>" for name in shown)
        rows = "".join(
            "<tr>" + "".join(f"<td>{_cell(values[at])}</td>" for values in shown.values()) + "</tr>"
            for at in range(min(len(self), ROWS))
        )
        more = f"<p>{len(self) - ROWS} more rows</p>" if len(self) > ROWS else ""
        return f"<table><thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table>{more}"


def _flat(row: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yields the values of a row of `audit.json` by their names in the CSV."""
    for name, value in row.items():
        if name == "dropped":
            yield "n_dropped", sum(value.values())
        if name == "std" and value is not None:
            yield from _flat({f"{of.removesuffix('_percent')}_std": spread for of, spread in value.items()})
        elif isinstance(value, dict):
            for key, within in value.items():
                yield IN_CSV.get(name, "{}.{}").format(name, key), within
        else:
            yield name, value


class Report(_Report):
    """The results of an audit: numbers, and a page that shows them."""

    @property
    def rows(self) -> Table:
        """A table with one row per scheme, source, inlier ratio and solver."""
        return Table(self.document["results"])

    @property
    def document(self) -> dict[str, Any]:
        """All numbers, as in `audit.json`."""
        document: dict[str, Any] = json.loads(self.json())
        return document

    def plot(self, threshold: str | float | None = None, ax: Any = None) -> Any:
        """Draws the recovered share over the inlier ratio, a curve per scheme by its strongest solver, and returns the axes.

        threshold: one of the thresholds of the audit, as a number or a string. Default: the first. Needs matplotlib.
        """
        import matplotlib.pyplot  # type: ignore[import-not-found,import-untyped,unused-ignore]

        rows = self.document["results"]
        typed = list(rows[0]["recovered_percent"])
        given = typed[0] if threshold is None else threshold
        same = [one for one in typed if one == given or float(one) == _number(given)]
        if not same:
            raise UnliftError(f"threshold: expected one of {', '.join(typed)}, found {given}")
        threshold = same[0]
        ax = ax or matplotlib.pyplot.gca()
        for scheme in dict.fromkeys(row["scheme"] for row in rows):
            best: dict[float, float] = {}
            for row in rows:
                if row["scheme"] == scheme and row["neighbors"] == "oracle":
                    ratio, share = row["inlier_ratio"], row["recovered_percent"][threshold]
                    best[ratio] = max(best.get(ratio, 0.0), share)
            if best:
                ax.plot(*zip(*sorted(best.items())), marker="o", label=scheme)
        for row in rows:
            if row["neighbors"] != "oracle":
                ax.plot(row["inlier_ratio"], row["recovered_percent"][threshold], "x", color="black")
                ax.annotate(f"{row['scheme']}, {row['neighbors']}", (row["inlier_ratio"], row["recovered_percent"][threshold]))
        ax.set(xlabel="inlier ratio", ylabel=f"recovered within {threshold} {rows[0]['unit']} (%)", ylim=(0, 100))
        ax.legend()
        return ax

    def show(self) -> Any:
        """Returns the whole page with points for a notebook, which stores them. Needs IPython."""
        from IPython.display import HTML  # type: ignore[import-not-found,unused-ignore]

        return HTML(_frame(self.html()))

    def _repr_html_(self) -> str:
        """Returns the page with numbers only, because notebooks are often shared. `show` also has the points."""
        return _frame(self.html(share_safe=True))


def _number(given: str | float) -> float:
    try:
        return float(given)
    except ValueError:
        return math.nan


def _cell(value: object) -> str:
    if value is None:
        return ""
    return f"{value:g}" if isinstance(value, float) else html.escape(str(value))


def _frame(page: str) -> str:
    style = f"width: 100%; height: {HEIGHT}px; border: 1px solid #ccc"
    return f'<iframe srcdoc="{html.escape(page, quote=True)}" style="{style}"></iframe>'
