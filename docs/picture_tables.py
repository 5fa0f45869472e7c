"""The tables of pictures in docs/benchmarks.md: what came back, painted, beside the photos.

Used by make_benchmarks.py; standard library only.
"""
import csv, json, pathlib, subprocess, tempfile

RATIO = 0.5
SOURCE = "learned"
FLAT, SOLID = ["lines2d", "cp2d", "dcl2d"], ["olc", "ppl", "ray", "plane", "cp"]
SCENES = [("RedKitchen", "redkitchen", ["--scale", "1"]), ("Castle", "castle", [])]


def audit(program, *options):
    with tempfile.TemporaryDirectory() as out:
        ratios = ["--inlier-ratios", str(RATIO), "--neighbors", "oracle", "--neighbors", SOURCE]
        command = [program, "audit", *options, *ratios, "--invert", "--solver", "ranking", "--quiet", "--share-safe", "--out", f"{out}/audit"]
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


def head(schemes):
    yield "| of | In | " + " | ".join(schemes) + " |"
    yield "|" + " --- |" * (len(schemes) + 2)


def baseline(document, first, paper):
    """The figures of the true points, which every row of the scheme `first` has."""
    row = next(r["metrics"] for r in document["results"] if r["scheme"] == first)
    known = paper.get(("none", "baseline"))
    return (f"{row['ssim_baseline']:.3f} / {row['psnr_baseline']:.1f} dB / {row['lpips_baseline']:.3f}"
            + (f" [{known}]" if known else ""))


def table(name, document, schemes, paper):
    rows = {}
    for row in document["results"]:
        key = row["inlier_ratio"] if row["neighbors"] == "oracle" else row["neighbors"]
        rows[key, row["scheme"]] = row["metrics"]
    for key in [RATIO, SOURCE]:
        cells = []
        for scheme in schemes:
            known = paper.get((scheme, key))
            cells.append(told(rows[key, scheme]) + (f" [{known}]" if known else ""))
        yield f"| {name} | {key if key == RATIO else f'`{key}`'} | " + " | ".join(cells) + " |"


def tables(program, shared):
    """All lines of the section."""
    data, flat, solid, true = shared / "data", [], [], []
    for name, scene, scale in SCENES:
        photos, paper = data / scene / "images", published(shared, "2") if scene == "redkitchen" else {}
        for kind, options in (("SIFT", []), ("ALIKED", ["--features", "aliked"])):
            document = audit(program, "images", photos, *options)
            beside = paper if kind == "SIFT" else {}
            flat += table(f"{name}, {kind}", document, FLAT, beside)
            true.append(f"| {name}, {kind} | {baseline(document, FLAT[0], beside)} | ")
            map_of = data / (scene if kind == "SIFT" else f"{scene}-aliked")
            if not map_of.exists():
                true[-1] += "- |"
                continue
            for colors in [[], ["--colors"]][: 2 if kind == "SIFT" else 1]:
                document = audit(program, "map", map_of / "model", "--descriptors", map_of / "descriptors.bin", *scale, "--photos", photos,
                                 "--max-photos", "40", "--schemes", ",".join(SOLID), "--no-records-alone", *colors)
                beside = published(shared, "3") if (scene, kind, colors) == ("redkitchen", "SIFT", []) else {}
                solid += table(f"{name}, {kind}" + (" and colors" if colors else ""), document, SOLID, beside)
                true[-1] += f"{'<br>with colors ' if colors else ''}{baseline(document, SOLID[0], beside)}"
            true[-1] += " |"
    yield from ["SSIM / LPIPS, means over the photos at half their size; in brackets the paper's SSIM on 7-Scenes (another network, full size).", "",
                "Images:", "", *head(FLAT), *flat, "", "Maps as their cameras see them:", "", *head(SOLID),
                *solid, "", "True points, SSIM / PSNR / LPIPS:", "", "| of | images | map |", "| --- | --- | --- |", *true, ""]
