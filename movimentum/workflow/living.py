"""`run --live`: a page in which constants are sliders and the drive is a handle."""

from __future__ import annotations

import random
from collections.abc import Hashable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from movimentum.advice import Choose
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import MovimentumError, usage_error
from movimentum.records import replace
from movimentum.terminal import typed
from movimentum.tolerances import NEARBY_POSITION, POSES_AGREE
from movimentum.workflow.animate import ground_color, options_of
from movimentum.workflow.choices import Choices, Outcome, Picture
from movimentum.workflow.equations import distinguishable, stages_of
from movimentum.workflow.live_limits import built, cannot, no_program, refuse_changing, refuse_film_drawings, useless
from movimentum.workflow.stages import Solution, arranged, moved, solved, understand

if TYPE_CHECKING:
    from movimentum.drawing.picture_options import PictureOptions
    from movimentum.expressions import Expr
    from movimentum.living.page import Figure, Slider
    from movimentum.living.scene import LiveScene
    from movimentum.rendering.prepare import PreparedDrawing
    from movimentum.scene.expansion.product import NamedConstant
    from movimentum.scene.model import Scene
    from movimentum.solver.motion import PathMotion
    from movimentum.solver.poses import Poses
    from movimentum.source import SourceText

OTHER = "live/other-pose"
TRIED = 6
"""Settings at which the page's poses are compared with those of `solve` before it is written."""
ROOM = 1.3
"""How many times as large as the film a canvas is whose size the script does not say."""


def living_page(source: SourceText, target: Path, names: Sequence[str], choices: Choices, picture: Picture) -> Outcome:
    """Write the page; `UsageError` for constants that there are not, `ScriptError` for what cannot live."""
    refuse_unfit(target)
    figure, diagnostics = living_figure(source, names, choices, picture)
    written_page(figure, target, source)
    view = figure.film.prepared.view
    return Outcome(len(figure.times), 0, diagnostics, (), (view.width, view.height))


def refuse_unfit(target: Path) -> None:
    """`UsageError` for a file that is no page, or cannot be written."""
    from movimentum.output.files import refuse_unwritable

    if target.suffix.lower() != ".html":
        raise usage_error(
            "usage/live", "a living figure is a page", Choose.OUTPUT.to(typed(target.with_suffix(".html")))
        )
    refuse_unwritable(target)


def written_page(figure: Figure, target: Path, source: SourceText) -> Path:
    """Write a figure as a page, whole or not at all."""
    from movimentum.living.page import figure_document
    from movimentum.output.files import refuse_overwriting, whole_file
    from movimentum.workflow.read import reads

    refuse_unfit(target)
    refuse_overwriting(target, reads(source, figure.live.scene), range(0))
    with whole_file(target) as part, part.open("w", encoding="utf-8", newline="\n") as stream:
        stream.writelines(figure_document(figure))
    return target


def living_figure(
    source: SourceText, names: Sequence[str], choices: Choices, picture: Picture
) -> tuple[Figure, tuple[Diagnostic, ...]]:
    """The figure, and what is to be said of it."""
    from movimentum.drawing.picture_options import Show

    if Show.FREE in picture.show:
        raise usage_error("usage/live", "a living figure shows no free motions", Choose.SHOW.to("names,anchors"))
    plain = understand(source, choices, picture.max_pixels)
    sliders = tuple(_sliders(plain, names))
    kept = _distinguished(source, choices, plain, sliders)
    scene = understand(source, kept, picture.max_pixels)
    refuse_film_drawings(scene)
    solution = solved(arranged(scene, kept), kept)
    figure = _figure(source, scene, solution, sliders, picture)
    for slider in sliders:
        if not _matters(figure, slider):
            raise useless(source, scene, slider)
    return figure, (*solution.diagnostics, *_compared(source, choices, figure))


