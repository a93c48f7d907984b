"""A thin builder over onnx.helper: values are names, every call adds one node."""

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

OPSET = 17
# Of the time of opset 17: the onnx package writes newer ones that older runtimes refuse.
IR_VERSION = 8
MICROSOFT = "com.microsoft"


class Graph:
    """Collects nodes, weights, inputs and outputs of one ONNX graph."""

    def __init__(self, name):
        self._name = name
        self._nodes, self._weights, self._inputs, self._outputs = [], [], [], []
        self._public = {}
        self._count = 0

    def _fresh(self, stem):
        self._count += 1
        return f"{stem}_{self._count}"

    def input(self, name, shape):
        """Declares a float input; dimensions are numbers or names of free dimensions."""
        self._inputs.append(helper.make_tensor_value_info(name, TensorProto.FLOAT, shape))
        return name

    def output(self, value, name, shape):
        """Gives `value` its public name (renamed in the end: an Identity would cost a copy)."""
        self._public[value] = name
        self._outputs.append(helper.make_tensor_value_info(name, TensorProto.FLOAT, shape))

    def weight(self, array, dtype=np.float32):
        """Stores a constant."""
        name = self._fresh("w")
        self._weights.append(numpy_helper.from_array(np.ascontiguousarray(array, dtype), name))
        return name

    def scalar(self, value, dtype=np.float32):
        """Stores a constant without dimensions, as the operators on codes want scales."""
        name = self._fresh("w")
        self._weights.append(numpy_helper.from_array(np.array(value, dtype), name))
        return name

    def ints(self, *values):
        """Stores a constant vector of int64, as shapes and axes want them."""
        return self.weight(np.array(values), np.int64)

    def node(self, operator, *inputs, outputs=1, domain="", **attributes):
        """Adds a node; returns the name of its output, or a list when there are several."""
        names = [self._fresh(operator.lower()) for _ in range(outputs)]
        self._nodes.append(helper.make_node(
            operator, list(inputs), names, name=names[0], domain=domain, **attributes))
        return names[0] if outputs == 1 else names

    def conv(self, x, weight, bias=None, stride=1, pads=None, relu=False):
        """Convolution, padded to keep the size unless `pads` says otherwise, ReLU if wanted."""
        kernel = weight.shape[2:]
        strides = [stride, stride] if isinstance(stride, int) else list(stride)
        pads = pads or [kernel[0] // 2, kernel[1] // 2] * 2
        inputs = [x, self.weight(weight)] + ([] if bias is None else [self.weight(bias)])
        y = self.node("Conv", *inputs, kernel_shape=list(kernel), strides=strides, pads=pads)
        return self.node("Relu", y) if relu else y

    def linear(self, x, weight, bias=None, add=None):
        """x W^T + bias, or + `add`, an already computed value of the same shape."""
        third = add if bias is None else self.weight(bias)
        inputs = [x, self.weight(weight.T)] + ([] if third is None else [third])
        return self.node("Gemm", *inputs) if third else self.node("MatMul", *inputs)

    def model(self):
        """The finished, checked model."""
        for node in self._nodes:
            for names in (node.input, node.output):
                names[:] = [self._public.get(n, n) for n in names]
        graph = helper.make_graph(self._nodes, self._name, self._inputs, self._outputs, self._weights)
        domains = {n.domain for n in self._nodes} - {""}
        opsets = [helper.make_opsetid("", OPSET)] + [helper.make_opsetid(d, 1) for d in domains]
        model = helper.make_model(graph, opset_imports=opsets, ir_version=IR_VERSION,
                                  producer_name="rover")
        onnx.checker.check_model(model)
        return model
