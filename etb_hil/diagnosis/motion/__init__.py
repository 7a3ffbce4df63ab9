"""What single phases show: steps, returns, slow passes and rests.

They are read from the samples of their segments.
"""
