"""Options and fixtures that all tests share."""

import importlib
import os
import sys
from pathlib import Path

import numpy as np
import pytest

SCENES = Path(
    os.environ.get("BKDTREE_SCENES", Path(__file__).resolve().parents[2] / "shared" / "scenes")
)


def pytest_addoption(parser):
    parser.addoption("--seed", type=int, default=2006, help="seed of every random test")


def pytest_report_header(config):
    return f"seed: {config.getoption('--seed')} (--seed N sets another)"


@pytest.fixture
def seed(request) -> int:
    return request.config.getoption("--seed")


@pytest.fixture
def rng(seed) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.fixture
def scene_file():
    """Path of a real scene by its file name. Skips where it is missing, except under CI."""

    def find(name: str) -> Path:
        path = SCENES / name
        if not path.exists() and os.environ.get("CI") != "true":
            pytest.skip(f"no {path}")
        return path

    return find


@pytest.fixture
def run(monkeypatch, capsys):
    """Runs a command of ours by its name and arguments: exit code, output and errors."""

    def run(program: str, *arguments) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", [program, *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            importlib.import_module(f"{program.removeprefix('bkd-')}.cli").main()
        assert isinstance(end.value.code, int)
        return (end.value.code, *capsys.readouterr())

    return run
