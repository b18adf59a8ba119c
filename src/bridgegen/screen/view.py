"""A page that is served: where it is, until Ctrl-C."""

import sys
import webbrowser

from bridgegen.view.server import Server


def serve(server: Server, *, browser: bool, fragment: str = "") -> None:
    """Serve a page until Ctrl-C, and say so.

    Args:
        server: what serves it.
        browser: whether to open it in the user's browser.
        fragment: what the address ends with.
    """
    url = server.url + fragment
    serving = server.start()
    print(f"{url} (for this machine only; Ctrl-C ends it)", flush=True)
    try:
        if browser and not webbrowser.open(url):
            print("bridgegen: no browser found: open that address yourself", file=sys.stderr)
        while serving.is_alive():
            serving.join(1.0)  # a join without end would not let Ctrl-C through everywhere
    except KeyboardInterrupt:
        print("\nNo longer served.")
    finally:
        server.shutdown()
        server.server_close()
