"""Rewrites convolutions so that thin layers fill whole vector registers.

The runtime computes channels in blocks of 8 or 16; a layer of 4 or 8 channels wastes most of
each block. Storing a block of neighbouring pixels as extra channels ("space to depth") makes
the layer wide and its map small, and the convolution stays a convolution with a rearranged
kernel: exactly the same sums, without the wasted lanes and memory traffic.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Packing:
    """Pixels per block; channel (dy * columns + dx) * C + c holds pixel (dy, dx) of map c."""
    rows: int = 1
    columns: int = 1


@dataclass(frozen=True)
class PackedConv:
    """Arguments of the rearranged convolution."""
    weight: np.ndarray
    bias: np.ndarray
    stride: tuple
    pads: list


def _axis(kernel, stride, block_in, block_out):
    """Along one axis: packed stride, first packed tap and number of taps."""
    if stride * block_out % block_in:
        raise ValueError("packed stride is not whole")
    pad = kernel // 2
    first = -pad // block_in
    last = ((block_out - 1) * stride - pad + kernel - 1) // block_in
    return stride * block_out // block_in, first, last - first + 1


def pack(weight, bias, stride=1, source=Packing(), target=Packing()):
    """The convolution (`stride`, padded to keep the size) from one packing to another."""
    out_channels, in_channels, height, width = weight.shape
    step_y, first_y, taps_y = _axis(height, stride, source.rows, target.rows)
    step_x, first_x, taps_x = _axis(width, stride, source.columns, target.columns)
    packed = np.zeros((target.rows, target.columns, out_channels, source.rows, source.columns,
                       in_channels, taps_y, taps_x), np.float32)
    for oy, ox, ky, kx in np.ndindex(target.rows, target.columns, height, width):
        tap_y, dy = divmod(oy * stride - height // 2 + ky, source.rows)
        tap_x, dx = divmod(ox * stride - width // 2 + kx, source.columns)
        packed[oy, ox, :, dy, dx, :, tap_y - first_y, tap_x - first_x] = weight[:, :, ky, kx]
    ends = [max(0, first + taps - step) for first, taps, step
            in ((first_y, taps_y, step_y), (first_x, taps_x, step_x))]
    return PackedConv(
        packed.reshape(target.rows * target.columns * out_channels, -1, taps_y, taps_x),
        np.tile(bias, target.rows * target.columns), (step_y, step_x), [-first_y, -first_x, *ends])
