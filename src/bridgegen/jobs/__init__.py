"""What a command does, a folder each: options in, a result, its record and its page out.

Imports `pages` and below; a job may use one that stands below it in the import contract.
"""
