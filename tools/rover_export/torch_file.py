"""Reads PyTorch weight files without PyTorch.

A `.pt` file is a zip of raw tensors and a pickle that says what they are; files from before
PyTorch 1.6 are five pickles in a row followed by the raw tensors. Unpickling can run any
code, so the unpickler here knows the handful of names that a plain dictionary of tensors
needs and refuses every other.
"""

import io
import pickle
import struct
import zipfile
from collections import OrderedDict

import numpy as np

from . import ExportError

_STORAGE_TYPES = {
    "FloatStorage": np.dtype("<f4"),
    "DoubleStorage": np.dtype("<f8"),
    "HalfStorage": np.dtype("<f2"),
    "LongStorage": np.dtype("<i8"),
    "IntStorage": np.dtype("<i4"),
    "ByteStorage": np.dtype("u1"),
    "BoolStorage": np.dtype("?"),
}
_LEGACY_MAGIC = 0x1950A86A20F9469CFC6C
_MAX_DIMENSIONS = 8


def _rebuild_tensor(storage, offset, size, stride, *_ignored):
    """A view of `storage` as torch describes it, checked against the storage's bounds."""
    if not isinstance(storage, np.ndarray) or len(size) != len(stride) or len(size) > _MAX_DIMENSIONS:
        raise ExportError("malformed tensor in the weight file")
    numbers = [offset, *size, *stride]
    if any(not isinstance(n, int) or n < 0 for n in numbers):
        raise ExportError("malformed tensor in the weight file")
    last = offset + sum((n - 1) * s for n, s in zip(size, stride))
    if 0 not in size and last >= storage.size:
        raise ExportError("a tensor in the weight file reaches beyond its storage")
    step = storage.itemsize
    return np.lib.stride_tricks.as_strided(
        storage[offset:], shape=tuple(size), strides=tuple(s * step for s in stride))


def _rebuild_parameter(data, *_ignored):
    return data


class _Unpickler(pickle.Unpickler):
    """Knows tensors, storages and ordered dictionaries; anything else is refused."""

    _FUNCTIONS = {
        ("collections", "OrderedDict"): OrderedDict,
        ("torch._utils", "_rebuild_tensor_v2"): _rebuild_tensor,
        ("torch._utils", "_rebuild_parameter"): _rebuild_parameter,
    }

    def __init__(self, stream, storage_of):
        super().__init__(stream, encoding="utf-8")
        self._storage_of = storage_of

    def find_class(self, module, name):
        if (module, name) in self._FUNCTIONS:
            return self._FUNCTIONS[module, name]
        if module == "torch" and name in _STORAGE_TYPES:
            return _STORAGE_TYPES[name]
        raise ExportError(f"the weight file asks for {module}.{name}, which is not allowed")

    def persistent_load(self, key):
        if not isinstance(key, tuple) or len(key) < 5 or key[0] != "storage" \
                or not isinstance(key[1], np.dtype) or not isinstance(key[4], int) or key[4] < 0:
            raise ExportError("malformed storage in the weight file")
        return self._storage_of(key[1], str(key[2]), key[4])


def _load_zip(archive):
    names = {n.split("/", 1)[-1]: n for n in archive.namelist()}
    if "data.pkl" not in names:
        raise ExportError("the archive holds no data.pkl")

    def storage_of(dtype, key, count):
        if f"data/{key}" not in names:
            raise ExportError(f"the weight file lacks storage {key}")
        raw = archive.read(names[f"data/{key}"])
        if len(raw) < count * dtype.itemsize:
            raise ExportError(f"storage {key} of the weight file is cut short")
        return np.frombuffer(raw, dtype, count)

    return _Unpickler(io.BytesIO(archive.read(names["data.pkl"])), storage_of).load()


def _load_legacy(raw):
    """Magic number, version, system, object, order of storages; then the storages."""
    stream, storages = io.BytesIO(raw), {}

    def storage_of(dtype, key, count):
        if count * dtype.itemsize > len(raw):
            raise ExportError(f"storage {key} of the weight file is cut short")
        return storages.setdefault(key, np.zeros(count, dtype))

    def load():
        return _Unpickler(stream, storage_of).load()

    if load() != _LEGACY_MAGIC:
        raise ExportError("not a PyTorch weight file")
    load(), load()
    tensors, order = load(), load()
    for key in map(str, order):
        header = stream.read(8)
        count = struct.unpack("<q", header)[0] if len(header) == 8 else -1
        storage = storages.get(key)
        if storage is None or count != storage.size:
            raise ExportError(f"storage {key} of the weight file is cut short")
        data = stream.read(storage.nbytes)
        if len(data) != storage.nbytes:
            raise ExportError(f"storage {key} of the weight file is cut short")
        storage[:] = np.frombuffer(data, storage.dtype)
    return tensors


def _as_state(loaded):
    """The dictionary name -> float32 array, unwrapped from a training checkpoint if need be."""
    for wrapper in ("model", "state_dict"):
        if isinstance(loaded, dict) and isinstance(loaded.get(wrapper), dict):
            loaded = loaded[wrapper]
    if not isinstance(loaded, dict):
        raise ExportError("the weight file holds no dictionary of tensors")
    state = {str(k): np.array(v, np.float32) for k, v in loaded.items() if isinstance(v, np.ndarray)}
    if not state:
        raise ExportError("the weight file holds no tensors")
    bad = next((k for k, v in state.items() if not np.isfinite(v).all()), None)
    if bad:
        raise ExportError(f"tensor {bad} of the weight file is not finite")
    return state


def parse_weights(raw, name):
    """name -> float32 array from the bytes of a .pt, .pth or .npz file called `name`."""
    try:
        if not zipfile.is_zipfile(io.BytesIO(raw)):
            return _as_state(_load_legacy(raw))
        with zipfile.ZipFile(io.BytesIO(raw)) as archive:
            if all(n.endswith(".npy") for n in archive.namelist()):
                with np.load(io.BytesIO(raw), allow_pickle=False) as arrays:
                    return _as_state({k: arrays[k] for k in arrays.files})
            return _as_state(_load_zip(archive))
    except ExportError as error:
        raise ExportError(f"{name}: {error}") from None
    except Exception as error:  # A broken pickle can raise nearly anything.
        raise ExportError(f"{name}: not a readable weight file ({type(error).__name__})") from None


def read_weights(path):
    """name -> float32 array from a weight file on disk."""
    try:
        with open(path, "rb") as stream:
            raw = stream.read()
    except OSError as error:
        raise ExportError(f"{path}: {error.strerror}") from None
    return parse_weights(raw, str(path))
