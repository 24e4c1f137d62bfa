"""Stages 1 and 2 for trees of links: Mechanism -> Equations by recursion from link to link.

The derivation grows linearly with the number of links: each link's motion is expressed by that of
its parent, in shared statements.  Mass matrix and forcing are computed by the runtime by recursion
over the tree (Featherstone 2008, chapters 5 to 7), or written out where that is shorter or a speed
moves several links.
"""
