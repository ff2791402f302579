"""Do our columns hold what the reference readers read?

Every field of every message of a file is compared with pymavlink (telemetry logs, DataFlash) or
pyulog (ULog): raw values against raw values, and the SI values against the unit that the file or
the dialect states. What may differ is written down in `REASONS`; anything else is unexplained.

    PYTHONPATH=tests python -m telemetry.conformance [FILE or FOLDER...]

comparison.py  one file's result, and the comparison of one column
telemetry.py   `.tlog` against pymavlink's decoder
dataflash.py   `.bin` against DFReader
dataflash_text.py  `.log` against DFReader_text
ulog.py        `.ulg` against pyulog, in a process of its own
"""
