"""`bkd-sim replay`."""

from dataclasses import replace
from pathlib import Path

from sim.cli.parser import memory_arguments, ray_config_of, timing_of
from sim.command import Parser
from sim.configuration import config_argument
from sim.console import conclude, progress
from sim.errors import InputError
from sim.files import check_writable
from sim.options import json_argument
from sim.report.recording import load
from sim.report.replay import measure_replay
from sim.report.tables import replay_tables

EXAMPLE = "replay walker-rays.npz --memory banks"


def arguments(parser: Parser):
    """Options of the command."""
    text = "written by bkd-sim render --record"
    parser.add_argument("recording", metavar="RAYS.npz", type=Path, help=text)
    config_argument(parser, default=None)
    memory_arguments(parser)
    json_argument(parser)


def run(options) -> int:
    """Trace recorded rays again, by Verilog, model and float64 oracle; sort what differs."""
    check_writable(options.json)
    config = ray_config_of(options)
    timing = timing_of(options, config)
    with progress() as bar:
        task = bar.add_task("reading the rays", total=None)
        recording = load(options.recording)
        if options.config and config.fmt != recording.fmt:
            raise InputError(
                f"{options.recording}: its floats are {recording.fmt} and those of "
                f"{options.config} are {config.fmt}: use one whose fmt is {recording.fmt}"
            )
        prepared = recording.prepare(replace(config, fmt=recording.fmt))
        bar.update(task, total=len(recording.rays.t_min))
        report = measure_replay(
            recording,
            prepared,
            timing,
            step=lambda text: bar.update(task, description=text),
            tick=lambda ended: bar.update(task, completed=ended),
        )
    conclude(replay_tables(report), options.json, report.as_dict(), report.mismatches_shown)
    return 1 if report.mismatches else 0
