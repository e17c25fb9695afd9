"""No verdict is wrong: each is compared with closed formulas in 60 digits, on every branch, at random drives."""

from fractions import Fraction

from mpmath import mp, mpf

from movimentum.errors import MovimentumError
from movimentum.proving.prove import Prover
from movimentum.proving.verdicts import ProofVerdict
from tests.broad import broad
from tests.proving.closed_forms import DIGITS, Node, all_signs, mutated, off, random_family
from tests.proving.test_positions import film

CLAIMS, DRIVES = 6, 14
WRONG = mpf(10) ** -45
"""More than this is no rounding of 60 digits, and less than any number that a claim is changed by."""


def known(chance, family, motion):
    """Choices of sides, times in the film and elsewhere, each with where everything is; whether it is the film's."""
    end, found = motion.timeline.end, []
    for k in range(DRIVES):
        inside = k < DRIVES // 2
        t = Fraction(chance.randint(1, 9999), 10000) * end if inside else Fraction(chance.randint(-60, 60), 7)
        for signs in all_signs(family):
            with mp.workdps(DIGITS):
                env = family.poses(family.drive(mpf(t.numerator) / t.denominator), signs)
            if env is not None:
                found.append((t, inside, signs, env))
    return found


def of_film(family, motion, t):
    """The choice of sides of the film at a time; None where two are as near."""
    poses = motion.poses_at([t])
    if not poses.solved[0]:
        return None
    things = {thing.name: thing for thing in motion.timeline.scene.things}
    offs = []
    for signs in all_signs(family):
        with mp.workdps(DIGITS):
            env = family.poses(family.drive(mpf(t.numerator) / t.denominator), signs)
        if env is None:
            continue
        far = 0.0
        for name in family.points:
            thing, anchor = name.split(".")
            body = things[thing]
            local = next(one.local for one in body.anchors if one.name == anchor)
            x, y = poses.world(body.number, local)[0]
            far = max(far, abs(complex(env[name]) - complex(x, y)))
        offs.append((far, signs))
    offs.sort()
    assert offs, "the formulas have no pose where the film has one"
    assert offs[0][0] < 1e-2, offs
    return None if len(offs) > 1 and offs[1][0] < 1e-3 else offs[0][1]


def fitted(family, motion):
    """Of gears, by how much the second is turned: a rational number of degrees that the film has."""
    body = next(thing for thing in motion.timeline.scene.things if thing.name == "Planet")
    sun, arm = (next(t for t in motion.timeline.scene.things if t.name == name) for name in ("Sun", "Arm"))
    poses = motion.poses_at([Fraction(0)])
    assert poses.angle[sun.number][0] == poses.angle[arm.number][0] == 0.0
    turn = Fraction(float(poses.angle[body.number][0])).limit_denominator(10_000)
    assert abs(float(turn) - poses.angle[body.number][0]) < 1e-9
    return turn


def off_in_film(family, motion, claim, broken, here):
    """Whether a claim fails in the film: where it is told to be off most, or at one of the times that were tried."""
    if any(one is None or one > WRONG for one in here):
        return True
    if broken is None:
        return not here
    t = Fraction(broken[0])
    signs = of_film(family, motion, t)
    if signs is None:
        return True  # it is not known which pose that is
    with mp.workdps(DIGITS):
        env = family.poses(family.drive(mpf(t.numerator) / t.denominator), signs)
    found = off(claim, env)
    return found is None or found > WRONG


def compared(seed):
    """How many claims of a random film were compared with the truth."""
    chance, family = random_family(seed)
    claims = [mutated(chance, family, chance.choice(family.claims)) for _ in range(CLAIMS)]
    try:
        motion, broken = film(family.script([("1", "1")]))
    except MovimentumError:
        return 0  # it cannot be assembled
    if getattr(family, "gears", False):
        turn = fitted(family, motion)
        with mp.workdps(DIGITS):
            family.poses.fitted = mpf(turn.numerator) / turn.denominator

        def put(node):
            text = node.text.replace("FITTED", f"({turn.numerator}/{turn.denominator})")
            return Node(text, node.value) if node.value is not None else node

        claims = [(put(left), put(right)) if "FITTED" not in left.text + right.text else None for left, right in claims]
        claims = [claim for claim in claims if claim is not None]
    text = family.script(claims)
    motion, broken = film(text)
    if not motion.poses(0, motion.timeline.frame_count).solved.all():
        return 0
    prover = Prover(motion)
    places = known(chance, family, motion)
    sides = {t: of_film(family, motion, t) for t, inside, _, _ in places if inside}
    for claim, held in zip(claims, motion.timeline.claims, strict=True):
        judged = prover.judged(held, broken.get(held.claim.number))
        told = text, f"{claim[0]} = {claim[1]}", judged
        elsewhere = [off(claim, env) for _, _, _, env in places]
        here = [off(claim, env) for t, inside, signs, env in places if inside and sides[t] == signs]
        conditional = any("passes" in condition for condition in judged.conditions)
        match judged.verdict:
            case ProofVerdict.PROVED:
                assert all(one is None or one < WRONG for one in elsewhere), told
            case ProofVerdict.ON_BRANCH if not conditional:
                assert all(one is None or one < WRONG for one in here), told
            case ProofVerdict.FALSE:
                assert off_in_film(family, motion, claim, broken.get(held.claim.number), here), told
            case ProofVerdict.IN_FILM:
                assert any(one is not None and one > WRONG for one in elsewhere), told
            case _:
                pass
    return len(claims)


@broad("seed", range(40), first=1)
def test_no_verdict_is_wrong(seed):
    count = 0
    for number in range(3 if seed == 0 else 20):
        count += compared(1000 * seed + number)
    assert count
