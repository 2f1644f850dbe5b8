"""Rays and hits as memory words."""

import numpy as np

from hdl.config import Config
from hdl.rays.packet import hit, ray_word
from hdl.records import vertex, word_bits
from sim.compiler import fields


def ray_words(
    config: Config,
    origins: np.ndarray,
    directions: np.ndarray,
    t_min: np.ndarray,
    t_max: np.ndarray,
) -> np.ndarray:
    """Words (2n, limbs) of rays, of the bit patterns (n, 3) and (n,) of what they are."""
    layout = ray_word(config.fmt)
    words = np.zeros((2 * len(origins), word_bits(config.fmt) // 32), np.uint32)
    for half, (points, t) in enumerate([(origins, t_min), (directions, t_max)]):
        rows = np.zeros((len(points), words.shape[1]), np.uint32)
        for axis, (_, field) in enumerate(vertex(config.fmt)):
            fields.put(rows, field, points[:, axis], layout["point"].offset)
        fields.put(rows, layout["t"], t)
        words[half::2] = rows
    return words


def hit_words(config: Config, hits: dict[str, np.ndarray]) -> np.ndarray:
    """Words (n, limbs) of hits, of the columns (n,) of their fields."""
    words = np.zeros((len(hits["t"]), word_bits(config.fmt) // 32), np.uint32)
    for name, field in hit(config.fmt):
        fields.put(words, field, hits[name])
    return words


def hits_of(config: Config, words: np.ndarray) -> dict[str, np.ndarray]:
    """The fields t, u, v, triangle (n,) of hit words: the inverse of `hit_words`."""
    return {name: fields.get(words, field) for name, field in hit(config.fmt)}
