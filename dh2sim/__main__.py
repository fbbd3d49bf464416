"""``python -m dh2sim``, and the program ``dh2sim``."""

import signal

if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not where whoever started it has it ignored
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # no traceback of Python's own until ``main`` handles signals

from dh2sim.cli.main import main

if __name__ == "__main__":
    main()
