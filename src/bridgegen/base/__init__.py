"""What every room builds on: errors, arrays, statistics, files, processes, compiled kernels.

It knows nothing of driving. Imports no other room.
"""
