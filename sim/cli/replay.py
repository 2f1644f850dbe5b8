"""`bkd-sim replay`."""

import sys
from pathlib import Path

from sim.cli.console import check_writable, print_tables, progress, write_json
from sim.cli.parser import (
    Parser,
    json_argument,
    memory_arguments,
    ray_config_of,
    ray_timing_of,
)
from sim.report.recording import load
from sim.report.replay import measure_replay
from sim.report.tables import replay_tables

EXAMPLE = "replay walker-rays.npz --memory banks"


def arguments(parser: Parser):
    """Options of the command."""
    text = "written by bkd-sim render --record"
    parser.add_argument("recording", metavar="RAYS.npz", type=Path, help=text)
    memory_arguments(parser)
    json_argument(parser)


def run(options) -> int:
    """Trace recorded rays again, by Verilog, model and float64 oracle; sort what differs."""
    check_writable(options.json)
    timing = ray_timing_of(options)
    with progress() as bar:
        task = bar.add_task("reading the rays", total=None)
        recording = load(options.recording)
        form = f"{recording.fmt.exp_bits},{recording.fmt.man_bits}"
        prepared = recording.prepare(ray_config_of(options, form))
        bar.update(task, total=len(recording.rays.t_min))
        report = measure_replay(
            recording,
            prepared,
            timing,
            step=lambda text: bar.update(task, description=text),
            tick=lambda ended: bar.update(task, completed=ended),
        )
    print_tables(*replay_tables(report))
    write_json(options.json, report.as_dict())
    for line in report.mismatches_shown:
        print(line, file=sys.stderr)
    return 1 if report.mismatches else 0
