"""Fits on a cluster: parts of the search go out, what they found comes back."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

from movimentum.fitting.fit import FitJob, FitProblem, Work, make_problem, task_done
from movimentum.fitting.search import Candidates, Task
from movimentum.records import replace
from movimentum.workflow.clusters import done_by, unpacked


def done_there(job: FitJob, client: Any) -> Work:
    """Does parts of the search on the workers of ``client``, a `distributed.Client`; the result is the same."""

    def work(tasks: list[Task]) -> Iterator[Candidates]:
        whole = replace(job, files=replace(job.files, complete=True))  # the workers need not share our disk
        yield from done_by(client, search_part, whole, ((task,) for task in tasks))

    return work


@lru_cache(maxsize=1)
def _problem(data: bytes) -> FitProblem:
    job: FitJob = unpacked(data)
    return make_problem(job)


def search_part(data: bytes, task: Task) -> Candidates:
    """What comes of one part of the search; runs on a worker."""
    return task_done(_problem(data), task)
