"""A board on a serial port, as a Python object."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from hdl.fp.format import FloatFormat
from hdl.link.protocol import CRC_BYTES, HEADER_BYTES
from hdl.rays.packet import NO_TRIANGLE, RAYS
from hdl.records import word_bits
from host import parts
from host.fit import check_fit, packets_at_once
from host.link.channel import Channel, Progress, silently
from host.link.errors import SessionLost
from host.link.port import BAUD, open_port
from host.link.split import RUN
from host.registers import RegisterMap, Status, check_format, config_in, identification
from host.runner import Runner
from sim.compiler.rays import (
    View,
    camera_fields,
    check_rays,
    hits_of,
    scene_fields,
)
from sim.errors import InputError
from sim.pose import Pose, pose_of
from sim.prepare import Prepared
from sim.report.pixels import camera_rays

ANSWER_BYTES = HEADER_BYTES + CRC_BYTES + 2
"""Of an answer on the line, beside its body."""

INSTRUCTION_CYCLES, RAY_CYCLES, BESIDE = 1_000, 2_000, 10_000_000
"""More than a run takes, of the board's clock: an instruction, a ray, and whatever else."""


class Board:
    """A board: its memory, its registers, and a scene on it. A context manager.

    ::

        with Board.open("/dev/ttyUSB0") as board:
            board.upload(prepare(load_scene("walker:2000"), board.config))
            board.show(8)
            hits = board.render(view)

    Parameters
    ----------
    channel : Channel
    fmt : FloatFormat, optional
        What its floats have to be.
    close : callable
        Closes the port.

    Attributes
    ----------
    values : dict
        The registers that say what it is, by name.
    config : Config
    words : int
        Of its memory.
    clock_hz : int
        0 if it does not say.
    pose : Pose, optional
        The scene that is on it, and its frame.

    Raises
    ------
    LinkError
        Of all methods: names the port, what is wrong and what to do.
    """

    def __init__(
        self,
        channel: Channel,
        fmt: FloatFormat | None = None,
        close: Callable[[], None] = lambda: None,
    ):
        self.channel, self._close = channel, close
        self.values = identification(channel)
        self.config = config_in(self.values, channel.name)
        check_format(self.config, fmt, channel.name)
        self.words = self.values["MEMORY_WORDS"] or 1 << self.config.address_bits
        self.clock_hz = self.values["CLOCK_HZ"]
        self._limbs = word_bits(self.config.fmt) // 32
        self._registers = RegisterMap(channel, self.config)
        self._runner = Runner(self._registers, channel.name)
        self.pose: Pose | None = None
        self._known = False  # the memory holds it

    @classmethod
    def open(cls, url: str, baud: int = BAUD, fmt: FloatFormat | None = None) -> "Board":
        """The board on a port: a device, or any URL of pyserial."""
        port = open_port(url, baud)
        try:
            return cls(Channel(port, name=url), fmt, port.close)
        except BaseException:
            port.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._close()

    def read(
        self,
        address: int,
        count: int,
        first: int = 0,
        size: int | None = None,
        progress: Progress = silently,
    ) -> np.ndarray:
        """Bytes (count, size) of memory words: those from `first` on, all if not said."""
        size = 4 * self._limbs - first if size is None else size
        raw = self.channel.read(address, count, first, size, progress)
        return np.frombuffer(raw, np.uint8).reshape(count, size)

    def write(self, address: int, rows: np.ndarray, first: int = 0, progress: Progress = silently):
        """Write bytes (n, size) of memory words, from byte `first` of each on."""
        rows = np.ascontiguousarray(rows, np.uint8)
        self.channel.write([(address, rows.tobytes())], first, rows.shape[1], progress)

    def status(self) -> Status:
        """How a run goes, or went."""
        return self._registers.status()

    def counters(self) -> dict:
        """What the board has counted: of the last update and cast, and of the link since reset."""
        return self._registers.counters()

    def reset(self) -> bool:
        """Open a new session and stop the run that is under way; whether one was."""
        self.channel.open()
        return self._runner.stop()

    def run(self, job: dict, most_cycles: int) -> dict:
        """Run a job, given by the fields of hdl.core.frame_job. All counters of the board."""
        return self._runner.run(job, most_cycles)

    def upload(self, prepared: Prepared, frame: int | None = None, progress: Progress = silently):
        """Bring a scene to the board, in the pose of a frame: its first if not said.

        Raises
        ------
        InputError
            It does not fit the board: says what, what it needs and what is there.
        """
        first = prepared.frames[0] if frame is None else frame
        self._bring(pose_of(prepared, first), None, progress)

    def show(self, frame: int, progress: Progress = silently) -> dict | None:
        """Bring the scene to a frame: what changes travels, and an update follows.

        That is vertices, and rows of instances; where a part of a divided scene has a new tree,
        its program, triangles and links too.

        The counters of the update; None where nothing has changed, or nothing can move.

        Raises
        ------
        InputError
            A vertex has moved, and the board has no update processor; or a new tree does not fit.
        """
        before = self._on_board()
        pose = pose_of(before.prepared, frame)
        return self._bring(pose, before if self._known else None, progress)

    def _bring(self, pose: Pose, before: Pose | None, progress: Progress) -> dict | None:
        """Bring the memory to a pose, from another if it is known to be there."""
        prepared = pose.prepared
        if before is None or before.prepared is not prepared:
            check_fit(prepared, self.config, self.words)
        changes = parts.changes(pose, before, RUN.size)
        if before and changes and not self.config.update:
            raise InputError(
                f"{prepared.scene.name}: vertices have moved in frame {pose.frame} and the board "
                f"has no update processor: build one with update true, or upload that frame"
            )
        length, update = len(pose.image.instructions), None
        job = {
            "program": {"address": 0, "length": length},
            "casts": 0,
            "cast": {"scene": scene_fields(pose.image, prepared.margin)},
        }
        with self._at_work():
            self.pose, self._known = pose, False
            for part, runs in changes:
                self.channel.write(runs, part.first, part.size, progress)
            if changes and length and self.config.update:
                update = self._runner.run(job, BESIDE + INSTRUCTION_CYCLES * length)["update"]
            self._known = True
        return update

    def render(
        self,
        view: View,
        progress: Progress = silently,
        ran: Callable[[dict], None] = lambda _: None,
    ) -> dict[str, np.ndarray]:
        """Fields (n,) of the hits of a camera's rays, in the order of sim.model.rays.camera.

        In bands of rows where the memory does not hold all; `ran` is told the counters of each.
        """
        pose = self._on_board()
        check_rays(self.config, camera=True)
        image, prepared = pose.image, pose.prepared
        found: list[dict[str, np.ndarray]] = []
        with self._at_work():
            for band in view.bands(packets_at_once(image, self.words, view, prepared.scene.name)):
                rays = RAYS * band.packets
                cast = {
                    "scene": scene_fields(image, prepared.margin),
                    **camera_fields(self.config, band),
                    "hits": image.size,
                }
                job = {"casts": 1, "cast": cast}
                ran(self._runner.run(job, BESIDE + RAY_CYCLES * rays))
                found.append(self._hits(band, progress))
        return {name: np.concatenate([hits[name] for hits in found]) for name in found[0]}

    def _hits(self, view: View, progress: Progress) -> dict[str, np.ndarray]:
        """The hits of a run: their triangles, and the rest of those that are there."""
        fmt, at = self.config.fmt, self._on_board().image.size
        head, size, count = (
            parts.hit_head_bytes(self.config),
            parts.hit_bytes(self.config),
            RAYS * view.packets,
        )
        rows = np.zeros((count, size), np.uint8)
        rows[:, head:] = self.read(at, count, head, size - head, progress)
        hits = hits_of(self.config, parts.words_of(rows, self._limbs))
        misses = hits["triangle"] == NO_TRIANGLE
        wanted = parts.spans(~misses, head, ANSWER_BYTES)
        runs = [(at + span.start, span.stop - span.start) for span in wanted]
        raw = np.frombuffer(self.channel.gather(runs, 0, head, progress), np.uint8)
        places = [np.arange(span.start, span.stop) for span in wanted]
        rows[np.concatenate([*places, np.empty(0, np.int64)]), :head] = raw.reshape(-1, head)
        hits = hits_of(self.config, parts.words_of(rows, self._limbs))
        hits["t"][misses] = camera_rays(fmt, view).t_max[misses]
        hits["u"][misses] = hits["v"][misses] = 0
        return hits

    def _on_board(self) -> Pose:
        if self.pose is None:
            raise InputError(f"{self.channel.name}: there is no scene on the board; upload one")
        return self.pose

    @contextmanager
    def _at_work(self) -> Iterator[None]:
        """Nothing else runs meanwhile; a board that was reset has no scene."""
        self._runner.settle()
        try:
            yield
        except SessionLost:
            self.pose = None
            raise
