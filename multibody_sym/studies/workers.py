"""Who computes the rows of a study: threads of this process, or the workers of any executor."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, suppress
from dataclasses import field
from threading import Event
from typing import Final

from multibody_sym.errors import ArgumentError, MultibodyError, OutputError
from multibody_sym.records import dataclass
from multibody_sym.studies.rows import Rows, Span
from multibody_sym.studies.task import Task

Answer = tuple[Rows, float]
_SECONDS: Final = 0.25
"""About how long a worker is busy with what it is given at once: what is lost where it is killed."""
_MOST: Final = 2000
"""Rows that one answer has at most, so that memory is bounded."""
_GROWTH: Final = 8
_AHEAD: Final = 2
"""What each worker has been given: that at which it is and that which comes next."""
_OUT: Final = 64
"""The most that is given at once to the workers of an executor, of which nobody knows how many they are."""


def processors() -> int:
    """Return how many processors this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not Linux
        return os.cpu_count() or 1


@dataclass(eq=False)
class Crew:
    """Those who compute: `submit` gives somebody a number of rows from a first one on; `most` are given out at once."""

    task: Task
    submit: Callable[[int, int], Future[Answer]]
    most: int
    stop: Callable[[], None]
    size: int = 1
    given: dict[Future[Answer], Span] = field(default_factory=dict)

    def work(self, spans: Sequence[Span]) -> Iterator[Rows]:
        """Yield the rows of all numbers in the spans, as they come."""
        left = list(reversed(spans))
        while left or self.given:
            while left and len(self.given) < self.most:
                first, end = left.pop()
                if end - first > self.size:
                    left.append((first + self.size, end))
                    end = first + self.size
                self.given[self._submitted(first, end - first)] = first, end
            for future in wait(self.given, return_when=FIRST_COMPLETED).done:
                span = self.given.pop(future)
                rows, seconds = self._answer(future)
                self._adapt(span, seconds)
                yield rows

    def finished(self) -> Iterator[Rows]:
        """Yield what those who were told to stop had done until then."""
        for future in self.given:
            future.cancel()
        for future in [future for future in self.given if not future.cancelled()]:
            with suppress(Exception):
                rows, _ = future.result()
                if len(rows):
                    yield rows

    def _submitted(self, first: int, count: int) -> Future[Answer]:
        """Return what somebody is going to compute. Raises OutputError where nobody takes it."""
        try:
            return self.submit(first, count)
        except RuntimeError as problem:
            raise OutputError(f"the executor takes no work: {_line(problem)}") from problem

    def _answer(self, future: Future[Answer]) -> Answer:
        """Return what somebody computed.

        Raises ArgumentError where nobody could be sent what to do, OutputError where those who compute are gone.
        """
        try:
            return future.result()
        except MultibodyError:
            raise
        except Exception as problem:
            if self.task.reduce is not None and " pickle " in str(problem):
                sent = "reduce cannot be sent to workers, who take what is pickled; define it at the top of a module"
                raise ArgumentError(f"{sent} ({_line(problem)})") from problem
            raise OutputError(f"the workers do not answer any more: {_line(problem)}") from problem

    def _adapt(self, span: Span, seconds: float) -> None:
        """Let answers take about as long as they are meant to."""
        fitting = int((span[1] - span[0]) * _SECONDS / max(seconds, 1e-6))
        self.size = max(1, min(fitting, _GROWTH * self.size, _MOST))


def _line(problem: Exception) -> str:
    return f"{type(problem).__name__}: {problem}".splitlines()[0]


@contextmanager
def crew(task: Task, workers: int, executor: Executor | None) -> Iterator[Crew]:
    """Give those who compute: threads that can be stopped between two runs, or what an executor has."""
    if executor is not None:
        lent = executor
        yield Crew(task, lambda first, count: lent.submit(task.timed, first, count), most=_OUT, stop=lambda: None)
        return
    stop = Event()
    with ThreadPoolExecutor(workers, thread_name_prefix="study") as pool:
        most = _AHEAD * workers
        yield Crew(task, lambda first, count: pool.submit(task.timed, first, count, stop), most=most, stop=stop.set)
