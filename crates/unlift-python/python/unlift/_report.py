"""Results of an audit: tables, plots, and the page in a notebook."""

from __future__ import annotations

import html
import math
import os
import pathlib
from typing import Any

from ._unlift import Report as _Report
from ._unlift import Rows, UnliftError

#: Height of the page in a notebook, in pixels.
HEIGHT = 720
#: The most rows that a table shows in a notebook.
ROWS = 100


class Table:
    """The rows of an audit as an Arrow table, one column per number: `polars.DataFrame(table)`, `pyarrow.table(table)`, DuckDB."""

    def __init__(self, rows: Rows) -> None:
        self._rows = rows

    @property
    def columns(self) -> list[str]:
        """The names of the columns, as in the CSV of `unlift table` (`recovered_percent_within_0.10`).

        Columns that the CSV lacks have their names of `audit.json`, with a dot between the levels.
        """
        return self._rows.columns

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, column: str) -> list[Any]:
        return self._rows[column]

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        return self._rows.__arrow_c_stream__(requested_schema)

    def to_dict(self) -> dict[str, list[Any]]:
        """Returns a dict of columns."""
        return {column: self._rows[column] for column in self.columns}

    def to_pandas(self) -> Any:
        """Returns a pandas DataFrame."""
        import pandas  # type: ignore[import-not-found,import-untyped,unused-ignore]

        return pandas.DataFrame(self.to_dict())

    def __repr__(self) -> str:
        return repr(self._rows).replace("Rows", "Table")

    def _repr_html_(self) -> str:
        """Returns the first rows for a notebook, without empty columns."""
        shown = {name: values for name, values in self.to_dict().items() if any(value is not None for value in values)}
        heads = "".join(f"<th>{html.escape(name)}</th>" for name in shown)
        rows = "".join(
            "<tr>" + "".join(f"<td>{_cell(values[at])}</td>" for values in shown.values()) + "</tr>"
            for at in range(min(len(self), ROWS))
        )
        more = f"<p>{len(self) - ROWS} more rows</p>" if len(self) > ROWS else ""
        return f"<table><thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table>{more}"


class Report:
    """The results of an audit: numbers, and a page that shows them."""

    def __init__(self, found: _Report) -> None:
        self._found = found

    @property
    def rows(self) -> Table:
        """A table with one row per scheme, source, inlier ratio and solver."""
        return Table(self._found.rows)

    @property
    def document(self) -> dict[str, Any]:
        """All numbers, as in `audit.json`."""
        return self._found.document

    @property
    def passed(self) -> bool:
        """True if every gate held and every image could be used."""
        return self._found.passed

    def json(self, *, share_safe: bool = False) -> str:
        """Returns the text of `audit.json`; with `share_safe`, without paths, names and errors of your functions."""
        return self._found.json(share_safe=share_safe)

    def html(self, *, share_safe: bool = False) -> str:
        """Returns the page as one self-contained file; with `share_safe`, numbers only."""
        return self._found.html(share_safe=share_safe)

    def save(
        self, out: str | os.PathLike[str], *, share_safe: bool = False, force: bool = False
    ) -> pathlib.Path:
        """Writes `report.html` and `audit.json` into the folder `out`, both or none, and returns the path of the page.

        share_safe: write numbers only, no points. force: also replace files that unlift did not write.
        """
        return self._found.save(os.fspath(out), share_safe=share_safe, force=force)

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

    def __str__(self) -> str:
        return str(self._found)

    def __repr__(self) -> str:
        return repr(self._found)

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
