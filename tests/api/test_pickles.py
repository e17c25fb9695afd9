"""What Python gets can be pickled, also once it is solved, and is the same in another process, to the last bit."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import movimentum as mv
from tests.broad import broad
from tests.command import BINDS, CRANK, ROOT, environment

FREE = "Arm : .bar O=[0,0] P=[9,0]; @0 Arm.O=[0,0]; Arm.P ~ [0,9] .speed(3); s = .i(Arm.P.y); @1"
PARTS = """
    .let R = 20 .range(10, 30);
    .part Leg(phase) { Arm : .bar O = [0,0] P = [R,0]; @0 Arm.O = [phase, 0]; Arm.angle = phase*.t; }
    Leg[k = 0..2] : Leg(60*k + 1);
    @0 v = [R, 2]; @1
"""
FIT = """.let R = 30 .range(10, 80); .let idle = 3 .range(1, 5);
    Arm : .bar O = [0,0] P = [R,0];
    @0 Arm.O = [0,0]; Arm.angle = 90*.t;  .goal .max(Arm.P.y) = 50;  .require Arm.P.x > -1;
    @1"""

MADE: dict[str, Callable[[], object]] = {
    "script": lambda: mv.loads(CRANK),
    "bound": lambda: mv.loads(BINDS),
    "parts": lambda: mv.loads(PARTS, R=25),
    **{tier.value: lambda tier=tier: mv.loads(CRANK).solve(tier) for tier in mv.Accuracy},
    "digits": lambda: mv.loads(CRANK).solve("exact", digits=30, fps="7/2"),
    "hold": lambda: mv.loads(BINDS).solve(on_failure="hold"),
    "skip": lambda: mv.loads(BINDS).solve(on_failure="skip", fps=30),
    "free": lambda: mv.loads(FREE).solve(),
    "parts solved": lambda: mv.loads(PARTS, R=25).solve(),
    "moment": lambda: mv.loads(CRANK).solve().at("1/3"),
    "moments": lambda: mv.loads(CRANK).solve().at([0.5, 0]),
    "fit": lambda: mv.loads(FIT).fit(),
    "sweep": lambda: mv.loads(FIT).sweep(R=[20, 30], measure={"top": ".max(Arm.P.y)"}),
}


def values(made: object) -> object:
    """Everything that can be asked of it, as data that compare."""
    match made:
        case mv.Script():
            try:
                return values(made.solve()), repr(made), made.text, made.constants, made.things, made.diagnostics
            except mv.NoSolutionError as error:
                return str(error)
        case mv.Motion() | mv.Moments():
            rates = [made.velocity(name).tobytes() for name in made]
            said = made.diagnostics if isinstance(made, mv.Motion) else ()
            return (
                [made[name].tobytes() for name in made],
                rates,
                made.times.tobytes(),
                made.solved.tobytes(),
                repr(made),
                said,
            )
        case mv.Fit():
            told = (
                made.constants,
                made.before,
                made.others,
                made.met,
                made.cost,
                made.text,
                made.diagnostics,
                repr(made),
            )
            return told, made.goals, made.requirements
        case mv.Sweep():
            return [(name, column.tobytes()) for name, column in made.columns()], repr(made)
        case _:
            raise NotImplementedError(made)


def used(made: object) -> object:
    """It, with its caches filled."""
    values(made)
    return made


@broad("name", MADE, every=3)
def test_a_pickle_is_the_same(name: str) -> None:
    made = used(MADE[name]())
    for protocol in (2, pickle.HIGHEST_PROTOCOL):
        assert values(pickle.loads(pickle.dumps(made, protocol))) == values(made)
    assert values(copy.deepcopy(made)) == values(made)


CODE = """import pickle
from tests.api.test_pickles import values
with open("made", "rb") as made, open("told", "wb") as told:
    pickle.dump({name: values(each) for name, each in pickle.load(made).items()}, told)
"""


@broad("names", [["script", "standard", "moment"], ["exact", "free", "fit"]], first=1)
def test_pickles_are_the_same_in_another_process(tmp_path: Path, names: list[str]) -> None:
    made = {name: used(MADE[name]()) for name in names}
    (tmp_path / "made").write_bytes(pickle.dumps(made))
    subprocess.run([sys.executable, "-c", CODE], cwd=tmp_path, env=environment(), check=True)
    told = pickle.loads((tmp_path / "told").read_bytes())
    assert {name for name, each in made.items() if told[name] != values(each)} == set()


def test_a_pickle_needs_none_of_the_files(tmp_path: Path) -> None:
    Image.new("RGB", (40, 20), "red").save(tmp_path / "red.png")
    (tmp_path / "leg.mov").write_text(
        ".part Leg { Arm : .bar O = [0,0] P = [9,0]; @0 Arm.O = [1,2]; Arm.angle = 5*.t; }"
    )
    (tmp_path / "wing.mov").write_text(
        ".include 'leg.mov'; L : Leg(); Wing : 'red.png' O = [0,0]; @0 Wing.O = [50,50]; @1"
    )
    motion = mv.load(tmp_path / "wing.mov").solve()
    data, expected = pickle.dumps(motion), values(motion)
    for file in tmp_path.iterdir():
        file.unlink()
    assert values(pickle.loads(data)) == expected


@pytest.mark.slow
@pytest.mark.parametrize("path", sorted((ROOT / "scripts").glob("*.mov")), ids=lambda path: path.stem)
def test_motions_of_the_gallery_come_back(path: Path) -> None:
    motion = mv.load(path).solve(on_failure="hold")
    again = pickle.loads(pickle.dumps(motion))
    assert list(again) == list(motion)
    for name in motion:
        assert np.array_equal(again[name], motion[name], equal_nan=True), name
