"""Ctrl-C keeps what was rendered; kill -9 leaves nothing that looks finished."""
import signal
import time
import unittest

from support import CHEAP, CliTest, makeMovie, packetTable, probe


class Interrupts(CliTest):
    @classmethod
    def makePlates(cls):
        makeMovie(cls.folder / "long.mp4", seconds=60)

    def interruptOnceRunning(self, output, how, *arguments):
        """Starts a render of 1500 frames, sends the signal once frames are being written; exit code, standard error."""
        # Enough rain that 1500 frames take many seconds even on a fast machine.
        process = self.start("rain", "long.mp4", "-o", output, "--strokes", "30000", *CHEAP, *arguments)
        deadline = time.monotonic() + 60
        while process.poll() is None and time.monotonic() < deadline:
            if (self.folder / (output % 5)).exists() if "%" in output else self.leftovers():
                break
            time.sleep(0.02)
        time.sleep(0.7)
        self.assertIsNone(process.poll(), "it was over before the signal came")
        process.send_signal(how)
        _, said = process.communicate(timeout=60)
        return process.returncode, said.decode()

    def checkMovie(self, output, code, said):
        self.assertEqual(code, 130, said)
        self.assertIn("stopped on request after frame", said)
        last = int(said.rsplit("after frame ", 1)[1].split(";")[0])
        picture = probe(self.folder / output)
        self.assertEqual(int(picture["nb_read_frames"]), last + 1)
        self.assertLess(last, 1499)
        self.assertGreater(len(packetTable(self.folder / output, "a:0")), 0)
        self.assertEqual(self.leftovers(), [])

    def test_ctrlCLeavesAMovieThatPlays(self):
        self.checkMovie("stopped.mp4", *self.interruptOnceRunning("stopped.mp4", signal.SIGINT))

    def test_terminateAsWell(self):
        self.checkMovie("ended.mov", *self.interruptOnceRunning("ended.mov", signal.SIGTERM))

    def test_ctrlCLeavesWholeFrames(self):
        code, said = self.interruptOnceRunning("stop.%04d.png", signal.SIGINT)
        self.assertEqual(code, 130, said)
        last = int(said.rsplit("after frame ", 1)[1].split(";")[0])
        files = sorted(self.folder.glob("stop.*.png"))
        self.assertEqual([f.name for f in files], [f"stop.{i:04d}.png" for i in range(last + 1)])
        self.assertEqual(probe(files[-1])["nb_read_frames"], "1")
        self.assertEqual(self.leftovers(), [])

    def test_killLeavesNothingUnderTheFinalName(self):
        code, _ = self.interruptOnceRunning("killed.mp4", signal.SIGKILL)
        self.assertEqual(code, -signal.SIGKILL)
        self.assertFalse((self.folder / "killed.mp4").exists())
        # The next run of the same name takes the temporary file's place and leaves none.
        self.succeeds("rain", "long.mp4", "-o", "killed.mp4", "--frames", "0-4", *CHEAP)
        self.assertEqual(probe(self.folder / "killed.mp4")["nb_read_frames"], "5")
        self.assertEqual(self.leftovers(), [])


if __name__ == "__main__":
    unittest.main()
