"""The code of the documentation runs."""

import doctest
import importlib
import pathlib
import re

import numpy as np
import pytest

import unlift

README = pathlib.Path(__file__).parents[1] / "README.md"
ROOT = pathlib.Path(__file__).parents[3]
DOCUMENTS = ["README.md", "ARTIFACT.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "STYLE.md", "docs/formats.md", "docs/benchmarks.md"]


@pytest.mark.parametrize("name", DOCUMENTS)
def test_links_between_documents_lead_somewhere(name):
    document = ROOT / name
    for link in re.findall(r"\]\(([^) ]*[.#][^) ]*)\)", document.read_text()):
        file, _, anchor = link.partition("#")
        target = document.parent / file if file else document
        if "://" in link:
            continue
        assert target.exists(), link
        headings = [line.lstrip("#").strip().lower() for line in target.read_text().splitlines() if line.startswith("#")] if anchor else []
        # As GitHub makes anchors.
        assert not anchor or anchor in [re.sub(r"[^\w -]", "", heading).replace(" ", "-") for heading in headings], link


@pytest.mark.parametrize("name", ["unlift", "unlift.neighbors", "unlift.testing", "unlift._plugins"])
def test_examples_of_modules(name):
    found = doctest.testmod(importlib.import_module(name))
    assert found.attempted > 0 and found.failed == 0


def test_the_readme(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    points = np.random.default_rng(1).uniform(0, 3, (300, 3))
    np.save("PROJECT.npy", points)
    # A small map and few rows, so that the code runs in seconds.
    usual = unlift.audit
    monkeypatch.setattr(unlift, "audit", lambda m, **more: usual(m, **(more | {"solvers": ["consensus"], "inlier_ratios": [0.5]})))
    blocks = re.findall(r"```python\n(.*?)```", README.read_text(), re.S)
    assert len(blocks) == 3
    keypoints = np.random.default_rng(2).uniform(0, [639, 479], (200, 2))
    waves = np.sin(keypoints / 90 @ np.random.default_rng(3).uniform(-2, 2, (2, 128)))
    names = {"keypoints": keypoints, "sift": (60 + 55 * waves).astype(np.uint8)}
    for block in blocks:
        exec(block.replace('"PROJECT"', '"PROJECT.npy"'), names)
    assert (tmp_path / "out" / "report.html").exists() and (tmp_path / "is-mine-safe" / "audit.json").exists()
    assert (tmp_path / "images" / "report.html").exists()
