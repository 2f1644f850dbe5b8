"""A bad line: it drops, repeats, swaps, inserts and flips bytes, one by one and in bursts."""

import numpy as np

BURST = 100


class BadLine:
    """Damages what passes through it, by a seed.

    Parameters
    ----------
    seed : int or sequence of int
    rate : float
        Share of bytes that are damaged one by one.
    bursts : float
        Share of bytes that begin a burst of 100 random bytes.
    frames : float
        Share of what is passed at once that is lost, comes twice or late.
    """

    def __init__(self, seed, rate: float = 0.0, bursts: float = 0.0, frames: float = 0.0):
        self._rng = np.random.default_rng(seed)
        self.rate, self.bursts, self.frames = rate, bursts, frames
        self.cut = False
        self._held = b""
        self._burst = 0

    def carry(self, data: bytes) -> bytes:
        """What comes out at the other end."""
        if self.cut:
            return b""
        held, self._held = self._held, b""
        if self._rng.random() < self.frames:
            what = self._rng.integers(3)
            if what == 0:
                data = b""
            elif what == 1:
                data = data + data
            else:
                data, self._held = b"", data
        return self._damaged(data + held)

    def _damaged(self, data: bytes) -> bytes:
        if not (self.rate or self.bursts):
            return data
        chances = self._rng.random((2, len(data)))
        if not self._burst and chances[0].min(initial=1) >= self.rate:
            if chances[1].min(initial=1) >= self.bursts:
                return data
        out = bytearray()
        for byte, (single, burst) in zip(data, chances.T.tolist(), strict=True):
            if burst < self.bursts:
                self._burst = BURST
            if self._burst:
                self._burst -= 1
                out.append(int(self._rng.integers(256)))
            elif single >= self.rate:
                out.append(byte)
            else:
                self._damage(out, byte)
        return bytes(out)

    def _damage(self, out: bytearray, byte: int):
        what = self._rng.integers(5)
        if what == 0:
            return
        if what == 1:
            out += bytes([byte, byte])
        elif what == 2 and out:
            out.insert(-1, byte)
        elif what == 3:
            out += bytes([byte, int(self._rng.integers(256))])
        else:
            out.append(byte ^ 1 << int(self._rng.integers(8)))
