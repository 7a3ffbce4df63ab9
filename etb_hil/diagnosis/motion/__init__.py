"""What single phases show: steps, returns, slow passes and rests, read from the samples of their segments."""
