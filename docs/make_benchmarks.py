#!/usr/bin/env python3
"""Writes the tables of docs/benchmarks.md and README.md from audits of four real scenes.

    cargo build --release && python3 docs/make_benchmarks.py ../shared

or some sections of them, named after the folder; each prints on stderr how long it took (two idle cores):

    accuracy   20 min    four scenes, three solvers, three seeds; also the README's table and the section on confidence
    noise       1 min    noise models of the oracle
    own         5 min    an attacker's own sources
    alone       1 min    attacks on the records alone
    large      26 min    the cost of 700,000 points
    images     20 min    keypoints of photos
    k           5 min    keypoints of photos, for lists of 10 to 100
    pictures   15 min    pictures painted from what came back
    sequence    2 min    several queries with known poses
    again       2 min    a map released twice
    cost       15 min    leak and localization accuracy side by side, with mitigations
    protect    20 min    protected descriptors and sphere clouds
    artifact    0 min    the column `ours` of ARTIFACT.md, from the tables of docs/benchmarks.md

`± s` is the standard deviation over seeds, where it exceeds 0.5. Needs the scenes (SHARED/data); standard library only. Everything between the begin and end markers of the two files is replaced.
"""
import array, csv, json, math, pathlib, random, re, struct, subprocess, sys, tempfile, time

ROOT = pathlib.Path(__file__).resolve().parent.parent
SHARED = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ROOT.parent / "shared").resolve()
DATA = SHARED / "data"
PROGRAM = ROOT / "target/release/unlift"
SCHEMES = ["olc", "ppl", "ppl+", "ray", "ray-voxel", "plane", "cp"]
FEWER_SCHEMES = ["olc", "ppl", "ray", "plane", "cp"]
IMAGE_SCHEMES = ["lines2d", "cp2d", "dcl2d"]
SOLVERS = ["joint", "consensus", "ransac"]
METERS = ["--scale", "1"]


# -- audits --------------------------------------------------------------------------------------------------------------------------


def unlift(*words):
    """Runs an audit and returns its audit.json."""
    with tempfile.TemporaryDirectory() as out:
        command = [str(word) for word in (PROGRAM, "audit", *words, "--quiet", "--out", f"{out}/audit")]
        print(" ".join(command), file=sys.stderr)
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        return json.loads(pathlib.Path(out, "audit/audit.json").read_text())


def audit_map(scene, *options, solvers="consensus,ransac", descriptors=False):
    scale = [] if scene == "castle" else METERS
    given = ["--descriptors", DATA / scene / "descriptors.bin"] if descriptors else []
    sources = [] if "--neighbors" in options else ["--neighbors", "oracle"]
    path = DATA / scene / ("input.ply" if scene == "kitchen" else "model")
    return unlift("map", path, *scale, *given, "--full", "--solver", solvers, "--no-records-alone", *sources, *options)


def each(option, values):
    return [word for value in values for word in (option, value)]


def extract(photos, kind, out):
    fewer = [] if kind == "sift" else ["--min-score", "0.02"]
    command = [PROGRAM, "features", DATA / photos / "images", "--features", kind, "--as-stored", "--quiet", "--out", out, *fewer]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


# -- the paper's numbers -------------------------------------------------------------------------------------------------------------


def published(name):
    with open(ROOT / f"docs/paper/{name}.csv") as lines:
        return list(csv.DictReader(lines))


def published_maps(dataset):
    return {(row["scheme"], float(row["inlier_ratio"]), float(row["threshold_m"])): row["recovered_percent"]
            for row in published("geometric_3d") if (row["dataset"], row["feature"]) == (dataset, "sift")}


def published_images(feature):
    """The paper's shares on 7-Scenes: {(scheme, ratio or 'estimated', threshold): percent}."""
    table = {}
    for row in published("geometric_2d") + published("end_to_end_2d"):
        if (row["dataset"], row["feature"], row.get("metric", "recovered_percent")) == ("7-scenes", feature, "recovered_percent"):
            ratio = row.get("neighborhood") or float(row["inlier_ratio"])
            table[row["scheme"], ratio, row["threshold_px"]] = row.get("recovered_percent") or row.get("value")
    return table


def published_ssim(dim):
    """The paper's SSIM on 7-Scenes, SIFT: {(scheme, ratio): value}, that of the true points under the scheme `none`."""
    return {(row["scheme"], row["inlier_ratio"] if row["inlier_ratio"] == "baseline" else float(row["inlier_ratio"])): row["value"]
            for row in published("perceptual") if (row["dataset"], row["dim"], row["feature"], row["metric"]) == ("7-scenes", dim, "sift", "ssim")}


# -- cells and rows ------------------------------------------------------------------------------------------------------------------


def line(*cells):
    return "| " + " | ".join(cells) + " |"


def head(*names):
    return [line(*names), "|" + " --- |" * len(names)]


def share(row):
    """Percent within the smallest threshold."""
    return next(iter(row["recovered_percent"].values()))


