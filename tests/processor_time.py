"""Where a run's processor time goes: tests and fixtures above a limit are listed; ``--guard`` fails on too many.

Seconds are those of this process and of the children that have ended, without what numba compiled meanwhile, and
without the fixtures of a module or session that a test happened to be the first to ask for: these are listed by name.
"""

import os

import pytest
from numba.core import event

LIMIT, SHARE = 3.0, 1 / 200
"""Seconds of a test that is not marked slow, and part of what all tests take: the larger counts, as machines differ."""
MOST = 10
"""Tests and fixtures above the limit that `--guard` allows."""
COSTS, TOTAL = "processor time", "processor time of all"


def seconds():
    """Processor seconds so far, of this process and of children that have ended."""
    return sum(os.times()[:4])


class Compiling(event.Listener):
    """Processor seconds that the compiler has taken."""

    def __init__(self):
        self.total, self.depth, self.began = 0.0, 0, 0.0

    def on_start(self, _):
        if not self.depth:
            self.began = seconds()
        self.depth += 1

    def on_end(self, _):
        self.depth -= 1
        if not self.depth:
            self.total += seconds() - self.began


class ProcessorTime:
    """Registered with pytest in each process: workers report by ``user_properties``, the first process sums up."""

    def __init__(self):
        self.compiling, self.costs, self.shared, self.fixtures = Compiling(), {}, 0.0, []
        self.total = 0.0
        event.register("numba:compile", self.compiling)

    def now(self):
        return seconds() - self.compiling.total

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef):
        if fixturedef.scope == "function":
            return (yield)
        began, within = self.now(), self.shared
        try:
            return (yield)
        finally:
            own = self.now() - began - (self.shared - within)
            self.shared += own
            self.fixtures.append((f"{fixturedef.baseid}: fixture {fixturedef.argname}", own))

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item):
        self.began, self.within = self.now(), self.shared
        return (yield)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self, item, call):
        report = yield
        if call.when == "teardown":
            own = self.now() - self.began - (self.shared - self.within)
            costs = self.fixtures + ([(item.nodeid, own)] if not item.get_closest_marker("slow") else [])
            told = [(COSTS, [c for c in costs if c[1] > LIMIT]), (TOTAL, own + sum(cost for _, cost in self.fixtures))]
            report.user_properties = [*report.user_properties, *told]
            self.fixtures = []
        return report

    def pytest_runtest_logreport(self, report):
        for name, value in report.user_properties if report.when == "teardown" else ():
            if name == COSTS:
                for of, cost in value:
                    self.costs[of] = max(cost, self.costs.get(of, 0.0))
            elif name == TOTAL:
                self.total += value

    @property
    def limit(self):
        return max(LIMIT, SHARE * self.total)

    @property
    def too_many(self):
        return sum(cost > self.limit for cost in self.costs.values()) > MOST

    def pytest_sessionfinish(self, session):
        if session.config.getoption("--guard") and self.too_many:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter, config):
        if self.costs:
            terminalreporter.section(f"more than {LIMIT:.0f} processor seconds: {len(self.costs)}")
            for of, cost in sorted(self.costs.items(), key=lambda one: -one[1]):
                terminalreporter.write_line(f"{cost:6.1f} {of}")
            terminalreporter.write_line(f"all took {self.total:.0f} s: {self.limit:.1f} s is the limit")
            if config.getoption("--guard") and self.too_many:
                terminalreporter.write_line(f"at most {MOST} may take longer: make them smaller or mark them slow")
