"""The ways of a ray caster to memory: caches before one port, or banks beside it."""

from amaranth import *
from amaranth.lib import wiring

from hdl.config import Config
from hdl.memory.arbiter import Arbiter
from hdl.memory.cache import Cache
from hdl.memory.inorder import InOrder
from hdl.memory.port import PortInterface, ReadsInterface
from hdl.rays.caster import RayCaster


def through_caches(
    m: Module, config: Config, cast: RayCaster, clear: Value
) -> tuple[PortInterface, dict[str, Cache]]:
    """One port for all, with caches of nodes and of geometry; and these, by name.

    In a cycle in which `clear` is set they forget.
    """
    clients = 2 + len(_beside(config, cast))
    # Nodes first: each packet waits for one. Rays last: they are asked for early.
    m.submodules.arbiter = arbiter = Arbiter(
        config, clients=clients, outstanding=2 * config.packets + config.latency + 8
    )
    caches = {}
    for name, client in zip(("nodes", "geometry"), arbiter.clients, strict=False):
        reads = getattr(cast, name)
        caches[name] = cache = Cache(
            config, words=config.cache_words, tags=reads.signature.tags, misses=config.packets
        )
        m.submodules[f"{name}_cache"] = cache
        wiring.connect(m, reads, cache.reads)
        wiring.connect(m, cache.port, client)
        m.d.comb += cache.clear.eq(clear)
    for port, client in zip(_beside(config, cast), arbiter.clients[2:], strict=True):
        wiring.connect(m, port, client)
    return arbiter.port, caches


def through_bank(m: Module, config: Config, name: str, reads: ReadsInterface, port: PortInterface):
    """Nodes, or geometry, from a port of their own."""
    bank = InOrder(config, tags=reads.signature.tags, outstanding=config.packets)
    m.submodules[f"{name}_bank"] = bank
    wiring.connect(m, reads, bank.reads)
    wiring.connect(m, port, bank.port)


def past_banks(m: Module, config: Config, cast: RayCaster) -> PortInterface:
    """The port for what is neither nodes nor geometry."""
    ports = _beside(config, cast)
    if len(ports) == 1:
        return ports[0]
    m.submodules.arbiter = arbiter = Arbiter(
        config, clients=len(ports), outstanding=config.latency + 8
    )
    for port, client in zip(ports, arbiter.clients, strict=True):
        wiring.connect(m, port, client)
    return arbiter.port


def _beside(config: Config, cast: RayCaster) -> list[PortInterface]:
    """What is neither nodes nor geometry, the more urgent first."""
    return [cast.hits, cast.rays] if config.source else [cast.hits]