def cell(row, count=None):
    """Percent within the first thresholds, with the standard deviation over seeds where it exceeds 0.5."""
    std = row.get("std", {}).get("recovered_percent", {})
    shares = list(row["recovered_percent"].items())[:count]
    return "/".join(f"{x:.1f}" + (f" ± {std[t]:.1f}" if std.get(t, 0) > 0.5 else "") for t, x in shares)


def percents(of, thresholds=("5", "10", "25")):
    return "/".join(f"{of[t]:.1f}" for t in thresholds)


def known(values):
    return f" [{'/'.join(values)}]" if all(values) else ""


def column(rows, solver, scheme, field):
    return "/".join(f"{row[field]:.1f}" for ratio in (1.0, 0.5, 0.2, 0.1) for row in rows
                    if (row["solver"], row["scheme"], row["inlier_ratio"]) == (solver, scheme, ratio))


# -- sections ------------------------------------------------------------------------------------------------------------------------


def accuracy():
    scenes = {name: audit_map(scene, "--repeats", "3", "--thresholds", within, solvers=",".join(SOLVERS)) for name, scene, within in (
        ("RedKitchen", "redkitchen", "0.1,0.25"), ("kitchen", "kitchen", "0.1,0.25,0.05"),
        ("fountain", "fountain", "0.25,0.5"), ("Castle", "castle", "1,2.5"))}
    pairs = audit_map("redkitchen", "--schemes", "ppl", solvers="joint", descriptors=True)["results"]
    paper = {"RedKitchen": "7-scenes", "kitchen": "12-scenes", "fountain": "cambridge"}
    results = {name: document["results"] for name, document in scenes.items()}
    of = {(name, r["solver"], r["scheme"], r["inlier_ratio"]): r for name, rows in results.items() for r in rows}

    def strongest(names, ratios):
        yield from head("scene", "In", *SCHEMES)
        for name in names:
            numbers = published_maps(paper.get(name))
            for ratio in ratios:
                rows = [of[name, "joint", s, ratio] for s in SCHEMES]
                shares = [list(r["recovered_percent"].items())[:2] for r in rows]
                yield line(name, str(ratio), *("/".join(f"{x:.1f}" for _, x in pair) + known([numbers.get((s, ratio, float(t))) for t, _ in pair])
                                               for s, pair in zip(SCHEMES, shares)))
            yield line(name, "blind", *("/".join(f"{x:.1f}" for x in list(r["blind_percent"].values())[:2]) for r in rows))

    def weaker():
        yield from head("scene", "In", *SCHEMES)
        for name in results:
            for ratio in (0.5, 0.1):
                yield line(name, str(ratio), *("/".join(f"{share(of[name, solver, s, ratio]):.1f}" for solver in SOLVERS[1:]) for s in SCHEMES))

    nearest = [[of["kitchen", solver, s, ratio]["recovered_percent"]["0.05"] for solver in ("joint", "ransac")]
               for s, ratio in (("olc", 0.5), ("ppl", 0.2))]
    beside = [row["recovered_percent"] for s, ratio in (("olc", 0.5), ("ppl", 0.2)) for row in published("line_recovery_baselines_3d")
              if (row["scheme"], row["inlier_ratio"], row["threshold_m"]) == (s, f"{ratio:.2f}", "0.05")]
    put("docs/benchmarks.md", "accuracy", [
        "`joint`, within 10 / 25 cm (fountain 25 / 50 cm; Castle 1.0 / 2.5); in brackets the paper's mean over 7-Scenes (RedKitchen), "
        "12-Scenes (kitchen) and Cambridge (fountain), which are other maps: compare trends.", "",
        *strongest(results, [1.0, 0.5, 0.2, 0.1]), "",
        "kitchen within 5 cm, `joint` / `ransac` [paper]: " + ", ".join(
            f"{s} at {ratio} {a:.1f} / {b:.1f} [{c}]" for (s, ratio), (a, b), c in zip((("olc", 0.5), ("ppl", 0.2)), nearest, beside)) + ".", "",
        "`consensus` / `ransac`, within the first threshold:", "", *weaker(), "",
        "RedKitchen, In 1.0 / 0.5 / 0.2 / 0.1: `cp` recovered exactly, with the value that another record publishes, "
        + column(results["RedKitchen"], "joint", "cp", "exact_percent") + " %; the swapped axis known by `joint` "
        + column(results["RedKitchen"], "joint", "cp", "axis_accuracy_percent") + " %, by `ransac` "
        + column(results["RedKitchen"], "ransac", "cp", "axis_accuracy_percent") + " %; descriptors of `ppl` assigned to their point "
        + column(pairs, "joint", "ppl", "assignment_accuracy_percent") + " %.", ""])
    put("README.md", "results", [*(row.replace("RedKitchen | ", "").replace("scene | ", "").replace("| --- ", "", 1)
                                   for row in strongest(["RedKitchen"], [0.5, 0.1])), ""])
    put("docs/benchmarks.md", "confidence", [
        "Percent of all points that the attacker is 90 % sure to have within the smallest threshold / percent of these that are:", "",
        *head("map", "In", *SCHEMES), *(text for name, rows in results.items() for text in sure(name, rows)), ""])


