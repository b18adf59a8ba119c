"""Serve a driver: see `bridgegen.ego.remote.server`."""

from bridgegen.ego.remote.server import main

if __name__ == "__main__":
    main()
