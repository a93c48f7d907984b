#!/usr/bin/env python3
"""Makes a troubled copy of a sequence in EuRoC's layout: images are linked, lists rewritten.

    tools/trouble_sequence.py SEQUENCE COPY --black 20:3 --imu-gap 30:0.5

Times are seconds after the first image of camera 0. Needs nothing but Python."""

import argparse
import math
import os
import re
import shutil
import struct
import zlib
from pathlib import Path

LATE_PERIOD = 10  # --late: every tenth image comes after the next one
TURN_AXIS = (0.6, -0.48, 0.64)  # --move-rig, unit vectors in the body
MOVE_AXIS = (0.6, -0.4, 0.693)


def interval(text):
    """'20:3' -> (20, 23)."""
    begin, length = (float(part) for part in text.split(":"))
    return begin, begin + length


def turn_and_move(text):
    """'1:0.02' -> (1, 0.02)."""
    degrees, metres = (float(part) for part in text.split(":"))
    return degrees, metres


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("sequence", type=Path, help="folder that holds mav0")
    parser.add_argument("copy", type=Path, help="folder to make")
    parser.add_argument("--duration", type=float, default=float("inf"),
                        help="keep the images of the first so many seconds")
    parser.add_argument("--black", type=interval, metavar="T:N", help="black images for N s at T")
    parser.add_argument("--missing", type=interval, metavar="T:N", help="no images for N s at T")
    parser.add_argument("--imu-gap", type=interval, metavar="T:N", help="no inertial data likewise")
    parser.add_argument("--imu-end", type=float, metavar="T", help="no inertial data after T")
    parser.add_argument("--double", choices=["stamp", "image"],
                        help="each image twice: with its stamp again, or half a period later")
    parser.add_argument("--drop-third", action="store_true", help="leave out every third image")
    parser.add_argument("--imu-late", type=float, default=0, metavar="S",
                        help="the inertial sensor's stamps are S seconds too late")
    parser.add_argument("--move-rig", type=turn_and_move, metavar="DEG:M",
                        help="calibration that has all cameras turned and moved in the body")
    parser.add_argument("--late", action="store_true",
                        help=f"every {LATE_PERIOD}th image comes after the next one")
    return parser.parse_args()


def read_rows(file):
    lines = file.read_text().splitlines()
    rows = [line.split(",") for line in lines if line and not line.startswith("#")]
    return lines[0] if lines[0].startswith("#") else "#", rows


def write_rows(file, header, rows):
    file.write_text("\n".join([header] + [",".join(row) for row in rows]) + "\n")


def png_size(file):
    return struct.unpack(">II", file.read_bytes()[16:24])


def write_black_png(file, size):
    def chunk(kind, data):
        return (struct.pack(">I", len(data)) + kind + data +
                struct.pack(">I", zlib.crc32(kind + data)))
    width, height = size
    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    pixels = zlib.compress(bytes(height * (width + 1)))
    file.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", pixels) +
                     chunk(b"IEND", b""))


def within(seconds, span):
    return span is not None and span[0] <= seconds < span[1]


def doubled(rows, kind):
    """Each row twice; an image again gets a stamp half way to the next one."""
    result = []
    for row, after in zip(rows, rows[1:] + [None]):
        result.append(row)
        if kind == "stamp":
            result.append(row)
        elif after:
            result.append([str((int(row[0]) + int(after[0])) // 2)] + row[1:])
    return result


def delivered_late(rows):
    rows = list(rows)
    for i in range(LATE_PERIOD, len(rows) - 1, LATE_PERIOD):
        rows[i], rows[i + 1] = rows[i + 1], rows[i]
    return rows


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(4)) for j in range(4)] for i in range(4)]


def rigid(degrees, metres):
    """The matrix of a turn about TURN_AXIS (Rodrigues) and a way along MOVE_AXIS."""
    (x, y, z), angle = TURN_AXIS, math.radians(degrees)
    c, s = math.cos(angle), math.sin(angle)
    cross = ((0, -z, y), (z, 0, -x), (-y, x, 0))
    axis = (x, y, z)
    rows = [[(c if i == j else 0) + (1 - c) * axis[i] * axis[j] + s * cross[i][j]
             for j in range(3)] + [metres * MOVE_AXIS[i]] for i in range(3)]
    return rows + [[0, 0, 0, 1]]


def move_rig(calibration, degrees, metres):
    """Rewrites T_BS of a camera's sensor.yaml."""
    text = calibration.read_text()
    found = re.search(r"data:\s*\[([^\]]*)\]", text)
    values = [float(value) for value in found.group(1).split(",")]
    moved = product(rigid(degrees, metres), [values[4 * i:4 * i + 4] for i in range(4)])
    data = ", ".join(repr(value) for row in moved for value in row)
    calibration.write_text(text[:found.start()] + f"data: [{data}]" + text[found.end():])


def trouble_images(source, target, seconds, options):
    header, rows = read_rows(source / "data.csv")
    (target / "data").mkdir(parents=True)
    shutil.copy(source / "sensor.yaml", target)
    if options.move_rig:
        move_rig(target / "sensor.yaml", *options.move_rig)
    rows = [row for row in rows
            if seconds(row) < options.duration and not within(seconds(row), options.missing)]
    if options.drop_third:
        rows = [row for i, row in enumerate(rows) if i % 3 != 2]
    for row in rows:
        image = target / "data" / row[1]
        if within(seconds(row), options.black):
            write_black_png(image, png_size(source / "data" / row[1]))
        else:
            os.symlink((source / "data" / row[1]).resolve(), image)
    if options.double:
        rows = doubled(rows, options.double)
    if options.late:
        rows = delivered_late(rows)
    write_rows(target / "data.csv", header, rows)


def trouble_inertia(source, target, seconds, options):
    header, rows = read_rows(source / "data.csv")
    target.mkdir(parents=True)
    shutil.copy(source / "sensor.yaml", target)
    end = float("inf") if options.imu_end is None else options.imu_end
    rows = [row for row in rows
            if not within(seconds(row), options.imu_gap) and seconds(row) < end]
    late = round(options.imu_late * 1e9)
    rows = [[str(int(row[0]) + late)] + row[1:] for row in rows]
    write_rows(target / "data.csv", header, rows)


def main():
    options = parse_arguments()
    source, target = options.sequence / "mav0", options.copy / "mav0"
    first = int(read_rows(source / "cam0" / "data.csv")[1][0][0])

    def seconds(row):
        return (int(row[0]) - first) / 1e9

    for folder in sorted(path.name for path in source.iterdir() if path.is_dir()):
        if folder.startswith("cam"):
            trouble_images(source / folder, target / folder, seconds, options)
        elif folder.startswith("imu"):
            trouble_inertia(source / folder, target / folder, seconds, options)
        else:
            shutil.copytree(source / folder, target / folder)


if __name__ == "__main__":
    main()