def sure(name, rows):
    of = {(r["scheme"], r["inlier_ratio"]): r for r in rows if r["solver"] == "joint"}
    for ratio in (1.0, 0.1):
        cells = []
        for scheme in SCHEMES:
            percent, correct = of[scheme, ratio]["sure_percent"], of[scheme, ratio].get("sure_correct_percent")
            digits = 0 if percent is None or percent >= 1 or percent == 0 else 1
            cells.append("not known" if percent is None else f"{percent:.{digits}f}/" + ("-" if correct is None else f"{correct:.1f}"))
        yield line(name, str(ratio), *cells)


def noise():
    rows = audit_map("redkitchen", "--oracle-noise", "near,clustered", solvers="joint,consensus")["results"]
    shares = {(r["oracle_noise"], r["scheme"], r["solver"]): share(r) for r in rows if r["inlier_ratio"] == 0.1}
    put("docs/benchmarks.md", "noise", [
        *head("noise", "In", *SCHEMES),
        *(line(kind, "0.1", *("/".join(f"{shares[kind, s, solver]:.0f}" for solver in ("joint", "consensus")) for s in SCHEMES))
          for kind in ("near", "clustered")), ""])


def own():
    lines, best = [], {}
    for name, scene in (("RedKitchen", "redkitchen"), ("Castle", "castle"), ("fountain", "fountain"), ("ALIKED", "redkitchen-aliked")):
        sources = ["learned", "similarity" if name == "ALIKED" else "overlap", *(["geometric"] if scene.startswith("redkitchen") else [])]
        outdoor = ["--thresholds", "0.25,0.5"] if name == "fountain" else []
        # A source that has nothing to say about a scheme (`geometric`, planes) is noted in the audit.
        document = audit_map(scene, *each("--neighbors", sources), *outdoor, solvers="joint", descriptors=True)
        found = {(row["neighbors"], row["scheme"]): row for row in document["results"]}
        best = best or {s: cell(found["learned", s]) for s in SCHEMES}
        for source in sources:
            right = [100 * found[source, s]["inlier_ratio"] for s in SCHEMES if (source, s) in found]
            right = right[:1] if max(right) - min(right) < 1 else right
            cells = [cell(found[source, s], 1) if (source, s) in found else "-" for s in SCHEMES]
            lines.append(line(name, f"`{source}`", "/".join(f"{x:.1f}" for x in right), *cells))
    put("docs/benchmarks.md", "own sources", [
        "Within 10 cm (Castle: 1.0, fountain: 25 cm); ALIKED is RedKitchen with 9,972 points and descriptors of 16 bits.", "",
        *head("map", "neighbors by", "right, %", *SCHEMES), *lines, ""])
    put("README.md", "own", ["Without an oracle, from descriptors alone (`descriptors`): " + ", ".join(f"{s} {best[s]}" for s in SCHEMES) + " %.", ""])


def alone():
    schemes, shares = ["olc", "ppl", "ppl+", "ray", "cp"], {}
    for row in published("line_recovery_baselines_3d"):
        if row["method"].startswith("density"):
            shares.setdefault(row["scheme"], []).append(row["recovered_percent"])
    lines = [line("published, paper (12-scenes)", *("/".join(shares.get(s, [])[1:]) or "-" for s in schemes))]  # not within 5 cm
    for scene, name, thresholds in (("redkitchen", "RedKitchen", "0.1,0.25"), ("castle", "Castle", "1,2.5")):
        document = audit_map(scene, "--schemes", ",".join(schemes), "--inlier-ratios", "1", "--thresholds", thresholds, solvers="density,tomography")
        for solver in ("density", "tomography"):
            cells = {r["scheme"]: cell(r) for r in document["results"] if r["solver"] == solver}
            lines.append(line(f"`{solver}`, {name}", *(cells[s] for s in schemes)))
    put("docs/benchmarks.md", "records alone", [*head("attack", *schemes), *lines, ""])


def tiled(path, n_points):
    """RedKitchen side by side on a square, every copy with a jitter of 3 mm, as an NPY file."""
    data = (DATA / "redkitchen/model/points3D.bin").read_bytes()
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
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({n_points}, 3), }}"
    header += " " * (-(len(header) + 11) % 64) + "\n"
    path.write_bytes(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode() + values.tobytes())


def large():
    with tempfile.TemporaryDirectory() as folder:
        tiled(pathlib.Path(folder, "map.npy"), 700_000)
        document = unlift("map", f"{folder}/map.npy", *METERS, "--full", "--solver", "joint", "--schemes", "olc,ppl,ray,plane,cp,ppl+", "--no-records-alone")
    run, by_scheme = document["run"], {}
    for row, spent in zip(document["results"], run["seconds"]["rows"]):
        by_scheme.setdefault(row["scheme"], []).append(spent["recover"])
    stages = ", ".join(f"{k} {v:.1f}" for k, v in run["seconds"]["stages"].items())
    put("docs/benchmarks.md", "large", [
        f"{run['seconds']['total']:.1f} s in all ({stages}), {run['threads']} threads, peak {run['peak_memory_bytes'] / 2**20:.0f} MiB. "
        "Seconds of `joint` with confidence, of the fastest and the slowest ratio: "
        + ", ".join(f"{scheme} {min(spent):.0f} to {max(spent):.0f}" for scheme, spent in by_scheme.items()) + ".", ""])


