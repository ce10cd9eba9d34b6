"""Closing the loop: a diagnosed robot becomes the one that is trained for, and the table says what it won.

In: recordings of robots or their cameras, or robots that are drawn and withheld; a translator and a policy that know of
no effects. Out: for each robot its diagnosis with what its effects cost the task, networks trained for what each row
believes of it, and how each grasps on it.
"""
