"""Extensions of the shipped mechanisms, generated while mechc is built."""

NAMES = ("four_bar",)