def images():
    photos, paper, thresholds = DATA / "redkitchen/images", published_images("sift"), ("5", "10", "25")
    rows = unlift("images", photos, "--neighbors", "oracle", "--solver", "joint,ransac")["results"]
    of = {(r["solver"], r["scheme"], r["inlier_ratio"]): r for r in rows if r.get("oracle_noise")}

    def by_ratio(solver, ratios, beside):
        yield from ["`" + solver + "`:", "", *head("In", *IMAGE_SCHEMES)]
        for ratio in ratios:
            yield line(str(ratio), *(percents(of[solver, s, ratio]["recovered_percent"])
                                     + known([beside.get((s, ratio, t)) for t in thresholds]) for s in IMAGE_SCHEMES))

    exact = "/".join(f"{of['joint', 'cp2d', ratio]['exact_percent']:.1f}" for ratio in (1.0, 0.5, 0.1)).replace("/", " / ")
    errors = " / ".join(f"{of['joint', 'dcl2d', ratio]['median_error']:.0f}" for ratio in (1.0, 0.5, 0.1))
    lines = []
    for name, given, options, sources, feature in (
            ("RedKitchen, SIFT", photos, [], ["learned", "overlap"], "sift"),
            ("Castle, SIFT", DATA / "castle/features-sift.h5", [], ["learned"], None),
            ("RedKitchen, ALIKED 2,048", photos, ["--features", "aliked", "--min-score", "0.02"], ["learned", "similarity"], None),
            ("Castle, ALIKED 2,048", DATA / "castle/images", ["--features", "aliked"], ["learned"], "superpoint")):
        document = unlift("images", given, "--solver", "joint", *options, *each("--neighbors", sources))
        found = {(r["neighbors"], r["scheme"]): r for r in document["results"]}
        for source in sources:
            right = f"{100 * found[source, IMAGE_SCHEMES[0]]['inlier_ratio']:.1f}"
            lines.append(line(name, f"`{source}`", right, *(percents(found[source, s]["recovered_percent"]) for s in IMAGE_SCHEMES)))
        if feature:
            trained = [[published_images(feature).get((s, "estimated", t)) for t in thresholds] for s in IMAGE_SCHEMES]
            cells = ["/".join(x or "-" for x in shares) if any(shares) else "-" for shares in trained]
            lines.append(line(f"paper, 7-Scenes, {'SIFT' if feature == 'sift' else 'SuperPoint'}", "a network", "-", *cells))
    put("docs/benchmarks.md", "images", [
        "Percent of all keypoints within 5 / 10 / 25 px, seed 0; in brackets the paper's mean over 7-Scenes.", "",
        "### RedKitchen, 40 photos of 640 x 480", "", *by_ratio("joint", [1.0, 0.5, 0.3, 0.2, 0.1], paper),
        line("blind", *(percents(of["joint", s, 1.0]["blind_percent"]) for s in IMAGE_SCHEMES)), "", *by_ratio("ransac", [1.0, 0.5, 0.1], {}), "",
        f"In 1.0 / 0.5 / 0.1: `cp2d` exactly {exact} %; median error of `dcl2d` {errors} px, blind {rows[-1]['blind_median_error']:.0f}.", "",
        "### Neighborhoods from descriptors alone", "",
        "*Right* is the share of listed keypoints among the true 20 nearest. ALIKED: the best 2,048 keypoints.", "",
        *head("photos", "neighbors by", "right, %", *IMAGE_SCHEMES), *lines, ""])


def k():
    lines = []
    for name, options in (("SIFT 2,025", []), ("ALIKED 538", ["--features", "aliked", "--min-score", "0.2"])):
        of = {}
        for k in (10, 20, 50, 100):
            document = unlift("images", DATA / "redkitchen/images", *options, "--k", k, "--schemes", "lines2d,cp2d", "--neighbors", "oracle",
                              "--inlier-ratios", "0.5,0.2", "--solver", "joint,ransac")
            of |= {(k, r["scheme"], r["inlier_ratio"], r["solver"]): r["recovered_percent"]["10"] for r in document["results"]}
        for k in (10, 20, 50, 100):
            lines.append(line(name, str(k), *("/".join(f"{of[k, s, ratio, solver]:.1f}" for solver in ("joint", "ransac"))
                                              for s in ("lines2d", "cp2d") for ratio in (0.5, 0.2))))
    put("docs/benchmarks.md", "k", [
        *head("keypoints", "K", *(f"{s}, In {ratio}" for s in ("lines2d", "cp2d") for ratio in (0.5, 0.2))), *lines, ""])


