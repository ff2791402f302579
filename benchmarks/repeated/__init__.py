"""A large log, made by repeating a real one.

Definitions stand once, times and sequence numbers go on from repetition to repetition, checksums
are made anew: it is one long recording. Files are written piece by piece, so that a gigabyte needs
no gigabyte of memory.

tlog.py       MAVLink telemetry logs
dataflash.py  DataFlash logs
ulog.py       ULogs
"""
