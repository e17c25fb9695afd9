"""How long the debugger takes to answer: every question about every script of the gallery.

    python benchmarks/repl.py [--rounds N]

The session is opened and has solved its script, as it has when a person types; each question is then asked in a session
that has not been asked before. Prints the slowest answer to each question and the script that it was about.
"""

from __future__ import annotations

import argparse
import statistics
import time
from pathlib import Path

from movimentum.errors import MovimentumError
from movimentum.repl.session import Session, opened
from movimentum.repl.shell import answer
from movimentum.workflow.choices import Choices

SCRIPTS = Path(__file__).resolve().parent.parent / "scripts"


def questions(session: Session) -> list[str]:
    """One of each kind, about the scene's first body."""
    thing = next(t for t in session.work.scene.things if t.is_body and len(t.anchors) > 1)
    name = f"{thing.name}.{thing.anchors[1].name}"
    middle = session.work.timeline.frame_count // 2
    return [
        f"frame {middle}", "next", "steps", "show", f"show {name}", "constraints", "residuals", "plan", f"plot {name}",
        f"why {name}", "free", "solutions", "branch", "check", f"{name}.x < 100000",
    ]  # fmt: skip


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--rounds", type=int, default=3)
    rounds = parser.parse_args().rounds
    worst: dict[str, tuple[float, str]] = {}
    for script in sorted(SCRIPTS.glob("*.mov")):
        count = len(questions(opened(str(script), Choices())))
        for index in range(count):
            times: list[float] = []
            for _ in range(rounds):
                session = opened(str(script), Choices())
                line = questions(session)[index]
                session.poses()
                begin = time.perf_counter()
                try:
                    answer(session, line)
                except MovimentumError:
                    continue
                times.append(time.perf_counter() - begin)
            kind = line.split()[0] if not line.endswith("100000") else "a statement"
            kind = "show" if kind == "show" else kind
            if times:
                worst[kind] = max(worst.get(kind, (0.0, "")), (statistics.median(times), script.stem))
    for kind, (seconds, stem) in worst.items():
        print(f"{kind:12} {1000 * seconds:8.1f} ms  {stem}")


if __name__ == "__main__":
    main()
