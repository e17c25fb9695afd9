"""Draws the gallery's sprites: ``python scripts/sprites/make_sprites.py`` writes them beside this file.

Everything is drawn in the sprite's own frame: pixels, origin in the lower-left corner, y up, which is the frame
in which scripts give a sprite's anchors. Shapes are drawn eight times as large and averaged down with
premultiplied alpha, so edges are smooth and carry no halo. The output is the same at every run.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

from PIL import Image, ImageDraw

OVERSAMPLING = 8

OUTLINE = "#22303a"
STEEL = "#b8c4cc"
LIGHT = "#e3e9ed"
DARK = "#7b8b97"
IRON = "#97a7b2"
RED = "#b8433a"
DEEP_RED = "#8f2f29"
BRASS = "#d9b25a"
GREEN = "#5d8a63"
BLUE = "#4f7ea8"
STEAM = "#f6ead2"
EXHAUST = "#dfe7ec"
PAPER = "#f3f0e8"
GROUND = "#8c7b66"

Point = tuple[float, float]


class Sprite:
    """A drawing of ``width`` by ``height`` pixels, y up; ``line`` is the outline's thickness in pixels."""

    def __init__(self, width: int, height: int, line: float = 1.6) -> None:
        self.width, self.height, self.line = width, height, line
        self._image = Image.new("RGBA", (width * OVERSAMPLING, height * OVERSAMPLING), (0, 0, 0, 0))
        self._draw = ImageDraw.Draw(self._image)

    def _at(self, point: Point) -> Point:
        return point[0] * OVERSAMPLING, (self.height - point[1]) * OVERSAMPLING

    def _stroke(self, points: Sequence[Point], closed: bool, width: float, color: str) -> None:
        pixels = [self._at(p) for p in points]
        if closed:
            pixels.append(pixels[0])
        thick = width * OVERSAMPLING
        self._draw.line(pixels, fill=color, width=round(thick))
        for x, y in pixels:
            self._draw.ellipse((x - thick / 2, y - thick / 2, x + thick / 2, y + thick / 2), fill=color)

    def polygon(self, points: Sequence[Point], fill: str | None, outline: str | None = OUTLINE) -> None:
        """A filled polygon with a dark outline."""
        if fill is not None:
            self._draw.polygon([self._at(p) for p in points], fill=fill)
        if outline is not None:
            self._stroke(points, True, self.line, outline)

    def box(
        self, left: float, bottom: float, right: float, top: float, fill: str | None, outline: str | None = OUTLINE
    ) -> None:
        """A rectangle given by its edges."""
        self.polygon([(left, bottom), (right, bottom), (right, top), (left, top)], fill, outline)

    def polyline(self, points: Sequence[Point], width: float, color: str = OUTLINE) -> None:
        """An open stroke with round ends and joins."""
        self._stroke(points, False, width, color)

    def rod(self, points: Sequence[Point], width: float, fill: str) -> None:
        """A stroke of ``width`` with an outline around it."""
        self.polyline(points, width + 2 * self.line)
        self.polyline(points, width, fill)

    def disc(self, center: Point, radius: float, fill: str | None, outline: str | None = OUTLINE) -> None:
        """A disc whose outline lies inside ``radius``."""
        x, y = self._at(center)
        r = radius * OVERSAMPLING
        if outline is not None:
            self._draw.ellipse((x - r, y - r, x + r, y + r), fill=outline)
            r -= self.line * OVERSAMPLING
        self._draw.ellipse((x - r, y - r, x + r, y + r), fill=(0, 0, 0, 0) if fill is None else fill)

    def pin(self, center: Point, radius: float = 4.0) -> None:
        """A pin seen from its end."""
        self.disc(center, radius, LIGHT)
        self.disc(center, radius * 0.35, OUTLINE, None)

    def arc(self, center: Point, radius: float, start_deg: float, end_deg: float, steps: int = 48) -> list[Point]:
        """Points along an arc, counter-clockwise from ``start_deg``."""
        angles = (math.radians(start_deg + (end_deg - start_deg) * k / steps) for k in range(steps + 1))
        return [(center[0] + radius * math.cos(a), center[1] + radius * math.sin(a)) for a in angles]

    def clear(self, left: float, bottom: float, right: float, top: float) -> None:
        """Makes a rectangle transparent again: a hole."""
        (x0, y0), (x1, y1) = self._at((left, top)), self._at((right, bottom))
        self._draw.rectangle((x0, y0, x1, y1), fill=(0, 0, 0, 0))

    def save(self, path: Path) -> None:
        """Averages down and writes a straight-alpha PNG."""
        small = self._image.convert("RGBa").reduce(OVERSAMPLING).convert("RGBA")
        small.save(path, optimize=True)


