"""Draws the map over the workspace that `./breakshot bench strokes --json FILE` wrote: per kind of stroke, share accepted and worst achieved error."""

import json
import pathlib

import matplotlib.pyplot as plt
import numpy

QUANTITIES = [
    ("accepted, %", lambda cell: 100.0 * cell["accepted"] / cell["asked"] if cell["asked"] else numpy.nan, "viridis"),
    ("worst contact point, mm", lambda cell: cell["position_mm_max"] if cell["accepted"] else numpy.nan, "magma_r"),
    ("worst speed, %", lambda cell: cell["speed_pct_max"] if cell["accepted"] else numpy.nan, "magma_r"),
]


def draw(file: pathlib.Path, path: pathlib.Path) -> None:
    """One row of maps per kind of stroke; the same scale down each column. Raises KeyError for a file of another benchmark."""
    layers = json.loads(file.read_text(encoding="utf-8"))["metrics"]["map"]
    figure, grid = plt.subplots(len(layers), len(QUANTITIES), figsize=(3.2 * len(QUANTITIES), 2.7 * len(layers)), squeeze=False)
    for column, (title, value, colours) in enumerate(QUANTITIES):
        tables = []
        for layer in layers:
            xs = sorted({cell["x_m"] for cell in layer["cells"]})
            ys = sorted({cell["y_m"] for cell in layer["cells"]})
            table = numpy.full((len(ys), len(xs)), numpy.nan)
            for cell in layer["cells"]:
                table[ys.index(cell["y_m"]), xs.index(cell["x_m"])] = value(cell)
            half = 0.5 * (xs[1] - xs[0])
            tables.append((table, (xs[0] - half, xs[-1] + half, ys[0] - half, ys[-1] + half)))
        known = numpy.concatenate([table[~numpy.isnan(table)] for table, _ in tables])
        top = 100.0 if title.startswith("accepted") else (known.max() if known.size else 1.0)
        for row, (layer, (table, extent)) in enumerate(zip(layers, tables)):
            axes = grid[row][column]
            image = axes.imshow(table, origin="lower", extent=extent, vmin=0.0, vmax=top, cmap=colours)
            axes.set_title(f"{layer['stroke']}: {title}", fontsize=8)
            axes.tick_params(labelsize=7)
            figure.colorbar(image, ax=axes, shrink=0.8).ax.tick_params(labelsize=7)
    for axes in grid[-1]:
        axes.set_xlabel("x, m (the arm's base is at -0.5)", fontsize=7)
    figure.tight_layout()
    figure.savefig(path, dpi=100)
    plt.close(figure)
