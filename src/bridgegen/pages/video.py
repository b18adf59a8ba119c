"""A playback as a film (GIF, WebP; MP4 and WebM by ffmpeg), or as one picture (PNG, SVG)."""

import io
import shutil
import subprocess
import tempfile
import threading
from collections.abc import Iterable, Sequence
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

from PIL import Image

from bridgegen.base.disk import write_whole
from bridgegen.base.errors import InputError, StorageError
from bridgegen.pages.birdseye import HIT
from bridgegen.pages.frames import Film
from bridgegen.pages.playback import Playback

# --- Films as MP4 or WebM: frames are piped to the program ffmpeg ---


CODECS = {
    ".mp4": ("-c:v", "libx264", "-preset", "medium", "-crf", "20", "-pix_fmt", "yuv420p",
             "-movflags", "+faststart"),
    ".webm": ("-c:v", "libvpx-vp9", "-b:v", "0", "-crf", "32", "-pix_fmt", "yuv420p",
              "-row-mt", "1"),
}  # fmt: skip
"""Options of ffmpeg by the ending of the film's name."""

TIMEOUT = 600.0
"""Time limit of making a film [s]."""


def program() -> str:
    """Return the path of ffmpeg.

    Raises:
        InputError: it is not installed.
    """
    found = shutil.which("ffmpeg")
    if found is None and find_spec("imageio_ffmpeg") is not None:
        import imageio_ffmpeg

        with suppress(RuntimeError):
            found = str(imageio_ffmpeg.get_ffmpeg_exe())
    if found is None:
        raise InputError(
            "MP4 and WebM need the program ffmpeg: install it with the system's packages, or "
            "'pip install imageio-ffmpeg'; GIF and WebP need nothing"
        )
    return found


def encode(frames: Iterable[Image.Image], size: tuple[int, int], fps: int, kind: str) -> bytes:
    """Return a film.

    Args:
        frames: of that size.
        size: width and height [pixels]; odd ones gain a pixel.
        fps: frames per second.
        kind: a key of ``CODECS``.

    Raises:
        InputError: ffmpeg is not installed.
        StorageError: it fails, or takes longer than ``TIMEOUT``.
    """
    with tempfile.TemporaryDirectory(prefix="bridgegen-video-") as folder:
        out = Path(folder) / f"film{kind}"
        command = [
            program(), "-hide_banner", "-loglevel", "error", "-y",
            "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}", "-r", str(fps),
            # Frames go through a pipe: a codec in Python would be 30 to 70 MB of installation.
            "-i", "-", "-an", "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", *CODECS[kind], str(out),
        ]  # fmt: skip
        # A file, not a pipe: a pipe that nobody reads fills up, and ffmpeg would stop.
        with (Path(folder) / "said").open("w+b") as said:
            process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=said
            )
            late = threading.Event()

            def end() -> None:
                late.set()
                process.kill()

            limit = threading.Timer(TIMEOUT, end)
            limit.start()
            try:
                assert process.stdin is not None
                # ffmpeg that ends early closes the pipe; its own message says why.
                with suppress(BrokenPipeError), process.stdin as pipe:
                    for frame in frames:
                        pipe.write(frame.tobytes())
                process.wait()
            finally:
                limit.cancel()
                process.kill()
                process.wait()
            if process.returncode != 0 or not out.is_file():
                said.seek(0)
                words = said.read(2000).decode("utf-8", "replace").strip().splitlines()
                why = words[-1] if words else f"exit status {process.returncode}"
                if late.is_set():
                    why = f"it took longer than {TIMEOUT:g} s"
                raise StorageError(f"ffmpeg could not write the {kind[1:]} film: {why}")
        return out.read_bytes()


HEADS = {
    ".gif": (0, b"GIF8"),
    ".webp": (0, b"RIFF"),
    ".mp4": (4, b"ftyp"),
    ".webm": (0, b"\x1a\x45\xdf\xa3"),
    ".png": (0, b"\x89PNG"),
    ".svg": (0, b"<svg"),
}
"""Formats by the ending of the name, with bytes of such a file and where they are."""

STILL = (".png", ".svg")

SIZES, MAX_FPS = (160, 3840), 50
BEFORE, AFTER = 8.0, 2.0
"""Default duration of a film before and after the decisive instant [s]."""

_COLOURS = 128


