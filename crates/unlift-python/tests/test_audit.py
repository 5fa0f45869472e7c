"""Audits: the results of the command line, schemes and sources that are functions, interrupts."""

import json
import subprocess

import numpy as np
import pytest

import unlift
from conftest import PROGRAM, needs_program


@pytest.fixture
def small(points):
    return unlift.Map(points, scale=1.0)


def cheap(map, schemes, **more):
    options = {"inlier_ratios": [0.5], "solvers": ["consensus"], "k": 20} | more
    return unlift.audit(map, schemes, **options)


def figures(document):
    """Returns what does not depend on the time and the machine."""
    keep = ["schema", "seed", "options", "results", "not_audited", "break_even", "gates"]
    return json.dumps({key: document.get(key) for key in keep}, sort_keys=True)


@needs_program
def test_figures_are_those_of_the_command_line(points, tmp_path):
    np.save(tmp_path / "points.npy", points)
    line = "audit map points.npy --scale 1 --schemes olc,cp --inlier-ratios 0.5 --k 20 --gate all:0.10<=1 --quiet --out cli"
    done = subprocess.run([PROGRAM, *line.split()], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 1, done.stderr
    report = unlift.audit(
        unlift.Map(points, scale=1.0, k=20), ["olc", "cp"], inlier_ratios=[0.5], k=20, gates=["all:0.10<=1"]
    )
    assert not report.passed
    lines = [line for line in done.stdout.splitlines() if line.startswith("gate ")]
    assert lines[0].startswith("gate all:0.10<=1: FAILED, found ") and ", recovered within 0.10 m, in a map of " in lines[0]
    assert lines == [line for line in str(report).splitlines() if line.startswith("gate ")]
    cli = json.loads((tmp_path / "cli" / "audit.json").read_text())
    assert figures(report.document) == figures(cli)
    # Read from a file, the report has its path and hash.
    read = unlift.audit(
        unlift.read(tmp_path / "points.npy", scale=1.0, k=20), ["olc", "cp"], inlier_ratios=[0.5], k=20, gates=["all:0.10<=1"]
    )
    assert read.document["input"]["sha256"] == cli["input"]["sha256"]
    assert figures(read.document) == figures(cli)


def test_a_scheme_is_a_function(small):
    @unlift.scheme
    def level(points, random):
        angle = random.uniform(0, 2 * np.pi, len(points))
        return unlift.Lines(points, np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1))

    unlift.testing.check_scheme(level)
    report = cheap(small, ["olc", level])
    rows = report.rows
    assert rows["scheme"] == ["olc", "level"]
    assert rows["recovered_percent_within_0.25"][1] > rows["blind_percent_within_0.25"][1]
    assert figures(cheap(small, ["olc", level]).document) == figures(report.document)
    assert "level" in report.html()


def test_a_solver_is_a_function(small):
    def foot(released, lists):
        assert len(lists) == released.n_slots
        return released.columns["foot"]

    hidden = unlift.obfuscate(small, "olc", seed=1)
    lists = unlift.neighbors.oracle(hidden, 0.5, k=20)
    unlift.testing.check_solver(foot, hidden, lists)
    found = unlift.recover(hidden, lists, solver=foot)
    assert np.allclose(found.positions, hidden.released.columns["foot"] + hidden.released.origin, atol=1e-5)
    rows = cheap(small, ["olc"], solvers=[foot, "consensus"]).rows
    assert rows["solver"] == ["foot", "consensus"]
    # The solver does not support planes: its rows are missing, the others are not.
    report = cheap(small, ["plane"], solvers=[foot, "consensus"])
    assert report.rows["solver"] == ["consensus"]
    assert "KeyError" in report.document["not_audited"][0]["reason"]

    def consensus(released, lists):
        return foot(released, lists)

    with pytest.raises(unlift.UnliftError, match="a name that no solver of unlift has, found consensus"):
        cheap(small, ["olc"], solvers=[consensus])


