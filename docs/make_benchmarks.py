#!/usr/bin/env python3
"""Writes the accuracy tables of docs/benchmarks.md and README.md from audits of the two real scenes.

    cargo build --release && python3 docs/make_benchmarks.py ../shared

or parts of them, named after the folder; each tells on stderr how long it took (two idle cores):

    accuracy    2 min    both scenes, three solvers, three seeds; also the README's table and the section on confidence
    low         1 min    ratios below a tenth, three seeds
    noise       1 min    noise models and their figure
    own         6 min    an attacker's own sources
    alone       1 min    attacks on the records alone
    large       5 min    the cost of 700,000 points
    images     25 min    keypoints of photos
    pictures   25 min    what came back, painted
    sequence    5 min    several queries with known poses
    again       5 min    a map released twice
    cost       20 min    leak and localization accuracy side by side, with mitigations
    protect    30 min    protected descriptors and sphere clouds

`± s` is the standard deviation over seeds, where it exceeds 0.5. Needs the scenes (SHARED/data) and the paper's tables (SHARED/paper/tables);
standard library only. Everything between the begin and end markers of the two files is replaced.
"""
import array, csv, json, math, pathlib, random, struct, subprocess, sys, tempfile, time

import again_tables
import cost_tables
import image_tables
import picture_tables
import protect_tables
import sequence_tables

ROOT = pathlib.Path(__file__).resolve().parent.parent
SHARED = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ROOT.parent / "shared").resolve()
RATIOS = [1.0, 0.75, 0.5, 0.3, 0.2, 0.1]
FEWER = [1.0, 0.5, 0.2, 0.1]
SCHEMES = ["olc", "ppl", "ppl+", "ray", "ray-voxel", "plane", "cp"]
# Within small thresholds, `ppl+` gives nearly the figures of `ppl`.
FEWER_SCHEMES = [scheme for scheme in SCHEMES if scheme != "ppl+"]


def audit(scene, *options, solvers="consensus,ransac"):
    with tempfile.TemporaryDirectory() as out:
        command = [ROOT / "target/release/unlift", "audit", "map", SHARED / "data" / scene / "model",
                   "--solver", solvers, "--no-records-alone", "--quiet", "--out", f"{out}/audit", *options]
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


def cell(row, least=0.5):
    """Percent within each threshold, with the standard deviation over seeds where it exceeds `least`."""
    std = row.get("std", {}).get("recovered_percent", {})
    return " / ".join(f"{x:.1f}" + (f" ± {std[t]:.1f}" if std.get(t, 0) > least else "")
                      for t, x in row["recovered_percent"].items())


def near(row, least=0.5):
    """The cell of the smallest threshold alone."""
    return cell(row, least).split(" / ")[0]


def head(names, columns):
    """The first two lines of a table."""
    yield "| " + " | ".join([*names, *columns]) + " |"
    yield "|" + " --- |" * (len(names) + len(columns))


def table(rows, solver, published, ratios):
    by_key = {(r["scheme"], r["inlier_ratio"]): r for r in rows if r["solver"] == solver}
    yield from head(["In"], SCHEMES)
    for ratio in ratios:
        cells = []
        for scheme in SCHEMES:
            text = cell(by_key[scheme, ratio])
            known = [published.get((scheme, ratio, t)) for t in (0.10, 0.25)]
            text += f" [{'/'.join(known)}]" if all(known) else ""
            cells.append(text)
        yield f"| {ratio} | " + " | ".join(cells) + " |"
    guesses = [" / ".join(f"{x:.1f}" for x in by_key[s, 1.0]["blind_percent"].values()) for s in SCHEMES]
    yield "| blind | " + " | ".join(guesses) + " |"


def several(rows, solvers, ratios, blind=False):
    """Percent by several solvers, within the smallest threshold."""
    by_key = {(r["solver"], r["scheme"], r["inlier_ratio"]): r for r in rows}
    yield from head(["In"], SCHEMES)
    for ratio in ratios:
        cells = [" / ".join(near(by_key[solver, s, ratio]) for solver in solvers) for s in SCHEMES]
        yield f"| {ratio} | " + " | ".join(cells) + " |"
    if blind:
        guesses = [[*by_key[solvers[0], s, 1.0]["blind_percent"].values()][0] for s in SCHEMES]
        yield "| blind | " + " | ".join(f"{x:.1f}" for x in guesses) + " |"


