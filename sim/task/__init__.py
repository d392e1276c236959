"""The task on top of the simulator: what is observed, asked for and rewarded, and its episodes and pictures."""
