"""The slider-crank of 240 frames with Manim (Cairo renderer), positions computed by hand, written as a GIF."""

import math
import shutil
import sys
import tempfile
from pathlib import Path

from manim import BLUE, GRAY, ORANGE, WHITE, Line, Scene, ValueTracker, linear, tempconfig

FRAMES, FPS = 240, 25
UNIT = 8 / 400  # Manim's frame is 8 units high


def place(x, y):
    return [(x - 300) * UNIT, (y - 200) * UNIT, 0]


class SliderCrank(Scene):
    def construct(self):
        turn = ValueTracker(0.0)

        def points():
            angle = turn.get_value()
            x, y = 150 + 80 * math.cos(angle), 200 + 80 * math.sin(angle)
            return x, y, x + math.sqrt(260**2 - (y - 200) ** 2)

        def crank(line):
            x, y, _ = points()
            line.put_start_and_end_on(place(150, 200), place(x, y))

        def rod(line):
            x, y, end = points()
            line.put_start_and_end_on(place(x, y), place(end, 200))

        def slider(line):
            _, _, end = points()
            line.put_start_and_end_on(place(end - 30, 200), place(end + 30, 200))

        for color, width, update in ((BLUE, 9, crank), (ORANGE, 9, rod), (GRAY, 26, slider)):
            line = Line(place(0, 0), place(10, 0), color=color, stroke_width=width)
            line.add_updater(update, call_updater=True)
            self.add(line)
        self.play(turn.animate.set_value(2 * math.pi), run_time=FRAMES / FPS, rate_func=linear)


with tempfile.TemporaryDirectory() as folder:
    settings = {
        "media_dir": folder,
        "pixel_width": 600,
        "pixel_height": 400,
        "frame_height": 8.0,
        "frame_width": 12.0,
        "frame_rate": FPS,
        "format": "gif",
        "background_color": WHITE,
        "verbosity": "ERROR",
        "progress_bar": "none",
        "disable_caching": True,
        "output_file": "slider",
    }
    with tempconfig(settings):
        SliderCrank().render()
    made = next(Path(folder).rglob("*.gif"))
    shutil.copy(made, sys.argv[1])
