"""`bkd-sim render`."""

from pathlib import Path

from sim.cli.parser import (
    machine_arguments,
    memory_arguments,
    ray_config_of,
    timing_of,
)
from sim.command import Parser, size_of
from sim.console import conclude, print_text, progress
from sim.errors import InputError
from sim.files import check_writable
from sim.options import (
    compiler_of,
    divide_argument,
    frame_of,
    frames_of,
    json_argument,
    picture_of,
    scene_arguments,
    scene_of,
    view_arguments,
)
from sim.report.painter import check_view, painter_for
from sim.report.picture import check_picture_file, save
from sim.report.recording import Recorder
from sim.report.render import Watch, measure_render
from sim.report.scene_view import camera_and_lamp, check_camera
from sim.report.tables import render_tables

EXAMPLE = "render walker --camera whole --shadows"
SIZE = "512x386"


def arguments(parser: Parser):
    """Options of the command."""
    scene_arguments(parser, default="walker")
    divide_argument(parser)
    machine_arguments(parser)
    add = parser.add_argument
    frames = parser.add_mutually_exclusive_group()
    frames.add_argument("--frame", metavar="K", help="one frame; that a third of the way")
    frames.add_argument("--frames", metavar="A:B", help="an animation of frames A to B - 1")
    view_arguments(parser, SIZE)
    add("--shadows", action="store_true", help="cast a ray from each hit to the lamp too")
    memory_arguments(parser)
    add("--out", metavar="FILE", type=Path, help="picture, or animation; the scene's name .png")
    add("--record", metavar="FILE.npz", type=Path, help="keep the rays of a frame, for replay")
    json_argument(parser)


def run(options) -> int:
    """Animate, update and cast rays in the Verilog, check every bit, and write a picture."""
    width, height = size_of(options.size, SIZE)
    check_camera(options.camera)
    check_view(options.view, options.divide)
    config = ray_config_of(options)
    timing = timing_of(options, config)
    out = picture_of(options)
    check_writable(options.json, out, options.record)
    if options.record and options.divide:
        raise InputError(f"--record {options.record}: keeps rays of whole scenes; without --divide")
    if options.record and options.record.suffix != ".npz":
        raise InputError(f"{options.record}: rays are kept as .npz; name a file that ends in it")
    with progress() as bar:
        task = bar.add_task("reading the scene", total=None)

        def step(text):
            bar.update(task, description=text)

        scene = scene_of(options)
        if options.frames:
            frames = frames_of(options.frames, scene.frames)
        else:
            frames = frame_of(options.frame, scene.frames)
        check_picture_file(out, len(frames))
        if options.record and len(frames) > 1:
            raise InputError(f"--record {options.record}: holds one frame; choose it by --frame")
        prepared = compiler_of(options)(scene, config, builder=options.builder, step=step)
        step("choosing the view")
        camera, lamp = camera_and_lamp(options.camera, prepared, frames, width, height)
        painter, recorder = painter_for(options.view, prepared, lamp), Recorder()
        bar.update(task, total=len(frames))
        watch = Watch(
            step=step,
            tick=lambda done: bar.update(task, completed=done),
            paint=painter.paint,
            record=recorder.add if options.record else lambda *_: None,
        )
        report = measure_render(
            prepared, timing, camera, frames, lamp=lamp if options.shadows else None, watch=watch
        )
        save(out, painter.pictures, fps=options.fps or 24.0)
        if options.record:
            recorder.save(options.record)
    conclude(render_tables(report, out), options.json, report.as_dict(), report.mismatches_shown)
    if prepared.advice:
        print_text(prepared.advice)
    return 1 if report.model_mismatches else 0
