"""LightGlue (ICCV 2023), layer by layer, so that a caller can stop early and drop points.

Points are rows: state x [N, D]; several heads lie side by side in D. What is exactly linear is
folded into the weights: the 1/sqrt(d) of attention, the output projection of attention (into
the feed-forward net behind it) and the rotation of neighbouring channels in the rotary encoding.
"""

from dataclasses import dataclass

import numpy as np

from . import ExportError
from .graph import Graph

_LAYER_NORM_EPSILON = 1e-5


@dataclass(frozen=True)
class Shape:
    """What the weights say about the network."""
    input_dim: int
    dim: int
    heads: int
    layers: int


def renamed(state):
    """Weights under the names of the current LightGlue, whichever release wrote them."""
    result = {}
    for name, value in state.items():
        name = name.removeprefix("matcher.")
        for kind in ("self_attn", "cross_attn"):
            parts = name.split(".")
            if parts[0] == kind and len(parts) > 1 and parts[1].isdigit():
                name = ".".join(["transformers", parts[1], kind, *parts[2:]])
        result[name] = value
    return result


def shape_of(state):
    """Reads the sizes off the tensors."""
    try:
        dim = state["transformers.0.self_attn.out_proj.weight"].shape[0]
        layers = 1 + max(int(n.split(".")[1]) for n in state if n.startswith("transformers."))
        head_dim = 2 * state["posenc.Wr.weight"].shape[0]
    except KeyError as error:
        raise ExportError(f"not LightGlue weights: {error} is missing") from None
    projection = state.get("input_proj.weight")
    return Shape(dim if projection is None else projection.shape[1], dim, dim // head_dim, layers)


def _rotated(weight):
    """Rows (a, b) of each pair become (-b, a): the quarter turn of the rotary encoding."""
    pairs = weight.reshape(-1, 2, *weight.shape[1:])
    return np.stack([-pairs[:, 1], pairs[:, 0]], 1).reshape(weight.shape)


class _Stage:
    """One graph: the builder and the weights it draws from."""

    def __init__(self, state, name):
        self.state, self.shape, self.graph = state, shape_of(state), Graph(name)

    def pair(self, name):
        return self.state[f"{name}.weight"], self.state[f"{name}.bias"]

    def attention(self, q, k, v):
        """softmax(q k^T) v per head; q and k carry the scale already."""
        g, heads = self.graph, self.shape.heads
        if heads == 1:
            return g.node("MatMul", g.node("Softmax", g.node("MatMul", q, g.node(
                "Transpose", k, perm=[1, 0])), axis=-1), v)
        split = g.ints(0, heads, self.shape.dim // heads)
        q, v = (g.node("Transpose", g.node("Reshape", t, split), perm=[1, 0, 2]) for t in (q, v))
        k = g.node("Transpose", g.node("Reshape", k, split), perm=[1, 2, 0])
        y = g.node("MatMul", g.node("Softmax", g.node("MatMul", q, k), axis=-1), v)
        return g.node("Reshape", g.node("Transpose", y, perm=[1, 0, 2]), g.ints(0, self.shape.dim))

    def feed_forward(self, x, message, block, projection):
        """x + ffn([x, projection(message)]) without joining the two or projecting first."""
        g, dim = self.graph, self.shape.dim
        weight, bias = self.pair(f"{block}.ffn.0")
        out_weight, out_bias = self.pair(f"{block}.{projection}")
        own, other = weight[:, :dim], weight[:, dim:].astype(np.float64)
        y = g.linear(x, own, bias + other @ out_bias)
        y = g.linear(message, other @ out_weight, add=y)
        y = g.node("LayerNormalization", y, *map(g.weight, self.pair(f"{block}.ffn.1")),
                   axis=-1, epsilon=_LAYER_NORM_EPSILON)
        return g.linear(self.gelu(y), self.state[f"{block}.ffn.3.weight"], None, add=g.node(
            "Add", x, g.weight(self.state[f"{block}.ffn.3.bias"])))

    def gelu(self, y):
        """Written the way in which the runtime recognises and fuses it."""
        g = self.graph
        erf = g.node("Erf", g.node("Div", y, g.weight(np.sqrt(2.0))))
        return g.node("Mul", g.node("Mul", y, g.node("Add", erf, g.weight(1.0))), g.weight(0.5))

    def self_attention(self, x, cos, sin, block):
        g, shape = self.graph, self.shape
        weight, bias = self.pair(f"{block}.Wqkv")
        # Rows are (head, channel, q|k|v); gathered here into q, k and v blocks.
        weight, bias = weight.reshape(-1, 3, shape.dim), bias.reshape(-1, 3)
        scale = (shape.dim // shape.heads) ** -0.5
        (q, k, v), (qb, kb, vb) = np.moveaxis(weight, 1, 0), bias.T
        plain = (q * scale, k), (qb * scale, kb)
        turned = [[_rotated(part) for part in half] for half in plain]
        both = g.node("Add",
                      g.node("Mul", g.linear(x, np.concatenate(plain[0]), np.concatenate(plain[1])), cos),
                      g.node("Mul", g.linear(x, np.concatenate(turned[0]), np.concatenate(turned[1])), sin))
        q, k = g.node("Split", both, axis=-1, outputs=2)
        return self.feed_forward(x, self.attention(q, k, g.linear(x, v, vb)), block, "out_proj")

    def cross_attention(self, x0, x1, block):
        g, shape = self.graph, self.shape
        weight, bias = self.pair(f"{block}.to_qk")
        scale = (shape.dim // shape.heads) ** -0.25
        qk0, qk1 = (g.linear(x, weight * scale, bias * scale) for x in (x0, x1))
        v0, v1 = (g.linear(x, *self.pair(f"{block}.to_v")) for x in (x0, x1))
        m0, m1 = self.attention(qk0, qk1, v1), self.attention(qk1, qk0, v0)
        return [self.feed_forward(x, m, block, "to_out") for x, m in ((x0, m0), (x1, m1))]


def build_input(state):
    """Descriptors to the state, positions to the rotary encoding of queries and keys."""
    stage = _Stage(state, "lightglue_input")
    g, shape = stage.graph, stage.shape
    points = g.input("keypoints", ["points", 2])
    x = g.input("descriptors", ["points", shape.input_dim])
    if "input_proj.weight" in state:
        x = g.linear(x, *stage.pair("input_proj"))
    g.output(x, "x", ["points", shape.dim])
    # Each frequency serves a pair of channels, in every head, for queries and for keys.
    frequencies = np.tile(np.repeat(state["posenc.Wr.weight"], 2, 0), (2 * shape.heads, 1))
    angle = g.linear(points, frequencies)
    g.output(g.node("Cos", angle), "cos", ["points", 2 * shape.dim])
    g.output(g.node("Sin", angle), "sin", ["points", 2 * shape.dim])
    return g.model()


def _scores(stage, x, name, weights):
    """Sigmoid of a linear function of each point's state."""
    y = stage.graph.node("Sigmoid", stage.graph.linear(x, *weights))
    stage.graph.output(stage.graph.node("Reshape", y, stage.graph.ints(-1)), name, ["points" + name[-1]])


def build_layer(state, layer):
    """Self attention in each image, cross attention between them, the layer's point scores."""
    stage = _Stage(state, f"lightglue_layer_{layer}")
    g, dim, block = stage.graph, stage.shape.dim, f"transformers.{layer}"
    states = []
    for i in "01":
        x, cos, sin = (g.input(f"{name}{i}", [f"points{i}", width])
                       for name, width in (("x", dim), ("cos", 2 * dim), ("sin", 2 * dim)))
        states.append(stage.self_attention(x, cos, sin, f"{block}.self_attn"))
    states = stage.cross_attention(*states, f"{block}.cross_attn")
    for i, x in enumerate(states):
        g.output(x, f"x{i}_out", [f"points{i}", dim])
        if f"token_confidence.{layer}.token.0.weight" in state:
            _scores(stage, x, f"confidence{i}", stage.pair(f"token_confidence.{layer}.token.0"))
        _scores(stage, x, f"matchability{i}", stage.pair(f"log_assignment.{layer}.matchability"))
    return g.model()


def build_assignment(state, layer):
    """Log of the partial assignment matrix after `layer`."""
    stage = _Stage(state, f"lightglue_assign_{layer}")
    g, dim, head = stage.graph, stage.shape.dim, f"log_assignment.{layer}"
    x = [g.input(f"x{i}", [f"points{i}", dim]) for i in "01"]
    weight, bias = stage.pair(f"{head}.final_proj")
    p0, p1 = (g.linear(t, weight * dim ** -0.25, bias * dim ** -0.25) for t in x)
    sim = g.node("MatMul", p0, g.node("Transpose", p1, perm=[1, 0]))
    certain = [g.linear(t, *stage.pair(f"{head}.matchability")) for t in x]
    # log sigmoid(z) = -softplus(-z)
    lost0, lost1 = (g.node("Softplus", g.node("Neg", z)) for z in certain)
    scores = g.node("Add", g.node("LogSoftmax", sim, axis=1), g.node("LogSoftmax", sim, axis=0))
    scores = g.node("Sub", g.node("Sub", scores, lost0), g.node("Transpose", lost1, perm=[1, 0]))
    g.output(scores, "scores", ["points0", "points1"])
    return g.model()
