"""bkd-sim board and bkd-host as their users run them: real processes and a real serial port."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageSequence

from sim.cosim.verilate import simulator

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(simulator() == "icarus", reason="hundreds of times slower"),
]
ENVIRONMENT = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
SIZE = ["--size", "20x15"]
SMALL = "waves:200"


@pytest.fixture(scope="module")
def port():
    """A serial port with the ulx3s behind it, by its pins.

    At 25 MHz, a bit of 3 Mbaud takes half as many cycles to simulate as at 50.
    """
    command = [sys.executable, "-m", "sim", "board", "--pty", "--clock", "25"]
    with subprocess.Popen(command, env=ENVIRONMENT, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process.stdout.readline().strip()
        finally:
            process.send_signal(signal.SIGINT)


def run(*arguments) -> subprocess.CompletedProcess:
    """Run a command of ours to its end."""
    command = [sys.executable, "-m", *map(str, arguments)]
    return subprocess.run(command, env=ENVIRONMENT, capture_output=True, text=True)


def pictures(file: Path) -> list[np.ndarray]:
    with Image.open(file) as image:
        return [np.array(frame.convert("RGB")) for frame in ImageSequence.Iterator(image)]


def test_pictures_are_those_of_the_simulation(port, scene_file, tmp_path):
    fox, folder, animation = scene_file("Fox.glb"), tmp_path / "fox", tmp_path / "fox.png"
    play = ["play", fox, "--frames", "0:4", *SIZE]
    played = run("host", "--port", port, *play, "--out", folder)
    assert (played.returncode, played.stderr) == (0, ""), played.stderr
    rendered = run("sim", "render", fox, "--frames", "0:4", *SIZE, "--out", animation)
    assert rendered.returncode == 0, rendered.stderr
    found = [pictures(file)[0] for file in sorted(folder.iterdir())]
    assert len(found) == 4 and len(np.unique(found[0].reshape(-1, 3), axis=0)) > 10
    assert np.array_equal(found, pictures(animation))


def test_a_host_that_is_killed_leaves_a_board_that_works(port):
    command = [sys.executable, "-m", "host", "--port", port, "upload", SMALL]
    for seconds in (3.0, 4.0):  # in the middle, on most machines
        with subprocess.Popen(command, env=ENVIRONMENT, stderr=subprocess.PIPE) as process:
            time.sleep(seconds)
            process.kill()
        assert run("host", "--port", port, "identify").returncode == 0
    assert run("host", "--port", port, "upload", SMALL).returncode == 0
    verified = run("host", "--port", port, "verify", SMALL)
    assert verified.returncode == 0 and " 0 " in verified.stdout.splitlines()[-2], verified.stdout


def test_a_scene_that_is_too_large_is_refused_at_once(port):
    refused = run("host", "--port", port, "upload", "walker:20k")
    assert refused.returncode == 2 and refused.stderr.count("\n") == 1
    assert "16,384" in refused.stderr and "memory words" in refused.stderr
