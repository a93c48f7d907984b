"""Puts finished graphs into the models folder: all of a family or nothing."""

import json
import os
from pathlib import Path

from . import EXPORTER_VERSION, ExportError


def _write(path, data):
    """A reader sees the old file or the new one, never half of one."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        temporary.write_bytes(data)
        os.replace(temporary, path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise ExportError(f"{path}: {error.strerror}") from None


def _ports(values):
    return {v.name: [d.dim_param or d.dim_value for d in v.type.tensor_type.shape.dim] for v in values}


def _describe(model, size):
    return {"bytes": size, "inputs": _ports(model.graph.input), "outputs": _ports(model.graph.output)}


def is_current(folder, family, source):
    """Whether the family lies there complete, from this exporter and this source."""
    try:
        known = json.loads((Path(folder) / f"{family}.json").read_text(encoding="utf-8"))
        return known["exporter"] == EXPORTER_VERSION and known["source"] == source and all(
            (Path(folder) / name).stat().st_size == entry["bytes"]
            for name, entry in known["graphs"].items())
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return False


def save(folder, family, source, models, facts):
    """Writes the graphs, then `family.json`, which vouches for them, last."""
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ExportError(f"{folder}: {error.strerror}") from None
    graphs = {}
    for name, model in models.items():
        data = model.SerializeToString()
        _write(folder / f"{name}.onnx", data)
        graphs[f"{name}.onnx"] = _describe(model, len(data))
    contract = {"name": family, "exporter": EXPORTER_VERSION, "source": source, **facts,
                "graphs": graphs}
    _write(folder / f"{family}.json", (json.dumps(contract, indent=2) + "\n").encode())
