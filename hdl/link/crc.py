"""The check of a frame: CRC-32/ISO-HDLC."""

from typing import Any

from amaranth import *
from amaranth.lib.crc.catalog import CRC32_ISO_HDLC


def crc32(restarts: Value) -> Any:
    """Take bytes: `data` where `valid`. `crc` and `match_detected` are of those before this cycle.

    Those before `restarts`, and in its cycle, do not count. Costs less than the `start` of
    amaranth.lib.crc, which a byte can come with.
    """
    return ResetInserter(restarts)(CRC32_ISO_HDLC(data_width=8).create())
