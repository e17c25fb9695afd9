"""The language server: the protocol on one side, `movimentum.editing` and the solver on the other."""

from __future__ import annotations

import asyncio
import logging
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from lsprotocol import types
from pygls.exceptions import JsonRpcException
from pygls.lsp.server import LanguageServer

from movimentum.editing import about, completion, marks
from movimentum.editing.project import Use
from movimentum.errors import MovimentumError
from movimentum.formatting.columns import formatted, line_edits
from movimentum.lsp import shapes
from movimentum.lsp.shapes import OpenText, path_of, uri_of
from movimentum.lsp.state import State
from movimentum.source import SourceText, Span
from movimentum.version import version

SHOW_PICTURE = "movimentum.showPicture"
"""The command that renders a picture: (address of the script, time) -> {"uri", "path"} or {"error"}."""


class Server(LanguageServer):
    """A session."""

    def __init__(self) -> None:
        super().__init__("movimentum", version(), text_document_sync_kind=types.TextDocumentSyncKind.Incremental)
        self.state = State(self.text_document_publish_diagnostics, self._soon)
        self._loop: asyncio.AbstractEventLoop | None = None
        self._folder: tempfile.TemporaryDirectory[str] | None = None

    def _soon(self, work: Callable[[], None]) -> None:
        """Do something in the thread that answers."""
        loop = self._loop
        if loop is not None and not loop.is_closed():
            loop.call_soon_threadsafe(work)

    def begin(self) -> None:
        """The session begins."""
        self._loop = asyncio.get_running_loop()

    def end(self) -> None:
        """The session ends."""
        self.state.solver.close()
        if self._folder is not None:
            self._folder.cleanup()

    @property
    def pictures(self) -> Path:
        """A folder for pictures, which goes with the session."""
        if self._folder is None:
            self._folder = tempfile.TemporaryDirectory(prefix="movimentum-", ignore_cleanup_errors=True)
        return Path(self._folder.name)

    def place(self, params: Any) -> tuple[str, OpenText | None, int]:
        """Path, text and offset of a request."""
        path = path_of(params.text_document.uri)
        text = self.state.texts.open.get(path)
        position = getattr(params, "position", None)
        return path, text, 0 if text is None or position is None else text.offset(position)


def serve() -> None:
    """Serve over standard input and output until the editor ends it.

    Whatever else writes to standard output, a library perhaps, writes to standard error from here on.
    """
    logging.getLogger("pygls").setLevel(logging.CRITICAL)
    given, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    server = make_server()
    try:
        server.start_io(given, answers)
    finally:
        server.end()


def make_server() -> Server:
    """A server with everything that it answers."""
    server = Server()
    _texts(server)
    _answers(server)
    _edits(server)
    _outlines(server)
    return server


def _texts(server: Server) -> None:
    state = server.state

    @server.feature(types.INITIALIZE)
    def begin(_params: types.InitializeParams) -> None:
        server.begin()

    @server.feature(types.TEXT_DOCUMENT_DID_OPEN)
    def opened(params: types.DidOpenTextDocumentParams) -> None:
        document = params.text_document
        state.put(path_of(document.uri), OpenText(document.uri, document.text, document.version))

    @server.feature(types.TEXT_DOCUMENT_DID_CHANGE)
    def changed(params: types.DidChangeTextDocumentParams) -> None:
        path = path_of(params.text_document.uri)
        text = state.texts.open.get(path)
        if text is not None:
            text.change(tuple(params.content_changes), params.text_document.version)
            state.typed(path)

    @server.feature(types.TEXT_DOCUMENT_DID_CLOSE)
    def closed(params: types.DidCloseTextDocumentParams) -> None:
        state.close(path_of(params.text_document.uri))

    @server.feature(types.TEXT_DOCUMENT_DID_SAVE)
    def saved(_params: types.DidSaveTextDocumentParams) -> None:
        """Nothing: what is open is known already."""

    @server.feature(types.WORKSPACE_DID_CHANGE_WATCHED_FILES)
    def watched(_params: types.DidChangeWatchedFilesParams) -> None:
        state.disk_changed()

    @server.feature(types.WORKSPACE_DID_CHANGE_WORKSPACE_FOLDERS)
    def folders(_params: types.DidChangeWorkspaceFoldersParams) -> None:
        state.disk_changed()


def _answers(server: Server) -> None:
    state = server.state

    @server.feature(
        types.TEXT_DOCUMENT_COMPLETION, types.CompletionOptions(trigger_characters=[".", "'", "/", "{", ":"])
    )
    def complete(params: types.CompletionParams) -> types.CompletionList:
        path, text, offset = server.place(params)
        if text is None:
            return types.CompletionList(is_incomplete=False, items=[])
        found = completion.proposals(state.project, path, offset)
        return types.CompletionList(False, [shapes.completion_item(text, n, each) for n, each in enumerate(found)])

    @server.feature(types.TEXT_DOCUMENT_HOVER)
    def hover(params: types.HoverParams) -> types.Hover | None:
        path, text, offset = server.place(params)
        found = None if text is None else about.about(state.project, path, offset, state.known(path))
        if found is None or text is None:
            return None
        content = types.MarkupContent(types.MarkupKind.Markdown, found.markdown)
        return types.Hover(content, text.range(found.span))

    @server.feature(types.TEXT_DOCUMENT_DEFINITION)
    def definition(params: types.DefinitionParams) -> types.Location | None:
        path, _, offset = server.place(params)
        symbol = about.definition_of(state.project, path, offset)
        other = None if symbol is None else state.texts.at(symbol.path)
        return None if symbol is None or other is None else types.Location(other.uri, other.range(symbol.span))

    def uses_at(params: Any) -> list[Use]:
        path, _, offset = server.place(params)
        use = state.project.use_at(path, offset)
        return [] if use is None or use.symbol is None else state.project.all_uses(use.symbol)

    @server.feature(types.TEXT_DOCUMENT_REFERENCES)
    def references(params: types.ReferenceParams) -> list[types.Location]:
        declared = params.context.include_declaration
        return [
            types.Location(other.uri, other.range(Span(use.piece.start, use.piece.end)))
            for use in uses_at(params)
            if (declared or not use.defining) and (other := state.texts.at(use.path)) is not None
        ]

    @server.feature(types.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT)
    def highlight(params: types.DocumentHighlightParams) -> list[types.DocumentHighlight]:
        path, text, _ = server.place(params)
        if text is None:
            return []
        here = [use for use in uses_at(params) if use.path == path]
        return [types.DocumentHighlight(text.range(Span(use.piece.start, use.piece.end))) for use in here]


