"""SELU in four memory-bound passes; the runtime's own operator takes several times as long.

    selu(x) = scale (max(x, 0) + alpha exp(min(x, 0)) - alpha)

The outer scale is left to the linear layer that comes next (`SELU_SCALE`), and alpha goes into
the exponential: with y = x + ln(alpha), which costs nothing in the bias before, the bracket is
max(y, ln alpha) + exp(min(y, ln alpha)) - alpha - ln(alpha).
"""

import numpy as np

SELU_SCALE = 1.0507009873554805
_ALPHA = 1.6732632423543772
# To be added to the bias of the layer in front.
SELU_SHIFT = float(np.log(_ALPHA))


def selu(graph, shifted):
    """SELU without its scale, of a value that carries SELU_SHIFT."""
    knee = graph.weight(SELU_SHIFT)
    negative = graph.node("Exp", graph.node("Min", shifted, knee))
    positive = graph.node("Sub", graph.node("Max", shifted, knee), graph.weight(_ALPHA + SELU_SHIFT))
    return graph.node("Add", positive, negative)
