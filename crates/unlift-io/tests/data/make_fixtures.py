"""Writes the fixtures of this folder. Needs pycolmap 4.2, h5py 3.16 and NumPy; see README.md."""

import shutil
import sqlite3
from pathlib import Path

import h5py
import numpy as np
import pycolmap

HERE = Path(__file__).parent
RNG = np.random.default_rng(0)
MODELS = sorted(
    (m for m in pycolmap.CameraModelId.__members__.values() if int(m) >= 0), key=int
)


def pose():
    axis_angle = RNG.normal(size=3)
    translation = RNG.normal(size=3)
    return pycolmap.Rigid3d(
        pycolmap.Rotation3d(axis_angle=axis_angle), translation
    )


def camera(camera_id, model):
    made = pycolmap.Camera.create_from_model_id(camera_id, model, 500.0, 640, 480)
    if made.model != pycolmap.CameraModelId.EQUIRECTANGULAR:
        made.params = [p + 0.001 * (i + 1) for i, p in enumerate(made.params)]
    return made


def image(image_id, camera_id, n_keypoints):
    name = "küche/ä 0.jpg" if image_id == 1 else f"i{image_id}.jpg"
    return pycolmap.Image(
        name=name,
        keypoints=RNG.uniform(0, 480, size=(n_keypoints, 2)),
        camera_id=camera_id,
        image_id=image_id,
    )


def add_points(model, image_ids, ids):
    used = {i: 0 for i in image_ids}
    for k, point_id in enumerate(ids):
        track = pycolmap.Track()
        for j in range(2 + k % 2):
            at = image_ids[(k + j) % len(image_ids)]
            track.add_element(at, used[at])
            used[at] += 1
        point = pycolmap.Point3D()
        point.xyz = RNG.normal(size=3) * 4
        point.color = RNG.integers(0, 256, size=3)
        point.error = 0.5
        point.track = track
        model.add_point3D_with_id(point_id, point)
        for element in track.elements:
            points2D = model.image(element.image_id).points2D
            points2D[element.point2D_idx].point3D_id = point_id


def rigs_and_frames():
    """One camera of every model; the first two on one rig, with two frames."""
    model = pycolmap.Reconstruction()
    for i, m in enumerate(MODELS):
        model.add_camera(camera(i + 1, m))
    sensor = lambda i: pycolmap.sensor_t(pycolmap.SensorType.CAMERA, i)
    rig = pycolmap.Rig(rig_id=1)
    rig.add_ref_sensor(sensor(1))
    rig.add_sensor(sensor(2), pose())
    model.add_rig(rig)
    for i in range(3, len(MODELS) + 1):
        rig = pycolmap.Rig(rig_id=i)
        rig.add_ref_sensor(sensor(i))
        model.add_rig(rig)
    images = [(1, 1, 1), (2, 2, 1), (3, 1, 2), (4, 2, 2)]
    images += [(2 + i, i, i) for i in range(3, len(MODELS) + 1)]
    for frame_id in sorted({f for _, _, f in images}):
        frame = pycolmap.Frame(frame_id=frame_id, rig_id=max(1, frame_id if frame_id > 2 else 1))
        for image_id, camera_id, f in images:
            if f == frame_id:
                frame.add_data_id(pycolmap.data_t(sensor(camera_id), image_id))
        frame.rig_from_world = pose()
        model.add_frame(frame)
    for image_id, camera_id, frame_id in images:
        made = image(image_id, camera_id, 4)
        made.frame_id = frame_id
        model.add_image(made)
    for frame_id in sorted({f for _, _, f in images}):
        model.register_frame(frame_id)
    add_points(model, [i for i, _, _ in images], [5, 3, 900, 7, 12, 2**40, 1, 44])
    return model


def project():
    """A classic project: three files under sparse/0, and a database with its own image ids."""
    model = pycolmap.Reconstruction()
    model.add_camera_with_trivial_rig(camera(1, pycolmap.CameraModelId.SIMPLE_RADIAL))
    image_ids = [1, 2, 3]
    for i in image_ids:
        model.add_image_with_trivial_frame(image(i, 1, 8), pose())
    add_points(model, image_ids, [4, 2, 11, 6, 9, 3])
    return model


def root_sift(n):
    d = RNG.gamma(0.6, size=(n, 128))
    return np.minimum(np.round(512 * np.sqrt(d / d.sum(axis=1, keepdims=True))), 255).astype(np.uint8)


