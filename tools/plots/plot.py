#!/usr/bin/env python3
"""Draws what benchmarks wrote: PNG files for docs/ or a report. Of `./breakshot bench singulation` (or `paper`):

  times.png        mean time of each strategy, beside the means that the paper gives for its own robot (its Fig. 14)
  distribution.png share of the episodes that are singulated by a time, and how many strokes they took
  reliability.png  predicted P(singulated) of the strokes beside how often it came true
  learning.png     how far what was learnt of mu and e is from the truth, stroke by stroke
  episodes.png     the failed and slowest episodes and the median one, stroke by stroke
and of `./breakshot bench strokes`:
  stroke_map.png   strokes accepted and their achieved errors over the workspace
"""

import argparse
import csv
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import stroke_map
import tables

# Appl. Sci. 2021, 11, 7327, Sec. 6: seconds, three cases, without its parameters. Another robot: only ratios compare.
PAPER = {"paper": 4.5, "random_hybrid": 11.16, "random_push": 24.5}
COLOURS = {"robust": "#1a7f4e", "paper": "#2b5fa8", "random_hybrid": "#c98a1b", "random_push": "#a8432b"}
ORDER = list(COLOURS)
FAILURE_S = 60.0


def read(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def by_strategy(rows):
    groups = {}
    for row in rows:
        groups.setdefault(row["strategy"], []).append(row)
    return {name: groups[name] for name in sorted(groups, key=lambda n: ORDER.index(n) if n in ORDER else len(ORDER))}


def mean(values):
    return sum(values) / len(values)


def label_bars(axes, bars):
    axes.bar_label(bars, fmt="%.2f s", padding=2, fontsize=8)


def times(groups, out):
    figure, (ours, papers) = plt.subplots(1, 2, figsize=(9, 3.4))
    names = list(groups)
    label_bars(ours, ours.bar(names, [mean([float(r["time_s"]) for r in groups[n]]) for n in names], color=[COLOURS.get(n, "grey") for n in names]))
    ours.set_title(f"this cell, {len(next(iter(groups.values())))} episodes each (a failure counts {FAILURE_S:.0f} s)", fontsize=9)
    label_bars(papers, papers.bar(list(PAPER), list(PAPER.values()), color=[COLOURS[n] for n in PAPER]))
    papers.set_title("the paper's robot, its Fig. 14", fontsize=9)
    for axes in (ours, papers):
        axes.set_ylabel("mean time to singulate, s")
        axes.margins(y=0.15)
        axes.tick_params(axis="x", labelsize=8)
    save(figure, out / "times.png")


def distribution(groups, out):
    figure, (when, strokes) = plt.subplots(1, 2, figsize=(9, 3.4))
    most = 1
    for name, rows in groups.items():
        done = sorted(float(r["time_s"]) for r in rows if r["success"] == "1")
        share = [(i + 1) / len(rows) for i in range(len(done))]
        when.step([0.0, *done], [0.0, *share], where="post", label=name, color=COLOURS.get(name, "grey"))
        counts = [int(r["hits"]) + int(r["pushes"]) for r in rows]
        most = max(most, *counts)
        strokes.hist(counts, bins=range(1, most + 2), align="left", histtype="step", label=name, color=COLOURS.get(name, "grey"))
    when.set_xlabel("time of the cell, s")
    when.set_ylabel("share singulated")
    when.set_ylim(0.0, 1.02)
    when.legend(fontsize=8)
    strokes.set_xlabel("strokes")
    strokes.set_ylabel("episodes")
    save(figure, out / "distribution.png")


def reliability(strokes, out):
    figure, axes = plt.subplots(figsize=(4.2, 4.0))
    axes.plot([0, 1], [0, 1], color="grey", linewidth=0.8)
    for name, rows in by_strategy(strokes).items():
        bins = {}
        for row in rows:
            predicted = float(row["p_singulated"])
            bins.setdefault(min(9, int(10 * predicted)), []).append((predicted, int(row["singulated"])))
        points = [(mean([p for p, _ in v]), mean([s for _, s in v]), len(v)) for _, v in sorted(bins.items())]
        axes.plot([p for p, _, _ in points], [s for _, s, _ in points], color=COLOURS.get(name, "grey"), linewidth=0.8, label=f"{name} ({len(rows)} strokes)")
        axes.scatter([p for p, _, _ in points], [s for _, s, _ in points], s=[8 + 120 * n / len(rows) for _, _, n in points], color=COLOURS.get(name, "grey"))
    axes.set_xlabel("predicted P(singulated)")
    axes.set_ylabel("came true")
    axes.legend(fontsize=8)
    save(figure, out / "reliability.png")


def learning(strokes, out):
    """Bands hold half and nine tenths of the episodes. Errors of an honest posterior are within two of its sigmas in 95 % of them."""
    figure, grid = plt.subplots(1, 2, figsize=(9, 3.4))
    for axes, quantity, name in zip(grid, ("mu", "e"), ("mu, disc on table", "e, disc on disc")):
        by_number = {}
        for row in strokes:
            by_number.setdefault(int(row["stroke"]), []).append(row)
        numbers = [n for n in sorted(by_number) if len(by_number[n]) >= 20]
        errors = {n: sorted(100.0 * (float(r[quantity + "_learnt"]) / float(r[quantity]) - 1.0) for r in by_number[n]) for n in numbers}
        at = lambda n, share: errors[n][min(len(errors[n]) - 1, int(share * len(errors[n])))]
        for low, high, alpha in ((0.05, 0.95, 0.15), (0.25, 0.75, 0.3)):
            axes.fill_between(numbers, [at(n, low) for n in numbers], [at(n, high) for n in numbers], color=COLOURS["robust"], alpha=alpha, linewidth=0)
        axes.plot(numbers, [at(n, 0.5) for n in numbers], color=COLOURS["robust"], marker="o", markersize=4)
        axes.axhline(0.0, color="grey", linewidth=0.8)
        for n in numbers:
            rows = by_number[n]
            within = mean([abs(float(r[quantity + "_learnt"]) - float(r[quantity])) <= 2.0 * float(r[quantity + "_sigma"]) for r in rows])
            axes.annotate(f"{100.0 * within:.0f} %", (n, at(n, 0.95)), textcoords="offset points", xytext=(0, 4), ha="center", fontsize=7)
        axes.set_xticks(numbers)
        axes.set_xlabel("strokes seen", fontsize=8)
        axes.set_ylabel("learnt over true - 1, %", fontsize=8)
        axes.set_title(f"{name}; above the bands: share of truths within 2 sigma", fontsize=8)
        axes.margins(y=0.15)
    save(figure, out / "learning.png")


def save(figure, path):
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)
    print(f"wrote {path}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=pathlib.Path, help="the file of --csv")
    parser.add_argument("--strokes", type=pathlib.Path, help="the file of --strokes-csv")
    parser.add_argument("--map", type=pathlib.Path, help="the file of ./breakshot bench strokes --json")
    parser.add_argument("--tables", type=pathlib.Path, help="the file of --tables")
    parser.add_argument("--strategy", default="robust", help="whose episodes --tables draws; default: %(default)s")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("."), help="folder for the pictures; default: here")
    arguments = parser.parse_args()
    if not (arguments.episodes or arguments.strokes or arguments.map or arguments.tables):
        parser.error("give --episodes, --strokes, --tables or --map")
    try:
        arguments.out.mkdir(parents=True, exist_ok=True)
        if arguments.episodes:
            episodes = by_strategy(read(arguments.episodes))
            times(episodes, arguments.out)
            distribution(episodes, arguments.out)
        if arguments.strokes:
            strokes = read(arguments.strokes)
            shown = [s for s in strokes if s["strategy"] == "robust"] or strokes
            reliability(shown, arguments.out)
            learning(shown, arguments.out)
        if arguments.tables:
            tables.draw(arguments.tables, arguments.out / "episodes.png", arguments.strategy)
            print(f"wrote {arguments.out / 'episodes.png'}")
        if arguments.map:
            stroke_map.draw(arguments.map, arguments.out / "stroke_map.png")
            print(f"wrote {arguments.out / 'stroke_map.png'}")
    except (OSError, KeyError, ValueError, StopIteration) as error:
        print(f"plot: {type(error).__name__}: {error}; expected the files of ./breakshot bench singulation --csv FILE --strokes-csv FILE --tables FILE and of bench strokes --json FILE", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
