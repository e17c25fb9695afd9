"""Derivatives that nothing tells."""

from __future__ import annotations

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.planning.structure.rates import RateError, RateTrouble
from movimentum.scene.model import Scene


def untold_rate(scene: Scene, error: RateError) -> Diagnostic:
    """A derivative that nothing tells."""
    constraint = next((c for c in scene.constraints() if c.number == error.constraint), None)
    who = "a free motion" if error.thing is None else f"the free motion of `{scene.things[error.thing].name}`"
    code, message, help_ = _UNTOLD[error.trouble]
    return Diagnostic(
        code=f"constraint/{code}",
        severity=Severity.ERROR,
        message=message.format(who=who),
        span=constraint.span if constraint else None,
        helps=(help_,),
    )


_UNTOLD = {
    RateTrouble.CYCLE: (
        "cyclic-derivative",
        "this derivative depends on itself",
        "state the equation with `.i(…)` instead: `x = 5 - .i(x)`",
    ),
    RateTrouble.FED_BACK: (
        "cyclic-derivative",
        "{who} depends on its own velocity",
        "take the derivative of something that this statement does not move",
    ),
    RateTrouble.HIGHER: (
        "no-acceleration",
        "{who} has a velocity, but no acceleration",
        "`.d(.d(…))` needs a motion that equations determine, or one that only trails, not one that follows a wish",
    ),
    RateTrouble.FLOWING: (
        "no-velocity",
        "the velocity of {who} is unknown, because it depends on an integral",
        "determine what is still free, or leave the integral out",
    ),
    RateTrouble.PUSHED: (
        "no-acceleration",
        "{who} has a velocity, but no acceleration: something pushes it",
        "`.d(…)` of it, once, is known",
    ),
    RateTrouble.DEMANDED: (
        "demanded-velocity",
        "this says how fast {who} should be, but `.d(…)` only tells how fast it is",
        "a wish moves it (`… ~ […] .speed(20);`), and so does an equation with `.i(…)`",
    ),
}
"""By what is wrong with a derivative: a code, a message and a help."""
