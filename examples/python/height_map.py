#!/usr/bin/env python3
"""Builds a model of a height map in numpy arrays, draws it, and looks at its points: height_map.py PICTURE.png

Needs the package `pbm` and numpy alone.
"""

import struct
import sys
import zlib

import numpy as np
import pbm


def write_png(path, picture):
    """Writes [height][width][4] uint8 as a PNG."""
    height, width, _ = picture.shape
    rows = np.zeros((height, 1 + 4 * width), np.uint8)  # each begins with its filter, none
    rows[:, 1:] = picture.reshape(height, -1)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)) +
                   chunk(b"IDAT", zlib.compress(rows.tobytes())) + chunk(b"IEND", b""))


def terrain(cells):
    """Vertices, faces, heights and slopes of a square of 100 m with hills."""
    x, z = np.meshgrid(np.linspace(0, 100, cells), np.linspace(0, 100, cells), indexing="ij")
    y = sum(9 / octave**1.6 * np.sin(octave * x / 11 + octave**2) * np.cos(octave * z / 9 - octave + x / 30)
            for octave in range(1, 9))
    corner = np.arange(cells * cells).reshape(cells, cells)
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[:-1, 1:], corner[1:, 1:]
    faces = np.concatenate([np.stack([a, c, b], -1).reshape(-1, 3), np.stack([b, c, d], -1).reshape(-1, 3)])
    slope = np.degrees(np.arctan(np.hypot(*np.gradient(y, 100 / (cells - 1)))))
    return np.stack([x, y, z], -1).reshape(-1, 3), faces, slope.ravel()


def colours_of(heights, slopes):
    """Meadows below, snow above, rock where it is steep: [points][3], sRGB."""
    share = np.clip((heights - heights.min()) / np.ptp(heights), 0, 1)[:, None]
    colours = (1 - share) * (90, 140, 60) + share * (245, 245, 250)
    return np.where(slopes[:, None] > 50, (120, 105, 90), colours).astype(np.uint8)


vertices, faces, slopes = terrain(300)
report = pbm.build(vertices, faces, colours=colours_of(vertices[:, 1], slopes), fields={"slope": slopes},
                   units={"slope": "degrees"}, depth=9, unit="m", up="y", lights="studio", shadows=True)
with report.model as model:
    print(f"{model.info.points} points, {model.info.file_bytes / 1e6:.1f} MB, voxels of {model.info.voxel_size:.3f} m")
    camera = model.default_camera((960, 540)).orbited(-20)
    camera.position += 0.2 * (camera.position - camera.focal_point)  # a corner came nearer
    write_png(sys.argv[1], model.render(camera, (960, 540), quality="fine", background=(255, 255, 255)))
    points = model.points(level=7)
    steep = points["scalar_slope"] > 50
    print(f"level 7: {len(steep)} points, {steep.mean():.0%} of them steeper than 50 degrees, "
          f"highest {points['positions'][:, 1].max():.1f} m")
