"""Which of several autopilots of one vehicle does a decentralised voter select, when and why?

Given the logs of one to n autopilots that fly one vehicle; sought what each of them thinks of all
(errors, priorities), whom it votes for and who is selected, such that the published record of such
a voter comes out cycle for cycle from its inputs alone. `Log`... + `Settings` -> `Voting`.

The voter is that of a triple redundant PX4 (thesis, chapter 4 and section 5.3), and the same for n
autopilots. Every autopilot sends the validity flags of its estimator and commander to the others
once a cycle, compares its own with the last ones received, counts lasting errors, ranks, votes. A
program outside counts the votes and switches.

settings.py      all parameters; the presets `thesis` and `recorded`
tables.json      the flags, and the published priorities of three
flags.py         the flags of a log: its own, and those that it received
clocks.py        several logs of one flight on one clock, or why not
views.py         what each autopilot could know: who received what from whom
priorities.py    counters to priorities: the table of three, the rule for n
middle.py        units of one sensor in one log: which departs from the mid value
columns.py       the same as columns beside the sensors, for an analysis
rules.py         one cycle: state and inputs to state and result
replay.py        many cycles, at given times or free running at any phase
recorded.py      what a log's own voter wrote, to be compared, never an input
selection.py     the program outside that counts the votes
reaction.py      how long detection and take-over took
voting.py        `vote`: logs to `Voting`
simulate.py      n autopilots that lose messages, fall silent, die or lie, at random
scenarios.py     the scenarios that say when three are not enough
"""

from fdi.methods.voting.reaction import Reaction
from fdi.methods.voting.settings import PRESETS, Settings
from fdi.methods.voting.simulate import Failure, Outcome, Scenario, simulate
from fdi.methods.voting.voting import Voting, vote

__all__ = [
    "PRESETS",
    "Failure",
    "Outcome",
    "Reaction",
    "Scenario",
    "Settings",
    "Voting",
    "simulate",
    "vote",
]