def refuse_path(out: Path) -> None:
    """Reject a path of another format, or at which another kind of file exists.

    Raises:
        InputError: no such format, or ffmpeg is needed and missing.
        StorageError: another file exists there, or the file cannot be read.
    """
    kind = out.suffix.lower()
    if kind not in HEADS:
        raise InputError(f"{out}: the name of a video must end in {', '.join(HEADS)}")
    if kind in CODECS:
        program()
    at, head = HEADS[kind]
    try:
        with out.open("rb") as file:
            ours = file.read(16)[at:].startswith(head)
    except FileNotFoundError:
        return
    except OSError as error:
        raise StorageError(f"{out}: cannot be written: {error.strerror}") from None
    if not ours:
        raise StorageError(f"{out}: exists already, is no {out.suffix}, and is not overwritten")


def check_look(size: tuple[int, int], fps: int) -> None:
    """Reject a size [pixels] or a frame rate [1/s] out of bounds.

    Raises:
        InputError: one is out of bounds.
    """
    low, high = SIZES
    if not all(low <= number <= high for number in size):
        raise InputError(
            f"{low} <= width, height <= {high} must hold for --size [pixels], got "
            f"{size[0]}x{size[1]}"
        )
    if not 1 <= fps <= MAX_FPS:
        raise InputError(f"1 <= fps <= {MAX_FPS} must hold for --fps [1/s], got {fps}")


def write_video(
    playback: Playback,
    out: Path,
    *,
    size: tuple[int, int] = (960, 540),
    fps: int = 20,
    start: float | None = None,
    end: float | None = None,
) -> None:
    """Write a scenario as a film or, with an end of ``STILL``, as one picture.

    Args:
        playback: the scenario.
        out: its end is one of ``HEADS``.
        size: of the picture, width and height [pixels].
        fps: frames per second; of a GIF or WebP, 100 / fps is rounded to whole hundredths of a
            second.
        start: of the film, or the instant of the picture [s]; by default ``BEFORE`` the decisive
            instant, and that instant.
        end: of the film [s]; by default ``AFTER`` the decisive instant.

    Raises:
        InputError: size, rate or times are out of bounds, or no such format.
        StorageError: something else exists there, or it cannot be written.
    """
    refuse_path(out)
    check_look(size, fps)
    step, last = playback.time_step, playback.n_steps - 1
    length = last * step
    whole = Film(playback, size, 0, last)
    decisive = playback.conflict.instant if playback.conflict else whole.closest
    kind = out.suffix.lower()
    still = kind in STILL
    if start is None:
        before = 0.0 if still else BEFORE
        start = max(0.0, min(decisive * step, length if end is None else end) - before)
    if not 0.0 <= start <= length:
        raise InputError(f"0 <= --from <= {length:g} must hold [s], got {start:g}")
    if still:
        k = round(start / step)
        around = round(2.0 / step)
        film = Film(playback, size, max(0, k - around), min(last, k + around))
        write_whole(out, [film.drawing(k).encode() if kind == ".svg" else _png(film.frame(k))])
        return
    if end is None:
        end = min(length, max(start, decisive * step) + AFTER)
    if not start < end <= length:
        raise InputError(
            f"--from < --to <= {length:g} must hold [s], got --from {start:g}, --to {end:g}"
        )
    count = int((end - start) * fps + 1e-9) + 1
    steps = [min(last, round((start + i / fps) / step)) for i in range(count)]
    film = Film(playback, size, steps[0], steps[-1])
    frames = (film.frame(k) for k in steps)
    if kind in CODECS:
        write_whole(out, [encode(frames, size, fps, kind)])
    else:
        write_whole(out, [_animated(list(frames), fps, kind)])


def _png(picture: Image.Image) -> bytes:
    file = io.BytesIO()
    picture.save(file, "PNG", optimize=True)
    return file.getvalue()


def _animated(frames: Sequence[Image.Image], fps: int, kind: str) -> bytes:
    """Return a GIF or WebP."""
    file = io.BytesIO()
    delay = 10 * round(100 / fps)  # ms; a GIF counts hundredths of a second
    if kind == ".webp":
        frames[0].save(
            file,
            "WEBP",
            save_all=True,
            append_images=frames[1:],
            duration=delay,
            loop=0,
            quality=80,
            method=2,
        )
    else:
        width, height = frames[0].size
        both = Image.new("RGB", (width, 3 * height), HIT)  # red, too, where neither shows it
        both.paste(frames[0])
        both.paste(frames[-1], (0, height))
        palette = both.quantize(_COLOURS, dither=Image.Dither.NONE)
        few = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
        few[0].save(
            file,
            "GIF",
            save_all=True,
            append_images=few[1:],
            duration=delay,
            loop=0,
            optimize=False,
        )
    return file.getvalue()
