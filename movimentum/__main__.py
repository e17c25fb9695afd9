"""The ``movimentum`` command, also ``python -m movimentum``. Ctrl-C is handled before anything is imported."""

# Built in: the module `signal` is Python, and importing it takes milliseconds in which Ctrl-C is a traceback.
import _signal  # pyright: ignore[reportMissingImports]
import os


def main() -> None:
    """Run the command line and end the process with its exit code."""
    try:
        if _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler:
            _signal.signal(_signal.SIGINT, _end)
    except ValueError:  # not the main thread
        pass
    from movimentum.signals import end_at_once

    end_at_once(_end)
    from movimentum.cli.app import main as run

    run()


def _end(number: int, frame: object) -> None:
    """Handler for Ctrl-C while the first modules are imported: end silently."""
    os._exit(128 + number)


if __name__ == "__main__":
    main()
