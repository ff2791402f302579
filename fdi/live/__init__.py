"""What do the residuals say while the vehicle flies? The methods on a link instead of a file.

Given a link that brings MAVLink; sought lines and a view while it comes, and a whole ``.tlog``.
The bytes go through the reader of logs in a window of bounded length, and what is made of them is
what files go through: nothing is computed in a second way. Nothing is sent to the vehicle.

- ``connection.py``: ``udp:``, ``tcp:``, serial: a `Link`
- ``recorder.py``: the ``.tlog`` as it goes
- ``hearing.py``: who speaks, and is the link alive
- ``window.py``: the last seconds of a vehicle as a log
- ``session.py``: one more piece of bytes; what every engine does
- ``observing.py``: the linear observer; ``watching.py``: the bank and the methods
- ``listening.py``: the loop till Ctrl-C
- ``screen.py``: the view on a terminal
"""
