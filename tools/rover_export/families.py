"""What can be exported: where each family's weights come from and which graphs it has."""

from dataclasses import dataclass
from math import exp
from typing import Callable

from .aliked import build_dense
from .aliked_head import PATCH, build_descriptors, build_offsets, dim_of
from .lightglue import build_assignment, build_input, build_layer, renamed, shape_of
from .packages import LIGHTGLUE_PACKAGE, XFEAT_PACKAGE
from .superpoint import build_superpoint
from .xfeat import build_xfeat
from .xfeat_int8 import build_xfeat_int8

_APACHE = "Apache-2.0"
_BSD = "BSD-3-Clause"
_MAGIC_LEAP = "Magic Leap: academic or non-profit research use only, not to be passed on"


@dataclass(frozen=True)
class Family:
    """`build` maps the weights to (name -> model, further facts for the contract)."""
    build: Callable
    package: tuple | None = None
    weights: str = ""
    option: str = ""


def _xfeat(state):
    facts = {"kind": "extractor", "licence": _APACHE, "descriptor_dim": 64, "cell": 8,
             "size_multiple": 32, "input_scale": 1.0 / 255}
    return {"xfeat": build_xfeat(state, False), "xfeat_int8": build_xfeat_int8(state),
            "xfeat_keypoints": build_xfeat(state, True)}, facts


def _superpoint(state):
    facts = {"kind": "extractor", "licence": _MAGIC_LEAP, "descriptor_dim": 256, "cell": 8,
             "size_multiple": 8, "input_scale": 1.0 / 255}
    return {"superpoint": build_superpoint(state)}, facts


def _aliked(name):
    def build(state):
        facts = {"kind": "extractor", "licence": _BSD, "descriptor_dim": dim_of(state),
                 "size_multiple": 32, "input_scale": 1.0 / 255, "level_factors": [1, 2, 8, 32],
                 "level_dim": dim_of(state) // 4, "patch": PATCH,
                 "positions": state["desc_head.agg_weights"].shape[0]}
        return {name: build_dense(state, name),
                f"{name}_offsets": build_offsets(state, f"{name}_offsets"),
                f"{name}_descriptors": build_descriptors(state, f"{name}_descriptors")}, facts
    return build


def _matcher(name, licence):
    def build(state):
        state = renamed(state)
        shape = shape_of(state)
        models = {f"{name}_input": build_input(state)}
        for layer in range(shape.layers):
            models[f"{name}_layer_{layer}"] = build_layer(state, layer)
            models[f"{name}_assign_{layer}"] = build_assignment(state, layer)
        facts = {"kind": "matcher", "licence": licence, "descriptor_dim": shape.input_dim,
                 "dim": shape.dim, "heads": shape.heads, "layers": shape.layers,
                 "encoding_dim": shape.dim, "match_threshold": 0.1,
                 "prune_matchability": 0.01, "exit_share": 0.95,
                 "confidence_thresholds": thresholds(shape.layers)}
        return models, facts
    return build


def thresholds(layers):
    """A point counts as certain after layer k (from 0) of n above this confidence."""
    return [0.8 + 0.1 * exp(-4.0 * k / layers) for k in range(layers - 1)]


FAMILIES = {
    "xfeat": Family(_xfeat, XFEAT_PACKAGE, "weights/xfeat.pt"),
    "lighterglue": Family(_matcher("lighterglue", _APACHE), XFEAT_PACKAGE,
                          "weights/xfeat-lighterglue.pt"),
    "aliked-t16": Family(_aliked("aliked-t16"), LIGHTGLUE_PACKAGE, "/aliked-t16.pth"),
    "aliked-n16": Family(_aliked("aliked-n16"), LIGHTGLUE_PACKAGE, "/aliked-n16.pth"),
    "lightglue-aliked-n16": Family(_matcher("lightglue-aliked-n16", _APACHE), LIGHTGLUE_PACKAGE,
                                   "pretrained_weights/aliked_lightglue.pth"),
    "superpoint": Family(_superpoint, option="superpoint"),
    "lightglue-superpoint": Family(_matcher("lightglue-superpoint", _APACHE),
                                   option="superpoint_lightglue"),
}
DEFAULT = ("xfeat", "lighterglue")
