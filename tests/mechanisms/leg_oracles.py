"""Where the gallery's walking legs are: chains of circle intersections, from published numbers alone."""

from __future__ import annotations

import numpy as np

from tests.mechanisms.kinematics import Array, Columns, between, body, circle_circle, distance, merge, polar, still
from tests.mechanisms.linkage_oracles import HOLY, jansen_points

KLANN = {
    9: (1.366, 1.366), 11: (1.009, 0.574), 15: (1.599, 0.750),
    27: (0.741, 0.750), 29: (1.331, 0.750), 33: (0.0, 0.0), 35: (0.232, 0.866), 37: (0.866, 1.500),
}  # fmt: skip
"""US patent 6,260,862: the axles of the upper and the lower rocker and the crank, and with the leg stretched forward
the elbow, the crank's pin, the foot, the knee and the hip."""


def klann_points(crank_deg: Array) -> dict[int, Array]:
    """The joints by the patent's numbers, in its units; the crank begins at 180°."""
    points = {number: still(place, crank_deg) for number, place in KLANN.items()}

    def far(first: int, second: int) -> float:
        return float(distance(np.array(KLANN[first]), np.array(KLANN[second])))

    points[29] = points[15] + polar(far(15, 29), crank_deg)
    points[27] = circle_circle(points[29], far(29, 27), points[11], far(11, 27), -1)
    points[35] = circle_circle(points[29], far(29, 35), points[27], far(27, 35), -1)
    points[37] = circle_circle(points[35], far(35, 37), points[9], far(9, 37), +1)
    points[33] = circle_circle(points[35], far(35, 33), points[37], far(37, 33), -1)
    return points


def klann(t: Array) -> Columns:
    """170 pixels to the patent's unit, whose origin is at (50, 50); half a turn a second, clockwise."""
    at = {number: 170 * place + 50 for number, place in klann_points(180 - 180 * t).items()}
    drawn = {number: (170 * x + 50, 170 * y + 50) for number, (x, y) in KLANN.items()}
    leg = between("Leg", {"H": drawn[37], "K": drawn[35], "F": drawn[33]}, "K", at[35], "H", at[37])
    arm = between("Arm", {"P": drawn[29], "E": drawn[27], "K": drawn[35]}, "P", at[29], "E", at[27])
    # the third corners are not taken from the plates' shapes but from the circles: they must agree
    leg["Leg.F.x"], leg["Leg.F.y"] = at[33].T
    arm["Arm.K.x"], arm["Arm.K.y"] = at[35].T
    return merge(
        leg,
        arm,
        body("Crank", {"O": drawn[15], "P": drawn[29]}, "O", at[15], -180 * t),
        between("Upper", {"O": drawn[9], "H": drawn[37]}, "O", at[9], "H", at[37]),
        between("Lower", {"O": drawn[11], "E": drawn[27]}, "O", at[11], "E", at[27]),
    )


def jansen_walker(t: Array) -> Columns:
    """Six legs at 1.7 pixels to Jansen's unit about (280, 210): cranks a third of a turn apart, each with a leg and its
    mirror image.
    """
    axle = np.array([280.0, 210.0])
    parts: list[Columns] = []
    ends = {
        "bde": "ZRS", "ghi": "UVW", "c": "ZU", "f": "SV", "j": "PR", "k": "PU",
    }  # fmt: skip
    for n in range(3):
        crank = 120 * n - 180 * t
        parts.append(body(f"Crank[{n}]", {"O": (0, 0), "P": (1.7 * HOLY["m"], 0)}, "O", still((280, 210), t), crank))
        for side, angle, flip in (("Left", crank, 1.0), ("Right", 180 - crank, -1.0)):
            points = {name: axle + 1.7 * place * [flip, 1.0] for name, place in jansen_points(angle).items()}
            for bar, anchors in ends.items():
                for anchor in anchors:
                    column = f"{side}[{n}].{bar}.{anchor}"
                    parts.append({f"{column}.x": points[anchor][:, 0], f"{column}.y": points[anchor][:, 1]})
    return merge(*parts)
