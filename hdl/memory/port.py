"""The memory port: the one way in which units reach memory."""

from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.records import word_bits


def request(config: Config) -> data.StructLayout:
    """What a port asks: a word to read, or bytes of a word to write.

    `address` counts words. Where `write`, the bytes of `data` with a set bit in `mask` are
    written; else the word is read and `data` and `mask` mean nothing.
    """
    bits = word_bits(config.fmt)
    return data.StructLayout({
        "address": config.address_bits,
        "write": 1,
        "mask": bits // 8,
        "data": bits,
    })


class PortInterface(wiring.PureInterface):
    """Members of a Port, for the type checker."""

    request: stream.Interface
    response: stream.Interface


class Port(wiring.Signature):
    """A pair of streams, as the side sees it that asks.

    Each read has one response, in the order of the reads; writes have none, and take effect in
    their order. A read may overtake writes that it came after: whoever reads what he wrote waits
    until the memory says that his writes have settled. One request and one response a cycle.

    Members
    -------
    request : Out(stream of request)
    response : In(stream of words), taken at once
    """

    def __init__(self, config: Config):
        super().__init__({
            "request": Out(stream.Signature(request(config))),
            "response": In(stream.Signature(word_bits(config.fmt), always_ready=True)),
        })

    def create(self, *, path=None, src_loc_at=0) -> PortInterface:
        """Interface with the members of a Port."""
        return PortInterface(self, path=path, src_loc_at=1 + src_loc_at)


class ReadsInterface(wiring.PureInterface):
    """Members of Reads, for the type checker."""

    request: stream.Interface
    response: stream.Interface


class Reads(wiring.Signature):
    """Reads whose words come back in any order, each with the tag that it was asked with.

    As the side sees it that asks. One request and one response a cycle. A tag may be asked with
    again before it has come back; which word is which is then for the asker to know.

    Parameters
    ----------
    config : Config
    tags : int
        Number of tags, at least 1.

    Members
    -------
    request : Out(stream of {tag, address: in words})
    response : In(stream of {tag, word}), taken at once
    """

    def __init__(self, config: Config, tags: int):
        self.tags = tags
        super().__init__({
            "request": Out(
                stream.Signature(
                    data.StructLayout({"tag": range(tags), "address": config.address_bits})
                )
            ),
            "response": In(
                stream.Signature(
                    data.StructLayout({"tag": range(tags), "word": word_bits(config.fmt)}),
                    always_ready=True,
                )
            ),
        })

    def create(self, *, path=None, src_loc_at=0) -> ReadsInterface:
        """Interface with the members of Reads."""
        return ReadsInterface(self, path=path, src_loc_at=1 + src_loc_at)
