"""A run's page, served to a browser on this machine while the run may still grow.

``run_view.py`` reads the run and says what the page asks for, ``folder_view.py`` several;
``server.py`` serves them on loopback.
"""
