"""Stages 1 and 2 for trees of links: Mechanism -> Equations by recursion from link to link.

What is derived grows with the number of links and not faster: each link's motion is said by that
of the link it hangs on, in statements that are shared.  Mass matrix and forcing are not written
out but left to the runtime, which walks the tree (Featherstone 2008, chapters 5 to 7).
"""
