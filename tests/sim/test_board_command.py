"""bkd-sim board as its users run it: the real board behind a serial port."""

import os
import secrets
import signal
import struct
import subprocess
import sys
import zlib
from contextlib import contextmanager

import pytest
import serial
from cobs import cobs

from hdl.link.protocol import BODY_BYTES, MAGIC, VERSION, Kind
from sim.cosim.verilate import simulator

BAD = {
    "baud": (["--direct", "--baud", "9600"], ["--baud 9600", "--direct"]),
    "fast": (["--baud", "2e7"], ["2e+07 baud"]),
    "slow": (["--baud", "10"], ["10 baud"]),
    "words": (["--words", "1"], ["words"]),
    "more words": (["--words", "1000000"], ["1000000"]),
    "configuration": (["-c", "none"], ["none", "ulx3s"]),
    "both": (["--pty", "--tcp", "0"], ["--tcp"]),
    "port": (["--tcp", "localhost"], ["--tcp localhost", "127.0.0.1:4000"]),
    "no such port": (["--tcp", "99999"], ["--tcp", "99999"]),
    "waves": (["--waves", "a.txt"], ["a.txt", ".fst"]),
    "folder": (["--waves", "no/such/a.fst"], ["a.fst", "written"]),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_line(case, run, tmp_path, monkeypatch):
    arguments, words = BAD[case]
    monkeypatch.chdir(tmp_path)
    code, out, err = run("bkd-sim", "board", *arguments)
    assert (code, out, err.count("\n")) == (2, "", 1), err
    assert err.startswith("bkd-sim: ") and all(word in err for word in words), err


@contextmanager
def simulated(folder, *arguments: str):
    """A board that is simulated, and its serial port."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-m", "sim", "board", "-c", "tiny", *arguments]
    process = subprocess.Popen(
        command,
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        path = process.stdout.readline().strip()
        assert path, process.stderr.read()
        with serial.serial_for_url(path, timeout=20) as port:
            yield process, port
    finally:
        process.kill()
        process.wait()


def ask(port, kind: Kind, session: int, sequence: int, body: bytes) -> bytes:
    """The body of the answer to a command."""
    frame = struct.pack("<BHHH", kind.value, session, sequence, len(body)) + body
    port.write(cobs.encode(frame + zlib.crc32(frame).to_bytes(4, "little")) + b"\0")
    answer = cobs.decode(port.read_until(b"\0")[:-1])
    header, found, crc = answer[:7], answer[7:-4], answer[-4:]
    assert header == struct.pack("<BHHH", Kind.OK.value, session, sequence, len(found))
    assert crc == zlib.crc32(answer[:-4]).to_bytes(4, "little")
    return found


@pytest.mark.slow
@pytest.mark.skipif(simulator() == "icarus", reason="hundreds of times slower")
@pytest.mark.parametrize(
    ("arguments", "end"),
    [
        (["--pty", "--direct"], signal.SIGINT),  # its pins: tests/host/test_processes.py
        (["--tcp", "0", "--direct"], signal.SIGTERM),
    ],
)
def test_it_answers(arguments, end, tmp_path, rng):
    with simulated(tmp_path, *arguments) as (process, port):
        session, words = secrets.randbelow(1 << 16), rng.bytes(5 * 16)
        greeting = ask(port, Kind.HELLO, session, 0, bytes([VERSION]))
        assert greeting == struct.pack("<IBH", MAGIC, VERSION, BODY_BYTES)
        run = struct.pack("<BBIH", 0, 16, 77, 5)
        assert ask(port, Kind.WRITE, session, 1, run + words) == b""
        assert ask(port, Kind.READ, session, 2, struct.pack("<IHBB", 77, 5, 0, 16)) == words
        os.killpg(process.pid, end)  # as a terminal does
        out, err = process.communicate(timeout=20)
    assert process.returncode == 0 and out == ""
    assert all(line.startswith("bkd-sim: ") for line in err.splitlines()), err
    assert f"--port {port.port} identify" in err and "cycles/s" in err.splitlines()[-1]
    assert "past the UART" in err
