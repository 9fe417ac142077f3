#!/usr/bin/env python3
"""Holds the bound of `./breakshot bench strokes` on a push's duration against TOPP-RA itself.

    ./breakshot bench strokes --paths paths.json
    python3 -m venv venv && venv/bin/pip install toppra
    venv/bin/python tests/bench/toppra_check.py paths.json

Not part of the build: toppra is a yardstick here and no dependency.
"""

import json
import sys

import numpy as np
import toppra
import toppra.algorithm
import toppra.constraint

FREE = 1e4  # stands for "no limit" on the way's own acceleration, m/s^2


def least_time(push):
    """TOPP-RA's duration of the path, s: the way itself is a further joint, so that its speed is limited as the push's is."""
    q = np.array(push["q"])
    way = push["step"] * np.arange(len(q))
    path = toppra.SplineInterpolator(way, np.column_stack([q, way]))
    speed = np.append(push["max_speed"], push["speed"])
    acceleration = np.append(np.full(q.shape[1], push["max_acceleration"]), FREE)
    limits = [
        toppra.constraint.JointVelocityConstraint(np.column_stack([-speed, speed])),
        toppra.constraint.JointAccelerationConstraint(np.column_stack([-acceleration, acceleration])),
    ]
    trajectory = toppra.algorithm.TOPPRA(limits, path, gridpoints=way).compute_trajectory(0, 0)
    return trajectory.duration


def main():
    toppra.setup_logging("ERROR")
    with open(sys.argv[1], encoding="utf-8") as file:
        pushes = json.load(file)
    theirs = np.array([least_time(push) for push in pushes])
    ours = np.array([push["bound_s"] for push in pushes])
    planned = np.array([push["planned_s"] for push in pushes])
    print(f"{len(pushes)} pushes")
    print(f"our bound over TOPP-RA's: median {np.median(ours / theirs):.4f}, from {np.min(ours / theirs):.4f} to {np.max(ours / theirs):.4f}")
    print(f"planned over TOPP-RA's:   median {np.median(planned / theirs):.4f}, p90 {np.quantile(planned / theirs, 0.9):.4f}")


if __name__ == "__main__":
    main()
