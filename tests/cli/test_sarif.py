"""SARIF, as code review tools read it."""

import json

from tests.command import movimentum


def test_a_log_of_one_run(tmp_path):
    (tmp_path / "a scene.mov").write_text(
        """.config(10);
Rod : .bar A=[0,0] B=[100,0];
@0 Rod.A=[0,0]; Rod.B=[90,0];
@1
"""
    )
    done = movimentum("check", "a scene.mov", "--format", "sarif", cwd=tmp_path)
    assert done.returncode == 1
    log = json.loads(done.stdout)
    assert log["version"] == "2.1.0"
    (run,) = log["runs"]
    (result,) = [r for r in run["results"] if r["level"] == "error"]
    rules = [rule["id"] for rule in run["tool"]["driver"]["rules"]]
    assert rules[result["ruleIndex"]] == result["ruleId"] == "constraint/conflict"
    place = result["locations"][0]["physicalLocation"]
    assert place["artifactLocation"]["uri"] == "a%20scene.mov"
    assert place["region"] == {"startLine": 3, "startColumn": 17, "endLine": 3, "endColumn": 29}
    lines = {r["physicalLocation"]["region"]["startLine"] for r in result["relatedLocations"]}
    assert lines <= {2, 3}
    assert all(r["message"]["text"] for r in result["relatedLocations"])
