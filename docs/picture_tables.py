"""The tables of pictures in docs/benchmarks.md: what came back, painted, beside the photos.

Used by make_benchmarks.py; standard library only.
"""
import csv, json, pathlib, subprocess, tempfile

METRICS = ["ssim", "psnr", "lpips"]
RATIOS = ["1.0", "0.5", "0.3"]
# Attacks that read lists: of records alone, and of the descriptors of each kind.
SIFT, ALIKED = ["overlap", "learned"], ["similarity", "learned"]
FLAT, SOLID = ["lines2d", "cp2d", "dcl2d"], ["olc", "ppl", "ray", "plane", "cp"]
SCENES = [("RedKitchen, 40 photos", "redkitchen", ["--scale", "1"]), ("Castle, 11 photos", "castle", [])]


def audit(program, names, *options):
    with tempfile.TemporaryDirectory() as out:
        ratios = ["--inlier-ratios", ",".join(RATIOS), "--neighbors", "oracle"]
        sources = [option for name in names for option in ("--neighbors", name)]
        command = [program, "audit", *options, *ratios, *sources, "--invert", "--solver", "joint", "--quiet", "--share-safe", "--out", f"{out}/audit"]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        return json.loads(pathlib.Path(out, "audit/audit.json").read_text())


def told(metrics, of=""):
    ssim, psnr, lpips = (metrics[name + of] for name in METRICS)
    return f"{ssim:.3f} / {psnr:.1f} / {lpips:.3f}"


def published(shared, dim):
    """The paper's SSIM on 7-Scenes, SIFT: {(scheme, ratio): value}, the baseline under the scheme `none`."""
    table = {}
    with open(shared / "paper/tables/perceptual.csv") as lines:
        for row in csv.DictReader(lines):
            if (row["dataset"], row["dim"], row["feature"], row["metric"]) == ("7-scenes", dim, "sift", "ssim"):
                ratio = row["inlier_ratio"]
                table[row["scheme"], ratio if ratio == "baseline" else float(ratio)] = row["value"]
    return table


def table(document, schemes, sources, paper):
    rows = {}
    for row in document["results"]:
        key = row["inlier_ratio"] if row["neighbors"] == "oracle" else row["neighbors"]
        rows[key, row["scheme"]] = row["metrics"]
    yield "| In | " + " | ".join(schemes) + " |"
    yield "|" + " --- |" * (len(schemes) + 1)
    base = [told(rows[1.0, scheme], "_baseline") for scheme in schemes]
    known = paper.get(("none", "baseline"))
    yield "| true points | " + " | ".join(f"{text} [{known}]" if known else text for text in base) + " |"
    for key in [*map(float, RATIOS), *sources]:
        cells = []
        for scheme in schemes:
            known = paper.get((scheme, key))
            cells.append(told(rows[key, scheme]) + (f" [{known}]" if known else ""))
        yield f"| {key if isinstance(key, float) else f'`{key}`'} | " + " | ".join(cells) + " |"
    run = document["run"]
    yield ""
    yield (f"Cost: {run['seconds']['total']:.0f} s, {run['threads']} threads, peak {run['peak_memory_bytes'] / 2**20:.0f} MiB.")
    yield ""


def recall(document, schemes):
    """Objects that the detector finds again, in per cent, by class."""
    results = document["results"]
    start, end = "objects_found_of_", "_baseline"
    classes = sorted({key[len(start):-len(end)] for row in results for key in row["metrics"] if key.startswith(start) and key.endswith(end)})
    if not classes:
        return
    names = ["objects_found", *(start + one for one in classes)]
    rows = [("true points", [100 * results[0]["metrics"][name + end] for name in names])]
    for scheme in schemes:
        for row in results:
            if row["scheme"] == scheme and (row["neighbors"] != "oracle" or row["inlier_ratio"] == 1.0):
                given = "1.0" if row["neighbors"] == "oracle" else f"`{row['neighbors']}`"
                rows.append((f"{scheme}, {given}", [100 * row["metrics"][name] for name in names]))
    words = ["all", *(one.replace("_", " ") for one in classes)]
    shown = [at for at in range(len(names)) if at == 0 or any(round(shares[at]) for _, shares in rows)]
    if not any(round(share) for _, shares in rows[1:] for share in shares):
        found = ", ".join(f"{words[at]} {rows[0][1][at]:.0f} %" for at in shown)
        yield from [f"Objects found again: none in any recovered picture; in pictures of the true points: {found}.", ""]
        return
    yield "| found again, % | " + " | ".join(words[at] for at in shown) + " |"
    yield "|" + " --- |" * (len(shown) + 1)
    for name, shares in rows:
        yield f"| {name} | " + " | ".join(f"{shares[at]:.0f}" for at in shown) + " |"
    yield ""
    never = [word for at, word in enumerate(words) if at not in shown]
    if never:
        yield from ["Never found again: " + ", ".join(never) + ".", ""]


def tables(program, shared):
    """All lines of the section."""
    data = shared / "data"
    yield from ["SSIM / PSNR in dB / LPIPS, means over photos, at half their size; in brackets the paper's SSIM on 7-Scenes (another network, full size).", ""]
    for name, scene, scale in SCENES:
        photos = data / scene / "images"
        yield from [f"### {name}, SIFT keypoints", ""]
        paper = published(shared, "2") if scene == "redkitchen" else {}
        document = audit(program, SIFT, "images", photos)
        yield from table(document, FLAT, SIFT, paper)
        yield from recall(document, FLAT)
        yield from [f"### {name}, ALIKED keypoints", ""]
        document = audit(program, ALIKED, "images", photos, "--features", "aliked")
        yield from table(document, FLAT, ALIKED, {})
        yield from recall(document, FLAT)
        for kind, sources, map_of in [("SIFT", SIFT, data / scene), ("ALIKED", ALIKED, data / f"{scene}-aliked")]:
            if not map_of.exists():
                continue
            yield from [f"### {name}, the map as its cameras see it, {kind}", ""]
            paper = published(shared, "3") if (scene, kind) == ("redkitchen", "SIFT") else {}
            document = audit(program, sources, "map", map_of / "model", "--descriptors", map_of / "descriptors.bin", *scale,
                             "--photos", photos, "--max-photos", "40", "--schemes", ",".join(SOLID), "--no-records-alone")
            yield from table(document, SOLID, sources, paper)
            yield from recall(document, SOLID)