def pictures():
    photos, flat, solid, true = DATA / "redkitchen/images", [], [], []
    attack = ["--inlier-ratios", "0.5", "--neighbors", "oracle", "--neighbors", "learned", "--invert", "--solver", "joint", "--share-safe"]

    def lines(name, document, schemes, paper):
        of = {(r["inlier_ratio"] if r["neighbors"] == "oracle" else "learned", r["scheme"]): r["metrics"] for r in document["results"]}
        for key, text in ((0.5, "0.5"), ("learned", "`learned`")):
            yield line(name, text, *(f"{of[key, s]['ssim']:.3f}/{of[key, s]['lpips']:.3f}" + known([paper.get((s, key))]) for s in schemes))

    def identity(name, document, schemes):
        """Percent of pictures assigned to their photo / of the photos' objects found again."""
        shares = lambda of, end="": "/".join(f"{100 * of[figure + end]:.1f}" for figure in ("reidentified", "objects_found"))
        rows = {(r["neighbors"], r["scheme"]): r["metrics"] for r in document["results"]}
        yield line(name, "true points", shares(next(iter(rows.values())), "_baseline"))
        for source, text in (("oracle", "0.5"), ("learned", "`learned`")):
            yield line(name, text, ", ".join(f"{s} {shares(rows[source, s])}" for s in schemes))

    def baseline(document, paper):
        of = document["results"][0]["metrics"]
        return f"{of['ssim_baseline']:.3f}/{of['psnr_baseline']:.1f} dB/{of['lpips_baseline']:.3f}" + known([paper.get(("none", "baseline"))])

    for kind, scene, options in (("SIFT", "redkitchen", []), ("ALIKED", "redkitchen-aliked", ["--features", "aliked"])):
        name, papers = f"RedKitchen, {kind}", [published_ssim(d) if kind == "SIFT" else {} for d in "23"]
        of_images = unlift("images", photos, *options, *attack)
        of_map = unlift("map", DATA / scene / "model", *METERS, "--descriptors", DATA / scene / "descriptors.bin", "--photos", photos, "--max-images", "40",
                        "--schemes", ",".join(FEWER_SCHEMES), "--no-records-alone", *attack)
        flat += lines(name, of_images, IMAGE_SCHEMES, papers[0])
        solid += lines(name, of_map, FEWER_SCHEMES, papers[1])
        if kind == "SIFT":
            identified = [*identity("images", of_images, IMAGE_SCHEMES)]
        true.append(line(name, baseline(of_images, papers[0]), baseline(of_map, papers[1])))
    put("docs/benchmarks.md", "pictures", [
        "SSIM / LPIPS (SqueezeNet), means over the photos at half their size; in brackets the paper's SSIM on 7-Scenes (another network, full size).", "",
        "Images:", "", *head("of", "In", *IMAGE_SCHEMES), *flat, "",
        "Maps as their cameras see them:", "", *head("of", "In", *FEWER_SCHEMES), *solid, "",
        "True points, SSIM / PSNR / LPIPS:", "", *head("of", "images", "map"), *true, "",
        "SIFT, percent of pictures assigned to their photo by LPIPS (by chance 2.5) / of objects detected again:", "",
        *head("of", "In", "assigned/objects"), *identified, ""])


def sequence():
    document = unlift("sequence", DATA / "redkitchen-aliked/model", DATA / "redkitchen/images", "--queries", "3,5,10,20", "--features", "aliked",
                      "--neighbors", "descriptors")
    of, lists = {(row["scheme"], row["neighbors"]): row for row in document["results"]}, []
    for n in (3, 5, 10, 20):
        own, both = ([of[s, f"{by}@{n}"] for s in IMAGE_SCHEMES] for by in ("sequence", "sequence+lists"))
        new = ", ".join(f"{row['metrics']['new_within_10_percent']:.1f}" for row in both) + f" [{both[0]['metrics']['new_percent']:.0f}]"
        lists.append(line(str(n), *(f"{a['recovered_percent']['10']:.1f} -> {b['recovered_percent']['10']:.1f}" for a, b in zip(own, both)), new))
    put("docs/benchmarks.md", "sequence", [
        f"RedKitchen, ALIKED ({document['input']['images']['used']} images, {document['input']['n_points']:,} keypoints):", "",
        *head("queries", *IMAGE_SCHEMES, "new things: " + ", ".join(IMAGE_SCHEMES)), *lists, ""])


