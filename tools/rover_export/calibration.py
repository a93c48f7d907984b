"""Images by formula, and how large a network's activations become on them.

Quantising needs the range of every activation. No recorded images are needed for that: the
network normalises its input, and pictures with edges, texture at all scales, print, light and
darkness drive it as far as real ones do (docs/networks.md has the comparison).
"""

import numpy as np
import onnx
import onnxruntime

_SEED = 11
_HEIGHT, _WIDTH = 256, 320


def _smooth(rng, cell):
    """Value noise: random values `cell` pixels apart, interpolated bilinearly; 0..1."""
    values = rng.random((_HEIGHT // cell + 2, _WIDTH // cell + 2))
    y, x = np.arange(_HEIGHT)[:, None] / cell, np.arange(_WIDTH)[None] / cell
    i, j = y.astype(int), x.astype(int)
    v, u = y - i, x - j
    top = values[i, j] * (1 - u) + values[i, j + 1] * u
    return top * (1 - v) + (values[i + 1, j] * (1 - u) + values[i + 1, j + 1] * u) * v


def _noise(rng):
    """Texture at all scales, with as much power in each octave as in natural images."""
    octaves = [cell / 64 * _smooth(rng, cell) for cell in (1, 2, 4, 8, 16, 32, 64)]
    return sum(octaves) / sum(cell / 64 for cell in (1, 2, 4, 8, 16, 32, 64))


def _shapes(rng, count, largest):
    """Overlapping tilted rectangles and ellipses of one gray each."""
    image = np.full((_HEIGHT, _WIDTH), rng.random())
    y, x = np.mgrid[0:_HEIGHT, 0:_WIDTH]
    for _ in range(count):
        angle, half = rng.random() * np.pi, 2 + largest * rng.random(2) ** 2
        dx, dy = x - rng.random() * _WIDTH, y - rng.random() * _HEIGHT
        u = (dx * np.cos(angle) + dy * np.sin(angle)) / half[0]
        v = (dy * np.cos(angle) - dx * np.sin(angle)) / half[1]
        inside = u * u + v * v < 1 if rng.random() < 0.4 else np.maximum(abs(u), abs(v)) < 1
        image[inside] = rng.random()
    return image


def _print(rng):
    """Lines of glyphs, each a pattern of 3x5 dark squares."""
    image = np.full((_HEIGHT, _WIDTH), 0.9)
    size = 1
    for row in range(4, _HEIGHT - 24, 24):
        size = size % 3 + 1
        for column in range(4, _WIDTH - 4 * size, 4 * size):
            glyph = np.kron(rng.random((5, 3)) < 0.5, np.ones((size, size)))
            image[row:row + 5 * size, column:column + 3 * size] -= 0.8 * glyph
    return image


def _board():
    """A chequerboard whose squares grow from left to right, with a slope of light."""
    y, x = np.mgrid[0:_HEIGHT, 0:_WIDTH]
    return 0.2 + 0.5 * ((np.sqrt(x * 3.0).astype(int) + y // 14) % 2) + 0.2 * y / _HEIGHT


def _scenes(rng):
    few, many = _shapes(rng, 25, 80), _shapes(rng, 300, 25)
    texture = _noise(rng)
    yield from (few, many, texture, _print(rng), _board())
    yield 0.7 * few + 0.3 * texture
    yield 0.6 * _shapes(rng, 60, 50) + 0.4 * _noise(rng)
    yield np.where(_smooth(rng, 64) > 0.5, _print(rng), 0.5 * texture)
    yield np.kron(_noise(rng)[::8, ::8], np.ones((8, 8)))


def images():
    """Gray images 0..1 as [1, 1, H, W]: every scene bright, dark, pale, with glare and noise."""
    rng = np.random.default_rng(_SEED)
    for scene in _scenes(rng):
        glare = np.clip(3 * _smooth(rng, 64) - 1.7, 0, 1)
        for light in (scene, 0.12 * scene + 0.02, 0.4 + 0.1 * scene, 0.25 * scene + glare):
            noisy = light + 0.01 * rng.standard_normal(light.shape)
            gray = np.round(255 * np.clip(noisy, 0, 1)) / 255
            yield gray.astype(np.float32)[None, None]


def samples(model, values, per_image=2000):
    """name -> [channels, n] of activations [1, channels, h, w] of `model` at random places."""
    model = onnx.ModelProto.FromString(model.SerializeToString())
    model.graph.output.extend(onnx.ValueInfoProto(name=name) for name in values)
    session = onnxruntime.InferenceSession(model.SerializeToString(),
                                           providers=["CPUExecutionProvider"])
    rng = np.random.default_rng(_SEED)
    found = {name: [] for name in values}
    for image in images():
        for name, value in zip(values, session.run(list(values), {"image": image})):
            flat = value[0].reshape(value.shape[1], -1)
            found[name].append(flat[:, rng.integers(0, flat.shape[1], per_image)])
    return {name: np.concatenate(parts, 1) for name, parts in found.items()}
