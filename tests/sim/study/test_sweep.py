"""sim.study.sweep: what is worked out is kept, on this machine and on a cluster."""

import os
import signal
import subprocess
import sys
from time import monotonic, sleep

import pytest

from sim.errors import InputError
from sim.study import sweep as sweeping
from sim.study.sweep import sweep
from tests.sim.study.counted import square

distributed = pytest.importorskip("distributed")

COMMAND = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background has none
from sim.study.sweep import sweep
from tests.sim.study.counted import square
if __name__ == "__main__":
    cells = [{"number": n, "folder": FOLDER, "seconds": 60 * (n > 1)} for n in range(4)]
    sweep(square, cells)
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Where work leaves its traces; results are kept beside it."""
    monkeypatch.setenv("BKDTREE_CACHE", str(tmp_path / "cache"))
    (tmp_path / "traces").mkdir()
    return tmp_path / "traces"


@pytest.fixture(scope="module")
def cluster():
    """A Dask cluster that is not the sweep's own."""
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=":0") as own:
        yield own.scheduler_address


def cells_of(folder, *numbers) -> list[dict]:
    return [{"number": number, "folder": str(folder)} for number in numbers]


def traces(folder) -> int:
    return len(list(folder.iterdir()))


def test_results_come_in_order_and_are_kept(folder):
    counts = []
    first = sweep(square, cells_of(folder, 3, -1, 2), done=counts.append)
    assert first == [{"square": 9}, {"refused": "-1 is below 0"}, {"square": 4}]
    assert counts == [0, 1, 2, 3] and traces(folder) == 2
    again = sweep(square, cells_of(folder, 2, 5, 3))
    assert again == [{"square": 4}, {"square": 25}, {"square": 9}]
    assert traces(folder) == 3, "only the new one is worked out"


def test_on_a_cluster(folder, cluster):
    assert sweep(square, cells_of(folder, 7, 8), scheduler=cluster) == [
        {"square": 49},
        {"square": 64},
    ]
    assert traces(folder) == 2


def test_a_cluster_of_other_sources_is_refused(folder, cluster, monkeypatch):
    monkeypatch.setattr(sweeping, "PACKAGES", ("sim",))  # here; workers have all of them
    with pytest.raises(InputError, match=r"worker tcp://.* has another version of bkdtree"):
        sweep(square, cells_of(folder, 9), scheduler=cluster)
    assert traces(folder) == 0


def test_no_scheduler_answers(folder, monkeypatch):
    monkeypatch.setattr(sweeping, "CONNECTING", 0.5)
    with pytest.raises(InputError, match="tcp://127.0.0.1:1: no Dask scheduler answers there"):
        sweep(square, cells_of(folder, 9), scheduler="tcp://127.0.0.1:1")


def test_a_sweep_that_is_interrupted_goes_on_where_it_was(folder):
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    code = f"FOLDER = {str(folder)!r}\n{COMMAND}"
    file = folder.parent / "command.py"
    file.write_text(code)
    kept = folder.parent / "cache" / "cells"
    with subprocess.Popen(
        [sys.executable, file], env=environment, start_new_session=True, stderr=subprocess.DEVNULL
    ) as process:
        begin = monotonic()
        while not kept.exists() or len(list(kept.glob("*.json"))) < 2:
            assert process.poll() is None and monotonic() - begin < 60
            sleep(0.1)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does
        assert process.wait(20) != 0
    done = traces(folder)
    cells = [{"number": n, "folder": str(folder), "seconds": 60 * (n > 1)} for n in range(2)]
    assert sweep(square, cells) == [{"square": 0}, {"square": 1}]
    assert done == traces(folder) == 2
