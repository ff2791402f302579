"""Does any input make a reader raise, hang or devour memory?

Small heads of real logs are mutated (one number gives one input, the same on every machine with
the same heads) and everything that a log offers is asked of the result. Only an `FdiError` may be
raised, in bounded time and memory.

    PYTHONPATH=tests python -m telemetry.fuzz [--count 200000] [--first 0]

heads.py      short logs of every format, cut out of real ones or composed
mutations.py  number to input
clocks.py     the same of damaged clocks, for `--clocks`
definitions.py the same of what a log says about itself, for `--analyze`
whole.py      how the whole analysis of it ends, by the exit code
exercise.py   what is asked of a log, and what has to hold
worker.py     a process that tries a range of numbers under limits
__main__.py   starts workers, watches them, makes failing inputs smaller and keeps them
"""
