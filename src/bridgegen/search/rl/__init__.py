"""Parts of dqn, ddpg and ppo: episodes, and Stable-Baselines3's models.

``agent`` and ``walkers`` need no torch; the other modules are imported when a search is built.
"""
