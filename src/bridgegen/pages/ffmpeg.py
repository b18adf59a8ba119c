"""Films as MP4 or WebM: frames are piped to the program ffmpeg."""

import shutil
import subprocess
import tempfile
import threading
from collections.abc import Iterable
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

from PIL import Image

from bridgegen.base.errors import InputError, StorageError

CODECS = {
    ".mp4": ("-c:v", "libx264", "-preset", "medium", "-crf", "20", "-pix_fmt", "yuv420p",
             "-movflags", "+faststart"),
    ".webm": ("-c:v", "libvpx-vp9", "-b:v", "0", "-crf", "32", "-pix_fmt", "yuv420p",
              "-row-mt", "1"),
}  # fmt: skip
"""Options of ffmpeg by the ends of the names."""

TIMEOUT = 600.0
"""How long it may take [s]."""


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
            "-i", "-", "-an", "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", *CODECS[kind], str(out),
        ]  # fmt: skip
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
                with suppress(BrokenPipeError), process.stdin as pipe:
                    for one in frames:
                        pipe.write(one.tobytes())
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
