"""Makes the folder PROJECT for the examples: a COLMAP project of the made-up room, with descriptors of 64 values in its database."""

import os
import random
import sqlite3
import struct
import subprocess
import sys

draw = random.Random(2)
rows = subprocess.run([sys.executable, "room.py"], check=True, capture_output=True, text=True).stdout.splitlines()[1:]
points = [tuple(map(float, row.split(","))) for row in rows]
os.makedirs("PROJECT/sparse/0")

# Four photos of the room; a point is seen in two of them, at a made-up keypoint.
keypoints = {image: [] for image in (1, 2, 3, 4)}
tracks = []
for at, _ in enumerate(points):
    track = []
    for image in (1 + at % 4, 1 + (at + 1) % 4):
        track += [image, len(keypoints[image])]
        keypoints[image].append((640 * draw.random(), 480 * draw.random(), at))
    tracks.append(track)
with open("PROJECT/sparse/0/cameras.txt", "w") as file:
    file.write("1 SIMPLE_PINHOLE 640 480 600 320 240\n")
with open("PROJECT/sparse/0/images.txt", "w") as file:
    for image, found in keypoints.items():
        file.write(f"{image} 1 0 0 0 0 0 0 1 room{image}.jpg\n")
        file.write(" ".join(f"{x:.2f} {y:.2f} {at + 1}" for x, y, at in found) + "\n")
with open("PROJECT/sparse/0/points3D.txt", "w") as file:
    for at, (x, y, z) in enumerate(points):
        file.write(f"{at + 1} {x} {y} {z} 128 128 128 0.5 {' '.join(map(str, tracks[at]))}\n")


def descriptor(point):
    """Returns bytes that change with the position, so that near points have similar descriptors."""
    values = [max(0.0, sum(d * x for d, x in zip(direction, point)) % 2.0 - 1.0 + 0.15 * draw.gauss(0, 1)) for direction in DIRECTIONS]
    length = sum(x * x for x in values) ** 0.5 or 1.0
    return bytes(min(255, round(512 * x / length)) for x in values)


DIRECTIONS = [[draw.gauss(0, 0.7) for _ in range(3)] for _ in range(64)]
with sqlite3.connect("PROJECT/database.db") as db:
    db.execute("create table cameras (camera_id integer primary key, model integer, width integer, height integer, params blob)")
    db.execute("create table images (image_id integer primary key, name text, camera_id integer)")
    db.execute("create table keypoints (image_id integer primary key, rows integer, cols integer, data blob)")
    db.execute("create table descriptors (image_id integer primary key, rows integer, cols integer, data blob)")
    db.execute("insert into cameras values (1, 0, 640, 480, ?)", [struct.pack("<3d", 600, 320, 240)])
    for image, found in keypoints.items():
        db.execute("insert into images values (?, ?, 1)", [image, f"room{image}.jpg"])
        db.execute("insert into keypoints values (?, ?, 2, ?)", [image, len(found), b"".join(struct.pack("<2f", x, y) for x, y, _ in found)])
        db.execute("insert into descriptors values (?, ?, 64, ?)", [image, len(found), b"".join(descriptor(points[at]) for *_, at in found)])
