"""``.config``: frames per time unit, the canvas and its background; and ``.loop``: the film repeats."""

from __future__ import annotations

import os
from fractions import Fraction

from movimentum.advice import Advised, Choose
from movimentum.diagnostics import Fix, Label, insertion, replacement
from movimentum.errors import MovimentumError
from movimentum.records import replace
from movimentum.scene import model
from movimentum.scene.constants import exact
from movimentum.scene.expansion.includes import ReadText
from movimentum.scene.expansion.product import Expanded
from movimentum.scene.findings import Findings
from movimentum.scene.option_reading import choice, read_color, report_count, report_twice
from movimentum.scene.themes import SUFFIX, THEMES, Theme, read_theme
from movimentum.source import Span, folder
from movimentum.syntax.expression_tree import Expression
from movimentum.syntax.suggest import nearest
from movimentum.syntax.tree import ConfigStatement, FilmLoop, Option, Text

MAX_PIXELS = 64_000_000
"""How many pixels a canvas may have, unless the caller says otherwise."""

DEFAULT_FPS = Fraction(25)
"""Of a script without ``.config``: a frame of a GIF then lasts exactly 4/100 s."""

_MAX_FPS = 10**9
_OPTIONS = ("background", "theme")


def build_config(configs: list[ConfigStatement], max_pixels: int, read: ReadText, findings: Findings) -> model.Config:
    """The configuration; a wrong value is reported and replaced by its default. ``read`` has the text of a theme."""
    if not configs:
        return model.Config(DEFAULT_FPS)
    first, *more = configs
    for other in more:
        findings.error(
            "name/duplicate",
            "there are two `.config`",
            other.span,
            labels=(Label(first.span, "the first one"),),
        )
    fps, size = DEFAULT_FPS, None
    if len(first.arguments) not in (1, 3):
        findings.error(
            "syntax/arguments",
            f"`.config` takes 1 or 3 arguments, not {len(first.arguments)}",
            first.span,
            helps=(_argument_help(first),),
        )
    else:
        fps = _fps(first.arguments[0], findings)
        if len(first.arguments) == 3:
            size = _size(first.arguments[1], first.arguments[2], max_pixels, findings)
    background, theme = _options(first.options, read, findings)
    return model.Config(fps, size, background, first.span, theme)


def _argument_help(config: ConfigStatement) -> Fix:
    """The first argument is the rate, and the first three are all that fit."""
    kept = 1 if len(config.arguments) < 3 else 3
    rest = Span(config.arguments[kept - 1].span.end, max(item.span.end for item in config.arguments))
    return replacement("write `.config(fps);` or `.config(fps, width, height);`", rest, "")


def _fps(argument: Expression | Text, findings: Findings) -> Fraction:
    value = exact(argument, "the number of frames per time unit", findings)
    if value is None:
        return DEFAULT_FPS
    if not 0 < value <= _MAX_FPS:
        findings.error(
            "kind/out-of-range",
            f"the number of frames per time unit must be greater than 0 and at most {_MAX_FPS:,}",
            argument.span,
        )
        return DEFAULT_FPS
    return value


def _size(
    width: Expression | Text, height: Expression | Text, max_pixels: int, findings: Findings
) -> tuple[int, int] | None:
    found: list[int] = []
    for argument, what in ((width, "the width"), (height, "the height")):
        value = exact(argument, what, findings)
        if value is not None and (value.denominator != 1 or value <= 0):
            findings.error("kind/out-of-range", f"{what} must be a whole number of pixels, 1 or more", argument.span)
            value = None
        if value is not None:
            found.append(int(value))
    if len(found) < 2:
        return None
    if found[0] * found[1] > max_pixels:
        findings.error(
            "limit/pixels",
            f"a canvas of {found[0]:,} × {found[1]:,} has more pixels than the limit of {max_pixels:,}",
            width.span.to(height.span),
            helps=(
                Advised("make it smaller, or raise the limit with `", Choose.MAX_PIXELS.to(found[0] * found[1]), "`"),
            ),
        )
        return None
    return found[0], found[1]


def _options(
    options: tuple[Option, ...], read: ReadText, findings: Findings
) -> tuple[tuple[int, int, int] | None, Theme | None]:
    """The background and the theme."""
    background: tuple[int, int, int] | None = None
    theme: Theme | None = None
    seen: dict[str, Option] = {}
    for option in options:
        first = seen.get(option.name)
        if option.name not in _OPTIONS:
            guess = nearest(option.name, _OPTIONS)
            findings.error(
                "syntax/unknown-option",
                f"`.config` has no option `.{option.name}`",
                option.name_span,
                helps=(
                    replacement(f"did you mean `.{guess}`?", option.name_span, f".{guess}")
                    if guess
                    else "it takes `.background('white')` and `.theme('textbook')`",
                ),
            )
        elif first is not None:
            report_twice(option, first.span, findings)
        elif len(option.arguments) != 1:
            report_count(option, 1, findings)
        else:
            seen[option.name] = option
            if option.name == "theme":
                theme = _theme(option.arguments[0], read, findings)
            else:
                background = read_color(option.arguments[0], findings)
    return background, theme


def _theme(argument: Expression | Text, read: ReadText, findings: Findings) -> Theme | None:
    """A built-in theme, or one that a file beside the script states."""
    name = argument.text if isinstance(argument, Text) else ""
    if not name.lower().endswith(SUFFIX) or "\0" in name:
        found = choice(argument, "a theme", tuple(THEMES), findings, (f"or name a file: `.theme('mine{SUFFIX}')`",))
        return None if found is None else THEMES[found]
    try:
        file = read(os.path.join(folder(findings.source), name))
    except MovimentumError as error:
        for item in error.diagnostics:
            code = "asset/missing" if item.code.startswith("usage/") else item.code
            findings.add(replace(item, code=code, span=argument.span, helps=()))
        return None
    return read_theme(file, findings)


def build_loop(expanded: Expanded, findings: Findings) -> Span | None:
    """Where the script says that the film begins again at its end; None if it does not.

    Errors: ``timeline/loop`` if no time passes before it or a step comes after it, ``name/duplicate`` for a second one.
    """
    found: FilmLoop | None = None
    steps = expanded.steps
    for item, step in expanded.film_loops:
        if found is not None:
            findings.error(
                "name/duplicate",
                "there are two `.loop`",
                item.span,
                labels=(Label(found.span, "the first one"),),
                helps=(_without(item, findings, "leave this one out"),),
            )
            continue
        found = item
        later = next((each for each in steps[step + 1 :] if step >= 0 and each.time > steps[step].time), None)
        if step < 0 or steps[step].time == steps[0].time:
            findings.error(
                "timeline/loop",
                "the film would end where it begins: `.loop` belongs to a later step",
                item.span,
                helps=(insertion("begin a step for it: `@+4 .loop;`", item.span.start, "@+4 "),),
            )
        elif later is not None:
            findings.error(
                "timeline/loop",
                "a step comes after `.loop`, where the film has begun again",
                later.span,
                labels=(Label(item.span, "the film ends here"),),
                helps=(_without(item, findings, "leave `.loop` out, or write it into the last step"),),
            )
    return None if found is None else found.span


def _without(item: FilmLoop, findings: Findings, title: str) -> Fix:
    from movimentum.scene.text_edits import removed

    return Fix(title, (removed(findings.source.text, item.span),))
