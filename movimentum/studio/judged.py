"""The claims of a script for its page: which hold, and where the others fail."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from movimentum.analysis.diagnose.claims import broken_claims
from movimentum.scene.model import Relation
from movimentum.studio.pictures import about, placed

if TYPE_CHECKING:
    from movimentum.solver.motion import PathMotion


def claims_told(motion: PathMotion) -> list[dict[str, Any]]:
    """The claims of a motion as `movimentum.studio.answers.ClaimsJudged` has them."""
    timeline = motion.timeline
    broken = {found.claim.number: found for found in broken_claims(motion)}
    claims = {held.claim.number: held.claim for held in timeline.claims}
    signs = {Relation.BELOW: "<", Relation.ABOVE: ">"}
    told: list[dict[str, Any]] = []
    for number, claim in sorted(claims.items()):
        sign = signs.get(claim.relation, "")
        sign += "" if sign and claim.strict else "="
        item: dict[str, Any] = {
            "span": placed(timeline.scene.source, claim.span),
            "words": f"{claim.told[0]} {sign} {claim.told[1]}",
            "things": sorted(about(claim)),
            "holds": number not in broken,
        }
        if number in broken:
            found = broken[number]
            worst = found.worst if np.isfinite(found.worst) else None
            item |= {"time": found.time, "frame": found.frame, "worst": worst, "at": found.worst_time}
            item["failing"] = [list(run) for run in found.failing]
        told.append(item)
    return told
