"""A four-bar linkage for the tests, whatever the gallery's looks like."""

from __future__ import annotations

FOUR_BAR = """\
.config(25, 400, 320);
Crank   : .bar  A = [130,110]  B = A + [50,0]                                .width(10) .color('firebrick');
Coupler : .bar  B = [0,0]  P = B + [70,90]  C = B + [150,0]  Z = B + [0,0]   .width(10) .color('steelblue');
Rocker  : .bar  C = [0,0]  D = C - [0,130]                                   .width(10) .color('seagreen');
PivotA  : .disc(8)  O = [130,110];      PivotD : .disc(8)  O = [310,110];    // no step mentions them: they stay
@0  Crank.A   = [130,110];   Crank.angle = 180*.t;                           // half a turn each second
    Coupler.B = Crank.B;     Rocker.C = Coupler.C;                           // pins
    Rocker.D  = [310,110];   Rocker.C.y > Rocker.D.y;                        // the rocker stands up
@2
"""
