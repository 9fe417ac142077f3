"""Starts a whole cell in lockstep, with the ROS gateway, on DDS domains of its own, and takes it down."""

import os
import pathlib
import signal
import subprocess
import tempfile
import time

SOURCE = pathlib.Path(__file__).resolve().parents[2]
PROCESSES = ["sim_bridge", "controller", "perception", "planner", "mes_gateway", "ros_gateway"]


class Cell:
    """A running cell; use it in a `with` block."""

    def __init__(self, binaries, formation="A"):
        slot = 3 * (os.getpid() % 11)
        self.cell_domain, self.mes_domain, self.ros_domain = 40 + slot, 41 + slot, 42 + slot
        self._arguments = ["--config", str(SOURCE / "config/cell.yaml")]
        for override in [
            "cell.mode=lockstep",
            f"cell.dds.cell_domain={self.cell_domain}",
            f"cell.dds.mes_domain={self.mes_domain}",
            f"cell.dds.ros2_domain={self.ros_domain}",
            f"sim_bridge.formation={formation}",
        ]:
            self._arguments += ["--set", override]
        self._binaries = pathlib.Path(binaries)
        self._running = []
        self._log = tempfile.TemporaryFile(mode="w+")

    def __enter__(self):
        for name in PROCESSES:
            command = [str(self._binaries / f"breakshot-{name}"), *self._arguments]
            self._running.append(subprocess.Popen(command, stdout=self._log, stderr=subprocess.STDOUT))
        return self

    def __exit__(self, *_):
        for process in reversed(self._running):
            process.send_signal(signal.SIGTERM)
        for process in reversed(self._running):
            try:
                process.wait(timeout=10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

    def logs(self):
        """The last lines of all processes, for the message of a test that failed."""
        self._log.seek(0)
        return "".join(self._log.readlines()[-80:])


def wait_for(condition, seconds):
    """Polls until `condition` returns something true, and returns it; None after `seconds`."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        result = condition()
        if result:
            return result
        time.sleep(0.02)
    return None
