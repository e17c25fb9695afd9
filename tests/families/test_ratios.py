"""Levers whose place along a line is a ratio, `Pin.P = Lever.A + (Lever.B - Lever.A)*s`, in closed form: what a script
solves for may be of any size beside the scene's, and nothing that is drawn tells what it is.
"""

import cmath

import numpy as np
import pytest

import movimentum as mv
from tests.broad import broad


def vector(z):
    return f"[{float(z.real)!r}, {float(z.imag)!r}]"


class Levers:
    """A crank, and levers through its pin and then through a point of the lever before."""

    def __init__(self, seed, size, far):
        g = np.random.default_rng(seed)

        def place(far):
            return complex(*(far * g.uniform(-1.0, 1.0, 2)))

        self.speed = float(g.choice([-70.0, 40.0]))
        self.origin, self.arm = far + size * place(300.0), size * cmath.rect(30.0, g.uniform(0, 6))
        self.pivots = [self.origin + size * cmath.rect(g.uniform(80, 200), g.uniform(0, 6)) for _ in range(2)]
        self.long = [size * g.uniform(20, 300) for _ in self.pivots]
        self.away = [size * place(200.0) for _ in self.pivots]
        self.turned = [cmath.rect(1.0, g.uniform(-3.0, 3.0)) for _ in self.pivots]

    def ends(self, t):
        """(2, F) where the levers' ends are."""
        through = self.origin + self.arm * np.exp(1j * np.radians(self.speed * t))
        ends = []
        for pivot, long in zip(self.pivots, self.long, strict=True):
            heading = (through - pivot) / abs(through - pivot)
            ends.append(pivot + long * heading)
            through = pivot + long * heading * cmath.rect(1.2, 0.9)
        return np.array(ends)

    def script(self, drawn_there):
        lines = [f"Crank : .bar O = {vector(self.origin)}  P = O + {vector(self.arm)};"]
        steps = [f"@0 Crank.O = {vector(self.origin)};  Crank.angle = {self.speed}*.t;"]
        through = "Crank.P"
        for k, (pivot, end) in enumerate(zip(self.pivots, self.ends(np.zeros(1))[:, 0], strict=True)):
            arm, place = end - pivot, pivot
            if not drawn_there:
                arm, place = arm * self.turned[k], pivot + self.away[k]
                steps.append(f"L{k}.B ~ {vector(end)};")
            far = arm * cmath.rect(1.2, 0.9)
            lines.append(f"L{k} : .bar A = {vector(place)}  B = A + {vector(arm)}  C = A + {vector(far)};")
            steps.append(f"L{k}.A = {vector(pivot)};  {through} = L{k}.A + (L{k}.B - L{k}.A)*s{k};")
            through = f"L{k}.C"
        return "\n".join([".config(10);", *lines, *steps, "@1"])


@pytest.mark.parametrize("drawn_there", [True, False])
@broad(("size", "far"), [(1.0, 0.0), (1e-3, 1e5), (1e4, 0.0)], first=1)
@broad("seed", range(6), first=2)
def test_a_lever_begins_where_it_is_drawn_or_wished(seed, size, far, drawn_there):
    levers = Levers(seed, size, far)
    script = mv.loads(levers.script(drawn_there))
    motion = script.solve()
    for k, ends in enumerate(levers.ends(motion.times)):
        found = motion[f"L{k}.B"]
        assert np.max(np.abs(found[:, 0] + 1j * found[:, 1] - ends)) < 3e-7 * size + 1e-12 * abs(far), k
    codes = [item.code for item in script.diagnostics if str(item.severity) != "note"]
    assert "constraint/ambiguous" not in codes, codes
