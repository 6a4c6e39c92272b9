"""Commands and conditions that end a test if they fail."""

import subprocess
import sys


def must(*command, **options):
    """Runs a command and returns what it printed."""
    command = [str(word) for word in command]
    result = subprocess.run(command, capture_output=True, text=True, **options)
    if result.returncode != 0:
        sys.exit(f"FAILED with {result.returncode}: {' '.join(command)}\n{result.stdout}{result.stderr}")
    return result.stdout


def check(condition, message):
    if not condition:
        sys.exit("FAILED: " + message)