def close(scene, thresholds, *options):
    """Percent that `ranking` recovers within a tenth and half of the smallest threshold."""
    rows = audit(scene, *options, "--thresholds", thresholds, "--inlier-ratios", "1,0.5,0.2", solvers="ranking")["results"]
    by_key = {(r["scheme"], r["inlier_ratio"]): " / ".join(f"{x:.0f}" for x in r["recovered_percent"].values()) for r in rows}
    yield from head(["In"], FEWER_SCHEMES)
    for ratio in (1.0, 0.5, 0.2):
        yield f"| {ratio} | " + " | ".join(by_key[s, ratio] for s in FEWER_SCHEMES) + " |"


def column(rows, solver, scheme, field, ratios=FEWER):
    return [f"{r[field]:.1f}" for ratio in ratios for r in rows
            if (r["solver"], r["scheme"], r["inlier_ratio"]) == (solver, scheme, ratio)]


def break_even_line(document):
    """Returns the break-even ratios that are not below all tested ones."""
    signs = {"interpolated": "", "above_tested": "above "}
    told = []
    for solver in SOLVERS:
        found = {b["scheme"]: b for b in document["break_even"] if b["solver"] == solver and b["bound"] in signs}
        told += [f"{signs[found[s]['bound']]}{found[s]['inlier_ratio']:.2f} (`{s}`, `{solver}`)" for s in SCHEMES if s in found]
    return f"Break-even inlier ratio (half within 10 cm): below {min(RATIOS):.2f}, except {', '.join(told)}."


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
    published = {scheme: shares[1:] for scheme, shares in published.items()}  # not within 5 cm
    schemes = ["olc", "ppl", "ppl+", "ray", "cp"]
    yield from head(["attack"], schemes)
    yield "| published, paper (12-scenes) | " + " | ".join(" / ".join(published.get(s, [])) or "-" for s in schemes) + " |"
    for scene, name, thresholds, more in (("redkitchen", "RedKitchen", "0.1,0.25", KITCHEN),
                                          ("castle", "Castle", "1,2.5", [])):
        document = audit(scene, "--schemes", ",".join(schemes), "--inlier-ratios", "1", "--thresholds", thresholds, *more,
                         solvers="density,tomography")
        for solver in ("density", "tomography"):
            cells = {r["scheme"]: cell(r) for r in document["results"] if r["solver"] == solver}
            yield f"| `{solver}`, {name} | " + " | ".join(cells[s] for s in schemes) + " |"


NOISES = ["uniform", "near", "clustered"]
SOLVERS = ["joint", "consensus", "ransac"]
NOISE_SOLVERS = ["ranking", "joint", "consensus"]


def noise_table(rows):
    """Yields the share within the smallest threshold for the noise models that no other table has."""
    shares = {(r["oracle_noise"], r["scheme"], r["inlier_ratio"], r["solver"]): [*r["recovered_percent"].values()][0]
              for r in rows}
    yield from head(["noise", "In"], SCHEMES)
    for noise in ("near", "clustered"):
        for ratio in (0.5, 0.1):
            cells = [" / ".join(f"{shares[noise, s, ratio, solver]:.0f}" for solver in ("ranking", "consensus")) for s in SCHEMES]
            yield f"| {noise} | {ratio} | " + " | ".join(cells) + " |"


def noise_figure(rows):
    """Draws the shares as small pictures: a row per noise model, a column per scheme, a line per solver."""
    shares = {(r["oracle_noise"], r["scheme"], r["solver"], r["inlier_ratio"]): [*r["recovered_percent"].values()][0]
              for r in rows}
    width, height, colors = 130, 96, {"ranking": "#2a7d3f", "joint": "#1b6ca8", "consensus": "#d1741f"}
    at = lambda ratio: 14 + (width - 26) * ratio
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {60 + width * len(SCHEMES)} {50 + height * 3}" '
           'font-family="sans-serif" font-size="10"><rect width="100%" height="100%" fill="white"/>']
    for i, solver in enumerate(NOISE_SOLVERS):
        out.append(f'<text x="{64 + 90 * i}" y="12" fill="{colors[solver]}">{solver}</text>')
    for column, scheme in enumerate(SCHEMES):
        out.append(f'<text x="{64 + width * column + 40}" y="28">{scheme}</text>')
        for line, noise in enumerate(NOISES):
            left, top = 60 + width * column, 34 + height * line
            if column == 0:
                out.append(f'<text x="2" y="{top + 40}">{noise}</text>')
            out.append(f'<rect x="{left + 14}" y="{top}" width="{width - 26}" height="80" fill="none" stroke="#ccc"/>')
            for solver in NOISE_SOLVERS:
                points = " ".join(f"{left + at(r):.1f},{top + 80 - 0.8 * shares[noise, scheme, solver, r]:.1f}"
                                  for r in RATIOS)
                out.append(f'<polyline points="{points}" fill="none" stroke="{colors[solver]}" stroke-width="1.5"/>')
    bottom = 44 + height * 3
    out.append(f'<text x="64" y="{bottom}">across: inlier ratio 0 to 1; up: percent within the smallest threshold, 0 to 100</text></svg>')
    return "\n".join(out) + "\n"


