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

    @property
    def head_dim(self):
        """Channels per head."""
        return self.dim // self.heads


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


class _Stage:
    """One graph: the builder and the weights it draws from."""

    def __init__(self, state, name):
        self.state, self.shape, self.graph = state, shape_of(state), Graph(name)

    def pair(self, name):
        return self.state[f"{name}.weight"], self.state[f"{name}.bias"]

    def by_head(self, x):
        """[N, D] to [heads, N, d]."""
        if self.shape.heads == 1:
            return x
        split = self.graph.ints(0, self.shape.heads, self.shape.head_dim)
        return self.graph.node("Transpose", self.graph.node("Reshape", x, split), perm=[1, 0, 2])

    def attention(self, q, k, v):
        """softmax(q k^T) v of all heads, side by side; the scale is in q and k already."""
        g, heads = self.graph, self.shape.heads
        axes = [1, 0] if heads == 1 else [0, 2, 1]
        weights = g.node("Softmax", g.node("MatMul", q, g.node("Transpose", k, perm=axes)), axis=-1)
        y = g.node("MatMul", weights, v)
        if heads == 1:
            return y
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

    def rotated(self, x, weight, bias, cos, sin):
        """Queries and keys of `x`, turned by the rotary encoding: [heads, N, d] each.

        `weight` is [q|k, head, pair, half of pair, D]. A pair (a, b) becomes
        (a cos - b sin, b cos + a sin); all first halves are computed apart from all second
        ones, which is free, since the order of channels in a dot product does not matter.
        """
        g, shape = self.graph, self.shape
        a, b = (g.linear(x, weight[:, :, :, i].reshape(-1, shape.dim), bias[:, :, :, i].ravel())
                for i in (0, 1))
        a, b = (g.node("Sub", g.node("Mul", a, cos), g.node("Mul", b, sin)),
                g.node("Add", g.node("Mul", b, cos), g.node("Mul", a, sin)))
        both = g.node("Reshape", g.node("Concat", a, b, axis=1),
                      g.ints(0, 2, 2, shape.heads, shape.head_dim // 2))
        both = g.node("Transpose", both, perm=[2, 3, 0, 1, 4])
        rows = [2, -1] if shape.heads == 1 else [2, shape.heads, -1]
        q, k = g.node("Split", g.node("Reshape", both, g.ints(*rows, shape.head_dim)), axis=0, outputs=2)
        return [g.node("Squeeze", t, g.ints(0)) for t in (q, k)]

    def self_attention(self, x, cos, sin, block):
        shape = self.shape
        weight, bias = self.pair(f"{block}.Wqkv")
        # Rows are (head, channel, q|k|v).
        weight = np.moveaxis(weight.reshape(shape.dim, 3, shape.dim), 1, 0).copy()
        bias = bias.reshape(shape.dim, 3).T.copy()
        weight[0] *= shape.head_dim ** -0.5
        bias[0] *= shape.head_dim ** -0.5
        pairs = (2, shape.heads, shape.head_dim // 2, 2)
        q, k = self.rotated(x, weight[:2].reshape(*pairs, shape.dim), bias[:2].reshape(pairs), cos, sin)
        v = self.by_head(self.graph.linear(x, weight[2], bias[2]))
        return self.feed_forward(x, self.attention(q, k, v), block, "out_proj")

    def cross_attention(self, x0, x1, block):
        g = self.graph
        weight, bias = self.pair(f"{block}.to_qk")
        scale = self.shape.head_dim ** -0.25
        qk0, qk1 = (self.by_head(g.linear(x, weight * scale, bias * scale)) for x in (x0, x1))
        v0, v1 = (self.by_head(g.linear(x, *self.pair(f"{block}.to_v"))) for x in (x0, x1))
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
    # Each frequency turns a pair of channels, in every head, of queries and of keys.
    frequencies = np.tile(state["posenc.Wr.weight"], (2 * shape.heads, 1))
    angle = g.linear(points, frequencies)
    g.output(g.node("Cos", angle), "cos", ["points", shape.dim])
    g.output(g.node("Sin", angle), "sin", ["points", shape.dim])
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
                       for name, width in (("x", dim), ("cos", dim), ("sin", dim)))
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
