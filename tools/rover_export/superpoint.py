"""SuperPoint (CVPR 2018 workshops): VGG encoder, cell-wise keypoint logits, descriptors."""

from .graph import Graph

_ENCODER = (("conv1a", "conv1b"), ("conv2a", "conv2b"), ("conv3a", "conv3b"), ("conv4a", "conv4b"))


def build_superpoint(state):
    """The ONNX model; `state` holds the network's tensors by their PyTorch names."""
    graph = Graph("superpoint")

    def conv(x, layer, relu=True):
        return graph.conv(x, state[f"{layer}.weight"], state[f"{layer}.bias"], relu=relu)

    x = graph.input("image", [1, 1, "height", "width"])
    for index, stage in enumerate(_ENCODER):
        if index > 0:
            x = graph.node("MaxPool", x, kernel_shape=[2, 2], strides=[2, 2])
        for layer in stage:
            x = conv(x, layer)
    for head, name, channels in (("P", "semi", 65), ("D", "desc", 256)):
        y = conv(conv(x, f"conv{head}a"), f"conv{head}b", relu=False)
        graph.output(y, name, [1, channels, "cell_rows", "cell_columns"])
    return graph.model()