def again():
    model = DATA / "redkitchen/model"
    document = unlift("again", model, model, *METERS, "--descriptors", DATA / "redkitchen/descriptors.bin", "--no-records-alone")
    of = {(row["scheme"], row["neighbors"]): row for row in document["results"]}
    thresholds = list(document["options"]["thresholds"])
    lines = ["RedKitchen:", "", *head("schemes", f"within {'/'.join(thresholds)}", "by geometry alone", "sure, right", "blind")]
    for scheme in document["options"]["schemes"]:
        row, geometry = of[scheme, "again"], of.get((scheme, "again-geometry"))
        right = row.get("sure_correct_percent")
        lines.append(line(scheme, percents(row["recovered_percent"], thresholds),
                          percents(geometry["recovered_percent"], thresholds) if geometry else "-",
                          f"{row['sure_percent']:.1f}" + (f", {right:.1f}" if right is not None else ""), f"{row['blind_percent'][thresholds[0]]:.1f}"))
    rows = [row for row in document["results"] if row["neighbors"] == "again"]
    linked, right = min(row["metrics"]["linked_percent"] for row in rows), 100 * min(row["inlier_ratio"] for row in rows)
    put("docs/benchmarks.md", "again", [
        *lines, "", f"Descriptors link at least {linked:.1f} % of the points; at least {right:.1f} % of the links are right.", ""])


def cost():
    mitigations = ["thin:1/4", "thin:1/16", "thin:tracks:1/4", "noise:0.1", "bits:1", "pca:32", "drop:0.5", "thin:1/4,bits:1"]
    documents = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, scene, photos, kind in (("RedKitchen", "redkitchen", "redkitchen", "sift"),
                                          ("RedKitchen, ALIKED", "redkitchen-aliked", "redkitchen", "aliked"), ("Castle", "castle", "castle", "sift")):
            made = f"{folder}/{scene}.h5"
            extract(photos, kind, made)
            more = each("--mitigate", mitigations) if kind == "aliked" else []
            documents[name] = audit_map(scene, "--neighbors", "similarity", "--localize", made, "--hold-out", "4", *more, solvers="joint", descriptors=True)
    of = {name: {row["scheme"]: row for row in document["localization"]} for name, document in documents.items()}
    number = lambda value, form="{:.2f}": "no pose" if value is None else form.format(value)
    bound, held, schemes = [], [], [*SCHEMES, *IMAGE_SCHEMES]
    for name, rows in of.items():
        center, meters = rows["none"]["center_error"], documents[name]["input"]["scale_m_per_unit"]
        unprotected = f"{1000 * center:.2f} mm" if meters else f"{center:.4f} x"
        bound.append(line(name, f"{unprotected}, {rows['none']['rotation_error_degrees']:.4f}°", *(number(rows[s]["multiple"]) for s in schemes)))
    for scheme in ["none", *schemes]:
        rows = [of[name][scheme]["held_out"] for name in ("RedKitchen", "RedKitchen, ALIKED")]
        held.append(line(f"`{scheme}`", *("no pose" if r["multiple"] is None else
                                          f"{r['center_error']:.4f}, {r['rotation_error_degrees']:.3f}°, {r['multiple']:.2f}" for r in rows)))
    document, table = documents["RedKitchen, ALIKED"], []
    as_typed = dict(zip(document["options"]["mitigate"], mitigations))
    leak = {row["scheme"]: (max(share(row), next(iter(row["blind_percent"].values()))), row["n_points"], sum(row["dropped"].values()))
            for row in document["results"]}
    for text in [None, *document["options"]["mitigate"]]:
        cells = []
        for scheme in ("olc", "ppl", "plane", "cp"):
            key = scheme if text is None else f"{scheme}_{text}"
            percent, n, dropped = leak[key]
            of_all = percent * n / (n + dropped)
            shown = f"{percent:.1f}" if text is None or of_all > 0.97 * percent else f"{percent:.1f}/{of_all:.1f}"
            multiple = of["RedKitchen, ALIKED"][key]["held_out"]["multiple"]
            cells.append(f"{shown}, {'-' if multiple is None else number(multiple)}")
        table.append(line("none" if text is None else f"`{as_typed[text]}`", *cells))
    put("docs/benchmarks.md", "cost", [
        "The bound: error of the camera center as a multiple of the unprotected one (median over images).", "",
        *head("map", "unprotected", *schemes), *bound, "",
        "Held-out images: median errors of the camera center and of the rotation, and the first as a multiple of the unprotected one.", "",
        *head("scheme", "RedKitchen", "RedKitchen, ALIKED"), *held, "",
        "Mitigations: recovered percent of the released points / of all points, and the error of the camera center of held-out images as a multiple",
        "of the unprotected one (`-`: no pose).", "", "RedKitchen, ALIKED, lists by `similarity`, within 0.10:", "",
        *head("mitigation", "olc", "ppl", "plane", "cp"), *table, ""])


