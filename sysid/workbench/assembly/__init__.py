"""Pipelines of kind ``assembly``: models wired into one system, chosen, trained and proven as one.

================== ============================================================================
"""
