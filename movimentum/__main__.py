"""The ``movimentum`` command, also as ``python -m movimentum``; nothing is imported before Ctrl-C is dealt with."""


def main() -> None:
    """Run the command line and end the process with its exit code."""
    try:
        from movimentum.signals import end_at_once
    except KeyboardInterrupt:
        raise SystemExit(130) from None
    end_at_once()
    from movimentum.cli import main as run

    run()


if __name__ == "__main__":
    main()
