"""A second DDS implementation takes part: Cyclone DDS reads the standard topics, sends an order and follows it to its end."""

import os
import sys
import time
import unittest
import uuid

# Loopback only, like the cell. Cyclone reads this when the first participant is made.
os.environ["CYCLONEDDS_URI"] = (
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces></General></Domain></CycloneDDS>'
)

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

import wire_types as wire
from cell import Cell, wait_for

BINARIES = sys.argv.pop()

RELIABLE = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.Durability.Volatile, Policy.History.KeepLast(64))
LATCHED = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.Durability.TransientLocal, Policy.History.KeepLast(1))
PATIENCE_S = float(os.environ.get("BREAKSHOT_PATIENCE_S", "120"))  # a loaded machine takes its time; nothing here asserts how fast


def take_one(reader, seconds=PATIENCE_S):
    return wait_for(lambda: (reader.take(1) or [None])[0], seconds)


class CycloneDds(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.cell = Cell(BINARIES)
        cls.cell.__enter__()
        cls.addClassCleanup(cls.cell.__exit__)

    def setUp(self):
        self.mes = DomainParticipant(self.cell.mes_domain)
        self.ros = DomainParticipant(self.cell.ros_domain)
        self.commands = DataWriter(self.mes, Topic(self.mes, "rt/mes/command", wire.JobCommand), qos=RELIABLE)
        self.acks = DataReader(self.mes, Topic(self.mes, "rt/mes/ack", wire.CommandAck), qos=RELIABLE)
        self.jobs = DataReader(self.mes, Topic(self.mes, "rt/mes/job", wire.JobState), qos=LATCHED)
        self.seq = 0
        self.session = time.time_ns()

    def command(self, verb, order, min_gap=0.0):
        self.seq += 1
        header = wire.MsgHeader(1, 1, 0, [7] * 16, self.session, self.seq, time.time_ns())
        spec = wire.JobSpec(min_gap, [0.0] * 4, 0, 0, 0, 0, 1.0)
        return wire.JobCommand(1, header, list(uuid.uuid4().bytes), order, 0, verb, 0, 0, 0, "cyclone", spec)

    def send(self, command):
        """Sends until the ack comes, as docs/mes.md asks of an MES."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            self.commands.write(command)
            ack = wait_for(lambda: next((a for a in self.acks.take(64) if bytes(a.command_id) == bytes(command.command_id)), None), 0.5)
            if ack:
                return ack
        self.fail("no ack\n" + self.cell.logs())

    def test_an_order_is_refused_with_its_reason(self):
        ack = self.send(self.command(wire.VerbKind.STORE_AND_START, list(uuid.uuid4().bytes), min_gap=9.0))
        self.assertEqual(ack.verdict, wire.VerdictKind.REJECTED)
        self.assertIn("min_gap_m", ack.text)

    def test_an_order_runs_to_its_end(self):
        order = list(uuid.uuid4().bytes)
        deadline = time.monotonic() + PATIENCE_S
        while True:  # the cell may still be getting ready
            ack = self.send(self.command(wire.VerbKind.STORE_AND_START, order))
            if ack.verdict != wire.VerdictKind.REJECTED or time.monotonic() > deadline:
                break
            time.sleep(0.5)
        # DUPLICATE: the order was taken, but discovery was not done in time for the first ack.
        self.assertIn(ack.verdict, (wire.VerdictKind.ACCEPTED, wire.VerdictKind.DUPLICATE), ack.text + "\n" + self.cell.logs())

        phases = []

        def ended():
            for job in self.jobs.take(64):
                if bytes(job.order_id) == bytes(order):
                    phases.append(job.phase)
                    if job.phase in (wire.JobPhase.ENDED, wire.JobPhase.ABORTED):
                        return job
            return None

        job = wait_for(ended, PATIENCE_S)
        self.assertIsNotNone(job, f"{phases}\n{self.cell.logs()}")
        self.assertEqual(job.phase, wire.JobPhase.ENDED, job.text + "\n" + self.cell.logs())
        self.assertIn(wire.JobPhase.RUNNING, phases)
        self.assertEqual(job.discs_seen, 2)
        self.assertEqual(job.discs_singulated, 2)
        self.assertAlmostEqual(job.progress, 1.0)

    def test_standard_ros2_types_can_be_read(self):
        joints = DataReader(self.ros, Topic(self.ros, "rt/joint_states", wire.RosJointState), qos=RELIABLE)
        images = DataReader(self.ros, Topic(self.ros, "rt/camera/color/image_raw", wire.RosImage), qos=RELIABLE)
        markers = DataReader(self.ros, Topic(self.ros, "rt/scene_markers", wire.MarkerArray), qos=RELIABLE)

        state = take_one(joints)
        self.assertIsNotNone(state, self.cell.logs())
        self.assertEqual(len(state.name), 6)
        self.assertEqual(len(state.position), 6)

        image = take_one(images)
        self.assertIsNotNone(image, self.cell.logs())
        self.assertEqual((image.width, image.height, image.encoding, image.step), (1280, 720, "rgb8", 3840))
        self.assertEqual(len(image.data), 1280 * 720 * 3)

        def with_discs():
            return next((a for a in markers.take(8) if sum(m.ns == "discs" for m in a.markers) == 2), None)

        array = wait_for(with_discs, PATIENCE_S)
        self.assertIsNotNone(array, self.cell.logs())


if __name__ == "__main__":
    unittest.main(verbosity=2)
