"""A simulator in a process of its own, and calls to what serves them inside."""

import shutil
import socket
import tempfile
import threading
from multiprocessing.connection import Connection
from pathlib import Path

from sim.cosim import verilate


class Process:
    """A simulator that runs, until it is closed.

    Parameters
    ----------
    folder : Path
        Of verilate.build.
    server : str
        Module whose test serves calls, by sim.cosim.server.answer.
    waves : Path, optional
        FST file for the waves of the whole run; `folder` was built with them then.

    Raises
    ------
    SimulationError
        The simulator does not start.
    """

    def __init__(self, folder: Path, server: str, waves: Path | None = None):
        self._waves = waves
        self._work = tempfile.TemporaryDirectory(prefix="bkdtree-")
        self._error: Exception | None = None
        path = Path(self._work.name) / "socket"
        with socket.socket(socket.AF_UNIX) as listener:
            listener.bind(str(path))
            listener.listen()
            listener.settimeout(0.1)
            self._thread = threading.Thread(
                target=self._simulate, args=(folder, server, path), daemon=True
            )
            self._thread.start()
            self._connection = self._accept(listener)

    def _simulate(self, folder: Path, server: str, path: Path):
        work = Path(self._work.name)
        try:
            verilate.run(
                folder,
                server,
                work,
                waves=self._waves is not None,
                log=work / "simulator.log",
                BKDTREE_SOCKET=path,
            )
        except Exception as error:
            self._error = error

    def _accept(self, listener: socket.socket) -> Connection:
        while self._thread.is_alive():
            try:
                return Connection(listener.accept()[0].detach())
            except TimeoutError:
                continue
        raise self._error or verilate.SimulationError("the simulator ended before it began")

    def call(self, name: str, *arguments):
        """What a call of the server returns.

        Raises
        ------
        SimulationError
            The call fails, or the simulator has ended.
        """
        try:
            self._connection.send((name, arguments))
            result = self._connection.recv()
        except (EOFError, ConnectionError):
            self._thread.join()
            raise self._error or verilate.SimulationError("the simulator has ended") from None
        if isinstance(result, RuntimeError):
            raise verilate.SimulationError(str(result))
        return result

    def close(self):
        """End the simulator, and keep its waves."""
        self._connection.close()
        self._thread.join()
        waves = Path(self._work.name) / verilate.WAVES
        if self._waves is not None and waves.exists():
            shutil.move(waves, self._waves)
        self._work.cleanup()
