"""sim.report.picture: what is read back from files, and what is refused."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from sim.errors import InputError
from sim.report.picture import check_picture_file, save


@pytest.fixture
def pictures(rng):
    """Four that differ, smooth enough for formats that lose."""
    x, y = np.meshgrid(np.linspace(0, 120, 48), np.linspace(0, 120, 32))
    return [np.stack([x + 30 * k, y, 0 * x + 60 * k], axis=2).astype(np.uint8) for k in range(4)]


def shown(file):
    with Image.open(file) as image:
        for frame in range(getattr(image, "n_frames", 1)):
            image.seek(frame)
            yield np.asarray(image.convert("RGB"), np.int64), image.info.get("duration")


@pytest.mark.parametrize("suffix", [".png", ".PNG", ".bmp", ".tif", ".ppm"])
def test_one_picture_is_kept_bit_for_bit(tmp_path, rng, suffix):
    picture = rng.integers(0, 256, (7, 5, 3), np.uint8)
    save(tmp_path / f"p{suffix}", [picture])
    ((found, _),) = shown(tmp_path / f"p{suffix}")
    np.testing.assert_array_equal(found, picture)
    assert [file.name for file in tmp_path.iterdir()] == [f"p{suffix}"]


@pytest.mark.parametrize(("suffix", "most"), [(".jpg", 12), (".webp", 12), (".gif", 12)])
def test_one_picture_is_kept_about(tmp_path, pictures, suffix, most):
    save(tmp_path / f"p{suffix}", pictures[2:3])
    ((found, _),) = shown(tmp_path / f"p{suffix}")
    assert np.abs(found - pictures[2]).mean() < most / 4
    assert np.abs(found - pictures[2]).max() <= most * 3


@pytest.mark.parametrize(("suffix", "most"), [(".png", 0), (".gif", 8), (".webp", 4)])
def test_an_animation_has_all_pictures_at_their_times(tmp_path, pictures, suffix, most):
    file = tmp_path / f"p{suffix}"
    save(file, pictures, fps=12)
    frames = list(shown(file))
    assert len(frames) == 4
    for (found, _), picture in zip(frames, pictures, strict=True):
        assert np.abs(found - picture).mean() <= most
    assert sum(duration for _, duration in frames) == pytest.approx(4 / 12 * 1000, abs=5)
    with Image.open(file) as image:
        assert image.info["loop"] == 0  # for ever


def test_what_is_still_does_not_flicker_in_a_gif(tmp_path, pictures):
    for k, picture in enumerate(pictures):
        picture[:16] = pictures[0][:16]
        picture[16:] = 60 * k
    save(tmp_path / "p.gif", pictures)
    frames = [found for found, _ in shown(tmp_path / "p.gif")]
    for found in frames[1:]:
        np.testing.assert_array_equal(found[:15], frames[0][:15])


@pytest.mark.parametrize("name", ["p", "p.", "p.txt", "p.psd", "p.xbm", ".png"])
@pytest.mark.parametrize("frames", [1, 3])
def test_files_that_pillow_does_not_write(tmp_path, pictures, name, frames):
    file = tmp_path / name
    for act in (
        lambda: check_picture_file(file, frames),
        lambda: save(file, pictures[:frames]),
    ):
        with pytest.raises(InputError) as error:
            act()
        assert str(error.value).startswith(f"{file}: ") and "\n" not in str(error.value)
        assert ".png" in str(error.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", [".jpg", ".bmp", ".tif", ".ppm"])
def test_several_pictures_in_a_file_for_one(tmp_path, suffix):
    file = tmp_path / f"p{suffix}"
    check_picture_file(file)
    check_picture_file(file, 1)
    with pytest.raises(InputError, match="2 frames go into .png, .gif or .webp"):
        check_picture_file(file, 2)


@pytest.mark.parametrize("suffix", [".png", ".GIF", ".webp"])
@pytest.mark.parametrize("frames", [1, 2, 100])
def test_files_that_hold_several(suffix, frames):
    check_picture_file(Path(f"p{suffix}"), frames)


def test_what_fails_leaves_the_old_file_and_nothing_else(tmp_path, pictures):
    """A .webp is at most 16383 pixels wide."""
    file = tmp_path / "p.webp"
    save(file, pictures[:1])
    before = file.read_bytes()
    with pytest.raises(InputError, match="^.*p.webp: cannot be written"):
        save(file, [np.zeros((1, 20000, 3), np.uint8)])
    assert file.read_bytes() == before
    assert list(tmp_path.iterdir()) == [file]
