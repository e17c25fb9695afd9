"""Code that was made before: most plans compute much of what another one computed."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from fractions import Fraction

from movimentum.expressions import Expr
from movimentum.kept import Kept
from movimentum.planning.codegen.generate import Clocks, Compiled, compiled


class KeptCode(Kept[tuple[Compiled, tuple[Fraction, ...]]]):
    """Compiled functions by what they compute, each with the clocks that were numbered when it was made."""

    def of(self, outputs: Sequence[Expr], clocks: Clocks) -> Compiled:
        """`compiled`."""
        some = tuple(outputs)
        return self.made_by(some, clocks, lambda: compiled(some, clocks))

    def made_by(self, key: Hashable, clocks: Clocks, make: Callable[[], Compiled]) -> Compiled:
        """What ``make`` gives, which numbers ``clocks``, made once for each ``key`` and the clocks numbered before."""
        whole = key, tuple(clocks.starts)
        found = self.get(whole)
        if found is None:
            function = make()
            self.keep(whole, (function, tuple(clocks.starts)))
            return function
        function, starts = found
        for start in starts:
            clocks.number(start)
        return function
