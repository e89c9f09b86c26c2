"""What test_processes.py asks of processes: a module of its own, since they import it, and it is to cost little."""

import os
import signal
import threading
import time

from wheeltapper.ground.errors import InputError


def tried(shared, name):
    """Return how often something was tried before."""
    with (shared / str(name)).open("a+") as file:
        file.write("x")
    return len((shared / str(name)).read_text()) - 1


def die(*_):
    os.kill(os.getpid(), signal.SIGKILL)


def squared(shared, task):
    number, how = task
    before = tried(shared, number)
    if how == "always" or (how == "once" and not before):
        die()
    if how == "asleep":
        time.sleep(600.0)
    if how == "exit":
        os._exit(7)
    if how == "late" and not before:
        time.sleep(0.3)
        die()
    if how == "answering" and not before:  # it takes longer than that to send so much
        threading.Timer(0.02, die).start()
        return bytes(10**8)
    return number**2


class TwoReasonsError(Exception):
    def __init__(self, one, other):
        super().__init__(f"{one} and {other}")


def raising(shared, task):
    raise {"ValueError": ValueError("bad"), "InputError": InputError("a", "b", "c", "d")}.get(
        task, TwoReasonsError("no", "pickle")
    )


def one_diagnosed(site, task):
    from wheeltapper.diagnosis import folder

    return die() if "kill" in task[0].name else folder._diagnose_file(site, task)


def refusing(finding, path):
    raise LookupError("my own")
