"""What a fit tells about its result: ends of ranges, what is left open, and the same to people and to programs."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

from movimentum.cli.app import run_command_line
from movimentum.fitting.fit import make_job, make_problem
from movimentum.fitting.search import Candidates
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from tests.broad import broad

ARM = """.let R = 40 .range({ends}); {lets}
Arm : .bar O = [0, 0] P = [R, 0];
@0 Arm.O = [0, 0]; Arm.angle = 300*.t;
{goals}
@1"""


def told(tmp_path, capsys, *options, ends="20, 60", lets="", goals="") -> tuple[dict, str]:
    path = tmp_path / "arm.mov"
    path.write_text(ARM.format(ends=ends, lets=lets, goals=goals))
    assert run_command_line(["fit", str(path), "--format", "json", *options]) == 0
    captured = capsys.readouterr()
    return json.loads(captured.out), captured.err


@pytest.mark.slow
def test_a_proposed_range_keeps_the_other_constants_and_does_better(tmp_path, capsys):
    given = {"lets": ".let S = 3 .range(0, 30);", "goals": ".goal .max(Arm.P.x) = 70; .goal S + R = 75;"}
    found, err = told(tmp_path, capsys, **given)
    assert [each["code"] for each in found["diagnostics"]] == re.findall(r"note\[(.+?)\]", err) != []
    (advice,) = (line for line in err.splitlines() if "help: --vary" in line)
    better, _ = told(tmp_path, capsys, *advice.split("help: ")[1].split(), **given)
    assert better["cost"] < 1e-12 < found["cost"]
    assert {each["name"] for each in better["constants"]} == {"R", "S"}


@pytest.mark.slow
def test_no_range_is_proposed_beyond_the_film(tmp_path, capsys):
    lets, goals = ".let t1 = 0.5 .range(0.5, 1);", ".goal Arm.P = [50*.cos(340), 50*.sin(340)] .at(t1);"
    _, err = told(tmp_path, capsys, lets=lets, goals=goals)
    assert "t1 is at the end of its range, 1" in err
    assert "--vary" not in err


@broad(
    ("goals", "free"),
    [
        ("(R - 30)^2 + (S - 4)^2 = -1", 0),
        ("(R - 30)^2 + (S - 4)^2 = 1", 1),
        ("(R - 30 + S)^2 = -1", 1),
        ("(R - 30)*(R - 30) + 2*(S - 4)^2 + (R - 30)*(S - 4) = -3", 0),
    ],
    every=2,
)
def test_isolated_minima_are_not_called_undecided(tmp_path, capsys, goals, free):
    _, err = told(tmp_path, capsys, lets=".let S = 3 .range(0, 10);", goals=f".goal {goals};")
    assert ("fit/undecided" in err) == (free > 0)


def test_refined_candidates_have_the_best_times():
    lets, x, y = ".let t1 = 0.5 .range(0, 1);", 40 * np.cos(np.radians(10)), 40 * np.sin(np.radians(10))
    text = ARM.format(ends="20, 60", lets=lets, goals=f".goal Arm.P = [{float(x)!r}, {float(y)!r}] .at(t1);")
    search = make_problem(make_job(SourceText("arm.mov", text), Choices(), {})).search
    stuck = search.judged(np.array([[0.5, 1.0]]))
    assert isinstance(stuck, Candidates)
    best = search.refined(stuck).best(1)  # the end of the film is a local minimum
    assert best.costs[0] < 1e-16
    np.testing.assert_allclose(best.points[0], [0.5, 10 / 300], atol=1e-8)