def _figure(
    source: SourceText, scene: Scene, solution: Solution, sliders: tuple[Slider, ...], picture: Picture
) -> Figure:
    from movimentum.equations.program import ConstantSymbol, NoProgram
    from movimentum.expressions import named_origins
    from movimentum.living.page import Figure, is_made_there
    from movimentum.living.program import live_stage
    from movimentum.living.scene import LiveScene, live_drawing, live_poses, lost
    from movimentum.rendering.stream import concatenate
    from movimentum.vector.film import Film
    from movimentum.workflow.frames import PoseChunks
    from movimentum.workflow.live_limits import conditions

    motion, timeline = solution.motion.path, solution.motion.timeline
    count = timeline.frame_count
    film = concatenate(list(PoseChunks(solution.motion, range(count), False, drawn=True)))
    refuse_changing(scene, film)
    origins: dict[int, Any] = {}
    live = LiveScene(scene, lambda each: bool(named_origins(each, origins)))
    things = live.opened()
    for thing in lost(things, is_made_there):
        raise cannot(source, scene, scene.things[thing.number], sliders)
    prepared, options = _prepared(scene, motion, film, picture)
    poses = live_poses(live, _placed, film, _properties(live, film))
    drawn = live_drawing(live, things, prepared, poses, film, options)
    places = {n.number: [live.place(_placed(n.number, part)) for part in "xycs"] for n in scene.things if n.is_body}
    payloads: dict[Hashable, str] = {ConstantSymbol(slider.name): slider.code for slider in sliders}
    try:
        kept = tuple(conditions(scene, motion))
        stages = stages_of(motion, [*live.outputs, *kept], payloads, whole=True)
    except NoProgram as error:
        raise no_program(error, scene) from error
    title = "Movimentum" if source.path.startswith("<") else Path(source.path).stem
    return Figure(
        film=Film(title, things, drawn, poses, _bodies(scene, poses), timeline.fps, 0),
        live=live,
        stages=tuple(live_stage(stage, len(live.outputs)) for stage in stages),
        conditions=len(kept),
        sliders=sliders,
        times=tuple(float(timeline.frame_time(frame)) for frame in range(count)),
        end=float(timeline.end),
        rate=float(timeline.fps),
        loop=picture.loop,
        loops=timeline.loops,
        size=motion.segments[0].plan.size,
        handle=_handle(scene, film),
        places=places,
    )


def _prepared(
    scene: Scene, motion: PathMotion, film: Poses, picture: Picture
) -> tuple[PreparedDrawing, PictureOptions]:
    """The drawing as it is now, with room around it where the script does not say how large it is."""
    from movimentum.rendering.prepare import prepare_drawing

    background = None if picture.background is None else ground_color(picture.background)
    options = replace(options_of(scene, picture, background), motion=motion)
    prepared = prepare_drawing(scene, film, options)
    if scene.config.size is None:
        view = prepared.view
        room = max(view.width, round(ROOM * view.width)), max(view.height, round(ROOM * view.height))
        prepared = prepare_drawing(scene, film, replace(options, canvas=room))
    return prepared, options


def _placed(number: int, part: str) -> Expr:
    from movimentum.analysis.interactive.formula import ThingPlacement
    from movimentum.expressions import symbol

    return symbol(ThingPlacement(number, part))


def _bodies(scene: Scene, poses: Poses) -> dict[int, Any]:
    from movimentum.living.page import LiveBody

    return {
        n: LiveBody(poses.origin[n, :, 0], poses.origin[n, :, 1], poses.angle[n], poses.visible[n])
        for n in range(len(scene.things))
    }


def _matters(figure: Figure, slider: Slider) -> bool:
    """Whether anything in the motion or the picture depends on a constant."""
    from movimentum.equations.program import ConstantSymbol
    from movimentum.expressions import symbols
    from movimentum.living.page import LiveData
    from movimentum.living.program import opened

    for stage in figure.stages:
        values = [getattr(one, "value", None) for one in stage.program.statements]
        outputs = stage.program.outputs
        for value in (*outputs[: stage.drawn], *outputs[stage.drawn + figure.conditions :], *values):
            if slider.code in {str(one) for one in getattr(value, "free_symbols", ())}:
                return True
    data = LiveData(figure.film, figure.live.scene)
    data.all()
    return ConstantSymbol(slider.name) in symbols(*opened([each.expr for each in data.found]))


