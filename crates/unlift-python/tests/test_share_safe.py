"""Share-safe reports contain only numbers."""

import json

import numpy as np
import pytest

import unlift


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    folder = tmp_path_factory.mktemp("secret")
    points = np.random.default_rng(7).uniform(0, 4, (300, 3))
    text = "\n".join(f"{i} {x} {y} {z} 0 0 0 0" for i, (x, y, z) in enumerate(points))
    (folder / "points3D.txt").write_text(text)

    @unlift.scheme
    def failing(points):
        raise KeyError("/home/secret/customers.csv")

    @unlift.source(needs="nothing")
    def sourcing(released):
        raise KeyError("secret line")

    m = unlift.read(folder, scale=1.0)
    return unlift.audit(
        m, ["olc", failing], ["oracle", sourcing], inlier_ratios=[0.5], solvers=["consensus"], gates=["failing:0.10<=20"]
    )


def test_nothing_that_functions_raised_or_that_was_read_is_in_it(report, tmp_path):
    assert "secret" in report.json() and "customers" in report.html()
    page = report.save(tmp_path / "out", share_safe=True)
    texts = [report.json(share_safe=True), report.html(share_safe=True), report._repr_html_()]
    texts += [page.read_text(), (tmp_path / "out" / "audit.json").read_text()]
    for text in texts:
        assert "secret" not in text and "customers" not in text
    safe = json.loads(texts[0])
    assert {one["reason"] for one in safe["not_audited"]} == {"its own function failed"}
    assert safe["results"] == report.document["results"]


def test_a_notebook_keeps_no_points(report, monkeypatch):
    shown, safe = report._repr_html_(), report.html(share_safe=True)
    assert shown.startswith("<iframe srcdoc=") and len(shown) < 1.5 * len(safe) + 1000
    assert "no points" in report.html(share_safe=True) or len(report.html()) > len(safe)

    class Display:
        HTML = staticmethod(lambda page: page)

    monkeypatch.setitem(__import__("sys").modules, "IPython.display", Display)
    monkeypatch.setitem(__import__("sys").modules, "IPython", Display)
    whole = report.show()
    assert whole.startswith("<iframe srcdoc=") and len(whole) > len(shown)
