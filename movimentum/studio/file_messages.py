"""What a page and the server say to each other about the files beside the script."""

from __future__ import annotations

from movimentum.studio.sides import FromPage, ToPage


class PictureDropped(FromPage, kind="picture"):
    """Put a picture beside the script: its file is ``called`` so, and has ``data`` (base64)."""

    called: str
    data: str


class StartAsked(FromPage, kind="start"):
    """The page shows the list of scripts again, and wants their thumbnails."""


class FilesAsked(FromPage, kind="files"):
    """Which files of the folder can be opened?"""


class PictureStored(ToPage, kind="stored"):
    """The picture that was dropped is beside the script; its file is ``called`` so. ``words``: why it is not."""

    called: str
    words: str = ""


class FilesListed(ToPage, kind="listed"):
    """The files of the script's folder that can be opened."""

    names: tuple[str, ...]
