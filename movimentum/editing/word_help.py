"""One-line explanations of the language's own words, for completion and hover."""

from __future__ import annotations

from movimentum.syntax.vocabulary import FUNCTIONS, SYNONYMS
from movimentum.things.option_rules import OptionForm, OptionRule
from movimentum.things.registry import KINDS

ITEMS: dict[str, tuple[str, str]] = {
    "config": (".config(fps, width, height)", "Frames per time unit, and the size of the picture in pixels."),
    "let": (".let name = value;", "A constant. `--set name=…` gives it another value."),
    "part": (".part Name(parameters) { … }", "A reusable group of things and statements."),
    "body": (
        ".body Name = Shape + Shape - Hole;",
        "One rigid thing of several shapes; those with a minus are cut out.",
    ),
    "for": (".for k = 1..3 { … }", "Repeats things and statements, once for each whole number."),
    "include": (".include 'file.mov';", "The constants and parts of another file."),
    "claim": (".claim left = right;", "An expected result: it moves nothing, and is checked in every frame."),
    "goal": (".goal left = right;", "What `fit` tries to achieve."),
    "require": (".require left < right;", "What must hold, whatever else `fit` finds."),
    "loop": ("@2 .loop;", "The film begins again at its end."),
    "view": (".view([x,y], zoom);", "The camera goes there in this step: the point is in the middle of the picture."),
}
"""Words that begin an item: how it is written, and what it does."""

KIND_HELP: dict[str, tuple[str, str]] = {
    "bar": (".bar A = [x,y]  B = …", "A line through its anchors, two or more: a link."),
    "arrow": (".arrow A = [x,y]  B = …", "A line through its anchors with a head at the last one."),
    "disc": (".disc(radius)  C = [x,y]", "A circle about its first anchor."),
    "label": (".label('text')  at = [x,y]", "A text at its first anchor. `{x:.1f}` in it is a number of the script."),
    "plate": (".plate A = [x,y]  B = …", "The rounded plate around its anchors, two or more."),
    "polygon": (".polygon A = [x,y]  B = …  C = …", "The filled polygon through its anchors, three or more."),
    "curve": (
        ".curve C = [x,y]  .polar(th, 40 + 9*.cos(2*th))",
        "A curve: `.polar`, `.param`, `.through` or `.points`.",
    ),
    "cut": (".cut Tool .in Thing", "The profile that a moving outline cuts in another thing."),
    "body": (
        ".body Name = Shape + Shape - Hole;",
        "One rigid thing of several shapes; those with a minus are cut out.",
    ),
    "gear": (".gear(teeth, module)  C = [x,y]", "A gear wheel about its first anchor; with `.inner` a ring."),
    "rack": (".rack(teeth, module)  A = [x,y]  B = …", "A toothed rack along its first two anchors."),
    "ground": (".ground Thing.P", "The hatched support under a fixed pin."),
    "line": (".line Thing.P Other.Q …", "A line through anchors of other things, which it follows."),
    "slide": (".slide Thing.A Thing.B", "Two guides along the line from A to B."),
    "cord": (".cord A.P Wheel B.Q", "A taut cord about wheels; `-Wheel` has the wheel on its left."),
    "spring": (".spring A.P B.Q", "A spring between two anchors, drawn for their distance."),
    "damper": (".damper A.P B.Q", "A damper between two anchors, drawn for their distance."),
    "cylinder": (".cylinder A.P B.Q", "A cylinder between two anchors; its barrel is at the first one."),
    "trace": (".trace Thing.P", "The path of an anchor; with `.whole` that of the whole film."),
    "dimension": (".dimension A.P B.Q", "A dimension line beside two anchors, with their distance."),
    "arc": (".arc A.P B.Q C.R", "The arc of the angle at the second anchor, with its value."),
    "vector": (".vector Thing.P .velocity(0.2)", "An arrow at an anchor: its velocity, or its `.acceleration(…)`."),
    "area": (".area A.P B.Q C.R", "The filled area with corners at anchors of other things."),
    "right": (".right A.P B.Q C.R", "The sign of the right angle at the second anchor."),
    "ticks": (".ticks A.P B.Q", "Short strokes across a line: lines with equally many are equally long."),
    "parallel": (".parallel A.P B.Q", "Arrowheads on a line: lines with equally many are parallel."),
    "graph": (".graph …  at = [x,y]", "A graph of values over time."),
    "inset": (".inset(Thing.P, zoom)  at = [x,y]", "A detail beside the film, larger."),
    "velocities": (".velocities …", "A figure of velocities."),
    "centre": (".centre Thing", "The instant centre of a thing."),
    "polode": (".polode Thing .fixed", "The path of the instant centre of a thing; `.moving` in the thing itself."),
    "inflection": (".inflection Thing", "The inflection circle of a thing."),
    "ring": (".ring(outer, inner)  C = [x,y]", "A ring about its first anchor."),
    "sector": (".sector(radius, begin, end)  C = [x,y]", "A sector about its first anchor; angles in degrees."),
    "bezier": (".bezier  A = [x,y] …", "A Bézier curve: three points, or four, seven, ten …"),
    "group": (".group Thing Other", "Things that fade, appear and lie on a layer together."),
    "skeleton": (".skeleton Thing", "A thing as its joints and the lines between them."),
    "sprite": ("'file.png'  A = [x,y]", "A picture; its anchors are in the picture's pixels."),
}

