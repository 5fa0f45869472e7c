"""The tables of pictures in docs/benchmarks.md: what came back, painted, beside the photos.

Used by make_benchmarks.py; standard library only.
"""
import csv, json, pathlib, subprocess, tempfile

RATIOS = ["1.0", "0.5"]
# Attacks that read lists: of records alone, and of the descriptors of each kind.
SIFT, ALIKED = ["overlap", "learned"], ["similarity", "learned"]
FLAT, SOLID = ["lines2d", "cp2d", "dcl2d"], ["olc", "ppl", "ray", "plane", "cp"]
SCENES = [("RedKitchen", "redkitchen", ["--scale", "1"]), ("Castle", "castle", [])]


def audit(program, names, *options):
    with tempfile.TemporaryDirectory() as out:
        ratios = ["--inlier-ratios", ",".join(RATIOS), "--neighbors", "oracle"]
        sources = [option for name in names for option in ("--neighbors", name)]
        command = [program, "audit", *options, *ratios, *sources, "--invert", "--solver", "joint", "--quiet", "--share-safe", "--out", f"{out}/audit"]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        return json.loads(pathlib.Path(out, "audit/audit.json").read_text())


def told(metrics):
    return f"{metrics['ssim']:.3f} / {metrics['lpips']:.3f}"


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
    base, known = rows[1.0, schemes[0]], paper.get(("none", "baseline"))
    yield (f"True points: {base['ssim_baseline']:.3f} / {base['psnr_baseline']:.1f} dB / {base['lpips_baseline']:.3f}"
           + (f" [{known}]." if known else "."))
    yield ""
    yield "| In | " + " | ".join(schemes) + " |"
    yield "|" + " --- |" * (len(schemes) + 1)
    for key in [*map(float, RATIOS), *sources]:
        cells = []
        for scheme in schemes:
            known = paper.get((scheme, key))
            cells.append(told(rows[key, scheme]) + (f" [{known}]" if known else ""))
        yield f"| {key if isinstance(key, float) else f'`{key}`'} | " + " | ".join(cells) + " |"
    yield ""


def tables(program, shared):
    """All lines of the section."""
    data = shared / "data"
    yield from ["SSIM / LPIPS, means over the photos (RedKitchen 40, Castle 11) at half their size, of images and of maps as their cameras see them;",
                "in brackets the paper's SSIM on 7-Scenes (another network, full size). True points also have the PSNR.", ""]
    for name, scene, scale in SCENES:
        photos = data / scene / "images"
        yield from [f"### Images of {name}, SIFT", ""]
        paper = published(shared, "2") if scene == "redkitchen" else {}
        document = audit(program, SIFT, "images", photos)
        yield from table(document, FLAT, SIFT, paper)
        yield from [f"### Images of {name}, ALIKED", ""]
        document = audit(program, ALIKED, "images", photos, "--features", "aliked")
        yield from table(document, FLAT, ALIKED, {})
        for kind, sources, map_of in [("SIFT", SIFT, data / scene), ("ALIKED", ALIKED, data / f"{scene}-aliked")]:
            if not map_of.exists():
                continue
            yield from [f"### Map of {name}, {kind}", ""]
            paper = published(shared, "3") if (scene, kind) == ("redkitchen", "SIFT") else {}
            document = audit(program, sources, "map", map_of / "model", "--descriptors", map_of / "descriptors.bin", *scale,
                             "--photos", photos, "--max-photos", "40", "--schemes", ",".join(SOLID), "--no-records-alone")
            yield from table(document, SOLID, sources, paper)
