"""A traversal unit at work under cocotb: its scenes, its memory and its triangle unit."""

import random
from collections import deque
from dataclasses import replace

import cocotb
import numpy as np
from cocotb.triggers import RisingEdge

from hdl.config import FULL, Config
from hdl.fp.format import FloatFormat
from hdl.rays.traversal import Traversal
from sim.compiler.order import order
from sim.model.rays.setup import margin_scale
from tests.harness import unbuilt
from tests.hdl.rays.scenes import RAYS, SLAB, Scene, Visit, any_scene, mesh_scene, walk
from tests.payloads import pack, unpack
from tests.sim.compiler.trees import balanced, chain, icosphere, random_tree
from tests.sim.tree.meshes import soup
from tests.streams import now, put, start

SMALL = Config(FloatFormat(4, 3), address_bits=12, packets=3, stack_depth=5)
CONFIGS = {"small": SMALL, "folded": replace(SMALL, folded=True), "full": FULL}


def scene(kind: str, config: Config, rng, packets: int) -> Scene:
    """A scene whose stacks fit the configuration."""
    scale = margin_scale(config.fmt) if config.fmt == FULL.fmt else 0
    if kind == "sphere":
        return mesh_scene(config, rng, *icosphere(3 if config.packets > 3 else 0), packets, scale)
    if kind == "soup":
        count = 300 if config.packets > 3 else 12
        return mesh_scene(config, rng, *soup(rng, count), packets, scale)
    if kind == "one":
        return mesh_scene(config, rng, *soup(rng, 1, 0.5), packets, scale)
    levels = config.stack_depth
    tree = {
        "random": lambda: random_tree(rng, 6),
        "balanced": lambda: balanced(min(levels, 8)),
        "chain": lambda: chain(levels + 1, bool(rng.integers(2))),
    }[kind]()
    triangles = int(-tree.children.min())
    faces = rng.integers(0, 9, (triangles, 3)).astype(np.int32)
    return any_scene(config, rng, order(tree, faces, 64), packets)