def protect():
    kinds = ["subspace:2", "subspace:4", "ldp:256,2,8"]
    protections = each("--protect-descriptors", kinds)

    def leak(name, document, schemes):
        """Percent recovered by the strongest row under every variant of the descriptors."""
        held = {row["scheme"]: row.get("held_out") for row in document["localization"]}
        within = list(document["results"][0]["recovered_percent"])[0]
        share_of = lambda row: max(row["recovered_percent"][within], row["blind_percent"][within])
        lines = [f"{name}, within {within}:", "",
                 *head("descriptors", "true in lists, %", *(f"`{s}`" for s in schemes), "right matches", "error")]
        as_typed = dict(zip(document["options"]["protect_descriptors"], kinds))
        for variant in ["", *as_typed]:
            of = {s: f"{s}_{variant}" if variant else s for s in schemes}
            best = [max((row for row in document["results"] if row["scheme"] == of[s]), key=share_of) for s in schemes]
            cells = [f"`{as_typed[variant]}`" if variant else "none", f"{100 * best[0]['inlier_ratio']:.1f} `{best[0]['neighbors']}`",
                     *(f"{share_of(row):.1f}" for row in best)]
            found = held.get(of[schemes[0]])
            if found and found["multiple"] is not None:
                placed = next(iter(found["recall_percent"].values()))
                cells += [f"{found['right_matches']:.0f} of {found['matches']:.0f}", f"{found['multiple']:.1f}" + (f" ({placed:.0f} %)" if placed < 99.5 else "")]
            else:
                cells += [f"{found['right_matches']:.0f} of {found['matches']:.0f}", "no pose"] if found else ["-", "-"]
            lines.append(line(*cells))
        return [*lines, ""]

    lines, spheres, recovered = [], [], 0.0
    with tempfile.TemporaryDirectory() as folder:
        for name, scene, photos, kind, sources, nth in (("Castle, SIFT", "castle", "castle", "sift", ["similarity", "overlap"], "4"),
                                                        ("RedKitchen, ALIKED", "redkitchen-aliked", "redkitchen", "aliked", ["similarity"], "10")):
            made = f"{folder}/{scene}.h5"
            extract(photos, kind, made)
            options = [*each("--neighbors", sources), *protections]
            # Localization is measured under the first scheme only.
            document = audit_map(scene, *options, "--schemes", "olc", "--localize", made, "--hold-out", nth, solvers="joint", descriptors=True)
            document["results"] += audit_map(scene, *options, "--schemes", "plane,cp", solvers="joint", descriptors=True)["results"]
            lines += leak(name, document, ["olc", "plane", "cp"])
    for name, scene, source in (("RedKitchen, ALIKED", "redkitchen-aliked", "similarity"), ("Castle, SIFT", "castle", "overlap")):
        document = audit_map(scene, "--schemes", "sphere", "--neighbors", source, solvers="consensus", descriptors=True)
        for row in document["results"]:
            metric, recovered = row["metrics"], max(recovered, share(row))
            spheres.append(line(name, f"`{row['scheme']}`", f"{metric['real_bearings_percent']:.0f}", f"{100 * row['inlier_ratio']:.0f}",
                                f"{metric['decoys_precision_percent']:.0f}/{metric['decoys_recall_percent']:.0f}", f"{metric['decoys_area']:.3f}"))
    put("docs/benchmarks.md", "protect", [
        *lines, *(["Sphere clouds:", "", *head("map", "scheme", "real bearings, %", "true in lists, %", "decoys: precision/recall, %", "area"), *spheres, "",
                   f"Points within the first threshold: at most {recovered:.1f} %.", ""] if spheres else ["Sphere clouds: the audits gave no rows.", ""])])


