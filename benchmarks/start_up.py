"""What a user waits for before anything happens.

    python benchmarks/start_up.py [--rounds N]

Cold `movimentum --version` against `python -c "import numpy, lark, PIL.Image"`, and a ten-line script to its first GIF.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from measure import interleaved, machine, movimentum, table, verdict

SCENES = Path(__file__).resolve().parent / "scenes"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=15)
    rounds = parser.parse_args().rounds
    with tempfile.TemporaryDirectory() as folder:
        script = str(SCENES / "ten-lines.mov")
        commands = {
            "import numpy, lark, PIL.Image": [sys.executable, "-c", "import numpy, lark, PIL.Image"],
            "movimentum --version": movimentum("--version"),
            "check ten-lines.mov": movimentum("check", script),
            "ten-lines.mov, first picture": movimentum("run", script, "-o", f"{folder}/a.png"),
            "ten-lines.mov, GIF": movimentum("run", script, "-o", f"{folder}/a.gif"),
        }
        interleaved(commands, 1)  # warm the disk cache, compile bytecode, keep the parser
        runs = interleaved(commands, rounds)
    base = runs["import numpy, lark, PIL.Image"].seconds
    print(machine())
    print(table(runs))
    print(verdict("--version / imports", runs["movimentum --version"].seconds / base, 1.0))
    print(verdict("ten lines to a GIF / imports", runs["ten-lines.mov, GIF"].seconds / base, 3.0))
    print(verdict("first picture", runs["ten-lines.mov, first picture"].seconds, 0.3, " s"))


if __name__ == "__main__":
    main()
