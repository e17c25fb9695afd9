"""What an index shows about the package: addresses, and the README with links that lead somewhere from there.

The build calls it (``[tool.hatch.metadata.hooks.custom]`` in pyproject.toml). All addresses follow from ``home`` there,
that of the repository. While that is empty there are none, and what would be a link is plain text.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

_LINK = re.compile(
    r"(?P<picture>!?)\[(?P<text>[^\]]*)\]\((?!https?:|mailto:|#)(?P<path>[^)\s#]+)(?P<anchor>#[^)\s]*)?\)"
)


class Metadata(MetadataHookInterface):
    """Fills ``readme`` and ``urls``."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Hatch calls this with the project's table."""
        home = (os.environ.get("MOVIMENTUM_HOME") or self.config.get("home", "")).rstrip("/")
        version = str(metadata["version"])
        ref = version.partition("+g")[2] or (f"v{version}" if ".dev" not in version else "main")
        text = (Path(self.root) / "README.md").read_text(encoding="utf-8")
        metadata["readme"] = {"content-type": "text/markdown", "text": described(text, home, ref, self.config)}
        metadata["urls"] = urls(home, ref, self.config)


def urls(home: str, ref: str, config: dict[str, Any]) -> dict[str, str]:
    """The addresses under the names that indexes know."""
    if not home:
        return {}
    page = config["pages"].format(home=home, ref=ref, path="{}").format
    return {
        "Homepage": home,
        "Source": home,
        "Documentation": page("docs/index.md"),
        "Changelog": page("CHANGELOG.md"),
        "Issues": config["issues"].format(home=home),
    }


def described(text: str, home: str, ref: str, config: dict[str, Any]) -> str:
    """The README with absolute links; without a ``home``, links are their text, and pictures are left out."""

    def absolute(match: re.Match[str]) -> str:
        if not home:
            return "" if match["picture"] else match["text"]
        pattern = config["pictures"] if match["picture"] else config["pages"]
        address = pattern.format(home=home, ref=ref, path=match["path"]) + (match["anchor"] or "")
        return f"{match['picture']}[{match['text']}]({address})"

    plain = re.sub(r"<!--.*?-->\n?", "", text, flags=re.DOTALL)
    parts = re.split(r"(^```.*?^```$)", plain, flags=re.MULTILINE | re.DOTALL)  # code stays as it is
    linked = (part if part.startswith("```") else _LINK.sub(absolute, part) for part in parts)
    return re.sub(r"\n{3,}", "\n\n", "".join(linked))