def rim(sprite: Sprite, center: Point, radius: float, color: str, *, tyre: bool) -> None:
    """A wheel's rim, 18 thick, with or without a steel tyre on it."""
    sprite.disc(center, radius, STEEL if tyre else color)
    if tyre:
        sprite.disc(center, radius - 7, color)
    sprite.disc(center, radius - 18, None)


def spokes(sprite: Sprite, middle: float, radius: float, throw: float, count: int, color: str, deep: str) -> None:
    """What is inside a rim of ``radius``: spokes, counterweight, crank and hub; crank pin ``throw`` to the right."""
    center, hole = (middle, middle), radius - 18
    for k in range(count):
        angle = 2 * math.pi * (k + 0.5) / count
        end = (middle + (hole + 2) * math.cos(angle), middle + (hole + 2) * math.sin(angle))
        sprite.polyline([center, end], 6, color)
    # the counterweight fills the rim's inside opposite the crank
    sprite.polygon(sprite.arc(center, hole + 1, 140, 220), deep)
    sprite.rod([center, (middle + throw, middle)], 20, color)
    sprite.disc(center, 17, deep)
    sprite.disc(center, 10, STEEL)
    sprite.pin((middle + throw, middle), 7)


def wheel(
    size: int, radius: float, throw: float, count: int, color: str, deep: str, *, tyre: bool, line: float = 1.6
) -> Sprite:
    """A spoked wheel about the middle of a ``size`` square, its crank pin at ``throw`` to the right."""
    sprite = Sprite(size, size, line)
    rim(sprite, (size / 2, size / 2), radius, color, tyre=tyre)
    spokes(sprite, size / 2, radius, throw, count, color, deep)
    return sprite


def flywheel() -> Sprite:
    """160 × 160: C = [80,80], crank pin P = C + [45,0]."""
    return wheel(160, 78, 45, 6, GREEN, "#426a49", tyre=False)


def driving_wheel() -> Sprite:
    """180 × 180: C = [90,90], crank pin P = C + [40,0]; its lines are thick enough to be shown at two thirds."""
    return wheel(180, 88, 40, 12, RED, DEEP_RED, tyre=True, line=2.5)


def wheel_centre() -> Sprite:
    """180 × 180: the same wheel without its rim, for scenes whose backdrop shows that: a turning circle looks still."""
    sprite = Sprite(180, 180)
    spokes(sprite, 90, 88, 40, 12, RED, DEEP_RED)
    return sprite


def connecting_rod(length: float, big: float, small: float, color: str) -> Sprite:
    """A tapered rod: big end at [20,20], small end ``length`` to its right; 40 high."""
    sprite = Sprite(round(length) + 40, 40)
    a, b = (20.0, 20.0), (20.0 + length, 20.0)
    sprite.disc(a, big, color)
    sprite.disc(b, small, color)
    sprite.polygon([(a[0] + big - 3, 26), (b[0] - small + 2, 24), (b[0] - small + 2, 16), (a[0] + big - 3, 14)], color)
    sprite.polygon(
        [(a[0] + big + 6, 21.5), (b[0] - small - 6, 21), (b[0] - small - 6, 19), (a[0] + big + 6, 18.5)], DARK, None
    )
    sprite.disc(a, big - 4, BRASS)
    sprite.pin(a, 6)
    sprite.pin(b, 5)
    return sprite


def coupling_rod() -> Sprite:
    """180 × 30: eyes at [15,15] and 150 to its right."""
    sprite = Sprite(180, 30)
    sprite.rod([(15, 15), (165, 15)], 8, STEEL)
    for x in (15.0, 165.0):
        sprite.disc((x, 15), 12, STEEL)
        sprite.pin((x, 15), 6)
    return sprite