# --- the constants


def _sliders(scene: Scene, names: Sequence[str]) -> Iterator[Slider]:
    from difflib import get_close_matches

    from movimentum.equations.program import identifier
    from movimentum.living.page import Slider

    known = {constant.name: constant for constant in scene.constants}
    if not known:
        message = "the script has no constants, which a living figure moves"
        raise usage_error("usage/constant", message, "`.let R = 50;` in the script makes one")
    for name in dict.fromkeys(names):
        constant = known.get(name)
        if constant is None:
            near = get_close_matches(name, known, 3, 0.3) or list(known)
            raise usage_error(
                "usage/constant", f"the script has no constant `{name}`", *(Choose.LIVE.to(n) for n in near)
            )
        value = constant.value[0].value
        if len(constant.value) != 1:
            numbers = [n for n, each in known.items() if len(each.value) == 1]
            helps = [Choose.LIVE.to(",".join(numbers))] if numbers else ["`.let x = 50;` is a number"]
            raise usage_error("usage/live", f"`{name}` is a vector, and a slider moves one number", *helps)
        least, most = _range(constant, float(value))
        yield Slider(name, identifier(name), float(value), least, most, constant.unit)


def _range(constant: NamedConstant, value: float) -> tuple[float, float]:
    """Its own, or from half of the value to one and a half times as much; of 0, from -1 to 1."""
    if constant.least is not None and constant.most is not None:
        return min(constant.least, value), max(constant.most, value)
    return (min(value / 2.0, value * 1.5), max(value / 2.0, value * 1.5)) if value else (-1.0, 1.0)


def _distinguished(source: SourceText, choices: Choices, plain: Scene, sliders: Sequence[Slider]) -> Choices:
    """Choices under which the constants keep their names; `ScriptError` for one that the scene's structure has."""
    structure = _structure(plain)
    for number, slider in enumerate(sliders):
        step = NEARBY_POSITION * (slider.most - slider.least)
        other = repr(slider.value + step if slider.value + step <= slider.most else slider.value - step)
        try:
            near = understand(source, replace(choices, settings=(*_without(choices, slider), (slider.name, other))))
            same = _structure(near) == structure
        except MovimentumError:
            same = False
        if not same:
            raise built(source, plain, slider)
        choices = replace(choices, settings=_without(choices, slider))
        choices = distinguishable(choices, slider.name, slider.value, number)
    return choices


def _without(choices: Choices, slider: Slider) -> tuple[Any, ...]:
    return tuple(pair for pair in choices.settings if pair[0] != slider.name)


def _structure(scene: Scene) -> Any:
    """The parts that a slider cannot change."""
    times = tuple(step.time for step in scene.steps)
    return scene.config.fps, scene.config.size, times, tuple(thing.name for thing in scene.things)


# --- what the picture needs


def _properties(live: LiveScene, film: Poses) -> dict[Any, Any]:
    """The numbers that travel with poses, as outputs of the program."""
    from movimentum.expressions import symbol
    from movimentum.living.numbers import live_array
    from movimentum.scene.model import AnchorCoordinate, AnchorRef, ThingProperty
    from movimentum.scene.shown import ARROW, Shown, text_number
    from movimentum.things.kinds.vector import VectorScale

    found: dict[Any, Any] = {}
    for thing in live.scene.things:
        for name in ("opacity", "red", "green", "blue"):
            if (thing.number, name) in film.properties:
                value = float(film.properties[thing.number, name][0])
                found[thing.number, name] = live_array([live.output(symbol(ThingProperty(thing.number, name)), value)])
        if thing.hidden:
            continue
        for number, piece in enumerate(each for each in thing.pieces if isinstance(each, Shown)):
            value = float(film.properties[thing.number, text_number(number)][0])
            found[thing.number, text_number(number)] = live_array([live.output(piece.value, value)])
        own = thing.own
        ref = thing.through[0] if thing.through else None
        if isinstance(own, VectorScale) and isinstance(ref, AnchorRef):
            order, scale = (1, own.velocity) if own.velocity is not None else (2, own.acceleration or 0.0)
            for axis, name in enumerate(ARROW):
                value = float(film.properties[thing.number, name][0])
                rate = live.rate(symbol(AnchorCoordinate(ref.thing, ref.anchor, axis)), order, value)
                found[thing.number, name] = live_array([rate * float(scale)])
    return found


