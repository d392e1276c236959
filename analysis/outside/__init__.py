"""Algorithms of other libraries at our budget, a command each; they leave the run folder that our scripts leave."""