def slide_valve(half_outer: float, half_inner: float, spindle: float) -> Sprite:
    """A D valve in section, face down; its middle is at [spindle + 6, 14] and its spindle's eye at [6,14]."""
    sprite = Sprite(math.ceil(spindle + half_outer + 18), 28)
    x = 6 + spindle
    sprite.rod([(6, 14), (x + half_outer + 7, 14)], 3, STEEL)
    outline = [
        (x - half_outer, 0.8), (x - half_inner, 0.8), (x - half_inner + 3, 10), (x + half_inner - 3, 10),
        (x + half_inner, 0.8), (x + half_outer, 0.8), (x + half_outer, 7), (x + half_inner, 20),
        (x - half_inner, 20), (x - half_outer, 7),
    ]  # fmt: skip
    sprite.polygon(outline, BRASS)
    sprite.pin((6, 14), 5)
    return sprite


def engine_piston(rod: float, bore: float, drop: float | None) -> Sprite:
    """Crosshead, piston rod and piston. The crosshead's pin is at [30, 50], the piston's middle ``rod`` to its right.

    With ``drop``, an arm hangs from the crosshead to a pin that far below (for a union link).
    """
    sprite = Sprite(round(rod) + 50, 100)
    x, y = 30.0, 50.0
    sprite.rod([(x, y), (x + rod, y)], 6, LIGHT)
    if drop is not None:
        sprite.polygon([(x - 9, y - 10), (x + 9, y - 10), (x + 5, y - drop - 5), (x - 5, y - drop - 5)], STEEL)
        sprite.pin((x, y - drop), 4)
    sprite.polygon(
        [
            (x - 22, y - 16),
            (x + 22, y - 16),
            (x + 22, y - 10),
            (x + 28, y - 5),
            (x + 28, y + 5),
            (x + 22, y + 10),
            (x + 22, y + 16),
            (x - 22, y + 16),
        ],
        IRON,
    )
    sprite.pin((x, y), 6)
    half = bore / 2
    sprite.box(x + rod - 8, y - half + 1, x + rod + 8, y + half - 1, DARK)
    for offset in (-4.0, 4.0):
        sprite.polyline([(x + rod + offset, y - half + 2), (x + rod + offset, y + half - 2)], 1.4)
    return sprite


def cylinder(
    sprite: Sprite, middle: Point, stroke: float, bore: float, valve: float, lap_edge: float, port: float
) -> None:
    """A cylinder with its steam chest in section, drawn into a backdrop.

    ``middle`` is the bore's middle; the piston is 16 thick and has 4 to spare at each end. ``valve`` is the height of
    the valve spindle above the piston rod; ``lap_edge`` the distance from the chest's middle to a steam port's outer
    edge, ``port`` its width.
    """
    x, y = middle
    half, length = bore / 2, stroke / 2 + 8 + 4
    face = y + valve - 14
    wall = 8.0
    sprite.box(x - length - wall, y - half - wall, x + length + wall, face, IRON)
    sprite.box(x - length, y - half, x + length, y + half, EXHAUST)
    # the steam chest
    chest = lap_edge + 30
    sprite.box(x - chest - 6, face - 1, x + chest + 6, face + 44, IRON)
    sprite.box(x - chest, face, x + chest, face + 38, STEAM)
    # steam passages from the valve face to the cylinder's ends, and the exhaust in the middle
    for side in (-1.0, 1.0):
        outer, inner = x + side * lap_edge, x + side * (lap_edge - port)
        end = x + side * (length - port - 1)
        floor = y + half
        bend = (face + floor) / 2
        passage = [
            (inner, face + 1), (outer, face + 1), (outer, bend + port / 2), (end + side * port, bend + port / 2 - 2),
            (end + side * port, floor - 1), (end, floor - 1), (end, bend - port / 2 - 2), (inner, bend - port / 2 + 1),
        ]  # fmt: skip
        sprite.polygon(passage, EXHAUST, None)
        sprite.polyline([passage[1], passage[2], passage[3], passage[4]], sprite.line)
        sprite.polyline([passage[5], passage[6], passage[7], passage[0]], sprite.line)
    well = (lap_edge - port) * 0.5
    sprite.box(x - well, face - (face - y - half) * 0.55, x + well, face + 1, "#c3d0d8")
    sprite.polygon(
        [(x - well + 1, face - 1), (x + well - 1, face - 1), (x + well - 1, face + 2), (x - well + 1, face + 2)],
        "#c3d0d8",
        None,
    )
    # stuffing boxes
    sprite.box(x - length - wall - 10, y - 9, x - length - wall, y + 9, DARK)
    sprite.box(x - length - wall, y - 4, x - length, y + 4, EXHAUST, None)
    sprite.box(x - chest - 16, face + 7, x - chest - 6, face + 21, DARK)


