"""`bkd-sim fit`."""

from dataclasses import fields, replace
from pathlib import Path

from hdl.config import TWO_LEVEL, Config
from sim.command import Parser, checked, command_line, format_of, size_of
from sim.configuration import write_config
from sim.console import print_tables, print_text, progress, table
from sim.divide.divided import divide
from sim.errors import InputError
from sim.files import check_writable, write_json
from sim.options import frames_of, json_argument, scene_of, source_arguments
from sim.parts.analyse import analyse
from sim.scene.normalise import normalise
from sim.study.fit import Tried, fit, frame_cycles, narrowest
from sim.study.hardware import FORMATS, MEASURED, read_hardware

EXAMPLE = "fit room -o room-machine.json"
SIZE = "240x180"


def arguments(parser: Parser):
    """Options of the command."""
    source_arguments(parser)
    add = parser.add_argument
    text = "share of pixels that may be wrong; %(default)g"
    add("--error", metavar="E", type=float, default=0.001, help=text)
    text = "float formats to try, exponent and mantissa bits; ten from 5,8 to 8,23"
    add("--formats", metavar="E,M", nargs="+", default=FORMATS, help=text)
    add("--size", metavar="WxH", default=SIZE, help="of images, in pixels; %(default)s")
    add("--frames", metavar="A:B", help="frames A to B - 1, or one frame; all")
    rays = parser.add_mutually_exclusive_group()
    text = "keep the way of rays from memory, for shadows"
    rays.add_argument("--shadows", action="store_true", help=text)
    text = "all rays come from memory, as in bkd-sim replay: leave the camera out"
    rays.add_argument("--no-camera", action="store_true", help=text)
    text = "images a second that are enough, for a machine folded to fewer units; %(default)g"
    add("--rate", metavar="N", type=float, default=24, help=text)
    add(
        "--clock",
        metavar="MHZ",
        type=float,
        help="of the machine; that of its float format, if it is known",
    )
    text = "write the configuration to FILE, for -c of all commands"
    add("-o", "--out", metavar="FILE", type=Path, help=text)
    json_argument(parser)


def run(options) -> int:
    """Derive the smallest machine that a scene needs, and say what it leaves out."""
    check_writable(options.out, options.json)
    size = size_of(options.size, SIZE)
    if not 0 <= options.error <= 1:
        raise InputError(f"--error {options.error:g}: give a share of pixels, from 0 to 1")
    for name in ("rate", "clock"):
        value = getattr(options, name)
        if value is not None and not 0 < value < float("inf"):
            raise InputError(f"--{name} {value:g}: give a number above 0")
    formats = [format_of(text, "--formats") for text in options.formats]
    for fmt in formats:
        checked(replace, TWO_LEVEL, fmt=fmt)
    with progress() as bar:
        task = bar.add_task("reading the scene", total=None)

        def step(text):
            bar.update(task, description=text)

        scene = scene_of(options)
        frames = (options.frames and frames_of(options.frames, scene.frames)) or None
        normalised = normalise(scene, frames)
        analysis = analyse(normalised.scene, normalised.frames, step=step)
        step("trying formats")
        chosen, tried = narrowest(
            scene,
            analysis,
            formats,
            options.error,
            size,
            lambda of: step(f"trying formats: {of.fmt} tried"),
        )
        step("compiling")
        whole = replace(TWO_LEVEL, fmt=chosen)
        prepared = divide(scene, whole, frames=frames, analysis=analysis, step=step)
        best = next(of for of in tried if of.fmt == chosen)
        known = read_hardware(MEASURED).figures(str(chosen))
        clock = options.clock or known["clock_mhz"]
        assumed = not (options.clock or known["clock_measured"])
        rates = {
            folded: 1e6 * clock / frame_cycles(prepared, best, folded, shadows=options.shadows)
            for folded in (False, True)
        }
        folded = rates[True] >= options.rate
        source = options.shadows or options.no_camera
        config = fit(prepared, size, camera=not options.no_camera, source=source, folded=folded)
    command = command_line()
    about = {"scene": scene.name, "error": options.error, "size": list(size), "command": command}
    if options.out:
        write_config(options.out, config, about)
    figures = {
        "about": about,
        "formats": [
            {"format": str(of.fmt), "wrong": of.wrong, "refused": of.reason} for of in tried
        ],
        "clock_mhz": clock,
        "images_per_second": {"all units": rates[False], "folded": rates[True]},
        "config": {f.name: str(getattr(config, f.name)) for f in fields(Config)},
    }
    write_json(options.json, figures)
    print_tables(_formats(tried), _parameters(config))
    print_text(_conclusion(scene.name, best.wrong or 0.0, config))
    text = f"{clock:g} MHz" + (", a clock that is assumed" if assumed else "")
    print_text(_speed(size, text, rates, options.rate))
    if options.out:
        print_text(f"{options.out}: the configuration, for -c of all commands")
    return 0


def _formats(tried: list[Tried]):
    rows = [
        (
            str(of.fmt),
            str(of.fmt.bits),
            "refused" if of.wrong is None else f"{100 * of.wrong:.2g} %",
        )
        for of in tried
    ]
    return table("Float formats, by the model", rows, header=("format", "bits", "pixels wrong"))


def _parameters(config: Config):
    """What is not as in the full machine."""
    rows = [
        (field.name, str(getattr(TWO_LEVEL, field.name)), str(getattr(config, field.name)))
        for field in fields(Config)
        if getattr(config, field.name) != getattr(TWO_LEVEL, field.name)
    ]
    return table("The machine", rows, header=("", "with all", "fitted"))


def _conclusion(name: str, wrong: float, config: Config) -> str:
    units = {
        "update processor": config.update,
        "transformation unit": config.instances,
        "camera": config.camera,
        "rays from memory": config.source,
    }
    left = [unit for unit, there in units.items() if not there]
    out = f"; left out: {', '.join(left)}" if left else ""
    fmt = config.fmt
    return f"{name}: {fmt.bits} bits ({fmt}) get {100 * wrong:.2g} % of pixels wrong{out}."


def _speed(size: tuple[int, int], clock: str, rates: dict[bool, float], wanted: float) -> str:
    folded = rates[True] >= wanted
    if folded:
        verdict = f"; {_count(wanted)} are enough: units take turns"
    elif rates[False] >= wanted:
        verdict = f"; {_count(wanted)} are wanted: all units are there"
    else:
        verdict = f"; {_count(wanted)} are wanted, and these are all units"
    width, height = size
    images = f"{_count(rates[folded])} images of {width} x {height} a second"
    return f"About {images} at {clock}{verdict}."


def _count(number: float) -> str:
    return f"{number:,.0f}" if number >= 100 else f"{number:.3g}"
