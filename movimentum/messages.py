"""The meaning of each message code: the reference page of all messages, one code at a time.

The page, ``docs/reference/messages.md``, is part of the package. It is made from ``docs/messages.toml`` and from the
test cases, so its examples are real output.
"""

from __future__ import annotations

import difflib
import os
import pkgutil
import re
from collections.abc import Mapping
from functools import cache

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.records import dataclass

PAGE_NAME = "messages.md"
_LINK = re.compile(r"\[([^\]]*)\]\(([^)\s]*)\)")
_FENCE = re.compile(r"^```[^\n]*\n(.*?)^```$", re.DOTALL | re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Explanation:
    """The meaning of a message ``code``, and what to do; ``family`` is the heading that it stands under.

    ``examples`` are scripts, commands and what Movimentum says about them, in this order; often a script and its
    message.
    """

    code: str
    family: str
    meaning: str
    examples: tuple[str, ...]

    @property
    def text(self) -> str:
        """The explanation as a terminal shows it: the examples are indented."""
        parts = [self.code, self.meaning]
        parts += ["\n".join(f"    {line}".rstrip() for line in example.split("\n")) for example in self.examples]
        return "\n\n".join(parts)

    @property
    def summary(self) -> str:
        """The first sentence."""
        return re.split(r"(?<=[.!?])\s", self.meaning, maxsplit=1)[0]


@cache
def explanations() -> Mapping[str, Explanation]:
    """Every message code and its explanation, in the order of the page. FileNotFoundError in a broken installation."""
    found: dict[str, Explanation] = {}
    for family in re.split(r"^## ", _page(), flags=re.MULTILINE)[1:]:
        title, _, rest = family.partition("\n")
        for part in re.split(r"^### ", rest, flags=re.MULTILINE)[1:]:
            head, _, body = part.partition("\n")
            code = head.strip("` ")
            said, _, shown = body.strip().partition("\n\n")
            examples = tuple(match[1].rstrip("\n") for match in _FENCE.finditer(shown))
            found[code] = Explanation(code, title.strip(), _LINK.sub(_link_text, said), examples)
    return found


def find(wanted: str) -> list[Explanation]:
    """The explanation of the code ``wanted``, or those of all codes of a family such as ``solve``; [] if unknown.

    The code may stand as in a message: ``error[solve/binds]``, in any case.
    """
    code = _code(wanted)
    known = explanations()
    return [known[code]] if code in known else [each for name, each in known.items() if name.split("/")[0] == code]


def similar(wanted: str) -> list[str]:
    """The codes and families that are spelled most like ``wanted``: at most three."""
    codes, code = list(explanations()), _code(wanted)
    same_word = [each for each in codes if each.split("/")[1] == code.split("/")[-1]]
    families = dict.fromkeys(each.split("/")[0] for each in codes)
    return list(dict.fromkeys([*same_word, *difflib.get_close_matches(code, [*codes, *families], 3, 0.6)]))[:3]


def unknown(wanted: str, command: str) -> Diagnostic:
    """The refusal of a code that does not exist; ``command`` lists all."""
    near = tuple(f"did you mean `{code}`?" for code in similar(wanted))
    return Diagnostic("usage/code", Severity.ERROR, f"no message has the code `{wanted}`", helps=(*near, command))


def _code(wanted: str) -> str:
    match = re.search(r"\[([^\]]+)\]", wanted)
    return (match[1] if match else wanted).strip(" `:;/").lower()


def listing() -> str:
    """All codes under the headings of the page, a line each."""
    known = explanations()
    width = max(map(len, known))
    lines: list[str] = []
    family = None
    for each in known.values():
        if each.family != family:
            family = each.family
            lines += ["", family]
        lines.append(f"  {each.code:{width}}  {each.summary}")
    return "\n".join(lines[1:])


def _link_text(match: re.Match[str]) -> str:
    """A link of the page as plain text: an address stays, a page of the documentation is named."""
    text, target = match.groups()
    if "://" in target:
        return f"{text} ({target})"
    page = os.path.normpath(os.path.join("reference", target.partition("#")[0])).replace(os.sep, "/")
    return f"{text} ({page.removesuffix('.md')} in the documentation)"


def _page() -> str:
    """The page, from the installed package, else from the checkout's ``docs/``."""
    try:
        return (pkgutil.get_data("movimentum", PAGE_NAME) or b"").decode("utf-8")
    except OSError:
        here = os.path.dirname(os.path.abspath(__file__))
        with open(os.path.join(here, "..", "docs", "reference", PAGE_NAME), encoding="utf-8") as file:
            return file.read()
