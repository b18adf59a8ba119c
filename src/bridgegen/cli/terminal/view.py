"""A served page: its address, until Ctrl-C."""

import sys
import tempfile
import webbrowser
from pathlib import Path

from bridgegen.jobs.view.server import Server

_REDIRECT = """<!doctype html><meta charset="utf-8"><title>BridgeGen</title>
<meta http-equiv="refresh" content="0; url={url}"><a href="{url}">The run's page</a>
"""


def serve(server: Server, *, browser: bool, fragment: str = "") -> None:
    """Serve a page until Ctrl-C, and print its address.

    The browser does not get the address itself, whose token every user of this machine could read
    in the list of processes, but a page that only this user can read and that redirects there.

    Args:
        server: of the page.
        browser: whether to open it in the user's browser.
        fragment: end of the address.
    """
    url = server.url + fragment
    serving = server.start()
    print(f"{url} (for you on this machine only; Ctrl-C ends it)", flush=True)
    with tempfile.TemporaryDirectory(prefix="bridgegen-view-") as folder:  # mode 0700
        try:
            if browser and not webbrowser.open(_redirect(Path(folder), url)):
                print("bridgegen: no browser found: open that address yourself", file=sys.stderr)
            while serving.is_alive():
                serving.join(1.0)  # a join without end would not let Ctrl-C through everywhere
        except KeyboardInterrupt:
            print("\nNo longer served.")
        finally:
            server.shutdown()
            server.server_close()


def _redirect(folder: Path, url: str) -> str:
    """Write a page that redirects to an address; return its own address."""
    page = folder / "open.html"
    page.write_text(_REDIRECT.format(url=url), "utf-8")
    return page.as_uri()