OPTION_HELP: dict[str, tuple[str, str]] = {
    "color": (".color('orange')", "The colour; of filled things, the colour of the inside."),
    "fill": (".fill('gold')", "The colour of the inside."),
    "edge": (".edge('navy')", "The colour of the edge."),
    "width": (".width(3)", "The width of the line in pixels; of a plate, how broad it is around an anchor."),
    "dash": (".dash(6, 4)", "Lengths of dashes and gaps in turn, in pixels."),
    "cap": (".cap('butt')", "The ends of lines: `'round'`, `'butt'` or `'square'`."),
    "opacity": (".opacity(0.5)", "0 (clear) to 1."),
    "pins": (".pins(4)", "Circles of that radius at the joints."),
    "supports": (".supports", "Drawn with supports at its joints; it does not fix the thing."),
    "fixed": (".fixed", "The older word for `.supports`."),
    "through": (".through(A, B)", "The anchors that it is drawn through."),
    "layer": (".layer(2)", "Higher is nearer. Without it, the number of the definition."),
    "still": (".still", "The camera leaves it where it is."),
    "hidden": (".hidden", "Takes part in the motion, but is not drawn."),
    "scale": (".scale(0.25)", "The size of an image pixel in world pixels."),
    "topleft": (".topleft", "Anchors count from the picture's upper left corner."),
    "inner": (".inner", "A ring: the teeth point inwards."),
    "size": (".size(18)", "The height of the letters, or how broad the symbol is."),
    "align": (".align('center')", "Where the text is at its anchor: `'left'`, `'center'` or `'right'`."),
    "italic": (".italic", "Slanted letters."),
    "text": (".text('L')", "A text instead of the value."),
    "places": (".places(1)", "Decimals of the value."),
    "offset": (".offset(24)", "How far the line is to the left of A→B; negative: to the right."),
    "radius": (".radius(28)", "The radius of the arc."),
    "coils": (".coils(8)", "How many coils."),
    "whole": (".whole", "The path of the whole film; of an arc, the counter-clockwise one."),
    "arcto": (".arcto(M, B)", "The edge to B is an arc through M; `.arcto(B, 30)`: with a radius."),
    "follows": (".follows(Rim)", "The letters of a label stand along a thing: a disc, a line, a trace …"),
    "while": (".while(Crank.angle < 180)", "The condition under which a trace draws."),
    "tail": (".tail(1.5)", "Only what was drawn in the last so many time units, fading."),
    "velocity": (".velocity(0.2)", "The velocity, so many pixels long for each pixel a time unit."),
    "acceleration": (
        ".acceleration(0.05)",
        "The acceleration, so many pixels long for each pixel a time unit squared.",
    ),
    "background": (".background('white')", "The colour behind everything."),
    "theme": (".theme('textbook')", "The default look of everything."),
    "at": (".at(place)", "The place of a copy; after a goal or a value, its time."),
    "turned": (".turned(90)", "How far a copy is turned, in degrees."),
    "mirrored": (".mirrored", "The copy is a mirror image."),
    "range": (".range(20, 80)", "The values that `sweep` and `fit` may give this constant."),
    "unit": (".unit('mm')", "The unit that tables and controls show."),
    "within": (".within(0.1)", "How far it may be off."),
    "weight": (".weight(10)", "How much this goal counts."),
    "speed": (".speed(60)", "The greatest speed of the wish, per time unit."),
    "pushes": (".pushes", "The inequality pushes: whatever is free gives way."),
    "weak": (".weak", "The wish is below all others, as a spring or a weight is; `.weak(2)` below `.weak`."),
    "least": (".least", "As small as can be: a weight, the pull of a spring."),
    "most": (".most", "As large as can be."),
    "holds": (".holds", "It stays as it is unless something stronger moves it."),
    "largest": (".largest", "As large as can be."),
    "smallest": (".smallest", "As small as can be."),
    "count": (".count(2)", "The number of signs side by side."),
    "bulge": (".bulge(0.2)", "The edges are arcs, so many of their lengths high; less than 0: inwards."),
    "smooth": (".smooth", "One smooth curve, without corners."),
    "offstage": (".offstage", "It may leave the canvas: no note reports it."),
    "leader": (".leader", "A thin line leads from the anchor to the text."),
    "clip": (".clip Thing", "It is seen only inside another thing."),
    "polar": (".polar", "In polar coordinates; of a curve, its radius: `.polar(th, 40 + 9*.cos(2*th))`."),
    "param": (".param(u, [80*.cos(u), 50*.sin(u)])", "The places of a curve, by a parameter from 0 to 360."),
    "points": (".points('lobe.csv')", "The points of a curve, from a file."),
    "in": (".cut Roller .in Shaft", "The thing that is cut, and that the profile moves with."),
    "outer": (".outer", "Of a cut, the edge that is farthest from the thing's first anchor."),
    "outline": (".outline([x, y], …)", "The outline of a picture for contact; of an SVG also `.outline('#id')`."),
    "open": (".open", "The curve does not return to its beginning."),
    "over": (".over(…)", "What a graph is drawn over; of a table, the column of its arguments."),
    "moving": (".moving", "As seen from the moving thing."),
    "xlabel": (".xlabel('s')", "The label of the x axis."),
    "ylabel": (".ylabel('mm')", "The label of the y axis."),
    "title": (".title('…')", "What is written above."),
    "grips": (".grips", "The wheels that a cord runs about turn with it."),
    "crossed": (".crossed", "The belt is crossed: the wheels turn against each other."),
}

