"""What the translator does not understand, it says: file, line and construct."""


class Refusal(Exception):
    """A construct that cannot be translated; its text names file, line and what stands there."""

    def __init__(self, message: str, file: str = "", line: int = 0):
        where = f"{file}, line {line}: " if file else ""
        super().__init__(f"{where}{message}")
