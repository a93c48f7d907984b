"""Writes the ONNX graphs that Rover runs, from published weights (see docs/networks.md)."""

# Raised whenever a graph or its contract changes: graphs carrying another version are rebuilt.
EXPORTER_VERSION = 3


class ExportError(Exception):
    """A fault in the input that the user can mend; printed as one line, exit status 2."""
