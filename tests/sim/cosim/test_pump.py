"""Ports of the simulated board: what clients send comes back, whatever they do."""

import os
import select
import socket
import threading
import time
from contextlib import contextmanager

import pytest
import serial

from hdl.config import TINY
from sim.cosim.board import SimulatedBoard
from sim.cosim.board_bench import DirectBench, PinsBench
from sim.cosim.pump import Pump
from sim.cosim.tcp import TcpPort
from sim.cosim.terminal import Terminal
from sim.cosim.verilate import simulator
from sim.errors import InputError
from tests.pumping import running
from tests.sim.cosim.echo import Echo, EchoBoard

pytestmark = pytest.mark.skipif(simulator() == "icarus", reason="waits for seconds of wall time")
PORTS = {"pty": Terminal, "tcp": lambda: TcpPort("127.0.0.1", 0)}
BAUD = 3e6


@contextmanager
def pumped(port, *, direct: bool = True):
    """A pump that runs, of an echo."""
    if direct:
        bench = DirectBench(Echo())
    else:
        bench = PinsBench(EchoBoard(clock_hz=50e6, baud=BAUD), 50e6 / BAUD)
    with port, SimulatedBoard(TINY, bench=bench) as board, running(Pump(board, port)) as pump:
        yield pump


def opened(port) -> serial.Serial:
    return serial.serial_for_url(port.path, baudrate=115_200, timeout=20)


@pytest.mark.parametrize("direct", [True, False], ids=["direct", "pins"])
@pytest.mark.parametrize("name", PORTS)
def test_bytes_come_back(name, direct, rng):
    port = PORTS[name]()
    given = bytes(range(256)) + rng.bytes(20_000 if direct else 1000)
    with pumped(port, direct=direct) as pump, opened(port) as client:
        client.write(given[:3])
        assert client.read(3) == given[:3]
        writer = threading.Thread(target=client.write, args=(given[3:],))
        writer.start()
        assert client.read(len(given) - 3) == given[3:]
        writer.join()
    assert pump.given == pump.received == len(given)


@pytest.mark.parametrize("name", PORTS)
def test_time_stands_still_while_all_is_idle(name):
    port = PORTS[name]()
    with pumped(port) as pump, opened(port) as client:
        client.write(b"x")
        assert client.read(1) == b"x"
        settled(pump)
        cycles, cpu = pump.board.cycles, time.process_time()
        time.sleep(0.5)
        assert pump.board.cycles == cycles and time.process_time() - cpu < 0.1
        client.write(b"y")
        assert client.read(1) == b"y" and pump.board.cycles > cycles


def settled(pump: Pump):
    """Wait until the board is idle."""
    limit = time.monotonic() + 20
    while not pump.board.idle:
        assert time.monotonic() < limit
        time.sleep(0.01)


@pytest.mark.parametrize("name", PORTS)
def test_clients_come_one_after_the_other(name):
    port = PORTS[name]()
    with pumped(port):
        for given in (b"one", b"another", b"\r\n\x03\x04\x11\x13\x1a\xff\0"):
            with opened(port) as client:
                client.write(given)
                assert client.read(len(given)) == given


def test_a_client_that_breaks_off_harms_no_one():
    with pumped(port := PORTS["tcp"]()) as pump:
        address = port.path.removeprefix("socket://").split(":")
        client = socket.create_connection((address[0], int(address[1])))
        client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
        client.send(b"x" * 5000)
        client.close()  # resets the connection
        settled(pump)
        with opened(port) as client:
            client.write(b"mine")
            assert client.read(4) == b"mine"


def connected(port) -> int:
    """A client, as a file descriptor that does not wait."""
    if isinstance(port, Terminal):
        client = os.open(port.path, os.O_RDWR | os.O_NOCTTY)
    else:
        host, number = port.path.removeprefix("socket://").split(":")
        client = socket.create_connection((host, int(number))).detach()
    os.set_blocking(client, False)
    return client


@pytest.mark.parametrize("name", PORTS)
def test_nothing_is_lost_by_a_slow_reader(name, rng):
    """Who sends until nothing more goes, and only then reads a little, gets all of it."""
    port, given, received = PORTS[name](), rng.bytes(60_000), b""
    with pumped(port) as pump:
        client, left = connected(port), given
        while len(received) < len(given):
            if select.select([], [client] if left else [], [], 0.1)[1]:
                left = left[os.write(client, left) :]
                continue
            if left:  # all is full on the way there and back: time stands still
                cycles = pump.board.cycles
                time.sleep(0.1)
                assert pump.board.cycles == cycles and not pump.board.idle
            assert select.select([client], [], [], 20)[0]
            received += os.read(client, 8000)
        os.close(client)
    assert received == given


def test_an_address_that_is_taken_is_bad_input():
    with TcpPort("127.0.0.1", 0) as port:
        taken = int(port.path.split(":")[-1])
        with pytest.raises(InputError, match=f"--tcp 127.0.0.1:{taken}"):
            TcpPort("127.0.0.1", taken)
