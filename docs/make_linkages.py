"""Makes the gallery's imported scenes again: ``python docs/make_linkages.py [FOLDER]``.

Each is what `movimentum import` makes of a linkage, and the lines that move it.
"""

from __future__ import annotations

import cmath
import math
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from benchmarks.penrose import transformable  # noqa: E402
from movimentum.interop.linkages import linkage_script, read_linkage  # noqa: E402
from movimentum.source import SourceText  # noqa: E402

PEAUCELLIER = """
Path : .trace R3_5.V5 .whole;

// V5 is drawn round an ellipse. It follows as far as the linkage lets it: straight up and down.
R3_5.V5 ~ [320 + 40*.sin(180*.t), 200 + 100*.sin(90*.t)];
.claim R3_5.V5.x = 320 .within(1e-9);

@4   .loop;
"""

PARITY = ("#2b6cb0", "#c05621")
"""Of stars that turn one way, and the other."""


def peaucellier() -> str:
    """Peaucellier's inversor from its linkage file, its end drawn by a wish."""
    path = ROOT / "scripts" / "linkages" / "peaucellier.txt"
    linkage, _ = read_linkage(SourceText(path.name, path.read_text(encoding="utf-8")))
    script = linkage_script(linkage, path.name) + PEAUCELLIER
    return script.replace(".config(24)", ".config(24, 380, 400)", 1)


def penrose(order: int, edge: float, middle: float) -> str:
    """A transformable tiling: one half edge of the middle star is drawn round it, and the whole tiling closes."""
    linkage = transformable(order, complex(middle, middle), edge)
    points = [complex(*vertex) for vertex in linkage.vertices]
    count = min(k for _, k in linkage.rods)  # the tiling's own vertices come before the middles of its edges
    halves: dict[int, list[int]] = {}
    for i, k in linkage.rods:
        halves.setdefault(k, []).append(i)
    waiting = [min(range(count), key=lambda i: abs(points[i] - complex(middle, middle)))]
    centre = waiting[0]
    parity = {centre: 0}
    while waiting:
        i = waiting.pop()
        for one, other in halves.values():
            near = other if one == i else one if other == i else None
            if near is not None and near not in parity:
                parity[near] = 1 - parity[i]
                waiting.append(near)
    first = next(k for i, k in linkage.rods if i == centre)
    neighbour = next(i for i in halves[first] if i != centre)
    script = linkage_script(linkage, f"A transformable Penrose tiling of order {order}")
    for i, k in linkage.rods:
        name = f"R{i}_{k} : .bar "
        script = script.replace(name, f"{name} .color('{PARITY[parity[i]]}') .width(4) ", 1)
    ray = math.degrees(cmath.phase(points[neighbour] - points[centre]))
    size = f".config(24, {2 * middle:g}, {2 * middle:g})"
    script = script.replace(".config(24)", size, 1)

    def anchor(n: int) -> str:
        """The anchor that stands for a vertex: that of its first rod."""
        i, k = next(rod for rod in linkage.rods if n in rod)
        return f"R{i}_{k}.V{n}"

    return (
        script
        + f"""
// The middle stays where it is, a neighbour on its ray; a half edge is drawn round the middle.
{anchor(centre)} = [{middle:g}, {middle:g}];
{anchor(neighbour)} = [{middle:g}, {middle:g}] + [_, 0].r({ray!r});
{anchor(first)} ~ [{middle:g}, {middle:g}] + [{edge / 2:g}, 0].r({ray!r} + 35*(1 - .cos(90*.t)));

@4   .loop;
"""
    )


def main(folder: Path) -> None:
    """Write the scripts into ``folder``."""
    made = {
        "peaucellier-linkage": peaucellier(),
        "penrose-five": penrose(1, 90.0, 170.0),
        "penrose-twenty": penrose(2, 60.0, 180.0),
    }
    for name, text in made.items():
        (folder / f"{name}.mov").write_text(text, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "scripts")