FUNCTION_HELP: dict[str, tuple[str, str]] = {
    "a": (".a(u, v)", "The angle from u to v, in degrees, in (−180, 180]."),
    "q": (".q(s)", "The square root."),
    "i": (".i(s)", "The integral over time, from the beginning of the statement."),
    "d": (".d(s)", "The time derivative."),
    "sin": (".sin(s)", "The sine of degrees."),
    "cos": (".cos(s)", "The cosine of degrees."),
    "tan": (".tan(s)", "The tangent of degrees."),
    "asin": (".asin(s)", "The inverse sine, in degrees."),
    "acos": (".acos(s)", "The inverse cosine, in degrees."),
    "atan": (".atan(s)", "The inverse tangent, in degrees."),
    "atan2": (".atan2(y, x)", "The direction of [x, y], in degrees."),
    "abs": (".abs(s)", "The absolute value."),
    "min": (".min(a, b)", "The least of its arguments; with one, in a measure or goal, the least of all frames."),
    "max": (".max(a, b)", "The greatest of its arguments; with one, in a measure or goal, the greatest of all frames."),
    "floor": (".floor(s)", "The number rounded down to a whole number."),
    "mod": (".mod(a, b)", "The remainder, with the sign of b: `.mod(-30, 360)` is 330."),
    "exp": (".exp(s)", "e to the power of s."),
    "ln": (".ln(s)", "The natural logarithm."),
    "ease": (".ease(u)", "0 up to u = 0, 1 from u = 1, and smooth in between (3u² − 2u³)."),
    "across": (".across(P, A, B)", "The distance of P from the line through A and B: positive on the left of A→B."),
    "along": (".along(P, A, B)", "How far along the line from A to B the point P is."),
    "on": (
        ".on(P, Curve)",
        "How far P is from a curve: 0 on it, negative inside a closed one, or on an open one's right.",
    ),
    "where": (".where(P, Curve)", "How far along a curve the place nearest to P is: from 0 to 1."),
    "gap": (".gap(A, B)", "How far two things are apart, from outline to outline; of `Tooth[0..15]` the least."),
    "roll": (".roll(A, B) = 0;", "A and B roll on each other: the arcs that the contact travels on both are equal."),
    "point": (".point(Curve, s)", "The place on a curve at a value of `.where`, from 0 to 1."),
    "tangent": (".tangent(Curve, s)", "The direction of a curve there, a vector of length 1."),
    "curvature": (".curvature(Curve, s)", "The curvature there, 1/px: positive where it turns to the left."),
    "length": (".length(Curve)", "How long a curve is."),
    "mesh": (".mesh(A, B) = 0;", "The gears A and B run together; their teeth fit."),
    "belt": (".belt(A, B) = 0;", "A belt runs around the discs A and B."),
    "cord": (".cord(A.P, Wheel, B.Q)", "The length of a taut cord about wheels; `-Wheel` has the wheel on its left."),
    "table": (".table('file.csv', 'column', s)", "The value of a CSV file's column at s."),
    "mean": (".mean(s)", "The mean of all frames (measures and goals)."),
    "rms": (".rms(s)", "The root mean square of all frames (measures and goals)."),
    "range": (".range(s)", "The greatest less the least of all frames (measures and goals)."),
    "first": (".first(s)", "The value in the first frame (measures and goals)."),
    "last": (".last(s)", "The value in the last frame (measures and goals)."),
    "at": (".at(s, t)", "The value at the time t: in claims, measures and goals, and in statements from then on."),
}