OWN = ["olc", "ppl", "ray", "plane", "cp"]


def own_sources(name, scene, *options, sources=("learned", "overlap", "similarity", "geometric")):
    """What an attacker gets without an oracle: sources by scheme, joint recovery."""
    found = {}
    # Where a source has nothing to say about a scheme (geometric, planes), the audit says so and goes on.
    asked = [x for source in sources for x in ("--neighbors", source)]
    document = audit(scene, "--schemes", ",".join(OWN), *asked, *options, "--descriptors",
                     str(SHARED / "data" / scene / "descriptors.bin"), solvers="joint")
    for row in document["results"]:
        found[row["neighbors"], row["scheme"]] = row
    for source in sources:
        cells = [near(found[source, s]) if (source, s) in found else "-" for s in OWN]
        right = [100 * found[source, s]["inlier_ratio"] for s in OWN if (source, s) in found]
        shown = right[:1] if max(right) - min(right) < 1 else right
        yield f"| {name} | `{source}` | {' / '.join(f'{x:.1f}' for x in shown)} | " + " | ".join(cells) + " |"


def reference_line(rows):
    """Returns the lowest and the highest share of any scheme within the smallest threshold."""
    shares = [[*r["recovered_percent"].values()][0] for r in rows if r["solver"] == "reference"]
    return f"True three nearest neighbors given as points (`reference`), all schemes: {min(shares):.1f} to {max(shares):.1f}."


def exact_line(rows):
    shares = column([r for r in rows if r.get("exact_percent") is not None], "ranking", "cp", "exact_percent")
    return f"Recovered exactly, with the value that another record publishes (`cp`, `ranking`), In {' / '.join(map(str, FEWER))}: {' / '.join(shares)}."


def confidence_rows(name, rows, solver):
    """Percent of the points that the attacker is 90 % sure of, and percent of those within the threshold."""
    by_key = {(r["scheme"], r["inlier_ratio"]): r for r in rows if r["solver"] == solver}
    for ratio in (1.0, 0.1):
        cells = []
        for scheme in SCHEMES:
            row = by_key[scheme, ratio]
            correct = row.get("sure_correct_percent")
            sure = row["sure_percent"]
            cells.append("not known" if sure is None else f"{sure:.{0 if sure >= 1 or sure == 0 else 1}f} / " + ("-" if correct is None else f"{correct:.1f}"))
        yield f"| {name} | {ratio} | " + " | ".join(cells) + " |"


def reliability(documents):
    """Every second bin of the curve over all schemes and ratios of a map, recovered by `ranking`."""
    curves = []
    for name, rows in documents:
        pooled = [[0, 0.0, 0.0] for _ in range(10)]
        for row in rows:
            if row["solver"] == "ranking":
                for bin, more in zip(pooled, row.get("reliability", [])):
                    if more["n"]:
                        bin[0] += more["n"]
                        bin[1] += more["n"] * more["predicted"]
                        bin[2] += more["n"] * more["observed"]
        curves.append((name, pooled))
    yield from head(["map"], [f"{10 * b}-{10 * b + 10} %" for b in range(1, 10, 2)])
    for name, pooled in curves:
        cells = [f"{100 * a / n:.0f}: {100 * b / n:.0f}" if n else "-" for n, a, b in pooled[1::2]]
        yield f"| {name} | " + " | ".join(cells) + " |"


def low():
    """Yields the shares within the smaller threshold below a tenth, `joint` / `consensus`."""
    schemes = [s for s in SCHEMES if s != "ray-voxel"]
    yield from head(["map", "In"], schemes)
    for scene, name, options in (("redkitchen", "RedKitchen", KITCHEN), ("castle", "Castle", [])):
        rows = audit(scene, "--schemes", ",".join(schemes), "--inlier-ratios", "0.06,0.04", "--repeats", "3", *options,
                     solvers="joint,consensus")["results"]
        for ratio in (0.06, 0.04):
            cells = []
            for scheme in schemes:
                found = {r["solver"]: near(r, 5) for r in rows if (r["scheme"], r["inlier_ratio"]) == (scheme, ratio)}
                cells.append(f"{found['joint']} / {found['consensus']}")
            yield f"| {name} | {ratio} | " + " | ".join(cells) + " |"


