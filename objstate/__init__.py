"""Which doors are open, how far, how sure are we, and where did the furniture go?"""
