"""XFeat (CVPR 2024): dense descriptors, reliability and, if wanted, keypoint logits."""

import numpy as np

from .graph import Graph
from .packing import Packing, pack

_BATCH_NORM_EPSILON = 1e-5
_INSTANCE_NORM_EPSILON = 1e-5
# Block 1 works on 2x2 pixels, then on pairs of half-size pixels: 16 channels each time.
FULL, PAIRS = Packing(2, 2), Packing(1, 2)


class XFeat:
    """Builds the graph part by part; `values` names the activations that quantising looks at."""

    def __init__(self, state, name):
        self._state = state
        self.graph = Graph(name)
        self.values = {}

    def _noted(self, layer, value):
        self.values[layer] = value
        return value

    def _folded(self, layer):
        """Weight and bias of a convolution with the BatchNorm behind it folded in."""
        weight = self._state[f"{layer}.layer.0.weight"]
        scale = 1 / np.sqrt(self._state[f"{layer}.layer.1.running_var"] + _BATCH_NORM_EPSILON)
        return weight * scale[:, None, None, None], -self._state[f"{layer}.layer.1.running_mean"] * scale

    def _basic(self, x, layer, stride=1):
        weight, bias = self._folded(layer)
        return self._noted(layer, self.graph.conv(x, weight, bias, stride, relu=True))

    def _chain(self, x, block, count, first_stride=1):
        for index in range(count):
            x = self._basic(x, f"{block}.{index}", first_stride if index == 0 else 1)
        return x

    def _plain(self, x, layer):
        return self.graph.conv(x, self._state[f"{layer}.weight"], self._state[f"{layer}.bias"])

    def _packed(self, x, layer, stride, source, target):
        conv = pack(*self._folded(layer), stride, source, target)
        return self._noted(layer, self.graph.conv(x, conv.weight, conv.bias, conv.stride, conv.pads,
                                                  relu=True))

    def normalised(self, image):
        """Mean 0, variance 1 over the image."""
        one, zero = self.graph.weight([1.0]), self.graph.weight([0.0])
        return self.graph.node("InstanceNormalization", image, one, zero,
                               epsilon=_INSTANCE_NORM_EPSILON)

    def _stem(self, image):
        """Block 1 and its shortcut: 24 channels at a quarter of the size."""
        x = self._packed(image, "block1.0", 1, Packing(), FULL)
        x = self._packed(x, "block1.1", 2, FULL, PAIRS)
        x = self._packed(x, "block1.2", 1, PAIRS, PAIRS)
        x = self._packed(x, "block1.3", 2, PAIRS, Packing())
        y = self._noted("shortcut", self._shortcut(image, np.ones(24)))
        return self._noted("stem", self.graph.node("Add", x, y))

    def _shortcut(self, image, unit):
        """Average pooling over 4x4 and a 1x1 convolution, as one convolution of stride 4."""
        weight = np.repeat(np.repeat(self._state["skip1.1.weight"] / 16, 4, 2), 4, 3)
        return self.graph.conv(image, weight / unit[:, None, None, None],
                               self._state["skip1.1.bias"] / unit, 4, [0] * 4)

    def _enlarged(self, x, factor):
        scales = self.graph.weight([1, 1, factor, factor])
        return self.graph.node("Resize", x, "", scales, mode="linear",
                               coordinate_transformation_mode="half_pixel")

    def descriptors(self, image):
        x3 = self._chain(self._chain(self._stem(image), "block2", 2), "block3", 3, 2)
        x4 = self._chain(x3, "block4", 3, 2)
        x5 = self._chain(x4, "block5", 4, 2)
        x = self.graph.node("Add", self.graph.node("Add", x3, self._enlarged(x4, 2)),
                            self._enlarged(x5, 4))
        self._noted("pyramid", x)
        return self._plain(self._chain(x, "block_fusion", 2), "block_fusion.2")

    def reliability(self, descriptors):
        x = self._plain(self._chain(descriptors, "heatmap_head", 2), "heatmap_head.2")
        return self.graph.node("Sigmoid", x)

    def keypoint_logits(self, image):
        """Cell of 8x8 pixels -> 64 places in it and "none"."""
        weight, bias = self._folded("keypoint_head.0")
        # The cell's pixels as channels, then 1x1: one convolution of stride 8.
        x = self.graph.conv(image, weight.reshape(-1, 1, 8, 8), bias, 8, [0] * 4, relu=True)
        x = self._basic(self._basic(x, "keypoint_head.1"), "keypoint_head.2")
        return self._plain(x, "keypoint_head.3")


def finish(network, with_keypoints=False):
    """The ONNX model of a network that has no nodes yet."""
    graph = network.graph
    image = network.normalised(graph.input("image", [1, 1, "height", "width"]))
    descriptors = network.descriptors(image)
    graph.output(descriptors, "descriptors", [1, 64, "cell_rows", "cell_columns"])
    graph.output(network.reliability(descriptors), "reliability",
                 [1, 1, "cell_rows", "cell_columns"])
    if with_keypoints:
        graph.output(network.keypoint_logits(image), "keypoint_logits",
                     [1, 65, "cell_rows", "cell_columns"])
    return graph.model()


def build_xfeat(state, with_keypoints):
    """The ONNX model; `state` holds the network's tensors by their PyTorch names."""
    return finish(XFeat(state, "xfeat_keypoints" if with_keypoints else "xfeat"), with_keypoints)
