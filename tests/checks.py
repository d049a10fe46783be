"""What the scripts that read bakes back have in common."""


class Checks:
    """Counts checks, and prints each with its figure."""

    def __init__(self):
        self.done = 0
        self.failed = 0

    def check(self, good, what, figure):
        self.done += 1
        self.failed += not good
        print(f"{'ok    ' if good else 'FAILED'} {what}: {figure}")