def guides(sprite: Sprite, left: float, right: float, y: float) -> None:
    """A pair of slide bars for a crosshead 32 high."""
    for side in (-1.0, 1.0):
        low, high = sorted((y + side * 16, y + side * 23))
        sprite.box(left, low, right, high, STEEL)


def pillow_block(sprite: Sprite, center: Point, foot: float) -> None:
    """A bearing on a foot that stands at height ``foot``."""
    x, y = center
    sprite.polygon([(x - 14, y), (x - 34, foot), (x + 34, foot), (x + 14, y)], DARK)
    sprite.disc(center, 16, DARK)


def slider_crank_frame() -> Sprite:
    """560 × 300, the stationary parts of the steam engine: axle at (110,150), cylinder's middle at (425,150)."""
    sprite = Sprite(560, 300)
    sprite.box(20, 30, 540, 48, DARK)
    pillow_block(sprite, (110, 150), 48)
    sprite.polygon([(380, 60), (360, 48), (490, 48), (470, 60), (470, 110), (380, 110)], DARK)
    cylinder(sprite, (425, 150), 90, 64, 62, 32, 7)
    guides(sprite, 196, 352, 150)
    sprite.box(196, 48, 206, 127, DARK)
    return sprite


def walschaerts_frame() -> Sprite:
    """640 × 300: axle at (100,130), trunnion at (230,190), weigh shaft at (315,240), cylinder's middle at (520,130)."""
    sprite = Sprite(640, 300)
    sprite.box(0, 36, 640, 42, GROUND)
    sprite.box(0, 30, 640, 37, DARK, None)
    sprite.box(40, 120, 460, 140, "#55606a", OUTLINE)
    rim(sprite, (100, 130), 88, RED, tyre=True)
    cylinder(sprite, (520, 130), 80, 60, 76.8, 30, 8)
    guides(sprite, 262, 410, 130)
    sprite.polygon([(262, 107), (262, 153), (252, 153), (252, 107)], DARK)
    # brackets of the expansion link's trunnion and of the weigh shaft
    sprite.polygon([(216, 140), (244, 140), (240, 190), (220, 190)], "#6b7882")
    sprite.polygon([(296, 153), (334, 153), (325, 240), (305, 240)], "#6b7882")
    sprite.disc((315, 240), 10, DARK)
    return sprite


def curved_slot(
    sprite: Sprite, center: Point, radius: float, half_angle_deg: float, facing: float, width: float
) -> None:
    """A slotted link: an arc of ``radius`` about ``center``, in direction ``facing`` from there."""
    frame = sprite.arc(center, radius, facing - half_angle_deg, facing + half_angle_deg)
    slot = sprite.arc(center, radius, facing - half_angle_deg + 1.6, facing + half_angle_deg - 1.6)
    sprite.rod(frame, width, BLUE)
    sprite.rod(slot, width * 0.42, PAPER)


def expansion_link() -> Sprite:
    """70 × 130: trunnion T = [40,75], foot G = T - [10,60]; the slot's centre of curvature is T + [175,0]."""
    sprite = Sprite(70, 130)
    sprite.polygon([(30, 40), (48, 40), (36, 12), (24, 12)], BLUE)
    sprite.disc((30, 15), 9, BLUE)
    curved_slot(sprite, (215, 75), 175, 14.5, 180, 18)
    sprite.pin((30, 15), 4.5)
    return sprite


def combination_lever() -> Sprite:
    """30 × 146: V = [15,132], F = V - [0,18.2], B = F - [0,104]."""
    sprite = Sprite(30, 146)
    pins = (132.0, 132 - 18.2, 132 - 18.2 - 104)
    sprite.rod([(15, pins[0]), (15, pins[2])], 9, BRASS)
    for y in pins:
        sprite.disc((15, y), 8, BRASS)
    for y in pins:
        sprite.pin((15, y), 4)
    return sprite


