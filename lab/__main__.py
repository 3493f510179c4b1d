"""The first moments of the command line."""

import signal


def main() -> None:
    """Imports it and runs it. Ctrl-C during the import, half a second, ends all without a word of where."""
    before = signal.signal(signal.SIGINT, signal.SIG_DFL)
    from .cli import main as run

    signal.signal(signal.SIGINT, before)
    run()


if __name__ == "__main__":
    main()
