#!/usr/bin/env python3
"""Compares the poses of held-out images with those of poselib and pycolmap, from the same matches.

    pip install numpy poselib pycolmap
    cargo build --release -p unlift-audit --example held_out_matches
    target/release/unlift features ../shared/data/redkitchen/images --as-stored --out features.h5
    python3 docs/compare_poses.py ../shared/data/redkitchen/model features.h5 4

Point matches: the median errors of all three agree within 10 %. Line matches (lines2d): poselib's minimal solver p6lp in a RANSAC loop, its
inliers refined by least squares. Exit code 1 if they do not agree. (poselib's robust generalized estimator never returns for one match
per camera, so it is not used.)
"""
import json, os, pathlib, random, statistics, subprocess, sys

import numpy, poselib, pycolmap

ROOT = pathlib.Path(__file__).resolve().parent.parent
TARGET = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
INLIER = 4.0


def errors(problem, rotation, center):
    """The error of the center, and of the rotation in degrees."""
    cosine = (numpy.trace(rotation @ numpy.array(problem["rotation"]).T) - 1) / 2
    return numpy.linalg.norm(center - problem["center"]), numpy.degrees(numpy.arccos(numpy.clip(cosine, -1, 1)))


def columns(problem):
    places, directions, points = (numpy.array([match[c] for match in problem["matches"]]) for c in range(3))
    return places, directions, points


def camera(problem):
    width, height = map(int, problem["size"])
    return {"model": "PINHOLE", "width": width, "height": height, "params": [*problem["focal"], *problem["principal"]]}


def by_poselib(problem):
    places, _, points = columns(problem)
    pose, _ = poselib.estimate_absolute_pose(places, points, camera(problem), {"max_reproj_error": INLIER},
                                             {"loss_type": "TRUNCATED", "loss_scale": INLIER})
    return errors(problem, pose.R, -pose.R.T @ pose.t)


def by_pycolmap(problem):
    places, _, points = columns(problem)
    options = pycolmap.AbsolutePoseEstimationOptions()
    options.ransac.max_error = INLIER
    found = pycolmap.estimate_and_refine_absolute_pose(places, points, pycolmap.Camera(**camera(problem)), options)
    matrix = found["cam_from_world"].matrix()
    return errors(problem, matrix[:, :3], -matrix[:, :3].T @ matrix[:, 3])


def residuals(lines, points, focal, principal, rotation, translation):
    x = points @ rotation.T + translation
    with numpy.errstate(divide="ignore", invalid="ignore"):
        seen = x[:, :2] / x[:, 2:] * focal + principal
    off = (lines[:, :2] * seen).sum(1) + lines[:, 2]
    return numpy.where(x[:, 2] > 0, off, 1e6)


def turned(w):
    angle = numpy.linalg.norm(w)
    cross = numpy.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    a, b = (numpy.sin(angle) / angle, (1 - numpy.cos(angle)) / angle**2) if angle > 1e-12 else (1.0, 0.5)
    return numpy.eye(3) + a * cross + b * cross @ cross


def refined(rotation, translation, of):
    """Gauss-Newton with numeric derivatives on the inliers, which are chosen anew in every round."""
    for _ in range(20):
        r = of(rotation, translation)
        inliers = numpy.abs(r) < INLIER
        if inliers.sum() < 6:
            break
        slopes = []
        for c in range(6):
            by = numpy.zeros(6)
            by[c] = 1e-6
            turn = turned(by[:3])
            slopes.append((of(turn @ rotation, turn @ translation + by[3:]) - r)[inliers] / 1e-6)
        step = numpy.linalg.lstsq(numpy.array(slopes).T, -r[inliers], rcond=None)[0]
        turn = turned(step[:3])
        rotation, translation = turn @ rotation, turn @ translation + step[3:]
    return rotation, translation


def by_p6lp(problem, draw):
    places, directions, points = columns(problem)
    normals = numpy.stack([directions[:, 1], -directions[:, 0]], 1)
    normals /= numpy.linalg.norm(normals, axis=1, keepdims=True)
    lines = numpy.concatenate([normals, -(normals * places).sum(1, keepdims=True)], 1)
    focal, principal = numpy.array(problem["focal"]), numpy.array(problem["principal"])
    # The same lines for a camera with focal length one.
    flat = numpy.concatenate([lines[:, :2] * focal, (lines[:, :2] * principal).sum(1, keepdims=True) + lines[:, 2:]], 1)
    flat /= numpy.linalg.norm(flat, axis=1, keepdims=True)
    of = lambda rotation, translation: residuals(lines, points, focal, principal, rotation, translation)
    best, most = None, 0
    for _ in range(1000):
        chosen = draw.sample(range(len(points)), 6)
        for pose in poselib.p6lp(list(flat[chosen]), list(points[chosen])):
            n = (numpy.abs(of(pose.R, pose.t)) < INLIER).sum()
            if n > most:
                best, most = (pose.R, pose.t), n
    rotation, translation = refined(*best, of)
    return errors(problem, rotation, -rotation.T @ translation)


def main():
    command = [TARGET / "release/examples/held_out_matches", *sys.argv[1:4]]
    problems = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    draw, agree = random.Random(0), True
    for kind, others in [("point", {"poselib": by_poselib, "pycolmap": by_pycolmap}),
                         ("lines2d", {"p6lp": lambda problem: by_p6lp(problem, draw)})]:
        of = problems[kind]
        rows = {"unlift": [(p["center_error"], p["rotation_error_degrees"]) for p in of]}
        rows |= {name: [solve(problem) for problem in of] for name, solve in others.items()}
        medians = {name: [statistics.median(row[c] for row in found) for c in (0, 1)] for name, found in rows.items()}
        for name, (center, angle) in medians.items():
            ratio = medians["unlift"][0] / center
            agree &= abs(ratio - 1) <= 0.1
            print(f"{kind:8} {name:9} {len(of)} images: center {1000 * center:.3f} mm, rotation {angle:.4f} degrees, unlift / this {ratio:.3f}")
    return 0 if agree else 1


sys.exit(main())