def _edits(server: Server) -> None:
    state = server.state

    @server.feature(types.TEXT_DOCUMENT_PREPARE_RENAME)
    def prepare(params: types.PrepareRenameParams) -> types.PrepareRenamePlaceholder | None:
        path, text, offset = server.place(params)
        use = None if text is None else about.renamable(state.project, path, offset)
        if use is None or text is None:
            return None
        return types.PrepareRenamePlaceholder(text.range(Span(use.piece.start, use.piece.end)), use.piece.text)

    @server.feature(types.TEXT_DOCUMENT_RENAME, types.RenameOptions(prepare_provider=True))
    def rename(params: types.RenameParams) -> types.WorkspaceEdit:
        path, _, offset = server.place(params)
        try:
            edits = about.renamed(state.project, path, offset, params.new_name)
        except MovimentumError as error:
            raise JsonRpcException(error.diagnostics[0].message, types.LSPErrorCodes.RequestFailed) from None
        texts = {file: state.texts.at(file) for file in edits}
        return types.WorkspaceEdit(
            {text.uri: shapes.text_edits(text, edits[file]) for file, text in texts.items() if text is not None}
        )

    @server.feature(types.TEXT_DOCUMENT_FORMATTING)
    def layout(params: types.DocumentFormattingParams) -> list[types.TextEdit]:
        path, text, _ = server.place(params)
        if text is None:
            return []
        try:
            made = formatted(SourceText(path, text.text))
        except MovimentumError:
            return []  # its diagnostics say why
        return shapes.text_edits(text, line_edits(text.text, made))

    @server.feature(
        types.TEXT_DOCUMENT_CODE_ACTION, types.CodeActionOptions(code_action_kinds=[types.CodeActionKind.QuickFix])
    )
    def actions(params: types.CodeActionParams) -> list[types.CodeAction]:
        path, text, _ = server.place(params)
        if text is None or state.found.get(path, ("", ()))[0] != text.text:
            return []
        start, end = text.offset(params.range.start), text.offset(params.range.end)
        return shapes.code_actions(text, state.found[path][1], Span(start, end), params.context.diagnostics)

    @server.thread()
    @server.command(SHOW_PICTURE)
    def show_picture(*given: Any) -> dict[str, Any]:
        from movimentum.lsp.picture import picture

        uri, time = shapes.picture_arguments(given)
        path = path_of(uri)
        text = state.texts.text(path)
        if text is None:
            return {"error": f"there is no script at {uri}"}
        try:
            made = picture(path, text, time, server.pictures, state.texts)
        except MovimentumError as error:
            return {"error": error.diagnostics[0].message}
        return {"uri": uri_of(str(made)), "path": str(made)}


def _outlines(server: Server) -> None:
    state = server.state
    legend = types.SemanticTokensLegend(list(marks.KINDS), list(marks.MODIFIERS))

    @server.feature(types.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL, legend)
    def tokens(params: types.SemanticTokensParams) -> types.SemanticTokens:
        path, text, _ = server.place(params)
        return types.SemanticTokens(
            [] if text is None else shapes.token_numbers(text, marks.marks(state.project, path))
        )

    @server.feature(types.TEXT_DOCUMENT_FOLDING_RANGE)
    def folding(params: types.FoldingRangeParams) -> list[types.FoldingRange]:
        path, text, _ = server.place(params)
        outline = state.project.outline(path)
        if text is None or outline is None:
            return []
        folds = [(text.range(span), kind) for span, kind in marks.folds(outline)]
        return [
            types.FoldingRange(r.start.line, r.end.line, kind=kind) for r, kind in folds if r.end.line > r.start.line
        ]

    @server.feature(types.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    def symbols(params: types.DocumentSymbolParams) -> list[types.DocumentSymbol]:
        path, text, _ = server.place(params)
        outline = state.project.outline(path)
        return [] if text is None or outline is None else [shapes.symbol(text, each) for each in marks.entries(outline)]

    @server.feature(types.TEXT_DOCUMENT_INLAY_HINT)
    def hints(params: types.InlayHintParams) -> list[types.InlayHint]:
        path, text, _ = server.place(params)
        outline, known = state.project.outline(path), state.latest.get(path)
        if text is None or outline is None or known is None or known.facts is None:
            return []
        first, last = text.offset(params.range.start), text.offset(params.range.end)
        return [
            types.InlayHint(text.position(end), f" = {value}", padding_left=False)
            for name, end, plain in marks.constants(outline)
            if not plain and first <= end <= last and (value := known.facts.constant(name))
        ]
