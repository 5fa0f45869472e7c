#!/usr/bin/env python3
"""Writes the accuracy tables of docs/benchmarks.md and README.md from audits of the two real scenes.

    cargo build --release && python3 docs/make_benchmarks.py ../shared

Needs the scenes (SHARED/data) and the paper's tables (SHARED/paper/tables); standard library only.
Everything between the begin and end markers of the two files is replaced.
"""
import csv, json, pathlib, subprocess, sys, tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
SHARED = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ROOT.parent / "shared").resolve()
RATIOS = [1.0, 0.75, 0.5, 0.3, 0.2, 0.1]
SCHEMES = ["olc", "ppl", "ppl+", "ray", "ray-voxel", "plane", "cp"]


def audit(scene, *options, solvers="consensus,ransac"):
    with tempfile.TemporaryDirectory() as out:
        command = [ROOT / "target/release/unlift", "audit", "map", SHARED / "data" / scene / "model",
                   "--solver", solvers, "--out", f"{out}/audit", *options]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        return json.loads(pathlib.Path(out, "audit/audit.json").read_text())


def paper():
    table = {}
    with open(SHARED / "paper/tables/geometric_3d.csv") as lines:
        for row in csv.DictReader(lines):
            if row["dataset"] == "7-scenes" and row["feature"] == "sift":
                key = row["scheme"], float(row["inlier_ratio"]), float(row["threshold_m"])
                table[key] = row["recovered_percent"]
    return table


def cell(row):
    return " / ".join(f"{x:.1f}" for x in row["recovered_percent"].values())


def table(rows, solver, published=None):
    by_key = {(r["scheme"], r["inlier_ratio"]): r for r in rows if r["solver"] == solver}
    yield "| In | " + " | ".join(SCHEMES) + " |"
    yield "| --- |" + " --- |" * len(SCHEMES)
    for ratio in RATIOS:
        cells = []
        for scheme in SCHEMES:
            text = cell(by_key[scheme, ratio])
            if published:
                near, far = (published.get((scheme, ratio, t)) for t in (0.10, 0.25))
                text += f" [{near}/{far}]" if near else ""
            cells.append(text)
        yield f"| {ratio} | " + " | ".join(cells) + " |"
    blind = [" / ".join(f"{x:.1f}" for x in by_key[s, 1.0]["blind_percent"].values()) for s in SCHEMES]
    yield "| blind | " + " | ".join(blind) + " |"


def column(rows, solver, scheme, field):
    return [f"{r[field]:.1f}" for ratio in RATIOS for r in rows
            if (r["solver"], r["scheme"], r["inlier_ratio"]) == (solver, scheme, ratio)]


def break_even(document):
    signs = {"interpolated": "", "below_tested": "below ", "above_tested": "above "}
    yield "| solver | " + " | ".join(SCHEMES) + " |"
    yield "| --- |" + " --- |" * len(SCHEMES)
    for solver in ("consensus", "ransac"):
        by_scheme = {b["scheme"]: b for b in document["break_even"] if b["solver"] == solver}
        cells = [f"{signs[by_scheme[s]['bound']]}{by_scheme[s]['inlier_ratio']:.2f}" for s in SCHEMES]
        yield f"| {solver} | " + " | ".join(cells) + " |"


def cost(document):
    run = document["run"]
    stages = ", ".join(f"{k} {v:.1f}" for k, v in run["seconds"]["stages"].items())
    memory = run["peak_memory_bytes"] / 2**20
    return f"{run['seconds']['total']:.1f} s in all ({stages}), {run['threads']} threads, peak {memory:.0f} MiB"


def records_alone():
    """The published density attacks and ours, beside the paper's figures for the published ones."""
    published = {}
    with open(SHARED / "paper/tables/line_recovery_baselines_3d.csv") as lines:
        for row in csv.DictReader(lines):
            if row["method"].startswith("density"):
                published.setdefault(row["scheme"], []).append(row["recovered_percent"])
    schemes = ["olc", "ppl", "ppl+", "ray", "cp"]
    yield "| attack | " + " | ".join(schemes) + " |"
    yield "| --- |" + " --- |" * len(schemes)
    yield "| published, paper (12-scenes) | " + " | ".join(" / ".join(published.get(s, [])) or "-" for s in schemes) + " |"
    for scene, name, thresholds, more in (("redkitchen", "RedKitchen", "0.05,0.1,0.25", ["--scale", "1"]),
                                          ("castle", "Castle", "0.5,1,2.5", [])):
        document = audit(scene, "--schemes", ",".join(schemes), "--inlier-ratios", "1", "--thresholds", thresholds, *more,
                         solvers="density,tomography")
        for solver in ("density", "tomography"):
            cells = {r["scheme"]: cell(r) for r in document["results"] if r["solver"] == solver}
            yield f"| `{solver}`, {name} | " + " | ".join(cells[s] for s in schemes) + " |"


def main():
    put(ROOT / "docs/benchmarks.md", "records alone", [*records_alone(), ""])
    if "--records-alone" in sys.argv:
        return
    kitchen = audit("redkitchen", "--scale", "1", "--descriptors", str(SHARED / "data/redkitchen/descriptors.bin"))
    castle = audit("castle")
    rows, published = kitchen["results"], paper()
    out = ["## RedKitchen (7-Scenes, 21,149 points, meters)", "",
           "Percent within 10 / 25 cm; in brackets the paper's mean over the seven scenes of 7-Scenes (other maps: the trend",
           "compares, not the digit). K = 50, uniform oracle noise, automatic delta, seed 0.", ""]
    for solver in ("consensus", "ransac"):
        out += [f"### `{solver}`", "", *table(rows, solver, published), ""]
    out += ["### Break-even inlier ratio (half of the points within 10 cm)", "", *break_even(kitchen), "",
            "### Exchanged axis named (`cp`) and descriptor given to its own point (`ppl`), percent", "",
            "| In | " + " | ".join(map(str, RATIOS)) + " |", "| --- |" + " --- |" * len(RATIOS)]
    for solver in ("consensus", "ransac"):
        axis = column(rows, solver, "cp", "axis_accuracy_percent")
        out += [f"| axis, {solver} | " + " | ".join(axis) + " |"]
    for scheme in ("ppl", "ppl+"):
        assigned = column(rows, "consensus", scheme, "assignment_accuracy_percent")
        out += [f"| descriptors, {scheme} | " + " | ".join(assigned) + " |"]
    out += ["", f"Cost of this audit (both solvers): {cost(kitchen)}.", "",
            "## Castle (6,224 points, no scale)", "",
            "Percent within 1.0 / 2.5 median distances to the 50th neighbor.", ""]
    for solver in ("consensus", "ransac"):
        out += [f"### Castle, `{solver}`", "", *table(castle["results"], solver), ""]
    out += [f"Cost of this audit (both solvers): {cost(castle)}.", ""]
    put(ROOT / "docs/benchmarks.md", "accuracy", out)
    put(ROOT / "README.md", "results", [*table(rows, "consensus", published), ""])


def put(path, name, lines):
    begin, end = f"<!-- {name}: begin -->\n", f"<!-- {name}: end -->"
    text = path.read_text()
    head, tail = text.split(begin)[0], text.split(end)[1]
    path.write_text(head + begin + "\n" + "\n".join(lines) + "\n" + end + tail)


main()
