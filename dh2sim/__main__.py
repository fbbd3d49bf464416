"""``python -m dh2sim``, and the program ``dh2sim``."""

import os
import signal

# Matrices here are too small for more threads of OpenBLAS to be quicker, and on busy processors they wait for each
# other, spinning: 10 s for 0.2 s of work. To be set before NumPy is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not where whoever started it has it ignored
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # no traceback of Python's own

from dh2sim.cli.signals import leave_on_signals

leave_on_signals()  # until ``main`` handles signals

from dh2sim.cli.main import main  # noqa: E402

if __name__ == "__main__":
    main()
