"""The signals of the buses: AXI4, AXI4-Lite, and the registers behind it.

Members of the AXI signatures have the names of the AXI specification (ARM IHI 0022), in lower
case.
"""

from amaranth import Signal
from amaranth.lib import enum, wiring
from amaranth.lib.wiring import In, Out

LITE_BITS = 32
"""Width of AXI4-Lite data, and of a register."""


class Response(enum.Enum, shape=2):
    """How a transfer went."""

    OKAY = 0
    EXOKAY = 1
    SLVERR = 2
    DECERR = 3


class Axi4Interface(wiring.PureInterface):
    """Members of Axi4, for the type checker: those of the handshakes and of data."""

    arvalid: Signal
    arready: Signal
    rdata: Signal
    rresp: Signal
    rlast: Signal
    rvalid: Signal
    rready: Signal
    awvalid: Signal
    awready: Signal
    wdata: Signal
    wstrb: Signal
    wlast: Signal
    wvalid: Signal
    wready: Signal
    bresp: Signal
    bvalid: Signal
    bready: Signal


class Axi4(wiring.Signature):
    """AXI4 without users, regions and more than one ID, as the side sees it that asks.

    Parameters
    ----------
    address_bits : int
        Of the address of a byte.
    data_bits : int
    """

    def __init__(self, address_bits: int, data_bits: int):
        super().__init__({
            **_address("aw", address_bits, burst=True),
            "wdata": Out(data_bits),
            "wstrb": Out(data_bits // 8),
            "wlast": Out(1),
            "wvalid": Out(1),
            "wready": In(1),
            "bid": In(1),
            "bresp": In(Response),
            "bvalid": In(1),
            "bready": Out(1),
            **_address("ar", address_bits, burst=True),
            "rid": In(1),
            "rdata": In(data_bits),
            "rresp": In(Response),
            "rlast": In(1),
            "rvalid": In(1),
            "rready": Out(1),
        })

    def create(self, *, path=None, src_loc_at=0) -> Axi4Interface:
        """Interface with the members of Axi4."""
        return Axi4Interface(self, path=path, src_loc_at=1 + src_loc_at)


class AxiLiteInterface(Axi4Interface):
    """Members of AxiLite, for the type checker."""

    araddr: Signal
    awaddr: Signal


class AxiLite(wiring.Signature):
    """AXI4-Lite of 32-bit registers, as the side sees it that asks.

    Parameters
    ----------
    address_bits : int
        Of the address of a byte.
    """

    def __init__(self, address_bits: int):
        super().__init__({
            **_address("aw", address_bits),
            "wdata": Out(LITE_BITS),
            "wstrb": Out(LITE_BITS // 8),
            "wvalid": Out(1),
            "wready": In(1),
            "bresp": In(Response),
            "bvalid": In(1),
            "bready": Out(1),
            **_address("ar", address_bits),
            "rdata": In(LITE_BITS),
            "rresp": In(Response),
            "rvalid": In(1),
            "rready": Out(1),
        })

    def create(self, *, path=None, src_loc_at=0) -> AxiLiteInterface:
        """Interface with the members of AxiLite."""
        return AxiLiteInterface(self, path=path, src_loc_at=1 + src_loc_at)


def _address(channel: str, bits: int, *, burst: bool = False) -> dict[str, wiring.Member]:
    """Members of an address channel."""
    beside = {"id": 1, "len": 8, "size": 3, "burst": 2, "lock": 1, "cache": 4, "prot": 3, "qos": 4}
    if not burst:
        beside = {"prot": 3}
    outs = {"addr": bits, **beside, "valid": 1}
    members = {f"{channel}{name}": Out(width) for name, width in outs.items()}
    return {**members, f"{channel}ready": In(1)}


class RegistersInterface(wiring.PureInterface):
    """Members of Registers, for the type checker."""

    address: Signal
    write: Signal
    write_data: Signal
    read_data: Signal
    missing: Signal


class Registers(wiring.Signature):
    """Registers, as the side sees it that reads and writes them.

    In each cycle the register at `address` is read, and it is written where `write` is set.

    Parameters
    ----------
    address_bits : int
        Of the address of a register, which counts registers and not bytes.

    Members
    -------
    address : Out(address)
    write : Out(1)
    write_data : Out(32)
    read_data : In(32), of the address one cycle ago; 0 where there is no register
    missing : In(1), there is no register at the address of one cycle ago
    """

    def __init__(self, address_bits: int):
        super().__init__({
            "address": Out(address_bits),
            "write": Out(1),
            "write_data": Out(LITE_BITS),
            "read_data": In(LITE_BITS),
            "missing": In(1),
        })

    def create(self, *, path=None, src_loc_at=0) -> RegistersInterface:
        """Interface with the members of Registers."""
        return RegistersInterface(self, path=path, src_loc_at=1 + src_loc_at)
