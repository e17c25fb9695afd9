"""A scene with more statements in one of its steps, for trying them out."""

from __future__ import annotations

from movimentum.scene.build import build
from movimentum.scene.model import Scene
from movimentum.source import SourceText
from movimentum.syntax.parser import parse
from movimentum.syntax.tree import Item, ScriptTree, Statement, StepHeader


class Amender:
    """Makes scenes of one script that differ in one step; reads the script once."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._items: tuple[Item, ...] | None = None

    def amended(self, step: int, text: str) -> Scene:
        """The scene with the statements ``text`` at the end of step number ``step``; `ScriptError` if they are wrong.
        Their spans do not refer to the script.
        """
        if self._items is None:
            self._items = parse(self.scene.source).items
        items = self._items
        more = [item for item in parse(SourceText("<help>", f"@0 {text}")).items if isinstance(item, Statement)]
        headers = [place for place, item in enumerate(items) if isinstance(item, StepHeader)]
        end = headers[step + 1] if step + 1 < len(headers) else len(items)
        sizes = {thing.image: thing.image_size for thing in self.scene.things if thing.image is not None}
        script = ScriptTree((*items[:end], *more, *items[end:]))
        places = self.scene.elements
        return build(
            script,
            self.scene.source,
            lambda path: sizes.get(path) or (1, 1),
            element=lambda path, name: places.get((path, name), (0.0, 0.0)),
        )
