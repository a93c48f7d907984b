#!/usr/bin/env python3
"""Makes the reference numbers of rover/evaluation/reference_test.cc with evo, an independent
implementation: a noisy, scaled, turned trajectory with gaps and its reference, and what evo says
about them.

    build/deps/venv/bin/python tools/evo_reference.py rover/evaluation/testdata
"""

import copy
import json
import pathlib
import sys

import numpy as np
from evo.core import metrics, sync
from evo.core.metrics import PoseRelation, Unit
from evo.tools import file_interface

MAX_DIFFERENCE = 0.02  # s
START = 1403715285  # s, stamp of the first pose
GAP_MIDDLE = 3.3  # s, in the gap of the estimate


def quaternion(vector):
    angle = np.linalg.norm(vector)
    axis = vector / max(angle, 1e-12)
    return np.append(axis * np.sin(angle / 2), np.cos(angle / 2))


def multiply(a, b):
    x, y, z, w = a
    i, j, k, l = b
    return np.array([w * i + x * l + y * k - z * j, w * j - x * k + y * l + z * i,
                     w * k + x * j - y * i + z * l, w * l - x * i - y * j - z * k])


def rotate(q, p):
    pure = np.append(p, 0.0)
    conjugate = q * np.array([-1, -1, -1, 1])
    return multiply(multiply(q, pure), conjugate)[:3]


def pose_at(time):
    position = np.array([3 * np.cos(time), 2 * np.sin(1.3 * time), 0.5 * np.sin(0.7 * time)])
    turn = np.array([0.3 * np.sin(time), 0.2 * np.cos(2 * time), 0.9 * time])
    return position, quaternion(turn)


def line(time, position, q):
    values = " ".join(f"{v:.9f}" for v in [*position, *q])
    return f"{START + time:.6f} {values}\n"


def write_trajectories(folder):
    random = np.random.default_rng(1)
    reference = [line(t, *pose_at(t)) for t in np.arange(0, 8, 0.05)]
    turn, shift, scale = quaternion(np.array([0.4, -0.2, 1.1])), np.array([1, -2, 0.5]), 0.4
    estimate = []
    for t in np.arange(0.5, 7.5, 0.1) + 0.004:
        if 3 < t < 3.6 or random.uniform() < 0.1:
            continue
        position, q = pose_at(t)
        position = scale * rotate(turn, position + 0.02 * random.normal(size=3)) + shift
        q = multiply(multiply(turn, q), quaternion(0.01 * random.normal(size=3)))
        estimate.append(line(t, position, q))
    (folder / "reference.txt").write_text("".join(reference))
    (folder / "estimate.txt").write_text("".join(estimate))


def statistics(metric):
    return {k: float(v) for k, v in metric.get_all_statistics().items() if k != "sse"}


def drift(reference, estimate, with_scale):
    """What is left behind the gap if only the poses before it are aligned."""
    before = int(np.sum(estimate.timestamps < START + GAP_MIDDLE))
    aligned = copy.deepcopy(estimate)
    aligned.align(reference, correct_scale=with_scale, n=before)
    behind = np.arange(before, estimate.num_poses)
    reference = copy.deepcopy(reference)
    reference.reduce_to_ids(behind)
    aligned.reduce_to_ids(behind)
    metric = metrics.APE(PoseRelation.translation_part)
    metric.process_data((reference, aligned))
    return statistics(metric)


def judge(folder, with_scale):
    reference = file_interface.read_tum_trajectory_file(str(folder / "reference.txt"))
    estimate = file_interface.read_tum_trajectory_file(str(folder / "estimate.txt"))
    reference, estimate = sync.associate_trajectories(reference, estimate, MAX_DIFFERENCE)
    aligned = copy.deepcopy(estimate)
    _, _, scale = aligned.align(reference, correct_scale=with_scale)
    data = (reference, aligned)
    result = {"associated": estimate.num_poses, "scale": float(scale),
              "path": float(reference.path_length)}
    for name, metric in [
            ("ate", metrics.APE(PoseRelation.translation_part)),
            ("rpe_translation", metrics.RPE(PoseRelation.translation_part, 1, Unit.frames)),
            ("rpe_rotation", metrics.RPE(PoseRelation.rotation_angle_deg, 1, Unit.frames))]:
        metric.process_data(data)
        result[name] = statistics(metric)
    result["drift"] = drift(reference, estimate, with_scale)
    return result


def main():
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    write_trajectories(folder)
    answer = {"se3": judge(folder, False), "sim3": judge(folder, True)}
    (folder / "evo.json").write_text(json.dumps(answer, indent=1) + "\n")


if __name__ == "__main__":
    main()
