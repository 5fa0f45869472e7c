#!/usr/bin/env python3
"""Compares our SIFT with pycolmap's (the oracle) and OpenCV's: what is found, and how fast.

    pip install pycolmap opencv-python-headless numpy
    cargo build --release -p unlift-vision --example features
    python3 docs/compare_sift.py IMAGE... [--max-features N] [--no-speed]

A keypoint of one is found by the other if there is one within 1 pixel whose scale has a ratio below 1.1
and, in the second column, whose orientation is within 10 degrees; descriptor distances are those of the
latter, of descriptors scaled to unit length. Our extractor decodes JPEG by itself; `same pixels` gives it
what pycolmap decoded. Times are of extraction alone, photos decoded before, all extractors in turn,
the median of three runs.
"""
import argparse, multiprocessing, os, pathlib, statistics, struct, subprocess, tempfile, time, warnings

os.environ.setdefault("GLOG_minloglevel", "2")
warnings.filterwarnings("ignore", category=DeprecationWarning)
import cv2, numpy, pycolmap

ROOT = pathlib.Path(__file__).resolve().parent.parent
TARGET = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))


def ours(images, threads, options=()):
    with tempfile.NamedTemporaryFile() as out:
        command = [TARGET / "release/examples/features", *images, "--out", out.name, "--threads", str(threads), *options]
        printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        data, at, features = pathlib.Path(out.name).read_bytes(), 0, []
        for _ in images:
            n, wide = struct.unpack_from("<II", data, at)
            keypoints = numpy.frombuffer(data, "<f4", 4 * n, at + 8).reshape(n, 4)
            descriptors = numpy.frombuffer(data, "u1", wide * n, at + 8 + 16 * n).reshape(n, wide)
            features.append((keypoints, descriptors.astype("f4") / 512))
            at += 8 + (16 + wide) * n
    return features, float(printed.split()[-2])


def sift(most):
    options = pycolmap.FeatureExtractionOptions()
    options.use_gpu, options.num_threads, options.sift.max_num_features = False, 1, most
    return pycolmap.Sift(options, device=pycolmap.Device.cpu)


def theirs(grays, most):
    """Features and seconds of pycolmap, one thread."""
    extractor = sift(most)
    extractor.extract(grays[0])
    start = time.perf_counter()
    features = [extractor.extract(gray) for gray in grays]
    return features, time.perf_counter() - start


def worker(grays, most, gate, done):
    extractor = sift(most)
    extractor.extract(grays[0])
    gate.wait()
    for gray in grays:
        extractor.extract(gray)
    done.put(time.perf_counter())


def theirs_parallel(grays, most, threads):
    """Seconds of pycolmap in one process per thread, each with a share of the images."""
    context = multiprocessing.get_context("spawn")
    gate, done = context.Barrier(threads + 1), context.Queue()
    jobs = [context.Process(target=worker, args=(grays[i::threads], most, gate, done)) for i in range(threads)]
    [job.start() for job in jobs]
    gate.wait()
    start = time.perf_counter()
    end = max(done.get() for _ in jobs)
    [job.join() for job in jobs]
    return end - start


def opencv(grays, threads, most):
    """Number of features and seconds of OpenCV, with thresholds and sizes as near as it has them."""
    cv2.setNumThreads(threads)
    extractor = cv2.SIFT_create(nfeatures=most, contrastThreshold=0.02, edgeThreshold=10)
    extractor.detectAndCompute(grays[0], None)
    start = time.perf_counter()
    total = sum(len(extractor.detectAndCompute(gray, None)[0]) for gray in grays)
    return total, time.perf_counter() - start


def found(a, b):
    """For each keypoint of a: place and scale found in b, orientation too, and descriptor distance."""
    (ka, da), (kb, db) = a, b
    places, all_, distances = numpy.zeros(len(ka), bool), numpy.zeros(len(ka), bool), []
    order = numpy.argsort(kb[:, 0], kind="stable")
    kb, db = kb[order], db[order]
    low, high = numpy.searchsorted(kb[:, 0], ka[:, 0] - 1), numpy.searchsorted(kb[:, 0], ka[:, 0] + 1)
    for i, (k, d) in enumerate(zip(ka, da)):
        near = kb[low[i]:high[i]]
        off = numpy.hypot(near[:, 0] - k[0], near[:, 1] - k[1])
        good = (off < 1) & (abs(numpy.log(near[:, 2] / k[2])) < numpy.log(1.1))
        turn = abs((near[:, 3] - k[3] + numpy.pi) % (2 * numpy.pi) - numpy.pi)
        best = numpy.flatnonzero(good & (turn < numpy.radians(10)))
        places[i], all_[i] = good.any(), len(best) > 0
        if len(best):
            best = best[numpy.argmin(off[best])]
            unit = [v / max(numpy.linalg.norm(v), 1e-9) for v in (d, db[low[i]:high[i]][best])]
            distances.append((off[best], numpy.linalg.norm(unit[0] - unit[1])))
    return places, all_, distances


def table(name, mine, oracle):
    forth, back = [found(b, a) for a, b in zip(mine, oracle)], [found(a, b) for a, b in zip(mine, oracle)]
    share = lambda rows, i: 100 * numpy.concatenate([row[i] for row in rows]).mean()
    distances = numpy.array([pair for row in forth for pair in row[2]])
    print(f"{name}: {sum(len(k) for k, _ in oracle)} keypoints of pycolmap, {sum(len(k) for k, _ in mine)} of ours")
    print(f"  pycolmap's found by us: {share(forth, 0):.2f} %, with orientation {share(forth, 1):.2f} %")
    print(f"  ours found by pycolmap: {share(back, 0):.2f} %, with orientation {share(back, 1):.2f} %")
    print(f"  apart: median {numpy.median(distances[:, 0]):.4f} px, descriptors median {numpy.median(distances[:, 1]):.4f},"
          f" 95th percentile {numpy.quantile(distances[:, 1], 0.95):.4f}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("images", nargs="+")
    parser.add_argument("--max-features", type=int, default=8192)
    parser.add_argument("--no-speed", action="store_true")
    args = parser.parse_args()
    grays = [pycolmap.Bitmap.read(image, as_rgb=False).to_array() for image in args.images]
    grays = [numpy.ascontiguousarray(gray.reshape(gray.shape[:2])) for gray in grays]
    most, options = args.max_features, ["--max-features", str(args.max_features)]
    oracle, _ = theirs(grays, most)
    with tempfile.TemporaryDirectory() as folder:
        same = [f"{folder}/{i:05}.png" for i in range(len(grays))]
        for path, gray in zip(same, grays):
            cv2.imwrite(path, gray)
        table("same pixels", ours(same, 2, options)[0], oracle)
        table("same photos", ours(args.images, 2, options)[0], oracle)
        if args.no_speed:
            return
        total = [sum(len(k) for k, _ in ours(same, 1, options)[0]), sum(len(k) for k, _ in oracle), opencv(grays, 1, most)[0]]
        for threads in (1, 2):
            runs = [(ours(same, threads, options)[1],
                     theirs(grays, most)[1] if threads == 1 else theirs_parallel(grays, most, threads),
                     opencv(grays, threads, most)[1]) for _ in range(3)]
            for name, n, seconds in zip(("unlift", "pycolmap", "OpenCV"), total, zip(*runs)):
                seconds = statistics.median(seconds)
                print(f"{threads} threads, {name:9} {n / seconds:7.0f} features/s, {1000 * seconds / len(grays):6.1f} ms an image")


if __name__ == "__main__":
    main()
