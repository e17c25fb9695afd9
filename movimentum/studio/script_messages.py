"""Messages between a page and the server about the script, and the files beside it."""

from __future__ import annotations

from typing import Any

from movimentum.studio.sides import FromPage, ToPage


class ProposalsRequest(FromPage, kind="complete"):
    """Asks what may be written at ``place``."""

    rev: int
    place: int


class AboutRequest(FromPage, kind="about"):
    """Asks what is at ``place``."""

    rev: int
    place: int


class MeaningRequest(FromPage, kind="meaning"):
    """Asks what messages with this ``code`` mean."""

    rev: int
    code: str


class NamingRequest(FromPage, kind="naming"):
    """Could what stands at ``place`` get another name?"""

    rev: int
    place: int


class RenameRequest(FromPage, kind="rename"):
    """Give what stands at ``place`` the name ``name``; the answer is `TextEdited`."""

    rev: int
    place: int
    name: str


class FormatRequest(FromPage, kind="format"):
    """Lay out the script; the answer is `TextEdited`."""

    rev: int


class ProposalsReply(ToPage, kind="proposals"):
    """Proposals for the text in ``span`` at ``place``, the best first: each with ``label``, ``what`` (its
    kind, see `movimentum.editing.completion`), ``text``, ``detail`` and ``help``.
    """

    rev: int
    place: int
    span: tuple[int, int]
    proposals: list[dict[str, Any]]


class MeaningReply(ToPage, kind="meant"):
    """The meaning of messages with ``code``, and what to do, with examples (see `movimentum.messages`)."""

    rev: int
    code: str
    text: str


class AboutReply(ToPage, kind="explained"):
    """Information about ``span``: how it is ``written`` (empty: nothing is known), and ``paragraphs`` about it, with
    ``**bold**`` words, code in backquotes, and lists whose lines begin with ``- ``.
    """

    rev: int
    place: int
    span: tuple[int, int]
    written: str
    paragraphs: list[str]


class NamingReply(ToPage, kind="named"):
    """The name at ``place``, and the ``spans`` where it stands; ``words``: why it cannot be changed."""

    rev: int
    place: int
    name: str
    spans: list[tuple[int, int]]
    words: str = ""


class PictureDropped(FromPage, kind="picture"):
    """Put a picture beside the script: its file is ``called`` so, and has ``data`` (base64)."""

    called: str
    data: str


class StartRequest(FromPage, kind="start"):
    """The page shows the list of scripts again, and wants their thumbnails."""


class FilesRequest(FromPage, kind="files"):
    """Which files of the folder can be opened?"""


class PictureStored(ToPage, kind="stored"):
    """The picture that was dropped is beside the script; its file is ``called`` so. ``words``: why it is not."""

    called: str
    words: str = ""


class FilesListed(ToPage, kind="listed"):
    """The files of the script's folder that can be opened."""

    names: tuple[str, ...]
