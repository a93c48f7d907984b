"""Deformable 3x3 convolution out of gathers and one matrix product.

The runtime has no deformable convolution on the CPU, and its GridSample is slow. Here every
tap reads its four neighbours as whole rows of the map stored pixel by pixel.
"""

import numpy as np
from onnx import TensorProto

_TAPS = 9


class Sampler:
    """Bilinear samples, zero outside, at nine places per pixel of a map [1, C, h, w].

    Coordinates of y and of x are kept apart, [h, w, 9] each, and combined with whole tensors
    or scalars only: the runtime is slow at any other broadcast.
    """

    def __init__(self, graph, x):
        self.graph = graph
        self.shape = graph.node("Slice", graph.node("Shape", x), graph.ints(2), graph.ints(4), graph.ints(0))
        self.size = graph.node("Split", graph.node("Cast", self.shape, to=TensorProto.FLOAT),
                               axis=0, outputs=2)
        # The table has a ring of zeros: one pixel before, two after.
        self.stride = graph.node("Add", self.size[1], graph.weight([3.0]))
        self.grids = [self._grid(axis) for axis in (0, 1)]

    def _grid(self, axis):
        """Where an undeformed convolution looks along the axis."""
        g = self.graph
        count = g.node("Squeeze", g.node("Split", self.shape, axis=0, outputs=2)[axis], g.ints(0))
        steps = g.node("Range", g.weight(0, np.int64), count, g.weight(1, np.int64))
        steps = g.node("Cast", steps, to=TensorProto.FLOAT)
        steps = g.node("Reshape", steps, g.ints(*((-1, 1, 1) if axis == 0 else (1, -1, 1))))
        taps = np.repeat([-1, 0, 1], 3) if axis == 0 else np.tile([-1, 0, 1], 3)
        steps = g.node("Add", steps, g.weight(taps.reshape(1, 1, _TAPS)))
        return g.node("Expand", steps, g.node("Concat", self.shape, g.ints(_TAPS), axis=0))

    def _places(self, offsets):
        """Coordinates of the samples, clamped to the ring of zeros."""
        g = self.graph
        limit = g.node("Mul", g.node("Max", *self.size), g.weight([0.25]))
        limit = g.node("Squeeze", limit, g.ints(0))
        offsets = g.node("Clip", offsets, g.node("Neg", limit), limit)
        offsets = g.node("Squeeze", g.node("Transpose", offsets, perm=[0, 2, 3, 1]), g.ints(0))
        for part, grid, size in zip(g.node("Split", offsets, axis=2, outputs=2), self.grids, self.size):
            place = g.node("Add", part, grid)
            yield g.node("Min", g.node("Max", place, g.weight([-1.0])), size)

    def _table(self, x, channels):
        """The map as rows of pixels."""
        g = self.graph
        table = g.node("Pad", g.node("Transpose", x, perm=[0, 2, 3, 1]), g.ints(0, 1, 1, 0, 0, 2, 2, 0))
        return g.node("Reshape", table, g.ints(-1, channels))

    def _corner(self, y, x):
        """Index in the table of the neighbour up left; whole numbers, exact in float."""
        g = self.graph
        index = g.node("Add", g.node("Mul", y, self.stride), x)
        index = g.node("Add", index, g.node("Add", self.stride, g.weight([1.0])))
        return g.node("Reshape", g.node("Cast", index, to=TensorProto.INT64), g.ints(-1))

    def samples(self, x, offsets, channels):
        """[h w, 9 C], tap by tap, at the offsets [1, 18, h, w] (nine for y, then nine for x)."""
        g = self.graph
        places = list(self._places(offsets))
        corners = [g.node("Floor", p) for p in places]
        high = [g.node("Sub", p, c) for p, c in zip(places, corners)]
        weights = list(zip((g.node("Sub", g.weight([1.0]), h) for h in high), high))
        table, first, total = self._table(x, channels), self._corner(*corners), None
        stride = g.node("Cast", self.stride, to=TensorProto.INT64)
        for row, column in np.ndindex(2, 2):
            step = g.node("Add", g.node("Mul", stride, g.ints(row)), g.ints(column))
            values = g.node("Gather", table, g.node("Add", first, step), axis=0)
            weight = g.node("Mul", weights[0][row], weights[1][column])
            values = g.node("Mul", values, g.node("Reshape", weight, g.ints(-1, 1)))
            total = values if total is None else g.node("Add", total, values)
        return g.node("Reshape", total, g.ints(-1, _TAPS * channels))


def deformable_conv(graph, sampler, x, offset, weight, bias):
    """`x` [1, C, h, w] to [1, C', h, w]; offsets are clamped to a quarter of the larger side.

    `offset` is weight and bias of the convolution that says how far each tap moves.
    """
    apart = np.arange(2 * _TAPS).reshape(_TAPS, 2).T.ravel()
    offsets = graph.conv(x, offset[0][apart], offset[1][apart])
    out_channels, channels = weight.shape[:2]
    samples = sampler.samples(x, offsets, channels)
    y = graph.linear(samples, weight.transpose(0, 2, 3, 1).reshape(out_channels, -1), bias)
    shape = graph.node("Concat", graph.ints(1), sampler.shape, graph.ints(out_channels), axis=0)
    return graph.node("Transpose", graph.node("Reshape", y, shape), perm=[0, 3, 1, 2])
