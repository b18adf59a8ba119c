"""Write docs/playback.gif: the playback of one exported scenario, as README shows it.

It needs the extra ``browser``, Chromium, Pillow and a run:

    bridgegen search cyclist-right-turn --ego un-r157 --budget 400 --out runs/cyclist \\
        --fix sun_altitude_angle=50 --fix fog_density=0 --fix precipitation=0 --fix cloudiness=0
    python docs/make_playback.py runs/cyclist --chromium /usr/bin/chromium --end 8.5
"""

import argparse
import io
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

SIZE = {"width": 1280, "height": 900}
FRAMES_PER_SECOND = 8
WIDTH = 760  # px
COLOURS = 64
STEP = 0.05  # s, of the slider
MOVE = "(slider, k) => { slider.value = k; slider.dispatchEvent(new Event('input')); }"


def frames(report: Path, chromium: str, scenario: str, times: list[float]) -> list[Image.Image]:
    """Return a picture of the playback's road view for each time [s] of ``times``."""
    found = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_page(viewport=SIZE, color_scheme="light", reduced_motion="reduce")
        page.goto(f"{report.absolute().as_uri()}#{scenario}")
        page.wait_for_function("document.querySelector('#scrub').max > 0")
        page.evaluate("document.querySelector('#player').scrollIntoView()")
        page.locator("#scene").focus()
        page.keyboard.press("e")  # the view follows the ego
        page.add_style_tag(content=".over:has(#zoom-in) { display: none } #scene { outline: none }")
        view = page.locator("#scene")
        for time in times:
            page.locator("#scrub").evaluate(MOVE, round(time / STEP))
            page.wait_for_timeout(60)
            area = view.bounding_box()
            found.append(Image.open(io.BytesIO(page.screenshot(clip=area))).convert("RGB"))
        browser.close()
    return found


def main() -> None:
    """Write the animation."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path, help="folder of a finished search")
    parser.add_argument("--scenario", default="0001", help="name of an exported scenario")
    parser.add_argument("--start", type=float, default=0.0, help="first instant [s]")
    parser.add_argument("--end", type=float, default=10.0, help="last instant [s]")
    parser.add_argument("--chromium", default="/usr/bin/chromium")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "playback.gif")
    given = parser.parse_args()
    count = round((given.end - given.start) * FRAMES_PER_SECOND) + 1
    times = [given.start + k / FRAMES_PER_SECOND for k in range(count)]
    shots = frames(given.run / "report.html", given.chromium, given.scenario, times)
    height = round(shots[0].height * WIDTH / shots[0].width)
    small = [one.resize((WIDTH, height), Image.Resampling.LANCZOS) for one in shots]
    palette = small[len(small) // 2].quantize(COLOURS)
    images = [one.quantize(palette=palette, dither=Image.Dither.NONE) for one in small]
    durations = [round(1000 / FRAMES_PER_SECOND)] * (count - 1) + [2000]
    rest = images[1:]
    images[0].save(given.out, save_all=True, append_images=rest, duration=durations, loop=0)
    print(f"{given.out}: {count} frames, {given.out.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
