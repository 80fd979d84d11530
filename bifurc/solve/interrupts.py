"""Long compiled calls during which signals are looked at.

Python runs the handler of a signal between two of its own steps, in its main thread: never inside a compiled call.  A call that may
take long is therefore made in a thread of its own, while the main thread waits for it, and handlers run at once.  It is the same
call, to the last digit.  Where a handler raises, as that of Ctrl-C does, the call is told to stop, and waited for: it may write
into tables that others read.
"""
import threading
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

MANY = 128  # unknowns from which on one correction takes milliseconds; of a long sequence of events it takes minutes
LARGE = 500  # unknowns from which on factors of a full matrix take milliseconds


def spoil(arrays: Iterable[np.ndarray]) -> None:
    """Put NaN in place of all numbers of arrays: what iterates on them ends."""
    for array in arrays:
        array.fill(np.nan)


def interruptible(long: bool, stop: Callable[[], Any] | None, work: Callable[..., Any], *given: Any) -> Any:
    """Return ``work(*given)``, done beside the main thread where it is ``long``: where some 0.1 ms for a thread do not matter.

    Parameters
    ----------
    long : bool
        Whether the call may take as long as somebody would notice.
    stop : callable, or None
        Called where a handler of a signal raises: makes the call come to its end soon, by what it writes into what the call reads,
        as NaN in place of unknowns.  None for a call that writes into nothing that others know: it is left to itself.
    work : callable
        Compiled without the GIL, or a call of a library that lets go of it.
    given : object
        Its arguments.
    """
    if not long or threading.current_thread() is not threading.main_thread():
        return work(*given)
    made, failed, done = [], [], threading.Lock()

    def run() -> None:
        try:
            made.append(work(*given))
        except BaseException as error:
            failed.append(error)
        finally:
            done.release()

    done.acquire()
    threading.Thread(target=run, daemon=True).start()
    try:
        done.acquire()  # of a lock, since a signal's handler runs while one is waited for
    except BaseException:
        if stop is not None:
            stop()
            done.acquire()
        raise
    if failed:
        raise failed[0]
    return made[0]
