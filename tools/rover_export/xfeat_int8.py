"""XFeat with 8-bit convolutions: four times the arithmetic per instruction (see codes.py)."""

import numpy as np

from .calibration import samples
from .codes import CodeGraph, coding_of, summand_coding
from .packing import Packing, pack
from .xfeat import FULL, PAIRS, XFeat, finish


def _unpacked(state, layer, values):
    """Samples [channels, n], the pixels that a packed map holds as channels being samples too."""
    mean = state.get(f"{layer}.layer.1.running_mean")
    if mean is None or len(mean) == len(values):
        return values
    count = values.shape[1]
    return values.reshape(-1, len(mean), count).transpose(1, 0, 2).reshape(len(mean), -1)


def _codings(state):
    """Of every activation, measured on the images of calibration.py."""
    network = XFeat(state, "xfeat")
    model = finish(network)
    found = samples(model, network.values.values())
    values = {layer: _unpacked(state, layer, found[value]) for layer, value in network.values.items()}
    codings = {layer: coding_of(value) for layer, value in values.items()}
    for layer in ("block1.3", "shortcut"):
        codings[layer] = summand_coding(values[layer], codings["stem"])
    return codings


class _Int8XFeat(XFeat):
    """The same graph with Codes for its inner values."""

    def __init__(self, state, codings):
        super().__init__(state, "xfeat_int8")
        self._codings = codings
        self._codes = CodeGraph(self.graph)
        self._fused = None

    def _basic(self, x, layer, stride=1):
        return self._codes.conv(x, *self._folded(layer), self._codings[layer], stride)

    def _packed(self, x, layer, stride, source, target):
        conv = pack(*self._folded(layer), stride, source, target)
        return self._codes.conv(x, conv.weight, conv.bias,
                                self._codings[layer].tiled(len(conv.bias)), conv.stride, conv.pads)

    def _first(self, image, coding):
        """Block 1's first layer, on floats: the image would not survive 8 bits after scaling."""
        weight, bias = self._folded("block1.0")
        conv = pack(weight / coding.step[:, None, None, None], bias / coding.step, 1, Packing(), FULL)
        # One column too many, which the next layer does not read: else the 16 planes lie a
        # multiple of 4096 bytes apart, and the transposition takes four times as long.
        top, left, bottom, right = conv.pads
        x = self.graph.conv(image, conv.weight, conv.bias, conv.stride, [top, left, bottom, right + 2])
        return self._codes.quantised(self._codes.channels_last(x), coding.tiled(16))

    def _stem(self, image):
        x = self._first(image, self._codings["block1.0"])
        x = self._packed(x, "block1.1", 2, FULL, PAIRS)
        x = self._packed(x, "block1.2", 1, PAIRS, PAIRS)
        x = self._packed(x, "block1.3", 2, PAIRS, Packing())
        coding = self._codings["shortcut"]
        y = self._codes.channels_last(self._shortcut(image, coding.step))
        return self._codes.sum(x, self._codes.quantised(y, coding), self._codings["stem"])

    def _enlarged(self, x, factor):
        return self.graph.node("Resize", x, "", self.graph.weight([1, factor, factor, 1]),
                               mode="linear", coordinate_transformation_mode="half_pixel")

    def _floats(self, x, layer, unit):
        """A 1x1 basic layer that gives floats in units of `unit`."""
        weight, bias = self._folded(layer)
        y = self._codes.linear(x, weight / unit[:, None, None, None], bias / unit)
        return self.graph.node("Relu", y)

    def descriptors(self, image):
        coding = self._codings["pyramid"]
        x = self._chain(self._chain(self._stem(image), "block2", 2), "block3", 2, 2)
        x3 = self._floats(x, "block3.2", coding.step)
        x4 = self._chain(self._codes.quantised(x3, coding), "block4", 3, 2)
        x5 = self._floats(self._chain(x4, "block5", 3, 2), "block5.3", coding.step)
        x4 = self._codes.floats(x4, coding.step)
        x = self.graph.node("Add", self.graph.node("Add", x3, self._enlarged(x4, 2)),
                            self._enlarged(x5, 4))
        self._fused = self._chain(self._codes.quantised(x, coding), "block_fusion", 2)
        return self._codes.channels_first(self._plain(self._fused, "block_fusion.2"))

    def _plain(self, x, layer):
        return self._codes.linear(x, self._state[f"{layer}.weight"], self._state[f"{layer}.bias"])

    def reliability(self, descriptors):
        # Two linear layers in one: the descriptors need not be coded.
        weight, bias = self._folded("heatmap_head.0")
        inner = self._state["block_fusion.2.weight"][:, :, 0, 0]
        bias = bias + weight[:, :, 0, 0] @ self._state["block_fusion.2.bias"]
        x = self._codes.conv(self._fused, (weight[:, :, 0, 0] @ inner)[:, :, None, None], bias,
                             self._codings["heatmap_head.0"])
        x = self._plain(self._basic(x, "heatmap_head.1"), "heatmap_head.2")
        return self.graph.node("Sigmoid", self._codes.channels_first(x))


def build_xfeat_int8(state):
    """The ONNX model; it has the ports of build_xfeat(state, False)."""
    return finish(_Int8XFeat(state, _codings(state)))