def oscillating_stand() -> Sprite:
    """400 × 420: the shaft at (200,300), the trunnion at (200,110)."""
    sprite = Sprite(400, 420)
    sprite.box(60, 16, 340, 34, DARK)
    sprite.polygon([(120, 34), (280, 34), (222, 300), (178, 300)], "#c9d2d8")
    sprite.disc((200, 300), 26, DARK)
    return sprite


def oscillating_cylinder() -> Sprite:
    """80 × 150: the trunnion T = [40,70]; the bore runs along the middle."""
    sprite = Sprite(80, 150)
    sprite.box(8, 6, 72, 130, IRON)
    sprite.box(18, 12, 62, 128, STEAM)
    sprite.box(26, 130, 54, 142, DARK)
    sprite.box(35, 128, 45, 142, STEAM, None)
    sprite.disc((40, 70), 7, None, OUTLINE)
    return sprite


def oscillating_piston() -> Sprite:
    """60 × 230: the crank pin P = [30,210]; the piston's middle is 190 below it."""
    sprite = Sprite(60, 230)
    sprite.rod([(30, 210), (30, 20)], 6, LIGHT)
    sprite.box(9, 11, 51, 29, DARK)
    for y in (16.0, 24.0):
        sprite.polyline([(10, y), (50, y)], 1.4)
    sprite.disc((30, 210), 13, BRASS)
    sprite.pin((30, 210), 6)
    return sprite


def crank_disc() -> Sprite:
    """140 × 140: C = [70,70], pin P = C + [50,0]."""
    sprite = Sprite(140, 140)
    sprite.disc((70, 70), 66, STEEL)
    sprite.disc((70, 70), 59, IRON)
    sprite.disc((70, 70), 13, DARK)
    sprite.pin((120, 70), 8)
    return sprite


def yoke() -> Sprite:
    """420 × 150: the slot's middle O = [210,75]; rods reach 200 to either side."""
    sprite = Sprite(420, 150)
    sprite.rod([(10, 75), (410, 75)], 11, STEEL)
    sprite.box(190, 6, 230, 144, BRASS)
    sprite.box(201, 14, 219, 136, PAPER)
    sprite.clear(202, 15, 218, 135)
    return sprite


def yoke_frame() -> Sprite:
    """520 × 220: the shaft at (260,110); guides for the yoke's rods."""
    sprite = Sprite(520, 220)
    sprite.box(30, 14, 490, 28, DARK)
    for x in (106.0, 414.0):
        sprite.box(x - 18, 28, x + 18, 98, "#c9d2d8")
        sprite.box(x - 24, 92, x + 24, 128, IRON)
    return sprite


def trammel_base() -> Sprite:
    """400 × 400: two crossed grooves about (200,200)."""
    sprite = Sprite(400, 400)
    sprite.disc((200, 200), 130, "#d8b98c")
    sprite.box(184, 84, 216, 316, "#a57f4f")
    sprite.box(84, 184, 316, 216, "#a57f4f")
    sprite.box(184.8, 185, 215.2, 215, "#a57f4f", None)
    return sprite


def slide_block() -> Sprite:
    """40 × 28: a block that slides in a groove, its pin O = [20,14]."""
    sprite = Sprite(40, 28)
    sprite.box(2, 1, 38, 27, BRASS)
    return sprite


def eccentrics() -> Sprite:
    """120 × 120: the axle C = [60,60] with the two eccentrics' sheaves, 20 from it at 104° and -104°."""
    sprite = Sprite(120, 120)
    for side, color in ((-1.0, IRON), (1.0, STEEL)):
        angle = math.radians(side * 104)
        sprite.disc((60 + 20 * math.cos(angle), 60 + 20 * math.sin(angle)), 32, color)
    sprite.disc((60, 60), 13, DARK)
    sprite.polyline([(60, 60), (71, 60)], 2)
    return sprite


def eccentric_rod(color: str) -> Sprite:
    """280 × 80: the strap's middle E = [40,40], the pin 220 to its right."""
    sprite = Sprite(280, 80)
    sprite.polygon([(70, 51), (252, 44), (252, 36), (70, 29)], color)
    sprite.disc((40, 40), 39, color)
    sprite.disc((40, 40), 32, None)
    sprite.disc((260, 40), 9, color)
    sprite.pin((260, 40), 4.5)
    return sprite


