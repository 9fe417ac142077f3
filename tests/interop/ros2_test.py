"""A real ROS 2 node (rclpy from PyPI, no ROS environment) reads the standard topics that the ROS gateway publishes."""

import os
import sys
import unittest

from cell import Cell, wait_for

BINARIES = sys.argv.pop()
CELL = Cell(BINARIES)
os.environ["ROS_DOMAIN_ID"] = str(CELL.ros_domain)
os.environ["RMW_IMPLEMENTATION"] = "rmw_fastrtps_cpp"

import rclpy
from sensor_msgs.msg import Image, JointState
from visualization_msgs.msg import Marker, MarkerArray

PATIENCE_S = float(os.environ.get("BREAKSHOT_PATIENCE_S", "120"))  # a loaded machine takes its time


class Ros2(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        CELL.__enter__()
        cls.addClassCleanup(CELL.__exit__)
        rclpy.init()
        cls.addClassCleanup(rclpy.shutdown)
        cls.node = rclpy.create_node("breakshot_reader")
        cls.addClassCleanup(cls.node.destroy_node)

    def newest(self, message_type, topic, good=lambda message: True):
        """The first message on the topic that is good."""
        got = []
        subscription = self.node.create_subscription(message_type, topic, got.append, 10)

        def look():
            rclpy.spin_once(self.node, timeout_sec=0.1)
            return next((message for message in got if good(message)), None)

        message = wait_for(look, PATIENCE_S)
        self.node.destroy_subscription(subscription)
        self.assertIsNotNone(message, f"nothing on {topic}\n{CELL.logs()}")
        return message

    def test_joint_states(self):
        state = self.newest(JointState, "/joint_states")
        self.assertEqual(len(state.name), 6)
        self.assertEqual(len(state.position), 6)
        self.assertIn("elbow_joint", list(state.name))

    def test_image(self):
        image = self.newest(Image, "/camera/color/image_raw")
        self.assertEqual((image.width, image.height, image.encoding), (1280, 720, "rgb8"))
        self.assertEqual(len(image.data), 1280 * 720 * 3)
        self.assertGreater(max(image.data[::997]), 50, "the picture is not black")

    def test_markers(self):
        array = self.newest(MarkerArray, "/scene_markers", lambda a: sum(m.ns == "discs" for m in a.markers) == 2)
        disc = next(m for m in array.markers if m.ns == "discs")
        self.assertEqual(disc.type, Marker.CYLINDER)
        self.assertEqual(disc.header.frame_id, "world")
        self.assertAlmostEqual(disc.scale.x, 0.060, delta=0.003)

    def test_the_graph_names_the_types(self):
        self.newest(JointState, "/joint_states")
        types = dict(self.node.get_topic_names_and_types())
        self.assertEqual(types["/joint_states"], ["sensor_msgs/msg/JointState"])
        self.assertEqual(types["/scene_markers"], ["visualization_msgs/msg/MarkerArray"])


if __name__ == "__main__":
    unittest.main(verbosity=2)
