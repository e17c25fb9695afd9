"""A scene with more statements in one of its steps, for trying them out."""

from __future__ import annotations

from movimentum.scene.build import build
from movimentum.scene.cutting import profile_of
from movimentum.scene.model import Scene
from movimentum.source import SourceText, UnfoldedText
from movimentum.syntax.parser import parse
from movimentum.syntax.tree import ScriptTree, Statement


class SceneExtender:
    """Makes scenes of one script that differ in one step; reads the script once."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._script: ScriptTree | None = None

    def extended(self, step: int, text: str) -> Scene:
        """The scene with the statements ``text`` at the end of step number ``step``; `ScriptError` if they are wrong.
        Their spans do not refer to the script.
        """
        source = self.scene.source
        if self._script is None:
            self._script = parse(source.script)
        more = [(step, item) for item in parse(SourceText("<help>", f"@0 {text}")).items if isinstance(item, Statement)]
        sizes = {each.image: each.image_size for thing in self.scene.things if (each := thing.picture) is not None}
        places = self.scene.elements
        files = {file.path: file for file in source.files} if isinstance(source, UnfoldedText) else {}
        return build(
            self._script,
            source.script,
            lambda path: sizes.get(path) or (1, 1),
            read_text=files.__getitem__,
            settings=dict(self.scene.settings),
            added=more,
            element=lambda path, name: places.get((path, name), (0.0, 0.0)),
            read_table=self.scene.tables.__getitem__,
            carve=lambda _, jobs: [profile_of(self.scene, job) for job in jobs],
        )
