"""Tests of the exporter's 8-bit arithmetic and of the images that set its scales."""

import sys
import unittest
from pathlib import Path

import numpy as np
import onnxruntime

sys.path.insert(0, str(Path(__file__).resolve().parent))
from rover_export import calibration
from rover_export.codes import CodeGraph, coding_of, summand_coding
from rover_export.graph import Graph


def convolved(x, weight, bias):
    """Plain definition, padded to keep the size: [C, h, w] to [C', h, w]."""
    pad = weight.shape[2] // 2
    windows = np.lib.stride_tricks.sliding_window_view(
        np.pad(x, ((0, 0), (pad, pad), (pad, pad))), weight.shape[2:], (1, 2))
    return np.einsum("chwyx,ocyx->ohw", windows, weight, optimize=True) + bias[:, None, None]


class Codes(unittest.TestCase):
    """8-bit arithmetic is the plain definition to about half a code."""

    def setUp(self):
        self.rng = np.random.default_rng(6)
        self.graph = Graph("codes")
        self.codes = CodeGraph(self.graph)

    def quantised(self, name, x, coding):
        """A graph input [1, h, w, c], coded; the steps are divided out beforehand."""
        value = self.graph.input(name, list(x.shape))
        return self.codes.quantised(value, coding), {name: (x / coding.step).astype(np.float32)}

    def output(self, value, channels, inputs):
        self.graph.output(value, "y", [1, "h", "w", channels])
        session = onnxruntime.InferenceSession(self.graph.model().SerializeToString(),
                                               providers=["CPUExecutionProvider"])
        return session.run(["y"], inputs)[0]

    def test_coding_covers_the_samples(self):
        values = self.rng.normal(size=(5, 400)) * [[0.01], [1], [2], [3], [10]]
        for samples in (values, np.maximum(values, 0)):
            coding = coding_of(samples)
            codes = samples / coding.step[:, None] + coding.zero
            self.assertGreater(codes.min(), -0.51)
            self.assertLess(codes.max(), 255.51)
            self.assertEqual(coding.zero == 0, samples.min() == 0)

    def test_convolution_and_linear_layer(self):
        x = np.abs(self.rng.normal(size=(1, 12, 16, 8))) * np.arange(1, 9)
        weight, bias = self.rng.normal(size=(16, 8, 3, 3)) / 30, self.rng.normal(size=16)
        last = self.rng.normal(size=(4, 16, 1, 1))
        hidden = np.maximum(convolved(x[0].transpose(2, 0, 1), weight, bias), 0)
        expected = convolved(hidden, last, np.ones(4))
        coded, inputs = self.quantised("x", x, coding_of(x.reshape(-1, 8).T))
        y = self.codes.conv(coded, weight, bias, coding_of(hidden.reshape(16, -1)))
        actual = self.output(self.codes.linear(y, last, np.ones(4)), 4, inputs)[0].transpose(2, 0, 1)
        error = np.std(actual - expected) / np.std(expected)
        print(f"8-bit convolution and 1x1: relative error {error:.4f}")
        self.assertLess(error, 0.02)

    def test_sum_of_different_codings(self):
        x, y = np.abs(self.rng.normal(size=(1, 6, 8, 4))), self.rng.normal(size=(1, 6, 8, 4)) * 3
        total = coding_of((x + y).reshape(-1, 4).T)
        first, inputs = self.quantised("x", x, summand_coding(x.reshape(-1, 4).T, total))
        second, more = self.quantised("z", y, summand_coding(y.reshape(-1, 4).T, total))
        coded = self.codes.sum(first, second, total)
        actual = self.output(self.codes.floats(coded, np.ones(4)), 4, inputs | more)
        self.assertLess(np.abs((actual - x - y) / total.step).max(), 1.6)

    def test_calibration_images(self):
        images, again = list(calibration.images()), list(calibration.images())
        self.assertGreater(len(images), 20)
        for one, other in zip(images, again):
            np.testing.assert_array_equal(one, other)
            self.assertTrue(one.min() >= 0 and one.max() <= 1 and one.std() > 0.005)
            self.assertEqual((one.shape[2] % 32, one.shape[3] % 32), (0, 0))


if __name__ == "__main__":
    unittest.main()
