"""ALIKED's descriptor head (SDDH): patch to sample places, samples to descriptor."""

import numpy as np

from . import ExportError
from .graph import Graph
from .selu import SELU_SCALE, SELU_SHIFT, selu

PATCH = 3


def dim_of(state):
    """Width of the joint feature map and of the descriptor."""
    try:
        return state["desc_head.sf_conv.weight"].shape[0]
    except KeyError as error:
        raise ExportError(f"not ALIKED weights: {error} is missing") from None


def build_offsets(state, name):
    """Patches of the joint map to the places where each descriptor looks."""
    graph, dim = Graph(name), dim_of(state)
    first, second = "desc_head.offset_conv.0", "desc_head.offset_conv.2"
    weight = state[f"{first}.weight"]
    count = weight.shape[0] // 2
    x = graph.input("patches", ["points", PATCH * PATCH, dim])
    x = graph.node("Reshape", x, graph.ints(-1, PATCH * PATCH * dim))
    x = graph.linear(x, weight.transpose(0, 2, 3, 1).reshape(2 * count, -1),
                     state[f"{first}.bias"] + SELU_SHIFT)
    # All x offsets come first, then all y offsets: made pairs here.
    pairs = np.arange(2 * count).reshape(2, count).T.ravel()
    weight = state[f"{second}.weight"][pairs, :, 0, 0] * SELU_SCALE
    x = graph.linear(selu(graph, x), weight, state[f"{second}.bias"][pairs])
    graph.output(graph.node("Reshape", x, graph.ints(-1, count, 2)), "offsets", ["points", count, 2])
    return graph.model()


def build_descriptors(state, name):
    """The joint map at those places to the descriptor."""
    graph, dim = Graph(name), dim_of(state)
    mix = state["desc_head.agg_weights"]
    count = mix.shape[0]
    x = graph.input("samples", ["points", count, dim])
    x = graph.linear(graph.node("Reshape", x, graph.ints(-1, dim)),
                     state["desc_head.sf_conv.weight"][:, :, 0, 0], np.full(dim, SELU_SHIFT))
    x = graph.node("Reshape", selu(graph, x), graph.ints(-1, count * dim))
    x = graph.linear(x, mix.reshape(count * dim, dim).T)
    length = graph.node("ReduceL2", x, axes=[1], keepdims=1)
    x = graph.node("Div", x, graph.node("Max", length, graph.weight(1e-12)))
    graph.output(x, "descriptors", ["points", dim])
    return graph.model()