KITCHEN = ["--scale", "1"]


def accuracy():
    descriptors = ["--descriptors", str(SHARED / "data/redkitchen/descriptors.bin")]
    kitchen = audit("redkitchen", *KITCHEN, *descriptors, "--reference", "--repeats", "3", solvers=",".join(["ranking", *SOLVERS]))
    castle = audit("castle", "--reference", "--repeats", "3", solvers="ranking,joint,consensus")
    rows, published = kitchen["results"], paper()
    out = ["## RedKitchen (7-Scenes, 21,149 points, meters)", "",
           "`ranking`, within 10 / 25 cm; in brackets the paper's mean over 7-Scenes (other maps, so compare trends):", "",
           *table(rows, "ranking", published, [1.0, 0.5, 0.3, 0.2, 0.1]), "",
           "`joint` / `consensus` / `ransac`, within 10 cm:", "", *several(rows, ["joint", "consensus", "ransac"], [1.0, 0.5, 0.1]), "",
           "`ranking`, within 1 / 5 cm, seed 0:", "", *close("redkitchen", "0.01,0.05", *KITCHEN), ""]
    out += [reference_line(rows), "", exact_line(rows), "", break_even_line(kitchen), "",
            "Swapped axis named (`cp`), and descriptor given to its own point (`ppl`), percent:", "",
            *head(["In"], [str(ratio) for ratio in FEWER])]
    for solver in SOLVERS:
        out += [f"| axis, {solver} | " + " | ".join(column(rows, solver, "cp", "axis_accuracy_percent")) + " |"]
    out += ["| descriptors | " + " | ".join(column(rows, "consensus", "ppl", "assignment_accuracy_percent")) + " |"]
    out += ["", "## Castle (6,224 points, no scale)", "",
            "`ranking` / `joint` / `consensus`, within 1.0:", "",
            *several(castle["results"], ["ranking", "joint", "consensus"], [1.0, 0.5, 0.1], blind=True), "",
            "`ranking`, within 0.1 / 0.5, seed 0:", "", *close("castle", "0.1,0.5"), "",
            reference_line(castle["results"]), "", exact_line(castle["results"]), ""]
    put(ROOT / "docs/benchmarks.md", "accuracy", out)
    put(ROOT / "README.md", "results", [*table(rows, "ranking", published, [0.5, 0.1]), ""])
    put(ROOT / "docs/benchmarks.md", "confidence", [
        "`ranking`, percent of all points that the attacker is 90 % sure to have within the smallest threshold / percent of these that are:", "", *head(["map", "In"], SCHEMES), *confidence_rows("RedKitchen", rows, "ranking"),
        *confidence_rows("Castle", castle["results"], "ranking"), "",
        "Stated probability: share that came true, over all schemes, ratios and seeds:", "",
        *reliability([("RedKitchen", rows), ("Castle", castle["results"])]), ""])


def below_a_tenth():
    put(ROOT / "docs/benchmarks.md", "low", [
        "`joint` / `consensus`, within 10 cm (Castle: 1.0); `±` if above 5:", "", *low(), ""])


def noise():
    noisy = audit("redkitchen", *KITCHEN, "--oracle-noise", ",".join(NOISES), solvers=",".join(NOISE_SOLVERS))["results"]
    (ROOT / "docs/noise.svg").write_text(noise_figure(noisy))
    put(ROOT / "docs/benchmarks.md", "noise", [*noise_table(noisy), "", "![Noise models](noise.svg)", ""])


def own():
    put(ROOT / "docs/benchmarks.md", "own sources", [
        "Within 10 cm (Castle: 1.0); ALIKED is RedKitchen with 9,972 points and descriptors of 16 bits.", "",
        *head(["map", "neighbors by", "right, %"], OWN), *own_sources("RedKitchen", "redkitchen", *KITCHEN),
        *own_sources("Castle", "castle"), *own_sources("ALIKED", "redkitchen-aliked", *KITCHEN, sources=["learned", "similarity", "geometric"]), "",
        "### Descriptors give the map away", "",
        "Keypoints of photos: share of the first 20 listed that are among the 20 nearest; first RedKitchen (40 photos), then Castle (11):", "",
        *tell("redkitchen"), *list(tell("castle"))[2:], ""])