def artifact():
    text = (ROOT / "docs/benchmarks.md").read_text()

    def figures(section, key, columns, at=0, after="\n"):
        """One figure of each column, from the first row after `after` whose cells begin with `key`."""
        lines = text.split(f"<!-- {section}: begin -->")[1].split(f"<!-- {section}: end -->")[0].split(after, 1)[-1].splitlines()
        names = []
        for cells in ([cell.strip() for cell in row.strip("|").split("|")] for row in lines if row.startswith("|")):
            if set(columns) <= set(cells):
                names = cells
            elif names and cells[:len(key)] == list(key):
                return [re.findall(r"[\d.]+", cells[names.index(column)].split("[")[0])[at] for column in columns]
        sys.exit(f"docs/benchmarks.md, {section}: expected a row of {', '.join(key)} with the columns {', '.join(columns)}, found none")

    def listed(*arguments, **options):
        return ", ".join(figures(*arguments, **options))

    def span(values):
        return f"{min(values, key=float)} to {max(values, key=float)}"

    def kitchen(ratio, schemes, ransac=False):
        weaker = dict(at=1, after="`consensus` / `ransac`") if ransac else {}
        return figures("accuracy", ("RedKitchen", ratio), schemes, **weaker)

    def swaps(ratio, schemes=("lines2d", "cp2d"), ransac=False):
        return listed("images", (ratio,), schemes, at=1, after="`ransac`:" if ransac else "`joint`:")

    def said(section, words, at):
        """The figures `at` of those that follow `words`, which a slash separates."""
        found = re.search(re.escape(words) + r"[^\d]*([\d./]+)", text.split(f"<!-- {section}: begin -->")[1])
        return ", ".join(found[1].split("/")[i] for i in at)

    six, both, pair = ["olc", "ppl", "ppl+", "ray", "plane", "cp"], ["lines2d", "cp2d"], lambda *of, **more: ", ".join(kitchen(*of, **more))
    images, sift = lambda name, columns: listed("images", (name, "`learned`"), columns, at=1), "RedKitchen, SIFT"
    painted, true = lambda lists, schemes: listed("pictures", (sift, lists), schemes), lambda column, at=0: listed("pictures", (sift,), [column], at=at, after="True points")
    ours = {
        "Lists break all schemes": f"{span(kitchen('0.5', six))}; {swaps('0.5')}",
        "Descriptors give lists": images(sift, both),
        "Table 1, 7-Scenes": swaps("0.1"),
        "Table 1 by `ransac`": swaps("0.5", ransac=True),
        "Tables 2, 7, SIFT: In 0.5": pair("0.5", six),
        "Tables 2, 7, SIFT: In 0.1": pair("0.1", six),
        "Tables 2, 7 by `ransac`: In 0.5": pair("0.5", six, ransac=True),
        "Tables 2, 7 by `ransac`: In 0.1": pair("0.1", six, ransac=True),
        "Line schemes": span(kitchen("0.5", six[:4])),
        "`ray` is the safest": f"`ransac` {pair('0.1', ['ray', 'ppl'], ransac=True)}; `joint` {pair('0.1', ['ray', 'ppl'])}",
        "`plane`, `cp` need good lists": f"`ransac` {pair('0.1', six[4:], ransac=True)}; `joint` {pair('0.1', six[4:])}",
        "`ppl` and `ppl+` are alike": pair("0.1", six[1:3]),
        "Accuracy of lines may peak": f"{swaps('1.0', ['lines2d'], ransac=True)}, {swaps('0.5', ['lines2d'], ransac=True)}",
        "Undoing `cp` is infeasible": said("accuracy", "with the value that another record publishes", (0, 1, 3)),
        "The swapped axis": f"`ransac` {said('accuracy', 'by `ransac` ', (0, 1, 3))}; `joint` {said('accuracy', 'axis known by `joint`', (0, 1, 3))}",
        "Lists assign a pair's descriptors": said("accuracy", "assigned to their point", (0, 1, 3)),
        "Records alone give no lists": f"{listed('own sources', ('RedKitchen', '`geometric`'), ['ray'])}; `plane` none",
        "The network is for images only": listed("own sources", ("RedKitchen", "`learned`"), ["olc", "cp"]),
        "SIFT leaks less": f"{images(sift, both[:1])}; ALIKED {images('RedKitchen, ALIKED 2,048', both[:1])}",
        "Table 4, SuperPoint": f"ALIKED: {images('RedKitchen, ALIKED 2,048', both)}",
        "Table 3, images": painted("0.5", both),
        "True keypoints": true("images"),
        "Tables 3, 10, maps": painted("0.5", FEWER_SCHEMES),
        "True points": f"{true('map')}, {true('map', 1)}",
        "Images lose more": f"{true('images')}, {painted('0.5', both[:1])}; {true('map')}, {painted('0.5', ['ppl'])}",
        "Table 4: SSIM by own lists": painted("`learned`", both),
        "Tables 2, 3, 9, 12, Cambridge": f"fountain: {span(figures('accuracy', ('fountain', '0.5'), six))}",
        "Tables 8, 11, 12-Scenes": f"kitchen: {span(figures('accuracy', ('kitchen', '0.5'), six))}",
        "Table 13": listed("records alone", ("`density`, RedKitchen",), six[:2]),
        "Neighbor lists at In 0.2": pair("0.2", six[:2]),
        "Sparse keypoints lower": "; sparse ".join(
            ", ".join(figures("k", (keypoints, K), ["lines2d, In 0.5"], at=1)[0] for K in ("20", "10")) for keypoints in ("SIFT 2,025", "ALIKED 538")),
    }
    page, used = ROOT / "ARTIFACT.md", set()
    lines = page.read_text().splitlines()
    for at, row in enumerate(lines):
        for claim in (claim for claim in ours if row.startswith(f"| {claim}")):
            cells = row.split(" | ")
            lines[at] = " | ".join([*cells[:2], ours[claim], *cells[3:]])
            used.add(claim)
    if missing := set(ours) - used:
        sys.exit(f"ARTIFACT.md: expected rows that begin with {', '.join(sorted(missing))}, found none")
    page.write_text("\n".join(lines) + "\n")


SECTIONS = [accuracy, noise, own, alone, large, images, k, pictures, sequence, again, cost, protect, artifact]


def put(name, section, lines):
    path, begin, end = ROOT / name, f"<!-- {section}: begin -->\n", f"<!-- {section}: end -->"
    text = path.read_text()
    path.write_text(text.split(begin)[0] + begin + "\n" + "\n".join(lines) + "\n" + end + text.split(end)[1])


def main():
    for section in SECTIONS:
        if not sys.argv[2:] or section.__name__ in sys.argv[2:]:
            started = time.monotonic()
            section()
            print(f"{section.__name__}: {time.monotonic() - started:.0f} s", file=sys.stderr)


main()
