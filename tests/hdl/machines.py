"""Small cores that several tests simulate: a simulator takes half a minute to build."""

from dataclasses import replace

from hdl.config import FULL, Config
from hdl.fp.format import FloatFormat

PLAIN = Config(
    FloatFormat(5, 13), latency=4, address_bits=16, packets=3, stack_depth=24, cache_words=16
)
TINY = replace(PLAIN, instances=True)
CONFIGS = {
    "tiny": TINY,
    "banks": replace(PLAIN, latency=2, packets=4, cache_words=0),
    "folded": replace(TINY, packets=5, folded=True),
    "full": FULL,
}
