"""The slider-crank of 240 frames with matplotlib's FuncAnimation and its Pillow writer, positions computed by hand."""

import math
import sys

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.animation import FuncAnimation, PillowWriter

FRAMES, FPS = 240, 25

figure = plt.figure(figsize=(6, 4), dpi=100)
axes = figure.add_axes((0, 0, 1, 1))
axes.set_xlim(0, 600)
axes.set_ylim(0, 400)
axes.axis("off")
point = 72 / 100
(crank,) = axes.plot([], [], color="steelblue", linewidth=7 * point, solid_capstyle="round")
(rod,) = axes.plot([], [], color="darkorange", linewidth=7 * point, solid_capstyle="round")
(slider,) = axes.plot([], [], color="dimgray", linewidth=20 * point, solid_capstyle="round")


def draw(frame):
    angle = math.radians(1.5 * frame)
    x, y = 150 + 80 * math.cos(angle), 200 + 80 * math.sin(angle)
    end = x + math.sqrt(260**2 - (y - 200) ** 2)
    crank.set_data([150, x], [200, y])
    rod.set_data([x, end], [y, 200])
    slider.set_data([end - 30, end + 30], [200, 200])
    return crank, rod, slider


FuncAnimation(figure, draw, frames=FRAMES, blit=True).save(sys.argv[1], writer=PillowWriter(fps=FPS))
