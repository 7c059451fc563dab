"""A short form of scripts/stress_server.py: 8 clients in random order, some gone, some malformed."""
import os
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent.parent / "scripts"))
from stress_server import Stress  # noqa: E402


class StressTest(unittest.TestCase):
    def test_every_frame_is_the_command_lines_whoever_else_asks(self):
        report = Stress(os.environ["VIRGA"], requests=320, clients=8, seed=5, device="cpu").report()
        self.assertEqual(report["wrong"], [], report)
        self.assertGreater(report["requests"]["frames compared"], 150, report)
        self.assertGreater(report["requests"]["cancelled"], 5, report)
        self.assertGreater(report["requests"]["malformed"], 5, report)
        self.assertGreater(report["rendered"], 50, report)


if __name__ == "__main__":
    unittest.main()
