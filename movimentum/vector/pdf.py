"""A film as a PDF: one page for each frame, with the elements of its SVG in that frame.

A small writer of our own (decision 0036): streams are compressed, content shared by several pages is stored once, and
the same film gives the same bytes.
"""

from __future__ import annotations

import hashlib
import io
import zlib
from collections.abc import Sequence

from movimentum.encoding.pdf_images import Plane, planes
from movimentum.vector.film import Film
from movimentum.vector.numbers import short
from movimentum.vector.pdf_elements import PdfPainter

POINTS = 0.75
"""Of a pixel: 96 pixels are an inch, as in SVG."""


def pdf_document(film: Film) -> bytes:
    """The file."""
    file = PdfFile()
    resources, pages = file.reserved(), file.reserved()
    painter = PdfPainter(file, resources)
    width, height = (short(size * POINTS, 4) for size in (film.prepared.view.width, film.prepared.view.height))
    box = f"/MediaBox [0 0 {width} {height}]"
    kids: list[int] = []
    for number in range(film.frames):
        drawn = f"{POINTS} 0 0 -{POINTS} 0 {height} cm\n{painter.frame(film.frame(number))}"
        content = file.stream("", drawn.encode("ascii"))
        group = "/Group << /S /Transparency /CS /DeviceRGB >>"
        kids.append(file.add(f"<< /Type /Page /Parent {pages} 0 R /Contents {content} 0 R {group} >>".encode()))
    shared = f"/Resources {resources} 0 R"
    tree = f"<< /Type /Pages /Count {len(kids)} {box} {shared} /Kids [{' '.join(f'{kid} 0 R' for kid in kids)}] >>"
    file.set(pages, tree.encode())
    file.set(resources, painter.resources().encode())
    root = file.add(f"<< /Type /Catalog /Pages {pages} 0 R /Lang (en) >>".encode())
    about = file.add(b"<< /Title " + _text(film.title) + b" /Creator (Movimentum) /Producer (Movimentum) >>")
    return file.finished(root, about)


def _text(text: str) -> bytes:
    """A text of the document's information."""
    return b"<" + (b"\xfe\xff" + text.encode("utf-16-be", "replace")).hex().upper().encode() + b">"


class PdfFile:
    """Numbered objects; see ISO 32000-1, 7.5."""

    def __init__(self) -> None:
        self._objects: list[bytes] = []
        self._known: dict[bytes, int] = {}

    def reserved(self) -> int:
        """The number of an object that is `set` later."""
        self._objects.append(b"")
        return len(self._objects)

    def set(self, number: int, body: bytes) -> None:
        """The object that a number was reserved for."""
        self._objects[number - 1] = body

    def add(self, body: bytes) -> int:
        """A new object's number."""
        self._objects.append(body)
        return len(self._objects)

    def stream(self, entries: str, data: bytes, *, packed: bool = False) -> int:
        """A compressed stream with ``entries`` in its dictionary; one that is there already is used again."""
        data = data if packed else zlib.compress(data, 9)
        body = b"<< %s /Filter /FlateDecode /Length %d >>\nstream\n" % (entries.encode(), len(data))
        body += data + b"\nendstream"
        known = hashlib.blake2b(body, digest_size=16).digest()
        if known not in self._known:
            self._known[known] = self.add(body)
        return self._known[known]

    def image(self, png: bytes, slopes: Sequence[float]) -> int:
        """A picture, see `encoding.pdf_images.planes`: its colours, and its alpha as a soft mask."""
        colors, alpha = planes(png, slopes)
        mask = "" if alpha is None else f" /SMask {self._pixels(alpha, '/DeviceGray')} 0 R"
        return self._pixels(colors, "/DeviceRGB", mask)

    def _pixels(self, plane: Plane, space: str, mask: str = "") -> int:
        size = f"/Type /XObject /Subtype /Image /Width {plane.width} /Height {plane.height} /ColorSpace {space}"
        coded = f"/DecodeParms << /Predictor 15 /Colors {plane.colors} /Columns {plane.width} >>"
        return self.stream(f"{size} /BitsPerComponent 8 /Interpolate true {coded}{mask}", plane.rows, packed=True)

    def finished(self, root: int, about: int) -> bytes:
        """The whole file."""
        out = io.BytesIO()
        out.write(b"%PDF-1.4\n%\xe2\xe3\xcf\xd3\n")
        places: list[int] = []
        for number, body in enumerate(self._objects, 1):
            places.append(out.tell())
            out.write(b"%d 0 obj\n%s\nendobj\n" % (number, body))
        name = hashlib.md5(out.getvalue(), usedforsecurity=False).hexdigest().upper()
        table = out.tell()
        out.write(b"xref\n0 %d\n0000000000 65535 f \n" % (len(places) + 1))
        out.writelines(b"%010d 00000 n \n" % place for place in places)
        trailer = f"<< /Size {len(places) + 1} /Root {root} 0 R /Info {about} 0 R /ID [<{name}> <{name}>] >>"
        out.write(f"trailer\n{trailer}\nstartxref\n{table}\n%%EOF\n".encode())
        return out.getvalue()