class Bench:
    """Sends the packets of a scene through the unit, and is its memory and triangle unit.

    Parameters
    ----------
    dut
    name : str
        Of the unit.
    scene : Scene
    delays : (least, most)
        Cycles from a request to its answer; answers come in any order.
    busy : float
        Chance that a cycle takes no request, and that one sends nothing.

    Attributes
    ----------
    begun, steps : list of int
        Cycles in which packets started, and in which nodes came.
    requests, answers : list of int
        Cycles of all requests, and of all answers.
    """

    def __init__(self, dut, name: str, scene: Scene, *, delays=(1, 1), busy=0.0):
        self.dut, self.name, self.scene = dut, name, scene
        self.delays, self.busy = delays, busy
        self.config = CONFIGS[name]
        unit = unbuilt(Traversal(self.config))
        self.layouts = {
            port: getattr(unit, port).payload.shape()
            for port in ("i_setup", "i_start", "o_nodes", "i_nodes", "o_tests", "i_tests")
        }
        self.words = scene.words()
        self.walks = [walk(scene, packet) for packet in range(scene.packets)]
        self.begun: list[int] = []
        self.steps: list[int] = []
        self.requests: list[int] = []
        self.answers: list[int] = []
        self.under_way: dict[int, tuple[int, deque]] = {}  # packet of the scene, visits to come
        self.free = list(range(self.config.packets))
        self.left = scene.packets

    def port(self, name: str):
        return getattr(self.dut, f"{self.name}__{name}")

    async def run(self) -> dict[str, int]:
        """All packets; returns the counters."""
        inputs = {"root": len(self.words) - 1, "clear": 0, "o_done__ready": 0}
        for port in ("i_setup", "i_start", "i_nodes", "i_tests"):
            inputs[f"{port}__valid"] = 0
        for port in ("o_nodes", "o_tests"):
            inputs[f"{port}__ready"] = 0
        await start(self.dut, **{f"{self.name}__{k}": v for k, v in inputs.items()})
        self.port("clear").value = 1
        await RisingEdge(self.dut.clk)
        self.port("clear").value = 0
        tasks = [
            cocotb.start_soon(task)
            for task in (
                self._send(),
                self._serve("o_nodes", "i_nodes", self._node),
                self._serve("o_tests", "i_tests", self._test),
                self._done(),
            )
        ]
        await tasks[-1]
        for task in tasks[:-1]:
            task.cancel()
        await RisingEdge(self.dut.clk)
        names = ("steps", "tests", "pushes", "pops")
        counters = self.port("counters").value.to_unsigned()
        return {name: counters >> 32 * k & 0xFFFFFFFF for k, name in enumerate(names)}

    def _pack(self, port: str, columns: dict) -> int:
        return pack(self.layouts[port], self.config.fmt, {k: [v] for k, v in columns.items()})[0]

    async def _send(self):
        for packet in range(self.scene.packets):
            while not self.free:
                await RisingEdge(self.dut.clk)
            number = self.free.pop(random.randrange(len(self.free)))
            self.under_way[number] = (packet, deque(self.walks[packet].visits))
            rows = self.scene.rows[RAYS * packet :][:RAYS]
            for place in random.sample(range(3 * RAYS), 3 * RAYS):
                k, axis = divmod(place, 3)
                columns = {"packet": number, "number": k, "axis": axis} | {
                    f"ray.{field}": rows[k, column + axis] for field, column in SLAB.items()
                }
                await self._put_at_once("i_setup", self._pack("i_setup", columns))
            limits = self.scene.limits[RAYS * packet :][:RAYS]
            columns = {"packet": number} | {
                f"intervals.{k}.{field}": limits[k, column]
                for k in range(RAYS)
                for column, field in enumerate(("near", "far"))
            }
            await put(self.dut, f"{self.name}__i_start", [self._pack("i_start", columns)])
            self.begun.append(now())

    async def _put_at_once(self, port: str, word: int):
        self.port(f"{port}__payload").value = word
        self.port(f"{port}__valid").value = 1
        await RisingEdge(self.dut.clk)
        self.port(f"{port}__valid").value = 0

    def _expected(self, number: int) -> tuple[str, Visit]:
        assert number in self.under_way, f"packet {number} is not under way"
        packet, visits = self.under_way[number]
        assert visits, f"packet {packet} is through and goes on"
        return f"packet {packet}, {len(visits)} visits before its end", visits.popleft()

    def _node(self, packet: int, node: int) -> dict[str, int]:
        where, visit = self._expected(packet)
        assert node == visit.child, f"{where}: node {node}, not {visit} (a triangle if < 0)"
        return {"packet": packet, "word": self.words[node]}

    def _test(self, packet: int, triangle: int, mask: int) -> dict[str, int]:
        where, visit = self._expected(packet)
        assert (~triangle, mask) == visit[:2], f"{where}: {triangle=} {mask=:04b}, not {visit}"
        return {"packet": packet} | {f"t.{k}": visit.best[k] for k in range(RAYS)}

    async def _serve(self, asks: str, answers: str, reply):
        """Answer the requests of one stream on another, without end."""
        clk = self.dut.clk
        valid, payload, ready = (
            self.port(f"{asks}__{part}") for part in ("valid", "payload", "ready")
        )
        to_valid, to_payload = self.port(f"{answers}__valid"), self.port(f"{answers}__payload")
        to_ready = getattr(self.dut, f"{self.name}__{answers}__ready", None)
        due: list[tuple[int, int]] = []
        offered = waiting = None
        willing = not self.busy
        while True:
            ready.value = willing
            if offered is None and random.random() >= self.busy:
                able = [answer for answer in due if answer[0] <= now()]
                if able:
                    offered = random.choice(able)
                    due.remove(offered)
                    to_payload.value = offered[1]
            to_valid.value = offered is not None
            await RisingEdge(clk)
            if offered is not None and (to_ready is None or to_ready.value):
                offered = None
                self.answers.append(now())
                if answers == "i_nodes":
                    self.steps.append(now())
            if not valid.value:
                assert waiting is None, f"{asks}: valid was withdrawn"
                willing = not self.busy
                continue
            word = payload.value.to_unsigned()
            assert waiting in (None, word), f"{asks}: payload changed as it waited"
            waiting = None if willing else word
            if willing:
                self.requests.append(now())
                answer = reply(**unpack(self.layouts[asks], word))
                if answers == "i_nodes":
                    fields = self.layouts[answers]
                    bits = answer["word"] << fields["word"].offset | answer["packet"]
                else:
                    bits = self._pack(answers, answer)
                due.append((now() + random.randint(*self.delays) - 1, bits))
            willing = random.random() >= self.busy

    async def _done(self):
        valid, payload, ready = (
            self.port(f"o_done__{part}") for part in ("valid", "payload", "ready")
        )
        while self.left:
            willing = random.random() >= self.busy
            ready.value = willing
            await RisingEdge(self.dut.clk)
            if valid.value and willing:
                number = payload.value.to_unsigned()
                assert number in self.under_way, f"packet {number} is done and not under way"
                packet, visits = self.under_way.pop(number)
                assert not visits, f"packet {packet} ends before {visits[0]}"
                self.free.append(number)
                self.left -= 1
        ready.value = 0
