"""What dqn, ddpg and ppo are made of: episodes, and Stable-Baselines3's models.

``agent`` and ``walkers`` need no torch; the others are imported only when a search is built.
"""