def _handle(scene: Scene, film: Poses) -> tuple[str, str] | None:
    """The anchor that drives: of a thing whose turn or place a function of time states, the one that goes farthest; or
    of anything that moves.
    """
    from movimentum.expressions import symbols
    from movimentum.scene.model import AnchorCoordinate, Relation, ThingAngle

    driven: list[int] = []
    for constraint in scene.constraints():
        sides = (*constraint.left, *constraint.right)
        about = [each for side in sides for each in symbols(side)]
        timed = any(side.timed or "progress" in repr(side) for side in sides)
        if constraint.relation is Relation.EQUAL and timed and len({getattr(e, "thing", None) for e in about}) == 1:
            driven += [e.thing for e in about if isinstance(e, ThingAngle | AnchorCoordinate)]
    for number in (*driven, *(thing.number for thing in scene.things)):
        thing = scene.things[number]
        if thing.hidden or not thing.is_body or not thing.anchors:
            continue
        ways = [float(np.ptp(film.world(number, anchor.local), axis=0).max()) for anchor in thing.anchors]
        if max(ways) > 1.0:
            return thing.name, thing.anchors[int(np.argmax(ways))].name
    return None


# --- is it true?


def _compared(source: SourceText, choices: Choices, figure: Figure) -> Iterator[Diagnostic]:
    """A warning for the first setting with which `solve` finds other poses than the page."""
    from movimentum.living.follow import Follower
    from movimentum.living.program import python

    codes = [slider.code for slider in figure.sliders]
    functions = [python(stage, codes) for stage in figure.stages]
    follower = Follower(figure.stages, functions, {s.code: s.value for s in figure.sliders}, figure.size)
    chance = random.Random(0)
    base: Scene = figure.live.scene
    free = replace(choices, settings=tuple(p for p in choices.settings if p[0] not in {s.name for s in figure.sliders}))
    for number in range(TRIED + 1):
        values = [s.value if number == 0 else round(chance.uniform(s.least, s.most), 6) for s in figure.sliders]
        settings = [(s.name, repr(value)) for s, value in zip(figure.sliders, values, strict=True)]
        try:
            motion = moved(arranged(understand(source, replace(free, settings=(*free.settings, *settings))), free))
        except MovimentumError:
            continue
        poses = motion.poses(0, len(figure.times))
        found = follower.film(dict(zip(codes, values, strict=True)), figure.times)
        if not _same(figure, poses, found):
            said = " ".join(Choose.SET.to(f"{name}={text}") for name, text in settings)
            setting = ", ".join(f"{name} = {text}" for name, text in settings)
            message = f"with {setting} the page shows other poses than `solve`"
            span = base.constants[0].span
            yield Diagnostic(OTHER, Severity.WARNING, message, span, helps=(f"`movimentum run {said}` shows those",))
            return


def _same(figure: Figure, poses: Poses, found: Sequence[Sequence[float] | None]) -> bool:
    """Whether they agree up to the first frame without a pose: `solve` does not go on behind it."""
    for k, values in enumerate(found):
        if values is None or not poses.solved[k]:
            return (values is None) == (not poses.solved[k]) or k + 1 == len(found) or found[k + 1] is None
        for thing, (x, y, c, s) in figure.places.items():
            there = np.concatenate([poses.origin[thing, k], figure.size * poses.direction[thing, k]])
            here = np.array([values[x], values[y], figure.size * values[c], figure.size * values[s]])
            if float(np.abs(here - there).max()) > POSES_AGREE * figure.size:
                return False
    return True
