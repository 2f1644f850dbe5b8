"""What travels over the serial line between a host and a board: one description for both ends.

A frame is a header, a body and a CRC, numbers with their lowest byte first. On the line it is
encoded by COBS (Cheshire and Baker, "Consistent Overhead Byte Stuffing", 1999) and ends with a
zero byte, so that after any damage the next frame is found; a frame of no bytes is no frame. The
CRC is that of zlib and Ethernet (CRC-32/ISO-HDLC), over header and body.

=======  =====================================  ======================================
command  body                                   body of its answer
=======  =====================================  ======================================
HELLO    version of the host                    HELLO_ANSWER
READ     READ                                   `bytes` of each word, from `first` on
WRITE    WRITE, then runs: RUN, then `bytes`    none
         for each of its words; or no run
PEEK     PEEK                                   registers, 4 bytes each
POKE     POKE, then registers, 4 bytes each,    none
         or none
=======  =====================================  ======================================

The registers are those of hdl.registers: they say what the board is, run updates and casts, and
count. Registers that do not exist read as 0, and a write to them does nothing.

**Nothing is lost, and nothing is done twice.** A host chooses a session at random and opens it by
a HELLO of sequence number 0; its further commands count from 1, modulo 2**16. A board has a
session, none after reset, and the sequence number that it expects, and does as follows:

- HELLO with a session that is not the board's, of its version: opens that session, expects 1.
  Every HELLO is answered by OK, whatever its version or number: this frame is the same in all
  versions. One of another length is REFUSED.
- A command of another session, or without one: REFUSED, Reason.SESSION.
- The number that is expected: the command is executed, answered by OK with its number, and the
  next number is expected. If it is at fault, the answer is REFUSED, with a Reason as its body, and
  the same number stays expected; what it has written by then stays written.
- One of the 2**15 numbers before: the frame is a repetition. READ and PEEK are executed again;
  WRITE and POKE are not; all are answered by OK, if they are not at fault now. So a host sends no
  WRITE and no POKE while a READ or PEEK is unanswered.
- Any other number, or a frame that is damaged or finds no room: REPEAT, with the number that is
  expected; several can be answered by one. Without a session there is no answer.

An OK to a WRITE says that all before it are done too. After a REFUSED a host opens a new session.
"""

from amaranth.lib import data, enum

VERSION = 1
MAGIC = int.from_bytes(b"BKDT", "big")
BODY_BYTES = 1024
"""Most of a body. A longer one is refused, if there is room for it at all."""

HEADER = data.StructLayout({"kind": 8, "session": 16, "sequence": 16, "length": 16})
"""`length` is that of the body, in bytes."""
HEADER_BYTES = HEADER.size // 8
CRC_BYTES = 4


class Kind(enum.Enum, shape=8):
    """What a frame is: a command of the host, or an answer of the board."""

    HELLO = 0x01
    READ = 0x02
    WRITE = 0x03
    PEEK = 0x04
    POKE = 0x05
    OK = 0x80
    REFUSED = 0x81
    REPEAT = 0x82


class Reason(enum.Enum, shape=8):
    """Why a command is refused."""

    SESSION = 1  # it is of another session
    KIND = 2  # there is no such command
    LENGTH = 3  # the body is shorter or longer than the command, or the answer would be too long
    RANGE = 4  # words or registers beyond the last one, bytes beyond a word, or none of them
    MEMORY = 5  # the memory answered with an error during a READ or WRITE


HELLO = data.StructLayout({"version": 8})
HELLO_ANSWER = data.StructLayout({"magic": 32, "version": 8, "body_bytes": 16})
"""MAGIC, VERSION and BODY_BYTES of the board."""
READ = data.StructLayout({"address": 32, "count": 16, "first": 8, "bytes": 8})
"""`count` words, at least 1, and of each `bytes` bytes, at least 1, from byte `first` on."""
WRITE = data.StructLayout({"first": 8, "bytes": 8})
"""The bytes of each word that are written; the others stay as they are."""
RUN = data.StructLayout({"address": 32, "count": 16})
"""Words, at least 1, one after the other."""
PEEK = data.StructLayout({"register": 16, "count": 16})
"""Registers, at least 1, counted from offset 0: not in bytes."""
POKE = data.StructLayout({"register": 16})
