"""Draws the sample photograph leaf.jpg: a dark leaf on paper, lit from one side, with noise.

    python samples/make_photo.py [FOLDER]

Its bytes depend on the version of the JPEG library, so that the file of the repository stands as
it is; the picture does not.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFilter

WIDTH, HEIGHT, TIMES = 480, 320, 4
"""Pixels of the photograph, and how many times finer it is drawn."""

NOISE = 5.0


def outline() -> list[tuple[float, float]]:
    """A leaf with a toothed edge and a stalk, in pixels."""
    along = np.linspace(0.0, 1.0, 400)
    half = 105.0 * np.sin(np.pi * along**0.8) ** 0.9
    half *= 1.0 + 0.10 * np.abs(np.sin(14.0 * np.pi * along))
    x = 70.0 + 330.0 * along
    upper = [(a, 160.0 - b) for a, b in zip(x, half, strict=True)]
    lower = [(a, 160.0 + b) for a, b in zip(x, half, strict=True)]
    stalk = [(400.0, 154.0), (455.0, 148.0), (455.0, 160.0), (400.0, 166.0)]
    return [*upper, *stalk, *lower[::-1]]


def main(folder: Path) -> None:
    """Write the photograph into the folder."""
    size = (WIDTH * TIMES, HEIGHT * TIMES)
    leaf = Image.new("L", size, 0)
    points = [(x * TIMES, y * TIMES) for x, y in outline()]
    ImageDraw.Draw(leaf).polygon(points, fill=255)
    shape = leaf.resize((WIDTH, HEIGHT), Image.Resampling.BOX)
    shape = shape.filter(ImageFilter.GaussianBlur(0.8))
    dark = np.asarray(shape, dtype=np.float64) / 255.0
    x, y = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    light = 232.0 - 30.0 * np.hypot(x / WIDTH - 0.3, y / HEIGHT - 0.3)
    grey = light * (1.0 - dark) + (52.0 + 20.0 * np.sin(x / 37.0)) * dark
    grey += np.random.default_rng(7).normal(0.0, NOISE, grey.shape)
    Image.fromarray(grey.clip(0.0, 255.0).astype(np.uint8)).save(folder / "leaf.jpg", quality=88)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