def stephenson_link() -> Sprite:
    """60 × 130: the slot's middle S = [35,65], its centre of curvature S - [220,0]; pins 45 above and below S."""
    sprite = Sprite(60, 130)
    for y in (20.0, 110.0):
        sprite.disc((35, y), 11, BLUE)
    curved_slot(sprite, (-185, 65), 220, 10.5, 0, 18)
    for y in (20.0, 110.0):
        sprite.pin((35, y), 4.5)
    return sprite


def stephenson_frame() -> Sprite:
    """600 × 300: axle at (90,130), valve spindle along y = 130, weigh shaft at (350,210), chest's middle at 484.4."""
    sprite = Sprite(600, 300)
    face, middle, floor = 116.0, 484.4, 34.0
    sprite.box(20, floor - 12, 580, floor, DARK)
    sprite.box(middle - 60, floor, middle + 60, face, IRON)
    for side in (-1.0, 1.0):
        low, high = sorted((middle + side * 30, middle + side * 22))
        sprite.box(low, 60, high, face + 1, EXHAUST)
    sprite.box(middle - 10, 60, middle + 10, face + 1, "#c3d0d8")
    sprite.box(middle - 66, face, middle + 66, face + 44, IRON)
    sprite.box(middle - 60, face + 1, middle + 60, face + 38, STEAM)
    sprite.box(middle - 76, face + 6, middle - 66, face + 22, DARK)
    sprite.box(350, face + 5, 382, face + 23, DARK)
    sprite.box(356, floor, 376, face + 5, "#6b7882")
    sprite.polygon([(341, 139), (359, 139), (356, 210), (344, 210)], "#6b7882")
    sprite.disc((350, 210), 10, DARK)
    return sprite


def track() -> Sprite:
    """1000 × 34: a rail on sleepers, one tenth of the wheels' circumference apart (radius 57.2); rail head at 32."""
    sprite = Sprite(1000, 34)
    pitch = 2 * math.pi * 57.2 / 10
    k = 0
    while k * pitch < 1000:
        sprite.box(k * pitch + 6, 6, k * pitch + 22, 22, GROUND)
        k += 1
    sprite.box(-4, 22, 1004, 32, DARK)
    return sprite


SPRITES: dict[str, Callable[[], Sprite]] = {
    "flywheel": flywheel,
    "driving-wheel": driving_wheel,
    "wheel-centre": wheel_centre,
    "connecting-rod": lambda: connecting_rod(165, 15, 12, STEEL),
    "coupling-rod": coupling_rod,
    "main-rod": lambda: connecting_rod(230, 14, 11, STEEL),
    "engine-piston": lambda: engine_piston(150, 64, None),
    "engine-valve": lambda: slide_valve(32 + 3.8, 32 - 7, 124),
    "engine-frame": slider_crank_frame,
    "walschaerts-frame": walschaerts_frame,
    "walschaerts-piston": lambda: engine_piston(190, 60, 36),
    "walschaerts-valve": lambda: slide_valve(30 + 6, 30 - 8, 115),
    "expansion-link": expansion_link,
    "combination-lever": combination_lever,
    "oscillating-stand": oscillating_stand,
    "oscillating-cylinder": oscillating_cylinder,
    "oscillating-piston": oscillating_piston,
    "crank-disc": crank_disc,
    "yoke": yoke,
    "yoke-frame": yoke_frame,
    "trammel-base": trammel_base,
    "slide-block": slide_block,
    "eccentrics": eccentrics,
    "forward-rod": lambda: eccentric_rod("#d08b5b"),
    "backward-rod": lambda: eccentric_rod("#8fae7d"),
    "stephenson-link": stephenson_link,
    "stephenson-frame": stephenson_frame,
    "stephenson-valve": lambda: slide_valve(30 + 6, 30 - 8, 180),
    "track": track,
}


def main() -> None:
    """Writes every sprite beside this file."""
    folder = Path(__file__).resolve().parent
    for name, draw in SPRITES.items():
        draw().save(folder / f"{name}.png")


if __name__ == "__main__":
    main()