def tell(scene):
    """What descriptors of photos name, by kind of features and source."""
    command = ["cargo", "run", "--release", "--quiet", "-p", "unlift-features", "--example", "descriptors_tell", "--",
               SHARED / "data" / scene / "images"]
    last = None
    for line in subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, cwd=ROOT).stdout.splitlines():
        figures = line.split("|")[2:]
        # A photo's best 2,048 keypoints may all score above 0.2.
        if figures != last:
            yield line
        last = figures


def alone():
    put(ROOT / "docs/benchmarks.md", "records alone", [*records_alone(), ""])


def tiled(path, n_points):
    """RedKitchen side by side on a square, every copy with a jitter of 3 mm, as an NPY file."""
    data = (SHARED / "data/redkitchen/model/points3D.bin").read_bytes()
    n, at, points = struct.unpack_from("<Q", data, 0)[0], 8, []
    for _ in range(n):
        points.append(struct.unpack_from("<3d", data, at + 8))
        at += 51 + 8 * struct.unpack_from("<Q", data, at + 43)[0]
    wide = [sorted(p[c] for p in points)[int(0.99 * n)] - sorted(p[c] for p in points)[int(0.01 * n)] for c in range(3)]
    first, second = sorted(range(3), key=lambda c: -wide[c])[:2]
    side, draw, values = math.ceil(math.sqrt(n_points / n)), random.Random(0), array.array("d")
    for i in range(n_points):
        p, copy = list(points[i % n]), i // n
        p[first] += wide[first] * (copy % side)
        p[second] += wide[second] * (copy // side)
        values.extend(x + (draw.gauss(0, 0.003) if copy else 0.0) for x in p)
    head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({n_points}, 3), }}"
    head += " " * (-(len(head) + 11) % 64) + "\n"
    path.write_bytes(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head.encode() + values.tobytes())


def large():
    """The cost of an audit of 700,000 points: six schemes, six ratios, joint recovery."""
    with tempfile.TemporaryDirectory() as folder:
        tiled(pathlib.Path(folder, "map.npy"), 700_000)
        command = [ROOT / "target/release/unlift", "audit", "map", f"{folder}/map.npy", "--scale", "1", "--solver", "joint",
                   "--schemes", "olc,ppl,ray,plane,cp,ppl+", "--no-records-alone", "--quiet", "--out", f"{folder}/audit"]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        document = json.loads(pathlib.Path(folder, "audit/audit.json").read_text())
    by_scheme = {}
    for row, spent in zip(document["results"], document["run"]["seconds"]["rows"]):
        by_scheme.setdefault(row["scheme"], []).append(spent["recover"])
    put(ROOT / "docs/benchmarks.md", "large", [
        f"{cost(document)}. Seconds of `joint` with confidence, of the fastest and the slowest ratio: "
        + ", ".join(f"{scheme} {min(spent):.0f} to {max(spent):.0f}" for scheme, spent in by_scheme.items()) + ".", ""])


def images():
    put(ROOT / "docs/benchmarks.md", "images", image_tables.tables(ROOT / "target/release/unlift", SHARED))


def pictures():
    put(ROOT / "docs/benchmarks.md", "pictures", picture_tables.tables(ROOT / "target/release/unlift", SHARED))


def sequence():
    put(ROOT / "docs/benchmarks.md", "sequence", sequence_tables.tables(ROOT / "target/release/unlift", SHARED))


def again():
    put(ROOT / "docs/benchmarks.md", "again", again_tables.tables(ROOT / "target/release/unlift", SHARED))


def what_protection_costs():
    put(ROOT / "docs/benchmarks.md", "cost", cost_tables.tables(ROOT / "target/release/unlift", SHARED))


def protected():
    put(ROOT / "docs/benchmarks.md", "protect", protect_tables.tables(ROOT / "target/release/unlift", SHARED))


def main():
    sections = {"accuracy": accuracy, "low": below_a_tenth, "noise": noise, "own": own, "alone": alone, "large": large,
                "images": images, "pictures": pictures, "sequence": sequence, "again": again, "cost": what_protection_costs,
                "protect": protected}
    for name in sys.argv[2:] or sections:
        started = time.monotonic()
        sections[name]()
        print(f"{name}: {time.monotonic() - started:.0f} s", file=sys.stderr)


def put(path, name, lines):
    begin, end = f"<!-- {name}: begin -->\n", f"<!-- {name}: end -->"
    # Making the lines takes long; the file is read after that.
    lines = list(lines)
    text = path.read_text()
    head, tail = text.split(begin)[0], text.split(end)[1]
    path.write_text(head + begin + "\n" + "\n".join(lines) + "\n" + end + tail)


main()