def write_database(model, path, descriptors, feature_type):
    path.unlink(missing_ok=True)
    with pycolmap.Database.open(path) as db:
        camera_id = db.write_camera(model.camera(1))
        # In reverse order, so that ids differ from those of the model.
        for i in sorted(model.images, reverse=True):
            made = pycolmap.Image(name=model.image(i).name, camera_id=camera_id)
            image_id = db.write_image(made)
            db.write_descriptors(
                image_id, pycolmap.FeatureDescriptors(type=feature_type, data=descriptors[i])
            )
    # Small pages: the schema alone would take 100 KB in pages of 4 KB.
    with sqlite3.connect(path) as db:
        db.execute("PRAGMA journal_mode=DELETE")
        db.execute("PRAGMA page_size=512")
    db.execute("VACUUM")
    db.close()


def write_descriptors(model, path, descriptors):
    ids = np.array(sorted(model.points3D), dtype="<u8")
    rows = []
    for i in ids:
        track = model.point3D(int(i)).track.elements
        mean = np.mean(
            [descriptors[e.image_id][e.point2D_idx].astype(float) for e in track], axis=0
        )
        rows.append(np.clip(np.rint(512 * mean / np.linalg.norm(mean)), 0, 255))
    with open(path, "wb") as f:
        f.write(b"P3DESC01")
        f.write(np.array([len(ids)], dtype="<u8").tobytes())
        f.write(np.array([128, 1], dtype="<u4").tobytes())
        f.write(ids.tobytes())
        f.write(np.array(rows).astype(np.uint8).tobytes())


def features(path, libver):
    """hloc's layout as h5py writes it: one type and one form of storage per image."""
    with h5py.File(path, "w", libver=libver) as file:
        half = file.create_group("db/half.jpg")
        keypoints = np.array([[1.5, 2.25], [3, 4], [100, 50]], np.float16)
        half.create_dataset("keypoints", data=keypoints).attrs["uncertainty"] = 1.5
        half["descriptors"] = np.arange(12, dtype=np.float16).reshape(4, 3) / 8
        half["scores"] = np.array([0.5, 0.25, 0.125], np.float16)
        half["image_size"] = np.array([640, 480])
        double = file.create_group("db/seq/double.jpg")
        double["keypoints"] = np.array([[0.1, 0.2, 7, 8], [0.3, 0.4, 9, 10]])
        rows = np.arange(8, dtype=np.float32).reshape(4, 2)
        # The newest form of chunks is newer than the reader; hloc does not compress.
        packed = {} if libver == "latest" else {"chunks": (2, 1), "compression": "gzip", "shuffle": True}
        double.create_dataset("descriptors", data=rows, **packed)
        single = file.create_group("big \u00fc.png")
        single["keypoints"] = np.array([[1, 2], [3, 4]], ">f4")
        single["descriptors"] = np.array([[1, 2], [3, 4], [5, 6]], np.uint8)
        single["image_size"] = np.array([10, 20], np.int32)


def main():
    for folder in ("rig-bin", "rig-txt", "project"):
        shutil.rmtree(HERE / folder, ignore_errors=True)
        (HERE / folder).mkdir()
    model = rigs_and_frames()
    model.write_binary(HERE / "rig-bin")
    model.write_text(HERE / "rig-txt")
    model.export_PLY(HERE / "cloud.ply")

    model = project()
    classic = HERE / "project" / "sparse" / "0"
    classic.mkdir(parents=True)
    model.write_binary(classic)
    for name in ("rigs.bin", "frames.bin"):
        (classic / name).unlink()
    descriptors = {i: root_sift(8) for i in sorted(model.images)}
    write_database(
        model, HERE / "project" / "database.db", descriptors, pycolmap.FeatureExtractorType.SIFT
    )
    write_descriptors(model, HERE / "project" / "descriptors.bin", descriptors)
    floats = {i: RNG.normal(size=(8, 4)).astype("<f4").view(np.uint8) for i in sorted(model.images)}
    write_database(
        model, HERE / "project" / "floats.db", floats, pycolmap.FeatureExtractorType.ALIKED_N16ROT
    )
    points = np.arange(12, dtype=np.float64).reshape(4, 3) / 8
    np.save(HERE / "f8.npy", points)
    np.save(HERE / "f4-big-endian.npy", points.astype(">f4"))
    np.save(HERE / "f8-fortran.npy", np.asfortranarray(points))
    features(HERE / "features-latest.h5", "latest")
    features(HERE / "features-earliest.h5", "earliest")


main()
