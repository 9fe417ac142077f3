"""Draws single episodes that `./breakshot bench singulation --tables FILE` wrote: where the discs stood before each stroke, the stroke, what was expected, and the end."""

import json
import pathlib

import matplotlib.pyplot as plt

ROWS = 4
MOST_STEPS = 4  # pictures of strokes in a row, besides the end; a longer episode shows its first ones


def chosen(episodes):
    """The failures and the slowest first, then the median one: what a reader should see, not what looks best."""
    by_time = sorted(episodes, key=lambda e: (e["success"], -e["time_s"]))
    median = sorted(episodes, key=lambda e: e["time_s"])[len(episodes) // 2]
    return [*[e for e in by_time if e is not median][: ROWS - 1], median]


def draw_discs(axes, discs):
    for disc in discs:
        colour = [c / 255.0 for c in disc["rgb"]]
        axes.add_patch(plt.Circle(disc["p_WD_m"], disc["radius_m"], facecolor=colour, edgecolor="black", linewidth=0.5, alpha=0.85 if disc["on_table"] else 0.25))


def draw_stroke(axes, step):
    stroke = step["stroke"]
    start, direction = stroke["p_WS_m"], stroke["direction_W"]
    reach = max(stroke["length_m"], 0.03) if stroke["kind"] == "push" else 0.06
    # A hit's arrow ends where the striker meets the disc, a push's begins where the line begins.
    tail = start if stroke["kind"] == "push" else [s - reach * d for s, d in zip(start, direction)]
    head = [t + reach * d for t, d in zip(tail, direction)]
    axes.annotate("", xy=head, xytext=tail, arrowprops={"arrowstyle": "-|>", "linewidth": 1.4})
    for place in step["predicted_p_WD_m"]:
        axes.plot(*place, "+", color="dimgrey", markersize=5, markeredgewidth=0.8)


def frame(axes, region, title):
    x_min, x_max, y_min, y_max = region
    axes.add_patch(plt.Rectangle((x_min, y_min), x_max - x_min, y_max - y_min, fill=False, linestyle=":", linewidth=0.8))
    axes.set_xlim(x_min - 0.04, x_max + 0.04)
    axes.set_ylim(y_min - 0.04, y_max + 0.04)
    axes.set_aspect("equal")
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_title(title, fontsize=8)


def draw(file: pathlib.Path, path: pathlib.Path, strategy: str) -> None:
    """One row per episode of that strategy; "+": where the virtual world expected the discs to rest. Raises KeyError for a file of another kind."""
    episodes = [e for e in json.loads(file.read_text(encoding="utf-8")) if e["strategy"] == strategy and e["steps"]]
    if not episodes:
        raise ValueError(f"no episode of strategy {strategy} with a stroke in {file}")
    rows = chosen(episodes)
    columns = min(MOST_STEPS, max(len(e["steps"]) for e in rows)) + 1
    figure, grid = plt.subplots(len(rows), columns, figsize=(2.3 * columns, 2.45 * len(rows)), squeeze=False)
    for axes_row, episode in zip(grid, rows):
        for number, axes in enumerate(axes_row[:-1]):
            if number >= len(episode["steps"]):
                axes.axis("off")
                continue
            step = episode["steps"][number]
            draw_discs(axes, step["discs"])
            draw_stroke(axes, step)
            speed = f" {step['stroke']['speed_mps']:.2f} m/s" if step["stroke"]["kind"] == "hit" else ""
            frame(axes, episode["region_m"], f"{number + 1} of {len(episode['steps'])}: {step['stroke']['kind']}{speed}")
        end = axes_row[-1]
        draw_discs(end, episode["end"])
        frame(end, episode["region_m"], f"{episode['formation']} {episode['index']}: {episode['ended']}, {episode['time_s']:.2f} s")
    figure.tight_layout()
    figure.savefig(path, dpi=90)
    plt.close(figure)
