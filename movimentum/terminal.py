"""Makes foreign text safe for a terminal: file names, script text, recordings, headers of tables.

A terminal obeys everything it receives. An escape sequence in a file name moves the cursor or changes the title, and a
bidirectional control shows a name backwards. All text that does not come from Movimentum itself goes through here.
"""

from __future__ import annotations

import re

_CONTROLS = "\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff\ufff9-\ufffb\U000e0000-\U000e007f"
"""Delete and C1, marks and embeddings of writing direction, line ends of Unicode, halves of surrogate pairs (bytes of a
path that are not UTF-8), annotations and tags.
"""

# patterns are compiled when they are first used: many commands show nothing that is foreign
_OBEYED = f"[\x00-\x1f{_CONTROLS}]"
_OBEYED_IN_LINES = f"[\x00-\x08\x0b-\x1f{_CONTROLS}]"
_UNSAFE_IN_JSON = f"[{_CONTROLS}]"
_NOT_ASCII = "[^\x00-\x7f]"
_PLAIN_WORD = r"[A-Za-z0-9_./%+=:,@][A-Za-z0-9_./%+=:,@-]*"


def visible(text: str) -> str:
    """``text`` as one line, with escapes for what a terminal would obey (``\\x1b``, ``\\u202e``, ``\\n``)."""
    return re.sub(_OBEYED, _escape, text)


def visible_lines(text: str) -> str:
    """The same for text of several lines: line feeds and tabs stay."""
    return re.sub(_OBEYED_IN_LINES, _escape, text)


def visible_json(text: str, encoding: str | None = "utf-8") -> str:
    """JSON that means the same, with JSON escapes for what a terminal would obey. If the reader's ``encoding`` is not
    UTF-8, everything that is not ASCII is escaped too.
    """
    pattern = _UNSAFE_IN_JSON if (encoding or "").lower().replace("_", "-") in ("utf-8", "utf8") else _NOT_ASCII
    return re.sub(pattern, _json_escape, text)


def typed(argument: object) -> str:
    """A file's name (or any other argument) as it is typed in a shell, quoted if necessary.

    What a terminal would obey is written as an escape inside ``$'…'``; a leading ``-`` is protected, so that it is not
    read as an option.
    """
    word = str(argument)
    if word.startswith("-") and word != "-":
        word = f"./{word}"
    if re.search(_OBEYED, word):
        inside = word.replace("\\", "\\\\").replace("'", "\\'")
        return f"$'{re.sub(_OBEYED, _shell_escape, inside)}'"
    if re.fullmatch(_PLAIN_WORD, word):
        return word
    quoted = word.replace("'", "'\"'\"'")
    return f"'{quoted}'"


def _escape(match: re.Match[str]) -> str:
    character = match[0]
    short = {"\n": "\\n", "\r": "\\r", "\t": "\\t"}.get(character)
    code = ord(character)
    return short or (f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}")


def _json_escape(match: re.Match[str]) -> str:
    units = match[0].encode("utf-16-be", "surrogatepass")
    return "".join(f"\\u{units[k]:02x}{units[k + 1]:02x}" for k in range(0, len(units), 2))


def _shell_escape(match: re.Match[str]) -> str:
    problem = "surrogateescape" if "\udc80" <= match[0] <= "\udcff" else "surrogatepass"
    return "".join(f"\\x{byte:02x}" for byte in match[0].encode("utf-8", problem))