@pytest.mark.parametrize("family", ["pairs", "rays", "planes", "candidates"])
def test_every_family_of_records_can_be_returned(small, family):
    def pairs(points, random):
        order = random.permutation(len(points) // 2 * 2).reshape(-1, 2)
        a, b = points[order[:, 0]], points[order[:, 1]]
        return unlift.Lines(a, b - a, hidden=order)

    def rays(points, random):
        centers = np.array([[-9.0, 0.0, 0.0], [9.0, 0.0, 0.0]])
        center = random.integers(0, 2, len(points))
        return unlift.Rays(centers, center, points - centers[center])

    def planes(points, random):
        axis = random.integers(0, 3, len(points))
        return unlift.Planes(axis, np.take_along_axis(points, axis[:, None], 1)[:, 0])

    def candidates(points, random):
        other = points[np.roll(random.permutation(len(points)), 1)]
        axis = random.integers(0, 3, len(points))
        swapped = points.copy()
        swapped[np.arange(len(points)), axis] = other[np.arange(len(points)), axis]
        return unlift.Candidates(swapped, axis)

    function = locals()[family]
    row = cheap(small, [function]).document["results"][0]
    assert row["scheme"] == family
    assert row["n_points"] == 600
    assert row["recovered_percent"]["0.25"] > 10


def test_a_source_is_a_function(small, points):
    @unlift.source(needs="nothing", k=10)
    def meeting(released):
        # Lines whose feet are near each other: a poor list, but valid.
        foot = released.columns["foot"]
        apart = np.linalg.norm(foot[:, None] - foot[None], axis=2)
        near = np.argsort(apart, axis=1)[:, 1:11]
        return near, -np.take_along_axis(apart, near, 1)

    hidden = unlift.obfuscate(small, "olc", seed=1)
    unlift.testing.check_source(meeting, hidden)
    report = cheap(small, ["olc"], neighbors=[meeting], inlier_ratios=None)
    row = report.document["results"][0]
    assert row["neighbors"] == "meeting" and row["k"] == 10
    lists = unlift.Neighborhoods(hidden, meeting(hidden.released)[0], needs="nothing")
    assert len(lists) == 600 and unlift.recover(hidden, lists).positions.shape == (600, 3)


def test_what_a_function_raises_is_the_cause(small):
    def broken(points):
        raise KeyError("mine")

    with pytest.raises(unlift.UnliftError, match="broken") as error:
        cheap(small, [broken])
    assert isinstance(error.value.__cause__, KeyError)

    def wrong(points):
        return points

    with pytest.raises(unlift.UnliftError, match="expected Lines, Rays, Planes or Candidates"):
        cheap(small, [wrong])
    with pytest.raises(unlift.UnliftError, match="schemes: expected a name or a function, found 7"):
        cheap(small, [7])

    def elsewhere(points):
        return unlift.Lines(points + 1.0, np.tile([0.0, 0.0, 1.0], (len(points), 1)))

    with pytest.raises(AssertionError, match="elsewhere"):
        unlift.testing.check_scheme(elsewhere)
    with pytest.raises(unlift.UnliftError, match="elsewhere: hidden points: expected on their own records, found 600 of 600"):
        cheap(small, [elsewhere], gates=["all:0.10<=20"])

    def careless(points):
        return unlift.Lines(points, np.random.default_rng().normal(size=points.shape))

    with pytest.raises(unlift.UnliftError, match="careless: records: expected the same for the same key"):
        cheap(small, [careless])


def test_progress_is_told_and_may_stop(small):
    told = []
    cheap(small, ["olc", "cp"], progress=lambda done, total, what: told.append((done, total, what)))
    assert told[-1][0] == told[-1][1] >= 2
    assert all(isinstance(what, str) for _, _, what in told)

    def stop(done, total, what):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        cheap(small, ["olc", "cp"], progress=stop)


def test_reports_are_saved_and_tables_read_by_others(small, tmp_path):
    report = cheap(small, ["olc", "plane"])
    page = report.save(tmp_path / "out")
    assert page.name == "report.html" and "<html" in page.read_text()
    assert json.loads((tmp_path / "out" / "audit.json").read_text())["results"] == report.document["results"]
    safe = report.save(tmp_path / "safe", share_safe=True)
    assert len(safe.read_text()) < len(page.read_text())
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "report.html").write_text("mine")
    with pytest.raises(unlift.UnliftError, match="report.html"):
        report.save(tmp_path / "mine")
    assert (tmp_path / "mine" / "report.html").read_text() == "mine"
    assert report._repr_html_().startswith("<iframe srcdoc=")
    assert "olc" in str(report)

    rows = report.rows._repr_html_()
    assert rows.startswith("<table>") and "<td>olc</td>" in rows and "<th>recovered_percent_within_0.10</th>" in rows
    if PROGRAM is not None:
        csv = tmp_path / "rows.csv"
        subprocess.run([PROGRAM, "table", tmp_path / "out" / "audit.json", "--out", csv], check=True, capture_output=True)
        heads, cells = (line.split(",") for line in csv.read_text().splitlines()[:2])
        # Unknown values have no column; nor has a single repeat.
        known = {head for head, cell in zip(heads, cells) if cell} - {"repeats"}
        assert len(known) > 15 and known <= set(report.rows.columns)

    pyarrow = pytest.importorskip("pyarrow")
    table = pyarrow.table(report.rows)
    assert table.column("scheme").to_pylist() == ["olc", "plane"]
    assert table.schema.field("n_points").type == pyarrow.int64()
    assert table.column("recovered_percent_within_0.10").to_pylist() == report.rows["recovered_percent_within_0.10"]
    assert len(report.rows) == 2 and set(report.rows.to_dict()) == set(table.column_names)


def test_a_plot_takes_a_threshold_as_number_or_text(small):
    pytest.importorskip("matplotlib").use("Agg")
    report = cheap(small, ["olc"], thresholds=["0.10", "0.25"])
    for threshold in (None, 0.1, "0.10", "0.1"):
        assert "within 0.10 m" in report.plot(threshold).get_ylabel()
    with pytest.raises(unlift.UnliftError, match="threshold: expected one of 0.10, 0.25, found 0.3"):
        report.plot(0.3)
