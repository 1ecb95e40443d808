"""``python -m armdesign``: the same as the ``armdesign`` command."""

from armdesign.cli import main

if __name__ == "__main__":
    main()
