"""Serve a driver: see `bridgegen.drivers.remote.server`."""

from bridgegen.drivers.remote.server import main

if __name__ == "__main__":
    main()
