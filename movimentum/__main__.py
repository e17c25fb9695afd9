"""``python -m movimentum`` is the ``movimentum`` command."""

from movimentum.cli import main

if __name__ == "__main__":
    main()
