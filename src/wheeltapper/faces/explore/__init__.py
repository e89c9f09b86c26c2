"""The explorer: a page on this machine that shows what a scenario does while its fields are changed.

The server holds the scene, marches it, and sends samples; the page draws them.
"""