CLOCK_HELP: dict[str, tuple[str, str]] = {
    "t": (".t", "The time since the step that states this statement."),
    "s": (".s", "How far through its step this statement is: 0 to 1."),
    "iv": (".iv", "How long this statement stays in force."),
    "T": (".T", "The absolute time."),
    "pi": (".pi", "3.14159…"),
}

MEMBER_HELP: dict[str, tuple[str, str]] = {
    "x": ("v.x", "The first coordinate."),
    "y": ("v.y", "The second coordinate."),
    "z": ("v.z", "The third coordinate: 0."),
    "l": ("v.l", "The length, never negative."),
    "length": ("v.length", "The length, never negative."),
    "angle": ("Thing.angle", "How far the thing is turned from how it was drawn, in degrees, full turns included."),
    "a": ("Thing.a", "How far the thing is turned from how it was drawn, in degrees (short for `.angle`)."),
    "opacity": ("Thing.opacity", "0 (clear) to 1."),
    "red": ("Thing.red", "0 to 255; of a picture, its tint."),
    "green": ("Thing.green", "0 to 255; of a picture, its tint."),
    "blue": ("Thing.blue", "0 to 255; of a picture, its tint."),
    "visible": ("Thing.visible", "1 or 0: whether the thing is drawn."),
    "layer": ("Thing.layer", "Things on higher layers are nearer."),
    "scale": ("Thing.scale", "How many times as large the thing is drawn, about its first anchor."),
    "r": ("v.r(degrees)", "The vector, turned counter-clockwise."),
    "rotate": ("v.rotate(degrees)", "The vector, turned counter-clockwise."),
}


def kind_help(word: str) -> tuple[str, str]:
    """How a kind of thing is written, and what it is; also one that has no line of its own above."""
    kind = KINDS.get(word)
    return KIND_HELP.get(word) or (f".{word}", "" if kind is None else f"A kind of thing: {kind.written}.")


def function_help(word: str) -> tuple[str, str]:
    """How a function is written, and what it is."""
    canonical = SYNONYMS.get(word, word)
    written, words = FUNCTION_HELP.get(canonical, (f".{canonical}({'…' if FUNCTIONS.get(canonical) else ''})", ""))
    return written.replace(f".{canonical}(", f".{word}(", 1), words


def option_help(word: str, rule: OptionRule | None = None) -> tuple[str, str]:
    """How an option is written, and what it does."""
    bare = rule is not None and rule.form is OptionForm.FLAG
    return OPTION_HELP.get(word) or (f".{word}" if bare else f".{word}(…)", "" if rule is None else rule.what)


def word_help(word: str, *, member: bool) -> list[tuple[str, str]]:
    """All that a word may mean, where a parser has not said which: (how it is written, what it is)."""
    if member:
        return [MEMBER_HELP[word]] if word in MEMBER_HELP else []
    found = [ITEMS[word]] if word in ITEMS else []
    if word in KINDS and word != "sprite":
        found.append(kind_help(word))
    if word in FUNCTIONS or word in SYNONYMS:
        found.append(function_help(word))
    if word in CLOCK_HELP:
        found.append(CLOCK_HELP[word])
    if word in OPTION_HELP and not found:
        found.append(OPTION_HELP[word])
    return found or ([MEMBER_HELP[word]] if word in MEMBER_HELP else [])
