"""ALIKED (IEEE TIM 2023): the dense part, image to score map and four feature levels.

Thin full-size layers keep neighbouring pixels of a row as extra channels (see packing.py).
Stored pixel by pixel, such a packed map is the plain map (row, column, channel), so that no
unpacking is needed anywhere. Every activation lacks SELU's outer scale (see selu.py).
"""

import numpy as np

from .aliked_head import dim_of
from .deformable import Sampler, deformable_conv
from .graph import Graph
from .packing import Packing, pack
from .selu import SELU_SCALE, SELU_SHIFT, selu

_BATCH_NORM_EPSILON = 1e-5
_LANES = 16
_HEAD = 8


class _Encoder:
    """Levels of activations, channels first; level 1 is packed by `columns` pixels."""

    def __init__(self, state, name):
        self.state, self.graph = state, Graph(name)
        self.image = self.graph.input("image", [1, 1, "height", "width"])
        self.size = self.graph.node("Slice", self.graph.node("Shape", self.image), self.graph.ints(2),
                                    self.graph.ints(4), self.graph.ints(0))
        self.columns = max(1, _LANES // state["block1.conv1.weight"].shape[0])

    def folded(self, block, index, conv="conv{}"):
        """Weight and bias of a convolution with the BatchNorm behind it folded in."""
        norm = f"{block}.bn{index}"
        weight = self.state[f"{block}.{conv.format(index)}.weight"]
        scale = self.state[f"{norm}.weight"] / np.sqrt(
            self.state[f"{norm}.running_var"] + _BATCH_NORM_EPSILON)
        bias = self.state[f"{norm}.bias"] - self.state[f"{norm}.running_mean"] * scale
        return weight * scale[:, None, None, None], bias

    def packed(self, x, weight, bias, source, target):
        conv = pack(weight, bias, 1, Packing(1, source), Packing(1, target))
        return self.graph.conv(x, conv.weight, conv.bias, conv.stride, conv.pads)

    def first_block(self):
        """Two 3x3 convolutions at full size, the three equal colour channels made one."""
        weight, bias = self.folded("block1", 1)
        x = self.packed(self.image, weight.sum(1, keepdims=True), bias + SELU_SHIFT, 1, self.columns)
        weight, bias = self.folded("block1", 2)
        x = self.packed(self.selu(x, _LANES, (1, self.columns)), weight * SELU_SCALE,
                        bias + SELU_SHIFT, self.columns, self.columns)
        return self.selu(x, _LANES, (1, self.columns))

    def selu(self, x, channels, factor):
        """On pixels, channels last: the runtime's layout is a plain copy away from that.

        Flattened, so that its optimiser does not cancel the two transpositions. `factor` is
        (rows, columns) of the image per pixel of `x`.
        """
        flat = self.graph.node("Reshape", self.channels_last(x), self.graph.ints(-1, channels))
        return self.channels_first(selu(self.graph, flat), channels, factor)

    def channels_first(self, flat, channels, factor):
        """The map [1, channels, rows, columns] from one row per pixel."""
        size = self.graph.node("Div", self.size, self.graph.ints(*factor))
        shape = self.graph.node("Concat", self.graph.ints(1), size, self.graph.ints(channels), axis=0)
        return self.graph.node("Transpose", self.graph.node("Reshape", flat, shape), perm=[0, 3, 1, 2])

    def halved(self, x):
        """2x2 average; of packed pairs, a convolution that adds both halves of two rows."""
        if self.columns == 1:
            return self.pooled(x, 2)
        weight = np.tile(np.eye(_LANES // self.columns) / 4, (1, self.columns))[:, :, None, None]
        return self.graph.conv(x, np.repeat(weight, 2, 2), None, (2, 1), [0] * 4)

    def pooled(self, x, size):
        return self.graph.node("AveragePool", x, kernel_shape=[size, size], strides=[size, size])

    def residual(self, x, block, conv, kernel, factor):
        """Two convolutions beside a 1x1 shortcut, at 1 / `factor` of the size."""
        weight, bias = self.folded(block, 1, kernel)
        y = conv(x, f"{block}.conv1", weight * SELU_SCALE, bias + SELU_SHIFT)
        weight, bias = self.folded(block, 2, kernel)
        y = conv(self.selu(y, len(weight), factor), f"{block}.conv2", weight * SELU_SCALE, bias + SELU_SHIFT)
        short = self.graph.conv(x, self.state[f"{block}.downsample.weight"] * SELU_SCALE,
                                self.state[f"{block}.downsample.bias"])
        return self.selu(self.graph.node("Add", y, short), len(weight), factor)

    def deformable(self, x, block, factor):
        """The block's own deformable convolution; both of a block share one grid."""
        sampler = Sampler(self.graph, x)

        def conv(y, layer, weight, bias):
            offset = [self.state[f"{layer}.offset_conv.{part}"] for part in ("weight", "bias")]
            offset[0] = offset[0] * SELU_SCALE
            return deformable_conv(self.graph, sampler, y, offset, weight, bias)

        return self.residual(x, block, conv, "conv{}.regular_conv", (factor, factor))

    def plain(self, x, block):
        def conv(y, _layer, weight, bias):
            return self.graph.conv(y, weight, bias)

        return self.residual(x, block, conv, "conv{}", (2, 2))

    def maps(self):
        """Activations at 1, 1/2, 1/8 and 1/32 of the size."""
        x1 = self.first_block()
        x2 = self.plain(self.halved(x1), "block2")
        x3 = self.deformable(self.pooled(x2, 4), "block3", 8)
        x4 = self.deformable(self.pooled(x3, 4), "block4", 32)
        return x1, x2, x3, x4

    def levels(self):
        """dim / 4 channels of each map, one row per pixel."""
        levels = []
        for index, x in enumerate(self.maps(), 1):
            weight = self.state[f"conv{index}.weight"] * SELU_SCALE
            columns = self.columns if index == 1 else 1
            x = self.packed(x, weight, np.full(len(weight), SELU_SHIFT), columns, columns)
            x = self.graph.node("Reshape", self.channels_last(x), self.graph.ints(-1, len(weight)))
            levels.append(selu(self.graph, x))
        return levels

    def channels_last(self, x):
        return self.graph.node("Transpose", x, perm=[0, 2, 3, 1])


class _ScoreHead:
    """Works level by level up to its first layer, then on rows of packed pixels."""

    def __init__(self, encoder):
        self.encoder, self.graph, self.state = encoder, encoder.graph, encoder.state

    def first_layer(self, levels):
        """[1, H, W, 8]: the layer is 1x1, so it may go before the enlarging."""
        g, weight = self.graph, self.state["score_head.0.weight"][:, :, 0, 0] * SELU_SCALE
        quarter, total = weight.shape[1] // 4, None
        for index, (level, factor) in enumerate(zip(levels, (1, 2, 8, 32))):
            bias = np.full(_HEAD, SELU_SHIFT if index == 0 else 0.0)
            part = g.linear(level, weight[:, index * quarter:(index + 1) * quarter], bias)
            size = g.node("Div", self.encoder.size, g.ints(factor, factor))
            part = g.node("Reshape", part, g.node("Concat", g.ints(1), size, g.ints(_HEAD), axis=0))
            if factor > 1:
                part = g.node("Resize", part, "", g.weight([1, factor, factor, 1]), mode="linear",
                              coordinate_transformation_mode="align_corners")
            total = g.node("Add", total, part) if total else part
        return total

    def scores(self, levels):
        x = selu(self.graph, self.first_layer(levels))
        for layer, source, target, shift in ((2, 2, 4, SELU_SHIFT), (4, 4, 4, SELU_SHIFT), (6, 4, 16, 0.0)):
            weight = self.state[f"score_head.{layer}.weight"] * SELU_SCALE
            x = self.encoder.channels_first(x, source * weight.shape[1], (1, source))
            x = self.encoder.packed(x, weight, np.full(len(weight), shift), source, target)
            x = self.graph.node("Reshape", self.encoder.channels_last(x), self.graph.ints(-1, _LANES))
            x = selu(self.graph, x) if shift else x
        shape = self.graph.node("Concat", self.graph.ints(1, 1), self.encoder.size, axis=0)
        return self.graph.node("Sigmoid", self.graph.node("Reshape", x, shape))


def build_dense(state, name):
    """Image to score map and feature levels."""
    dim, encoder = dim_of(state), _Encoder(state, name)
    graph = encoder.graph
    levels = encoder.levels()
    graph.output(_ScoreHead(encoder).scores(levels), "scores", [1, 1, "height", "width"])
    for index, level in enumerate(levels, 1):
        graph.output(level, f"level{index}", [f"pixels{index}", dim // 4])
    return graph.model()
