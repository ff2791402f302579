"""What did the autopilot's own estimator notice?

- ``columns.py``: whom its complaints point to, over time
"""
