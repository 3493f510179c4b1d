"""The desktop's own file dialogs. They are processes of their own: a frame only asks whether one has ended."""

from __future__ import annotations

import shutil
import sys
import time
from pathlib import Path

from imgui_bundle import portable_file_dialogs as dialogs

HELPERS = ("zenity", "matedialog", "qarma", "kdialog")  # that the library starts, where the system has no dialogs
QUICK_SECONDS = 0.5  # in which nobody cancels: a dialog that ends so early did not open


def available() -> bool:
    return sys.platform in ("darwin", "win32") or any(map(shutil.which, HELPERS))


class Chooser:
    """At most one dialog. `asked` is what it was opened for, or None."""

    def __init__(self):
        self.asked: str | None = None
        self._dialog, self._opened = None, 0.0

    def ask(self, what: str, title: str, path: str, suffixes: tuple[str, ...], saves: bool) -> None:
        """Opens a dialog that begins at `path`; while one is open, that one stays."""
        if self.asked is None:
            filters = [" ".join(suffixes), " ".join(f"*{suffix}" for suffix in suffixes), "*", "*"]
            self._dialog = (dialogs.save_file if saves else dialogs.open_file)(title, path, filters)
            self.asked, self._opened = what, time.monotonic()

    def take(self) -> tuple[str, Path | None, bool] | None:
        """What was asked for, the answer, None if there is none, and whether the dialog has been seen; None as long as
        it is open."""
        if self.asked is None or not self._dialog.ready(0):
            return None
        answer = self._dialog.result()
        chosen = answer if isinstance(answer, str) else "".join(answer[:1])
        what, seen = self.asked, bool(chosen) or time.monotonic() - self._opened > QUICK_SECONDS
        self.asked = self._dialog = None
        return what, Path(chosen) if chosen else None, seen

    def close(self) -> None:
        """Ends a dialog that is still open: the library would wait for it."""
        if self.asked is not None:
            self._dialog.kill()
            self.asked = self._dialog = None
