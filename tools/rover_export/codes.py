"""8-bit arithmetic: activations as uint8 codes, weights as int8, sums exact in int32.

An activation's channels have steps of their own, so that one with small values is not drowned.
The runtime knows no such steps for activations, but needs not: a convolution's weights take them
in, and what the runtime sees is codes in, codes out, with a scale of one. ReLU needs no operator,
since codes cannot go below zero. Layers are laid out with the channels last, as the runtime's
fast integer convolution wants them.
"""

from dataclasses import dataclass

import numpy as np

from .graph import MICROSOFT

_LARGEST_CODE = 255
_LARGEST_WEIGHT = 127


@dataclass(frozen=True)
class Coding:
    """Code q of channel c stands for step[c] (q - zero)."""
    step: np.ndarray
    zero: int = 0

    def tiled(self, channels):
        """For a map that packs several pixels into its channels: the same for each of them."""
        return Coding(np.tile(self.step, channels // len(self.step)), self.zero)


@dataclass(frozen=True)
class Codes:
    """A uint8 value [1, h, w, channels] of a graph."""
    value: str
    coding: Coding


def _fitted(span, low, high):
    """Steps in proportion to `span`, wide enough for values from -low to high."""
    below, above = max(0.0, (low / span).max()), (high / span).max()
    scale = (below + above) / _LARGEST_CODE
    return Coding(span * scale, round(below / scale))


def coding_of(values):
    """For samples [channels, n]. Halfway (geometrically) between one step for all channels, which
    loses the weak ones, and as many codes for each, which makes the next layer's weights uneven.
    """
    high, low = values.max(1), -values.min(1)
    ranges = np.maximum(high, low)
    return _fitted(np.sqrt(np.maximum(ranges, 0.01 * ranges.max())), low, high)


def summand_coding(values, total):
    """For samples that will be added to others: steps in the proportions of the sum's coding."""
    return _fitted(total.step, -values.min(1), values.max(1))


class CodeGraph:
    """Adds operators on codes to a Graph."""

    def __init__(self, graph):
        self._graph = graph

    def _zero(self, coding):
        return self._graph.scalar(coding.zero, np.uint8)

    def channels_last(self, x):
        """[1, c, h, w] -> [1, h, w, c]."""
        return self._graph.node("Transpose", x, perm=[0, 2, 3, 1])

    def channels_first(self, x):
        """[1, h, w, c] -> [1, c, h, w]."""
        return self._graph.node("Transpose", x, perm=[0, 3, 1, 2])

    def quantised(self, x, coding):
        """Codes of floats [1, h, w, c] that were divided by the steps already."""
        return Codes(self._graph.node("QuantizeLinear", x, self._graph.scalar(1), self._zero(coding)),
                     coding)

    def floats(self, x, unit):
        """Floats [1, h, w, c] in units of `unit`, a vector."""
        scale = self._graph.weight(x.coding.step / unit)
        zero = self._graph.weight(np.full(len(unit), x.coding.zero), np.uint8)
        return self._graph.node("DequantizeLinear", x.value, scale, zero, axis=3)

    def sum(self, x, y, coding):
        """x + y, which have their steps in the proportions of `coding`."""
        inputs = []
        for term in (x, y):
            factor = term.coding.step[0] / coding.step[0]
            inputs += [term.value, self._graph.scalar(factor), self._zero(term.coding)]
        return Codes(self._graph.node("QLinearAdd", *inputs, self._graph.scalar(1),
                                      self._zero(coding), domain=MICROSOFT), coding)

    def conv(self, x, weight, bias, coding, stride=1, pads=None):
        """Convolution and, where the coding's zero is 0, ReLU; padded as Graph.conv does."""
        g, kernel = self._graph, weight.shape[2:]
        weight = weight * x.coding.step[None, :, None, None] / coding.step[:, None, None, None]
        scale = np.abs(weight).max((1, 2, 3)) / _LARGEST_WEIGHT
        inputs = [x.value, g.scalar(1), self._zero(x.coding),
                  g.weight(np.round(weight / scale[:, None, None, None]), np.int8),
                  g.weight(scale), g.weight(np.zeros(len(bias)), np.int8),
                  g.scalar(1), self._zero(coding),
                  g.weight(np.round(bias / coding.step / scale), np.int32)]
        strides = [stride, stride] if isinstance(stride, int) else list(stride)
        y = g.node("QLinearConv", *inputs, domain=MICROSOFT, channels_last=1, strides=strides,
                   kernel_shape=list(kernel), pads=pads or [kernel[0] // 2, kernel[1] // 2] * 2)
        return Codes(y, coding)

    def linear(self, x, weight, bias):
        """1x1 convolution of codes (whose zero is 0) to floats [1, h, w, c]."""
        g, weight = self._graph, weight[:, :, 0, 0] * x.coding.step
        scale = np.abs(weight).max(1) / _LARGEST_WEIGHT
        return g.node("MatMulIntegerToFloat", x.value,
                      g.weight(np.round(weight / scale[:, None]).T, np.int8), g.scalar(1),
                      g.weight(scale), g.scalar(0, np.uint8), g.weight(np.zeros(len(bias)), np.int8),
                      g.weight(bias), domain=MICROSOFT)
